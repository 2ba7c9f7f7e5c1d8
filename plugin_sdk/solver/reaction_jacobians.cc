#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "plugin_sdk/solver/reaction_solver.h"

namespace gravitas {
namespace {

// What they differ by, over `by`.
ConstraintDirection slope(const ConstraintDirection& from, const ConstraintDirection& to, double by) {
  return {
      (to.linear - from.linear) / by, (to.angular1 - from.angular1) / by, (to.angular2 - from.angular2) / by, {}, {}};
}
Wrench slope(const Wrench& from, const Wrench& to, double by) {
  return {(to.force - from.force) / by, (to.torque - from.torque) / by};
}

}  // namespace

template <typename Use>
void ReactionSolver::for_rows_of(const Joint& joint, Use&& use) const {
  // joints follow each other in any order: places of the next one may be less
  for (std::size_t r = joint.first_row; r < rows_.size() && rows_[r].place - joint.place < 3; ++r)
    use(r, rows_[r].place - joint.place);
}

void ReactionSolver::start_differentiating() {
  accelerate_with_reactions();
  // places count from one of the mechanism's own: far from the origin differences of small numbers are rounding
  const Vector3 origin = bodies_.front().pose.position;
  for (Body& body : bodies_) body.pose.position -= origin, body.asked.position -= origin;
  joints_of_.resize(std::max(joints_of_.size(), bodies_.size()));
  for (std::vector<std::size_t>& list : joints_of_) list.clear();
  size_ = longest_;
  for (const Spring& spring : springs_) size_ = std::max(size_, spring.row.reach);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Discrepancy& d = joints_[j].discrepancy;
    if (!d.is_angular()) d.point1 -= origin, d.point2 -= origin;
    joints_of_[joints_[j].body1].push_back(j), joints_of_[joints_[j].body2].push_back(j);
  }
  has_moved_ = true;  // bodies, from where they were asked
  states_.clear();
  for (const Joint& joint : joints_) states_.push_back(state_of(joint));
  all_joints_.resize(joints_.size());
  std::iota(all_joints_.begin(), all_joints_.end(), std::size_t{0});
}

void ReactionSolver::differentiate(std::uint32_t by, std::span<const std::uint32_t> forced,
                                   std::vector<JacobianBlock>* blocks) {
  add_forced(forced);
  for (int number = 0; number < 12; ++number) {
    differentiate_by(place_of(by), number);
    for (std::size_t i = 0; i < mechanism_->bodies.size(); ++i)
      (*blocks)[mechanism_->bodies[i]].col(number) << pushes_[i].force, pushes_[i].torque;
  }
}

void ReactionSolver::accelerate_with_reactions() {
  std::vector<Wrench> held(bodies_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i)
    add_force(rows_[i].direction, multipliers_[i], &held[rows_[i].body1], &held[rows_[i].body2]);
  own_.assign(bodies_.size(), JacobianBlock::Zero());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    if (!body.is_pushed()) continue;
    const std::size_t row = body.row;
    const Vector3 torque = vector_at(request_->wrench(), 2 * row + 1) + sprung_[i].torque + held[i].torque;
    own_[i] = acceleration_jacobian(body.pose.orientation, body.velocity.angular, vector_at(request_->inertia(), row),
                                    vector_at(request_->inverse_inertia(), row), torque);
    own_[i].rightCols<6>().diagonal().array() -= request_->drag()[row];
    accelerate(body, held[i], &body.acceleration);
  }
}

void ReactionSolver::accelerate(const Body& body, const Wrench& wrench, Twist* acceleration) {
  acceleration->linear += body.inverse_mass * wrench.force;
  acceleration->angular += body.inverse_inertia * wrench.torque;
}

void ReactionSolver::add_forced(std::span<const std::uint32_t> blocks) {
  forced_.assign(bodies_.size(), JacobianBlock::Zero());
  for (const std::size_t i : blocks) {
    const std::uint32_t row = request_->block_body()[2 * i], body = place_of(row);
    if (body == kNone) continue;
    const Eigen::Map<const JacobianBlock> block(&request_->block()[kBlockNumbers * i]);
    forced_[body] += accelerated_block(bodies_[body].pose.orientation, bodies_[body].inverse_mass,
                                       vector_at(request_->inverse_inertia(), row), block);
  }
}

ReactionSolver::JointState ReactionSolver::state_of(const Joint& joint) {
  const Discrepancy& d = at_pose(joint);
  const Matrix3 axes = to_rotation_matrix(d.axes);
  const Arms arms = arms_of(d, axes, joint);
  JointState state;
  for (int axis = 0; axis < 3; ++axis) {
    const Holding& holding = joint.holdings[static_cast<std::size_t>(axis)];
    if (holding.holds) state.rows[static_cast<std::size_t>(axis)] = row_of_axis(d, axes, axis, arms, joint);
    if (!acts_as_force(d, axis) && holding.push == 0.0) continue;
    const Spring spring = spring_of(d, axes, axis, arms, joint);
    add_force(spring.row.direction, spring.force, &state.one, &state.two);
  }
  return state;
}

void ReactionSolver::agree(double step) {
  const auto errors_along = [&](Twist Change::*of) {
    std::vector<double> errors;
    for (const Row& row : rows_) errors.push_back(row.direction.along(moving_[row.body1].*of, moving_[row.body2].*of));
    return errors;
  };
  const auto take_out = [&](std::vector<double> errors, Twist Change::*of) {
    const std::vector<Twist> change = taken_out(std::move(errors));
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      (moving_[i].*of).linear += change[i].linear;
      (moving_[i].*of).angular += change[i].angular;
    }
  };
  take_out(errors_along(&Change::way), &Change::way);
  // directions change on the way, and velocities are to agree with them
  std::vector<double> errors = errors_along(&Change::rate);
  const std::vector<Body> still = bodies_;
  move_along(step, true);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const JointState to = state_of(joints_[j]);
    for_rows_of(joints_[j], [&](std::size_t r, std::size_t axis) {
      const ConstraintDirection change = slope(states_[j].rows[axis].direction, to.rows[axis].direction, step);
      errors[r] += change.along(still[joints_[j].body1].velocity, still[joints_[j].body2].velocity);
    });
  }
  bodies_ = still;
  take_out(std::move(errors), &Change::rate);
}

void ReactionSolver::move_along(double step, bool pose_alone) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto& [way, rate] = moving_[i];
    Body& body = bodies_[i];
    if (!way.linear.isZero(0.0) || !way.angular.isZero(0.0))
      body.pose = displaced(body.pose, step * way.linear, step * way.angular);
    if (pose_alone) continue;
    body.velocity.linear += step * rate.linear;
    body.velocity.angular += step * rate.angular;
  }
}

void ReactionSolver::add_slopes(double step, const std::vector<std::size_t>& joints, bool of_springs, bool of_rows) {
  const std::vector<Body> still = bodies_;
  move_along(step);
  for (const std::size_t j : joints) {
    const Joint& joint = joints_[j];
    const JointState& from = states_[j];
    const JointState to = state_of(joint);
    Wrench &one = pushes_[joint.body1], &two = pushes_[joint.body2];
    if (of_springs) {
      const Wrench change1 = slope(from.one, to.one, step), change2 = slope(from.two, to.two, step);
      one.force += change1.force, one.torque += change1.torque;
      two.force += change2.force, two.torque += change2.torque;
    }
    if (!of_rows) continue;
    for_rows_of(joint, [&](std::size_t r, std::size_t axis) {
      const ConstraintDirection change = slope(from.rows[axis].direction, to.rows[axis].direction, step);
      side_[r] = (to.rows[axis].gamma - from.rows[axis].gamma) / step +
                 change.along(still[joint.body1].acceleration, still[joint.body2].acceleration);
      add_force(change, multipliers_[r], &one, &two);
    });
  }
  bodies_ = still;
}

void ReactionSolver::move_number(std::uint32_t by, int number) {
  constexpr double kBy = 1e-7;
  const Body& body = bodies_[by];
  Twist& moved = number < 6 ? moving_[by].way : moving_[by].rate;
  (number % 6 < 3 ? moved.linear : moved.angular) = Vector3::Unit(number % 3);
  double step = kBy;
  if (number < 3) step *= (size_ > 0.0 ? size_ : 1.0) + 1e-2 * body.pose.position.norm();
  if (number >= 6) step *= std::max(1.0, (number < 9 ? body.velocity.linear : body.velocity.angular).norm());
  add_slopes(step, joints_of_[by], true, !agrees_);
  if (!agrees_) return;
  agree(step);
  add_slopes(step, all_joints_, false, true);
}

void ReactionSolver::differentiate_by(std::uint32_t by, int number) {
  pushes_.assign(bodies_.size(), {}), changes_.assign(bodies_.size(), {}), moving_.assign(bodies_.size(), {});
  side_.assign(rows_.size(), 0.0);
  if (by != kNone) move_number(by, number);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Eigen::Matrix<double, 12, 1> state;
    state << moving_[i].way.linear, moving_[i].way.angular, moving_[i].rate.linear, moving_[i].rate.angular;
    const Eigen::Matrix<double, 6, 1> change = forced_[i].col(number) + own_[i] * state;
    changes_[i] = {change.head<3>(), change.tail<3>()};
    accelerate(bodies_[i], pushes_[i], &changes_[i]);
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    side_[r] = -(side_[r] + row.direction.along(changes_[row.body1], changes_[row.body2])) / row.scale;
  }
  factor_.make_consistent(&side_);
  factor_.solve(&side_);
  for (std::size_t r = 0; r < rows_.size(); ++r)
    add_force(rows_[r].direction, side_[r] / rows_[r].scale, &pushes_[rows_[r].body1], &pushes_[rows_[r].body2]);
}

}  // namespace gravitas
