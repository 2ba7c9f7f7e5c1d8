// Simulator `Substepping`: as Basic with the same Substeps, bit for bit, but with one broad phase for all inner steps.
// Its bounds reach ahead, along the velocities at S*, to the end of the step. It is made again where a body leaves the
// bounds it had: then a pair could be missing. More pairs change nothing, since contacts come from the narrow phase.
#include <algorithm>
#include <limits>

#include "kernel/environment.h"

namespace gravitas::kernel {
namespace {

constexpr double kReserve = 0.25;        // share of the way ahead that is added to all sides
constexpr double kLargestMargin = 30.0;  // of the least: 0.3 of the smallest half extent
constexpr double kOfSize = 0.5;          // of the half extent of the smaller of two bodies: how far they may open

bool holds(const Bounds& outer, const Bounds& inner) {
  return (outer.lower.array() <= inner.lower.array()).all() && (outer.upper.array() >= inner.upper.array()).all();
}

// How far contacts that bore something are open at S*: forces draw bodies that press each other apart, or both turn together.
// What holds them is the solver's to find. Along the normal as it turns with either body, without what they move along their
// velocities: what slides or bounces opens nothing here.
double widest_opening(const State& start, const StepData& data, const Model& model) {
  const double h = data.time_step[0];
  double widest = 0.0;
  for (std::uint32_t i = 0; i < start.contact_key.size(); ++i) {
    const Vector3 impulse = vector_at(start.contact_impulse.span(), i);
    if (impulse.isZero(0.0)) continue;
    const std::uint32_t a = start.contact_body[2 * i], b = start.contact_body[2 * i + 1];
    const auto between = [&](const Column<double>& column) -> Vector3 {
      return vector_at(column.span(), b) - vector_at(column.span(), a);
    };
    const Vector3 normal = impulse.normalized(), apart = between(data.trial_position);
    const double before = normal.dot(between(start.position) + h * between(start.linear_velocity));
    const auto opening = [&](std::uint32_t body) {
      const Vector3 turn = h * vector_at(data.trial_angular_velocity.span(), body);
      const Vector3 across = turn.cross(normal);
      return (normal + across + 0.5 * turn.cross(across)).dot(apart) - before;
    };
    double smaller = std::numeric_limits<double>::infinity();
    for (const std::uint32_t body : {a, b})
      if (model.bound[body].least_half_extent > 0.0) smaller = std::min(smaller, model.bound[body].least_half_extent);
    widest = std::max(widest, std::min({opening(a), opening(b), kOfSize * smaller}));
  }
  return widest;
}

}  // namespace

Trusted<Pairs> Environment::bound_and_pair(const Trusted<TrialState>& trial) {
  // How far apart bodies still get contacts: what is pushed out of one must not end in another, and nothing is pushed much
  // further than the longest way of the step, that of what pushes included. Where impacts are located, nothing is pushed.
  double longest = 0.0;
  for (std::uint32_t i = 0; i < model_.body_count && !locates_events(); ++i) {
    if (!is_awake(i) && !is_carrying(i)) continue;
    const Vector3 moved = vector_at(data_.trial_position.span(), i) - vector_at(front().position.span(), i);
    const double turned = data_.time_step[0] * vector_at(data_.trial_angular_velocity.span(), i).norm();
    longest = std::max(longest, moved.norm() + turned * model_.bound[i].reach);
  }
  data_.margin[0] = std::max(std::clamp(longest, margin_, kLargestMargin * margin_),
                             margin_ + widest_opening(front(), data_, model_));

  const bool reaches_ahead = description_.simulator == Simulator::kSubstepping;
  // who is left out beside sleepers may change from inner step to inner step
  if (reaches_ahead && inner_ > 0 && sleepers_ == 0) {
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
