#include "services/recorder/reaction_sums.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/islands.h"

namespace gravitas {
namespace {

constexpr double kRoundingOfBounds = 1e-9;  // of the bound

// A point of a body at S*, where the step ends.
Vector3 at_end(const kernel::StepData& data, std::uint32_t body, const Vector3& point) {
  if (body == kNone) return point;
  const Pose trial{vector_at(data.trial_position.span(), body), quaternion_at(data.trial_orientation.span(), body)};
  return carried(
      point, trial,
      displaced(trial, vector_at(data.pose_change.span(), 2 * body), vector_at(data.pose_change.span(), 2 * body + 1)));
}

// What a drive does of an impulse along a row's axes. A damper alone is one of the joint's springs.
std::optional<Vector3> drive_of(const Discrepancy& row, const Vector3& along) {
  std::optional<Vector3> drive;
  for (int k = 0; k < 3; ++k)
    if (axis_mode(row.modes, k) == AxisMode::kDriven && row.damping[k] == 0.0)
      drive = drive.value_or(Vector3::Zero()) + row.axes * Vector3(along[k] * Vector3::Unit(k));
  return drive;
}

// The bounds of a sum in the order in which an inner step tells them, the same in each.
class BoundsOfSum {
 public:
  explicit BoundsOfSum(ReactionSum* sum) : bounds_(&sum->bounds) {}

  void add(const Vector3& part, double bound) {
    if (next_ == bounds_->size()) bounds_->emplace_back();
    (*bounds_)[next_].part += part;
    (*bounds_)[next_++].bound += bound;
  }

 private:
  std::vector<ReactionBound>* bounds_;
  std::size_t next_ = 0;
};

void add_bounds(const Discrepancy& row, const Vector3& along, double time_step, BoundsOfSum* bounds) {
  for (int k = 0; k < 3; ++k) {
    const AxisMode mode = axis_mode(row.modes, k);
    if (mode == AxisMode::kFree) continue;
    if (row.maximum_force[k] < kUnlimited) bounds->add(along[k] * Vector3::UnitX(), row.maximum_force[k] * time_step);
    // pushes one way, away from the limit that it is at
    const bool is_one_sided =
        mode == AxisMode::kUnilateral || (mode == AxisMode::kLimited && row.lower[k] < row.upper[k]);
    if (is_one_sided) bounds->add(Vector3::Zero(), std::fabs(along[k]));
  }
}

void add_joints(const kernel::StepData& data, bool acts_in_derivatives, bool has_bounds, ReactionSums* sums) {
  const DiscrepancyColumns rows = data.discrepancies.columns();
  const double h = data.time_step[0];
  for (std::size_t i = 0; i < rows.size();) {
    const std::uint32_t joint = data.discrepancies.constraint[i];
    const std::uint32_t body1 = data.discrepancy_body[2 * i], body2 = data.discrepancy_body[2 * i + 1];
    ReactionSum& sum = (*sums)[{false, {joint, 0, 0}}];
    sum.bodies = {body1, body2};
    ++sum.inner_steps;
    BoundsOfSum bounds(&sum);
    bool has_point = false;  // of a row that pushes
    for (const std::size_t first = i; i < rows.size() && data.discrepancies.constraint[i] == joint; ++i) {
      const Discrepancy row = rows.at(i);
      const std::uint32_t turned = body2 == kNone ? body1 : body2;
      const Vector3 point = row.is_angular() ? at_end(data, turned, vector_at(data.trial_position.span(), turned))
                                             : at_end(data, body1, row.point1);
      if (i == first || (!has_point && !row.is_angular())) sum.point = point;
      has_point = has_point || !row.is_angular();
      Vector3 along = vector_at(data.discrepancy_impulse.span(), i);
      if (acts_in_derivatives) along += h * vector_at(data.held_force.span(), i);
      const Vector3 impulse = row.axes * along;
      if (const std::optional<Vector3> drive = drive_of(row, along)) {
        std::optional<Vector3>& all = row.is_angular() ? sum.drive_turn : sum.drive_impulse;
        all = all.value_or(Vector3::Zero()) + *drive;
      }
      if (has_bounds) add_bounds(row, along, h, &bounds);
      if (row.is_angular()) {
        sum.turn += impulse;
      } else {
        sum.impulse += impulse;
        sum.turn += (point - sum.point).cross(impulse);
      }
    }
  }
}

void add_contacts(const kernel::StepData& data, bool has_bounds, ReactionSums* sums) {
  for (std::size_t i = 0; i < data.contact_key.size(); ++i) {
    const Vector3 impulse = vector_at(data.contact_impulse.span(), i), turn = vector_at(data.contact_turning.span(), i);
    if (impulse.isZero(0.0)) continue;
    const std::uint32_t a = data.contact_body[2 * i], b = data.contact_body[2 * i + 1];
    ReactionSum& sum = (*sums)[{true, {a, b, data.contact_feature[i]}}];
    sum.bodies = {a, b};
    ++sum.inner_steps;
    sum.point = vector_at(data.contact_point.span(), i);
    sum.impulse += impulse;
    sum.turn += turn;
    if (!has_bounds) continue;
    const double* material = &data.contact_material[kMaterialColumns * i];
    const Vector3 normal = vector_at(data.contact_normal.span(), i);
    const double pressed = normal.dot(impulse), spin = normal.dot(turn);
    BoundsOfSum bounds(&sum);
    bounds.add(Vector3::Zero(), pressed);
    bounds.add(impulse - pressed * normal, std::max(material[kStaticFriction], material[kDynamicFriction]) * pressed);
    bounds.add(turn - spin * normal, material[kRollingFriction] * pressed);
    bounds.add(spin * Vector3::UnitX(), material[kSpinningFriction] * pressed);
  }
}

// Sums of one joint or contact in the attempts that have weights, the finest last.
using Attempts = std::vector<std::pair<double, const ReactionSum*>>;

ReactionSum extrapolated(const Attempts& attempts) {
  ReactionSum all;
  all.bounds.resize(attempts.back().second->bounds.size());
  const auto add_drive = [](double weight, const std::optional<Vector3>& one, std::optional<Vector3>* to) {
    if (one) *to = to->value_or(Vector3::Zero()) + weight * *one;
  };
  for (const auto& [weight, sum] : attempts) {
    all.point += weight * sum->point;
    all.impulse += weight * sum->impulse;
    all.turn += weight * sum->turn;
    add_drive(weight, sum->drive_impulse, &all.drive_impulse);
    add_drive(weight, sum->drive_turn, &all.drive_turn);
    for (std::size_t k = 0; k < all.bounds.size(); ++k) {
      all.bounds[k].part += weight * sum->bounds[k].part;
      all.bounds[k].bound += weight * sum->bounds[k].bound;
    }
  }
  return all;
}

// Are the sums of the same things, in each inner step or in one?
bool are_alike(std::span<const ReactionSums> attempts, std::span<const double> weights, const ReactionKey& key,
               Attempts* alike) {
  alike->clear();
  bool is_always = true, is_once = true;
  for (std::size_t n = 0; n < weights.size(); ++n) {
    if (weights[n] == 0.0) continue;
    const auto found = attempts[n].find(key);
    if (found == attempts[n].end()) return false;
    alike->emplace_back(weights[n], &found->second);
    is_always = is_always && found->second.inner_steps == n + 1;
    is_once = is_once && found->second.inner_steps == 1;
  }
  const ReactionSum& finest = *alike->back().second;
  return (is_always || is_once) && std::ranges::all_of(*alike, [&](const auto& attempt) {
           const ReactionSum& sum = *attempt.second;
           return sum.bounds.size() == finest.bounds.size() &&
                  sum.drive_impulse.has_value() == finest.drive_impulse.has_value() &&
                  sum.drive_turn.has_value() == finest.drive_turn.has_value();
         });
}

bool keeps_bounds(const ReactionSum& sum, const ReactionSum& finest) {
  for (std::size_t k = 0; k < sum.bounds.size(); ++k) {
    const double rounding = kRoundingOfBounds * std::fabs(finest.bounds[k].bound);
    if (!(sum.bounds[k].part.norm() <= sum.bounds[k].bound + rounding)) return false;
  }
  return true;
}

}  // namespace

void add_reactions(const kernel::StepData& data, bool acts_in_derivatives, bool has_bounds, ReactionSums* sums) {
  add_joints(data, acts_in_derivatives, has_bounds, sums);
  add_contacts(data, has_bounds, sums);
}

void extrapolate_reactions(std::span<const ReactionSums> attempts, std::span<const double> weights,
                           std::span<const std::uint32_t> body_flags, ReactionSums* sums) {
  if (attempts.empty() || attempts.size() != weights.size()) return;
  const auto is_movable = [&](std::uint32_t body) { return body != kNone && (body_flags[body] & kMovable) != 0; };
  // connected bodies, each group of them by the number of one; those that nothing moves have no part in it
  BodyUnion groups(body_flags.size() + 1);
  const auto group_of = [&](const ReactionSum& sum) {
    const auto one = std::ranges::find_if(sum.bodies, is_movable);
    return groups.root(one == sum.bodies.end() ? static_cast<std::uint32_t>(body_flags.size()) : *one);
  };
  for (const ReactionSums& attempt : attempts)
    for (const auto& [key, sum] : attempt)
      if (std::ranges::all_of(sum.bodies, is_movable)) groups.join(sum.bodies[0], sum.bodies[1]);
  std::vector<bool> is_left(body_flags.size() + 1);
  std::map<ReactionKey, ReactionSum> found;
  Attempts alike;
  for (std::size_t n = 0; n < weights.size(); ++n) {
    if (weights[n] == 0.0) continue;
    for (const auto& [key, sum] : attempts[n]) {
      if (found.contains(key)) continue;
      bool is_known = are_alike(attempts, weights, key, &alike);
      if (is_known) {
        const ReactionSum& best = found.emplace(key, extrapolated(alike)).first->second;
        is_known = keeps_bounds(best, *alike.back().second);
      }
      if (!is_known) is_left[group_of(sum)] = true;
    }
  }
  for (const auto& [key, best] : found) {
    const ReactionSum& finest = attempts.back().at(key);
    if (is_left[group_of(finest)]) continue;
    const auto told = sums->find(key);
    if (told == sums->end()) continue;  // who answers now does not repeat the attempt
    ReactionSum& sum = told->second;
    sum.point = best.point;
    sum.impulse += best.impulse - finest.impulse;
    sum.turn += best.turn - finest.turn;
    if (finest.drive_impulse && sum.drive_impulse) *sum.drive_impulse += *best.drive_impulse - *finest.drive_impulse;
    if (finest.drive_turn && sum.drive_turn) *sum.drive_turn += *best.drive_turn - *finest.drive_turn;
  }
}

}  // namespace gravitas
