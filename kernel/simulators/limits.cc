// Limits of joints that close on the way of a part of an extrapolated step (extrapolated.cc): a rope comes taut, a hinge meets
// its stop. The reaction jumps there, as that of an impact does, and bodies of joints have no times of impact.
//
// A trial without reactions tells when a gap would close, the better the shorter it is: what reactions do to the gap in its
// time t is of the order of t^2. So parts end before, each at kLeadToLimit of the way, until so little of it is left that
// one part may pass the closing (extrapolated.cc). One that a trial foretells too late is found as any jump is.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/discrepancy.h"

namespace gravitas::kernel {
namespace {

constexpr double kLeadToLimit = 0.9, kBeyond = 2.0;  // of the way to a limit: where parts end
constexpr double kNear = 1e-4;  // s, of the accuracy: what forces change in such a time is nothing to it
constexpr double kSlow = 8.0;   // 1/s, of the accuracy: slower closing is no jump
constexpr double kAtStart = 1e-9, kShort = 1e-3;  // of a trial: what tells gaps at its start, and how fast they close
constexpr double kRough = 0.5;                    // a trial is looked at again where a gap closes in less of it
constexpr double kSlop = 1e-9;                    // of the arm, m, or rad: gap that solvers take for none
constexpr double kOpen = 1e-12;                   // m or rad
constexpr double kRolling = 1e-5;                 // m/s: slower parting may be of what rolls
constexpr double kNextToNothing = 1e-7;           // of the step

// Where friction of turning goes by how contacts squeeze a body, solvers begin with impulses (per s) of the same contacts, by key,
// for those that pressed before.
void begin_with(std::span<const std::uint64_t> keys, const std::vector<double>& impulses, StepData* data) {
  if (!std::ranges::equal(keys, data->contact_key.span())) return;
  const std::span<double> warm = data->contact_warm_impulse.span();
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    const double* const material = &data->contact_material[kMaterialColumns * i];
    const bool turns = material[kRollingFriction] + material[kSpinningFriction] > 0.0;
    const Vector3 guess = vector_at(impulses, i);
    if (turns && !vector_at(warm, i).isZero(0.0) && !guess.isZero(0.0))
      set_vector(warm, i, Vector3(data->time_step[0] * guess));
  }
}

}  // namespace

// The longest part, up to `length`, that ends before the next limit that closes; or passes it, soon after it, if the start is near.
double Environment::first_limit(double begin, double length, bool* passes) {
  if (!constraint_.is_running()) return length;
  const double accuracy = description_.accuracy;
  const auto find_gaps = [&](double trial, std::vector<double>* gaps) {
    begin_inner_step(begin, trial);
    constrain(integrate());
    gaps->clear();
    const DiscrepancyColumns rows = data_.discrepancies.columns();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Discrepancy row = rows.at(i);
      const Vector3 middle = 0.5 * (row.point1 + row.point2);
      double slop = row.is_angular() ? kSlop : 8.0 * kEpsilon * middle.cwiseAbs().maxCoeff();
      for (const std::uint32_t body : data_.discrepancy_body.span().subspan(2 * i, 2))
        if (!row.is_angular() && body != kNone && model_.inverse_mass[body] > 0.0)
          slop = std::max(slop, kSlop * (middle - vector_at(data_.trial_position.span(), body)).norm());
      for (const double gap : limit_gaps(row)) gaps->push_back(gap < kUnlimited ? gap - slop : gap);
    }
    return gaps->size() == start_gaps_.size();
  };
  const auto is_open = [](double gap) { return kOpen < gap && gap < kUnlimited; };
  find_gaps(kAtStart * length, &start_gaps_);
  if (std::ranges::none_of(start_gaps_, is_open) || !find_gaps(kShort * length, &trial_gaps_)) return length;
  for (std::size_t k = 0; k < start_gaps_.size(); ++k)
    if (start_gaps_[k] - trial_gaps_[k] <= kSlow * accuracy * kShort * length) start_gaps_[k] = 0.0;
  double stop = length;
  for (double trial = length; std::ranges::any_of(start_gaps_, is_open); trial = 2.0 * stop) {
    *passes = false;  // what a longer trial said
    if (!find_gaps(trial, &trial_gaps_)) return length;
    stop = length;
    for (std::size_t k = 0; k < start_gaps_.size(); ++k) {
      const double gap = start_gaps_[k], way = gap - trial_gaps_[k], time = trial * gap / way;
      if (!is_open(gap) || way <= 0.0) continue;
      const bool is_near = time <= kNear * accuracy;
      stop = std::min(stop, (is_near ? kBeyond : kLeadToLimit) * time);
      *passes = *passes || is_near;
    }
    if (stop >= kRough * trial || stop <= kAtStart * length) break;
  }
  return stop;
}

// What attempts at a part, and trials, begin with (jumps.cc); and what parts is no contact.
//
// In an inner step of next to no length, as those that pass a limit are, what has just bounced off is not pressed. Where the limit
// stops it, it arrives anew in the next one, with its restitution: pressed here it would lose its speed, and restitution act on nothing.
void Environment::prepare_contacts() {
  begin_with(guess_.first, guess_.second, &data_);
  const double accuracy = description_.accuracy, step = length_of_step(step_count_ + 1);
  if (!(accuracy > 0.0) || data_.time_step[0] > std::max(kNextToNothing * step, kBeyond * kNear * accuracy)) return;
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
    const Vector3 parting =
        contact_velocity(data_, i, data_.trial_position, start_linear_velocity(), start_angular_velocity());
    if (vector_at(data_.contact_normal.span(), i).dot(parting) <= std::max(kSlow * accuracy, kRolling)) continue;
    data_.contact_depth[i] = -data_.margin[0];
    set_vector(data_.contact_warm_impulse.span(), static_cast<std::uint32_t>(i), Vector3::Zero());
  }
}

}  // namespace gravitas::kernel
