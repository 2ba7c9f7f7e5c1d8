// Simulator `Substepping`: as Basic with the same Substeps, bit for bit, but with one broad phase for all inner steps.
// Its bounds reach ahead, along the velocities at S*, to the end of the step. It is made again where a body leaves the
// bounds it had: then a pair could be missing. More pairs change nothing, since contacts come from the narrow phase.
#include <algorithm>

#include "kernel/environment.h"

namespace gravitas::kernel {
namespace {

constexpr double kReserve = 0.25;        // share of the way ahead that is added to all sides
constexpr double kLargestMargin = 30.0;  // of the least: 0.3 of the smallest half extent

bool holds(const Bounds& outer, const Bounds& inner) {
  return (outer.lower.array() <= inner.lower.array()).all() && (outer.upper.array() >= inner.upper.array()).all();
}

}  // namespace

Trusted<Pairs> Environment::bound_and_pair(const Trusted<TrialState>& trial) {
  // How far apart bodies still get contacts: what is pushed out of one must not end in another, and nothing is pushed much
  // further than the longest way of the step. Where impacts are located, nothing is pushed.
  double longest = 0.0;
  for (std::uint32_t i = 0; i < model_.body_count && !locates_events(); ++i) {
    if (!is_awake(i)) continue;
    const Vector3 moved = vector_at(data_.trial_position.span(), i) - vector_at(front().position.span(), i);
    const double turned = data_.time_step[0] * vector_at(data_.trial_angular_velocity.span(), i).norm();
    longest = std::max(longest, moved.norm() + turned * model_.bound[i].reach);
  }
  data_.margin[0] = std::clamp(longest, margin_, kLargestMargin * margin_);

  const bool reaches_ahead = description_.simulator == Simulator::kSubstepping;
  if (reaches_ahead && inner_ > 0) {
    bool all = true;
    for (std::uint32_t i = 0; i < model_.body_count && all; ++i)
      all = holds({vector_at(data_.lower.span(), i), vector_at(data_.upper.span(), i)}, trial_bounds(i));
    if (all) return *pairs_;
  }
  bound_bodies(trial);
  const double ahead = reaches_ahead ? length_of_step(step_count_ + 1) - inner_end_ : 0.0;
  for (std::uint32_t i = 0; i < model_.body_count && ahead > 0.0; ++i) {
    const Vector3 way = ahead * vector_at(data_.trial_linear_velocity.span(), i);
    const Vector3 reserve = Vector3::Constant(kReserve * way.norm() + margin_);
    set_vector(data_.lower.span(), i, vector_at(data_.lower.span(), i) + way.cwiseMin(0.0) - reserve);
    set_vector(data_.upper.span(), i, vector_at(data_.upper.span(), i) + way.cwiseMax(0.0) + reserve);
  }
  return *(pairs_ = find_pairs());
}

}  // namespace gravitas::kernel
