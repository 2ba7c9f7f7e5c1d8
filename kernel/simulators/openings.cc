// Limits of joints that open within an inner step of `Smooth`, and drives that begin to slip.
//
// Where a limit opens its force, which fell to zero, stays there, and that of a drive that slips at its bound: a kink, which costs a
// method its order. So an inner step ends just behind it. What is left until then tells where: the secant of the last two trials that
// hold leads to it.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"

namespace gravitas::kernel {
namespace {

constexpr int kMostOpeningLooks = 40, kHalvedLooks = 4;
// Of the length, to which it is known where a limit lets go (what that is off by counts with its square).
constexpr double kOpeningShare = 1e-6;
// Of the length: an integrator that asks for nothing behind it does not see what lets go there.
constexpr double kNearEnd = 0.75;

// What an axis that bears a force has left until it lets go, N or N m: a limit that force, a drive what is missing to its bound.
double left_of(const DiscrepancyAnswer& joints, std::size_t i, double force) {
  if (may_open(joints, i)) return std::abs(force);
  const bool drives = axis_mode(joints.mode[i / 3], static_cast<int>(i % 3)) == AxisMode::kDriven;
  return drives ? std::max(0.0, joints.maximum_force[i] - std::abs(force)) : kUnlimited;
}

// Where the first axis lets go, by the secant of the forces in trials of these two lengths; `latest` where none of them leads to a
// place before it.
double time_of_letting_go(const StepData& data, std::span<const double> borne, double held, double tried,
                          double latest) {
  double time = latest;
  if (borne.size() != data.held_force.size()) return time;
  for (std::size_t i = 0; i < borne.size(); ++i) {
    const double left = left_of(data.discrepancies, i, data.held_force[i]);
    const double falls = (left_of(data.discrepancies, i, borne[i]) - left) / (tried - held);
    if (falls > 0.0) time = std::min(time, tried + left / falls);
  }
  return time;
}

}  // namespace

void Environment::note_what_joints_bear() {
  data_.held_force.assign(data_.discrepancy_force);
  const bool is_first = least_borne_.size() != data_.held_force.size();
  if (is_first) first_borne_.assign(data_.held_force.span().begin(), data_.held_force.span().end());
  if (is_first) least_borne_.resize(data_.held_force.size()), most_borne_.resize(data_.held_force.size());
  for (std::size_t i = 0; i < least_borne_.size(); ++i) {
    const double borne = std::abs(data_.held_force[i]);
    least_borne_[i] = is_first ? borne : std::min(least_borne_[i], borne);
    most_borne_[i] = is_first ? borne : std::max(most_borne_[i], borne);
  }
}

// Makes the trial, which is in S*, end just behind where the first lets go of the limits and drives that hold at its beginning; has it?
bool Environment::end_where_joints_let_go(double begin, double* length, Trusted<TrialState>* trial) {
  const auto lets_go = [&] {
    for (std::size_t i = 0; i < least_borne_.size(); ++i) {
      const double borne = may_open(data_.discrepancies, i) ? least_borne_[i] : most_borne_[i];
      if (left_of(data_.discrepancies, i, first_borne_[i]) > 0.0 && left_of(data_.discrepancies, i, borne) == 0.0)
        return true;
    }
    return false;
  };
  if (!lets_go() || data_.derivative_time[0] - data_.time[0] < kNearEnd * *length) return false;
  const double finest = kOpeningShare * *length;
  double holds = 0.0, open = *length;  // the trials that are closest to it
  double known = 0.0, zero = open, next = 0.5 * open;
  borne_ = first_borne_;
  for (int i = 1; i <= kMostOpeningLooks && open - known > finest; ++i) {
    double tried =
        i % kHalvedLooks == 0 ? 0.5 * (holds + open) : std::clamp(next, holds + 0.5 * finest, open - 0.5 * finest);
    *trial = integrate_shorter(begin, &tried);
    if (lets_go()) {
      open = tried;
      // a zero that lies before it is the best that is known
      if (!(next < open)) next = 0.5 * (holds + open);
      continue;
    }
    const double before = std::exchange(zero, time_of_letting_go(data_, borne_, holds, tried, open));
    const double off = std::abs(zero - before);
    holds = known = tried;
    borne_.assign(data_.held_force.span().begin(), data_.held_force.span().end());
    if (zero >= open) {  // what is left falls faster and faster
      next = 0.5 * (holds + open);
    } else if (off <= finest) {
      known = std::max(holds, zero);
      next = zero + 0.5 * finest;
    } else {
      next = zero - 0.25 * off;  // from below, until zeros agree
    }
  }
  *length = open;
  if (data_.time_step[0] != open) *trial = integrate_shorter(begin, length);
  return true;
}

// Where an inner step ends just behind an opening the limit still holds: what the method is off by to its free side is put right, as
// where any limit bears. No joint is told to bear that.
std::optional<Trusted<Solution>> Environment::react_holding_limits(const Trusted<TrialState>& trial) {
  told_borne_.assign(data_.held_force.span().begin(), data_.held_force.span().end());
  for (std::size_t i = 0; i < std::min(told_borne_.size(), least_borne_.size()); ++i)
    if (least_borne_[i] == 0.0 && may_open(data_.discrepancies, i)) data_.held_force[i] = first_borne_[i];
  std::optional<Trusted<Solution>> solution = react(trial);
  if (told_borne_.size() == data_.held_force.size()) std::ranges::copy(told_borne_, data_.held_force.data());
  return solution;
}

}  // namespace gravitas::kernel
