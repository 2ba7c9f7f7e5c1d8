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

void ReactionSolver::differentiate(const stage::SolverReactionJacobiansReply& reply) {
  const auto count = static_cast<std::uint32_t>(bodies_.size() - 1);
  BodyUnion parts(count);
  std::vector<std::vector<std::size_t>> joints_of(count + 1);
  const auto join = [&](std::uint32_t one, std::uint32_t two) {
    if (bodies_[one].is_pushed() && bodies_[two].is_pushed()) parts.join(one, two);
  };
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    join(joints_[j].body1, joints_[j].body2);
    joints_of[joints_[j].body1].push_back(j), joints_of[joints_[j].body2].push_back(j);
  }
  for (std::size_t i = 0; i + 1 < request_->block_body().size(); i += 2)
    join(request_->block_body()[i], request_->block_body()[i + 1]);
  std::vector<std::vector<std::uint32_t>> part(count);
  std::vector<bool> is_jointed(count, false);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!bodies_[i].is_pushed()) continue;
    part[parts.root(i)].push_back(i);
    if (!joints_of[i].empty()) is_jointed[parts.root(i)] = true;
  }
  accelerate_with_reactions();
  has_moved_ = true;  // bodies, from where they were asked
  states_.clear();
  for (const Joint& joint : joints_) states_.push_back(state_of(joint));
  bool is_empty = true;
  for (std::uint32_t by = 0; by < count; ++by) {
    if (!bodies_[by].is_pushed() || !is_jointed[parts.root(by)]) continue;
    const std::vector<std::uint32_t>& felt = part[parts.root(by)];
    std::vector<JacobianBlock> blocks = forced_blocks(by);
    for (int number = 0; number < 12; ++number) {
      differentiate(by, number, joints_of[by], blocks);
      for (const std::uint32_t i : felt) blocks[i].col(number) << pushes_[i].force, pushes_[i].torque;
    }
    for (const std::uint32_t i : felt) {
      if (!blocks[i].allFinite()) throw Refusal("the Jacobian of a reaction is not finite: masses or forces overflow");
      reply.reaction_body().push(i, by);
      for (Eigen::Index k = 0; k < blocks[i].size(); ++k) reply.reaction_block().push(blocks[i].data()[k]);
      is_empty = false;
    }
  }
  // no block at all would be no answer
  if (!is_empty || count == 0) return;
  reply.reaction_body().push(0, 0);
  for (std::size_t k = 0; k < kBlockNumbers; ++k) reply.reaction_block().push(0.0);
}

void ReactionSolver::accelerate_with_reactions() {
  std::vector<Wrench> held(bodies_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i)
    add_force(rows_[i].direction, multipliers_[i], &held[rows_[i].body1], &held[rows_[i].body2]);
  own_.assign(bodies_.size(), JacobianBlock::Zero());
  for (std::size_t i = 0; i + 1 < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    if (!body.is_pushed()) continue;
    const Vector3 torque = vector_at(request_->wrench(), 2 * i + 1) + sprung_[i].torque + held[i].torque;
    own_[i] = acceleration_jacobian(body.pose.orientation, body.velocity.angular, vector_at(request_->inertia(), i),
                                    vector_at(request_->inverse_inertia(), i), torque);
    own_[i].rightCols<6>().diagonal().array() -= request_->drag()[i];
    accelerate(body, held[i], &body.acceleration);
  }
}

void ReactionSolver::accelerate(const Body& body, const Wrench& wrench, Twist* acceleration) {
  acceleration->linear += body.inverse_mass * wrench.force;
  acceleration->angular += body.inverse_inertia * wrench.torque;
}

std::vector<JacobianBlock> ReactionSolver::forced_blocks(std::uint32_t by) const {
  std::vector<JacobianBlock> blocks(bodies_.size(), JacobianBlock::Zero());
  for (std::size_t i = 0; i < request_->block_body().size() / 2; ++i) {
    const std::uint32_t body = request_->block_body()[2 * i];
    if (request_->block_body()[2 * i + 1] != by || !bodies_[body].is_pushed()) continue;
    const Eigen::Map<const JacobianBlock> block(&request_->block()[kBlockNumbers * i]);
    blocks[body] += accelerated_block(bodies_[body].pose.orientation, bodies_[body].inverse_mass,
                                      vector_at(request_->inverse_inertia(), body), block);
  }
  return blocks;
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
  for (std::size_t i = 0; i + 1 < bodies_.size(); ++i) {
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

void ReactionSolver::differentiate(std::uint32_t by, int number, const std::vector<std::size_t>& joints,
                                   const std::vector<JacobianBlock>& forced) {
  constexpr double kBy = 1e-7;
  pushes_.assign(bodies_.size(), {}), changes_.assign(bodies_.size(), {}), moving_.assign(bodies_.size(), {});
  side_.assign(rows_.size(), 0.0);
  const Body& body = bodies_[by];
  Twist& moved = number < 6 ? moving_[by].way : moving_[by].rate;
  (number % 6 < 3 ? moved.linear : moved.angular) = Vector3::Unit(number % 3);
  double step = kBy;
  if (number < 3) step *= (longest_ > 0.0 ? longest_ : 1.0) + 1e-2 * body.pose.position.norm();
  if (number >= 6) step *= std::max(1.0, (number < 9 ? body.velocity.linear : body.velocity.angular).norm());
  add_slopes(step, joints, true, !agrees_);
  if (agrees_) {
    agree(step);
    std::vector<std::size_t> all(joints_.size());
    std::iota(all.begin(), all.end(), 0);
    add_slopes(step, all, false, true);
  }
  for (std::size_t i = 0; i + 1 < bodies_.size(); ++i) {
    Eigen::Matrix<double, 12, 1> state;
    state << moving_[i].way.linear, moving_[i].way.angular, moving_[i].rate.linear, moving_[i].rate.angular;
    const Eigen::Matrix<double, 6, 1> change = forced[i].col(number) + own_[i] * state;
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
