// Which axes hold in a state, of those that need not: closed limits, bounded drives and friction.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "plugin_sdk/solver/reaction_solver.h"

namespace gravitas {
namespace {

constexpr double kAny = std::numeric_limits<double>::infinity();
constexpr double kAtLimit = 1e-8;  // of the reach, or rad

double lower_limit(const Discrepancy& d, int axis) {
  return axis_mode(d.modes, axis) == AxisMode::kUnilateral ? 0.0 : d.lower[axis];
}
double upper_limit(const Discrepancy& d, int axis) {
  return axis_mode(d.modes, axis) == AxisMode::kUnilateral ? kAny : d.upper[axis];
}

}  // namespace

bool may_hold(const Discrepancy& d, int axis) {
  const AxisMode mode = axis_mode(d.modes, axis);
  if (mode == AxisMode::kFree || mode == AxisMode::kLocked || holds_always(d, axis) || acts_as_force(d, axis))
    return false;
  return is_drive(mode) == (d.maximum_force[axis] < kUnlimited);
}

ReactionSolver::Holding ReactionSolver::held_always(const Discrepancy& d, int axis) {
  Holding holding;
  holding.holds = true;
  holding.is_velocity = is_drive(axis_mode(d.modes, axis));
  if (axis_mode(d.modes, axis) == AxisMode::kLimited) holding.limit = &Discrepancy::lower;
  holding.least = -kAny, holding.most = kAny;
  return holding;
}

void ReactionSolver::find_holdings() {
  may_let_go_ = false;
  bool has_others = false;
  for (Joint& joint : joints_) {
    for (int axis = 0; axis < 3; ++axis) {
      if (holds_always(joint.discrepancy, axis))
        joint.holdings[static_cast<std::size_t>(axis)] = held_always(joint.discrepancy, axis);
      else
        has_others = has_others || may_hold(joint.discrepancy, axis);
    }
  }
  if (!has_others) return;
  if (tells_start()) carry_cones();
  go_to_start();
  for (Joint& joint : joints_) {
    if (joint.discrepancy.is_twist()) turn_to_limit(&joint);
    const Discrepancy d = at_pose(joint);
    const Matrix3 axes = to_rotation_matrix(d.axes);
    const Arms arms = arms_of(d, axes, joint);
    for (int axis = 0; axis < 3; ++axis) {
      if (!may_hold(d, axis) || holds_always(joint.discrepancy, axis)) continue;
      const Row row = row_of_axis(d, axes, axis, arms, joint);
      Holding& holding = joint.holdings[static_cast<std::size_t>(axis)];
      holding = holding_at_start(d, axis, row);
      may_let_go_ = may_let_go_ || holding.holds || holding.push != 0.0;
    }
  }
  load_bodies();
}

// An irregular cone has two rows, and which of them comes first may be another in S_n: what it tells there is another piece. Carried
// back it is the same, exactly (at_pose()).
void ReactionSolver::carry_cones() {
  has_moved_ = true;
  for (Body& body : bodies_) body.pose = start_of(body);
  for (Joint& joint : joints_)
    if (joint.discrepancy.is_swing() && axis_mode(joint.discrepancy.modes, 0) == AxisMode::kLimited)
      joint.at_start = at_pose(joint);
}

bool ReactionSolver::is_closed_limit(const Joint& joint, std::size_t axis) {
  const Holding& holding = joint.holdings[axis];
  return holding.holds && !holding.is_velocity && !holds_always(joint.discrepancy, static_cast<int>(axis));
}

// Without memory of the states before, each finds it anew.
void ReactionSolver::let_go_from_start() {
  const auto has_closed = [](const Joint& joint) {
    return is_closed_limit(joint, 0) || is_closed_limit(joint, 1) || is_closed_limit(joint, 2);
  };
  if (std::ranges::none_of(joints_, has_closed)) return;
  std::vector<std::array<Holding, 3>> closed;
  for (const Joint& joint : joints_) closed.push_back(joint.holdings);
  do {
    load_bodies();
    go_to_start();
    solve_held();
  } while (change_holdings());
  load_bodies();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    Joint& joint = joints_[i];
    std::swap(joint.holdings, closed[i]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (is_closed_limit(joint, axis) && !closed[i][axis].holds) joint.holdings[axis] = Holding{};
  }
}

void ReactionSolver::let_go_opened() {
  for (Joint& joint : joints_) {
    const Discrepancy& d = joint.discrepancy;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!is_closed_limit(joint, axis)) continue;
      const Matrix3 axes = to_rotation_matrix(d.axes);
      const Row row = row_of_axis(d, axes, static_cast<int>(axis), arms_of(d, axes, joint), joint);
      const Holding& holding = joint.holdings[axis];
      const double beyond = row.error - holding.target(d, static_cast<int>(axis));
      const double gap = holding.most > 0.0 ? beyond : -beyond;
      if (gap > strayed(row)) joint.holdings[axis] = Holding{};
    }
  }
}

// By no velocity of the state: what is let go of changes these, and would be held again and let go without end.
double ReactionSolver::strayed(const Row& row) const {
  constexpr double kOfSquare = 0.75;  // a third stage of RK4 on a circle is off by half
  constexpr double kRoundingOfRest = 64.0 * std::numeric_limits<double>::epsilon();
  double turn = 0.0, coordinates = 0.0;
  for (const std::uint32_t i : {row.body1, row.body2}) {
    const Body& body = bodies_[i];
    const Pose start = start_of(body);
    const Twist start_velocity = start_velocity_of(body);
    const Quaternion since = shorter_arc(body.pose.orientation * start.orientation.conjugate());
    double turned = log_rotation(since).norm(), turning = start_velocity.angular.norm();
    if (row.reach > 0.0) {
      turned += (body.pose.position - start.position).norm() / row.reach;
      turning += start_velocity.linear.norm() / row.reach;
    }
    turn = std::max({turn, turned, request_->time_step() * turning});
    coordinates = std::max(coordinates, body.pose.position.cwiseAbs().maxCoeff());
  }
  // what rests is where it is told to be but for rounding
  if (!(row.reach > 0.0)) return kOfSquare * turn * turn + kRoundingOfRest;
  return kOfSquare * turn * turn * row.reach + kRoundingOfRest * (row.reach + coordinates);
}

void ReactionSolver::turn_to_limit(Joint* joint) {
  const Discrepancy start = at_pose(*joint);
  const Twisting twisting = twisting_of(start);
  const double turns = turns_to_limit(start), angle = twisting.angle + turns, error = angle * twisting.cosine();
  if (!may_hold(start, 0)) return;
  if (std::fabs(error - start.lower.x()) > kAtLimit && std::fabs(error - start.upper.x()) > kAtLimit) return;
  if (is_at_start_) add_turns(turns, &joint->at_start);
  const double since = angle - twisting_of(joint->discrepancy).angle;
  add_turns(kWholeTurn * std::round(since / kWholeTurn), &joint->discrepancy);
}

ReactionSolver::Holding ReactionSolver::holding_at_start(const Discrepancy& d, int axis, const Row& row) const {
  constexpr double kOfChange = 2.0;  // of what it is asked for changes by in a step
  const Body &one = bodies_[row.body1], &two = bodies_[row.body2];
  const Vector3 along = d.is_angular() ? Vector3(to_rotation_matrix(d.axes).col(axis)) : row.direction.linear;
  const double rate = row.direction.along(one.velocity, two.velocity) - along.dot(d.velocity);
  const double still = still_rate(row.direction.size_along(one.velocity, two.velocity));
  Holding holding;
  if (is_drive(axis_mode(d.modes, axis))) {
    const double bound = d.maximum_force[axis];
    // told in the state, it asks for another velocity than in S_n
    const double changed = is_at_start_ ? 0.0 : kOfChange * request_->time_step() * std::abs(along.dot(d.acceleration));
    holding.is_velocity = true;
    holding.least = -bound, holding.most = bound;
    holding.holds = std::abs(rate) <= still + changed && bound > 0.0;
    if (!holding.holds) holding.push = std::copysign(bound, -rate), holding.missing = std::abs(rate);
    return holding;
  }
  const double slop = kAtLimit * (d.is_angular() ? 1.0 : row.reach);
  if (row.error <= lower_limit(d, axis) + slop && rate <= still) {
    holding.holds = true;
    if (axis_mode(d.modes, axis) != AxisMode::kUnilateral) holding.limit = &Discrepancy::lower;
    holding.most = kAny;
  } else if (row.error >= upper_limit(d, axis) - slop && rate >= -still) {
    holding.holds = true;
    holding.limit = &Discrepancy::upper, holding.least = -kAny;
  }
  return holding;
}

bool ReactionSolver::change_holdings() { return release_overloaded() || change_open(); }

bool ReactionSolver::release_overloaded() {
  bool has_released = false;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Holding& holding = *rows_[i].holding;
    const double force = multipliers_[i];
    if (!(force < holding.least || force > holding.most)) continue;
    holding.holds = false;
    holding.is_released = has_released = true;
    if (holding.is_velocity) holding.push = std::clamp(force, holding.least, holding.most);
  }
  return has_released;
}

bool ReactionSolver::change_open() {
  constexpr int kMostReturns = 2;
  constexpr double kNothing = 1e-9;    // of the accelerations
  constexpr double kMostBeyond = 4.0;  // of what a drive is short of, that its bound makes in the step
  const auto may_change = [](const Holding& one) {
    return !one.holds && (one.missing > 0.0 || (one.is_released && one.returns < kMostReturns));
  };
  if (std::ranges::none_of(joints_,
                           [&](const Joint& joint) { return std::ranges::any_of(joint.holdings, may_change); }))
    return false;
  std::vector<Wrench> held(bodies_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i)
    add_force(rows_[i].direction, multipliers_[i], &held[rows_[i].body1], &held[rows_[i].body2]);
  std::vector<Twist> moving(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    moving[i] = bodies_[i].acceleration;
    accelerate(bodies_[i], held[i], &moving[i]);
  }
  bool has_changed = false;
  for (Joint& joint : joints_) {
    for (int axis = 0; axis < 3; ++axis) {
      Holding& holding = joint.holdings[static_cast<std::size_t>(axis)];
      if (!may_change(holding)) continue;
      const Discrepancy& d = at_pose(joint);
      const Matrix3 axes = to_rotation_matrix(d.axes);
      const Row row = row_of_axis(d, axes, axis, arms_of(d, axes, joint), joint);
      const double change = row.direction.along(moving[row.body1], moving[row.body2]);
      if (holding.missing > 0.0) {
        const double gained = request_->time_step() * (row.gamma + change) * std::copysign(1.0, holding.push);
        if (gained < kMostBeyond * holding.missing) continue;
        holding.push = holding.missing = 0.0;
        has_changed = true;
        continue;
      }
      const double nothing = kNothing * (std::abs(row.gamma) + std::abs(change));
      // away from a limit, or against what slips
      const double away = holding.is_velocity ? -holding.push : holding.most > 0.0 ? 1.0 : -1.0;
      if ((row.gamma + change) * std::copysign(1.0, away) >= -nothing) continue;
      holding.holds = has_changed = true;
      holding.push = 0.0;
      ++holding.returns;
    }
  }
  return has_changed;
}

}  // namespace gravitas
