// Simulator `Substepping`: as Basic with the same Substeps, bit for bit, but with one broad phase for all inner steps.
// Its bounds reach ahead, along the velocities at S*, to the end of the step. It is made again where a body leaves the
// bounds it had: then a pair could be missing. More pairs change nothing, since contacts come from the narrow phase.
#include "kernel/environment.h"

namespace gravitas::kernel {
namespace {

constexpr double kReserve = 0.25;  // share of the way ahead that is added to all sides

bool holds(const Bounds& outer, const Bounds& inner) {
  return (outer.lower.array() <= inner.lower.array()).all() && (outer.upper.array() >= inner.upper.array()).all();
}

}  // namespace

Trusted<Pairs> Environment::bound_and_pair(const Trusted<TrialState>& trial) {
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
