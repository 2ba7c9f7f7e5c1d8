// `Continuous` with an Accuracy: Basic's inner steps, which are of order 1 where reactions change on the way, extrapolated
// to step 0 (plugin_sdk/extrapolation.h). A part of a step is made in 1, 2, 3, … inner steps until the estimated error is
// below the accuracy; the finest of them then stand, and the last of these ends in the extrapolated state.
//
// What jumps on the way (a contact closes or opens, a slide ends) has no expansion in powers of the step: the part is
// shortened until it ends before the jump, to kFinestPart of the step, and one inner step as it is passes it. What flickers
// would crumble the whole step: each part below kCrumb of it makes the finest a little longer. A jump in the first or the last
// inner step of every attempt would look smooth; one of velocities shows in that step's change of them, which then does not
// tend to 0 with the step, one of reactions in shorter steps (jumps.cc). Impacts and joints' limits (limits.cc) are found first.
#include <algorithm>
#include <cmath>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"

namespace gravitas::kernel {
namespace {

constexpr double kFinestPart = 1e-10;  // of the step
constexpr double kCrumb = 1e-3, kCoarser = 1.02, kShorter = 0.25, kLonger = 4.0;
constexpr double kOfJump = 0.125;  // s; what the start misses within the accuracy is put right in the first inner step
constexpr double kSeesJumps = 1e-10;  // accuracies below are less than rounding, which looks like jumps of reactions
constexpr double kConverges = 0.5;    // share of the error that a piece more leaves, at most
// Attempts up to which errors are not compared: where the coarsest is off for the start alone (extrapolation.h) the estimate of three
// has half of what that of two has, however short the part is. That of four may leave it out.
constexpr std::uint32_t kNotCompared = 3;
constexpr double kSettled = 0.01;  // share of the accuracy: lesser errors need not converge while jumps are looked at

// The numbers of a state; attitudes q, which are the same as -q, on the side of those at the start.
void put(const State& state, const State& start, std::uint32_t bodies, Extrapolation* extrapolation) {
  for (std::uint32_t i = 0; i < bodies; ++i) {
    const auto put_vector = [&](const Column<double>& column, double scale) {
      for (std::size_t k = 3ULL * i; k < 3ULL * i + 3; ++k) extrapolation->put(column[k], scale);
    };
    const Quaternion q = quaternion_at(state.orientation.span(), i);
    const double side = q.dot(quaternion_at(start.orientation.span(), i)) < 0.0 ? -1.0 : 1.0;
    for (const double number : {q.w(), q.x(), q.y(), q.z()}) extrapolation->put(side * number, 0.5);
    put_vector(state.position, 1.0);
    put_vector(state.linear_velocity, std::max(1.0, vector_at(state.linear_velocity.span(), i).norm()));
    put_vector(state.angular_velocity, std::max(1.0, vector_at(state.angular_velocity.span(), i).norm()));
  }
}

}  // namespace

void Environment::extrapolate_parts(double begin, double length) {
  const double step = length_of_step(step_count_ + 1);
  double finest = kFinestPart * step, done = 0.0, wanted = length;
  bool has_failed = false;
  while (done < length && !must_restart_) {
    const double from = begin + done, left = length - done;
    first_impulses_.first.clear();
    NextStop stop{std::min(wanted, left)};
    if (has_contacts()) {
      begin_inner_step(from, stop.length);
      stop = first_impact(integrate(), from, stop.length);
    }
    bool passes_limit = false;
    const double part = first_limit(from, stop.length, &passes_limit);
    const bool is_before_impact = stop.length < std::min(wanted, left);
    const bool ends_with_impact = stop.meets && part == stop.length;
    const bool is_cut = part < std::min(wanted, left);
    if (part < kCrumb * step) finest *= kCoarser;
    const bool is_passed = part <= finest || passes_limit;
    const std::uint32_t pieces = is_passed ? 1 : pieces_to_accuracy(from, part, is_before_impact, ends_with_impact);
    if (pieces == 0) wanted = kShorter * part, has_failed = true;
    for (std::uint32_t i = 0; i < pieces && !must_restart_; ++i) {
      if (!make_piece(from, part, i, pieces)) return;
      end_inner_step(i > 0 && i + 1 == pieces ? take_extrapolated() : std::span<const double>());
    }
    if (pieces == 0) continue;
    done = part == left ? length : done + part;
    if (!is_cut) wanted = has_failed ? part : kLonger * part;
    has_failed = false;
  }
}

// The number of inner steps whose extrapolation meets the accuracy; 0: none does, or the step is to be begun again. Where
// the part ends with an impact its last inner step jumps as it should.
std::uint32_t Environment::pieces_to_accuracy(double begin, double length, bool is_before_impact,
                                              bool ends_with_impact) {
  const std::size_t front = front_, back = back_;
  const auto kept = std::pair(figures_, turned_far_);
  const auto go_back = [&] { front_ = front, back_ = back, figures_ = kept.first, turned_far_ = kept.second; };
  extrapolation_.begin(), jumps_.begin();
  const std::uint32_t first = ends_with_impact ? 2 : 1;  // whose first inner step does not end with the impact
  const bool sees_jumps = description_.accuracy >= kSeesJumps;
  const double of_jump = sees_jumps && !is_before_impact ? kOfJump : 0.0;
  const auto put_changes = [&](std::vector<double>* changes) {
    find_changes(changes);
    for (std::size_t k = 0; k < changes->size(); ++k)
      jumps_.put((*changes)[k] * std::max(length, of_jump / scales_[k]), 1.0);
  };
  double error = 0.0;
  std::uint32_t enough = 0;
  try {
    for (std::uint32_t pieces = 1; pieces <= kMostPieces && enough == 0; ++pieces) {
      for (std::uint32_t i = 0; i < pieces; ++i) {
        if (!make_piece(begin, length, i, pieces) || must_restart_) return go_back(), 0;
        if (commit_listener_ != nullptr) commit_listener_->on_attempt(data_, pieces);
        if (i == 0) {
          found_.first.assign(data_.contact_key.span().begin(), data_.contact_key.span().end());
          found_.second.clear();
          for (const double impulse : data_.contact_impulse.span())
            found_.second.push_back(impulse / data_.time_step[0]);
        }
        if (i == 0) put_changes(&first_changes_[pieces - 1]), pressed_by_attempts_ = pressed_;
        if (i + 1 == pieces && !ends_with_impact) put_changes(&trial_changes_);
        const std::size_t before = front_;
        front_ = back_;
        back_ = before == front ? kSpareState : before;
      }
      put(this->front(), states_[front], model_.body_count, &extrapolation_);
      const double now = extrapolation_.add();
      jumps_.add();
      if (std::max(now, jumps_.least_size()) <= description_.accuracy && pieces > first) enough = pieces;
      if (enough > 0 && of_jump > 0.0 && breaks_away(begin + length, length, pieces)) return go_back(), 0;
      go_back();
      const bool converges =
          pieces <= kNotCompared || now <= std::max(kConverges * error, kSettled * description_.accuracy);
      error = now;
      if (!converges) break;
      // what stands in the end begins with what its attempt began with
      if (enough == 0) first_impulses_ = found_;
    }
    if (enough > 0 && sees_jumps && hides_jump(begin, length, first, enough, error)) enough = 0;
    go_back();
  } catch (...) {
    go_back();
    throw;
  }
  return enough;
}

}  // namespace gravitas::kernel
