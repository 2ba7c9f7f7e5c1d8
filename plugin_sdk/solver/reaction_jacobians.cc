#include <algorithm>
#include <cmath>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "plugin_sdk/solver/reaction_solver.h"

namespace gravitas {
namespace {

// Moves a number of (x, r, v, w) by as much as tells how others change with it, with arms of `length`. Returns that.
double displace(int number, double length, Pose* pose, Twist* velocity) {
  constexpr double kBy = 1e-7;
  const double speed = (number < 9 ? velocity->linear : velocity->angular).norm();
  double by = kBy;
  if (number < 3) by *= length + 1e-2 * pose->position.norm();
  if (number >= 6) by *= std::max(1.0, speed);
  const Vector3 change = by * Vector3::Unit(number % 3);
  if (number < 3) pose->position += change;
  if (number >= 3 && number < 6) *pose = displaced(*pose, Vector3::Zero(), change);
  if (number >= 6 && number < 9) velocity->linear += change;
  if (number >= 9) velocity->angular += change;
  return by;
}

// What they differ by, over `by`.
ConstraintDirection slope(const ConstraintDirection& from, const ConstraintDirection& to, double by) {
  return {
      (to.linear - from.linear) / by, (to.angular1 - from.angular1) / by, (to.angular2 - from.angular2) / by, {}, {}};
}
Wrench slope(const Wrench& from, const Wrench& to, double by) {
  return {(to.force - from.force) / by, (to.torque - from.torque) / by};
}

}  // namespace

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
  const std::vector<Vector3> torques = accelerate_with_reactions();
  has_moved_ = true;  // bodies, from where they were asked
  states_.clear();
  for (const Joint& joint : joints_) states_.push_back(state_of(joint));
  bool is_empty = true;
  for (std::uint32_t by = 0; by < count; ++by) {
    if (!bodies_[by].is_pushed() || !is_jointed[parts.root(by)]) continue;
    const std::vector<std::uint32_t>& felt = part[parts.root(by)];
    std::vector<JacobianBlock> blocks = free_blocks(by, torques[by]);
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

std::vector<Vector3> ReactionSolver::accelerate_with_reactions() {
  std::vector<Wrench> held(bodies_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i)
    add_force(rows_[i].direction, multipliers_[i], &held[rows_[i].body1], &held[rows_[i].body2]);
  std::vector<Vector3> torques;
  for (std::size_t i = 0; i + 1 < bodies_.size(); ++i) {
    torques.push_back(vector_at(request_->wrench(), 2 * i + 1) + sprung_[i].torque + held[i].torque);
    accelerate(bodies_[i], held[i], &bodies_[i].acceleration);
  }
  return torques;
}

void ReactionSolver::accelerate(const Body& body, const Wrench& wrench, Twist* acceleration) {
  acceleration->linear += body.inverse_mass * wrench.force;
  acceleration->angular += body.inverse_inertia * wrench.torque;
}

std::vector<JacobianBlock> ReactionSolver::free_blocks(std::uint32_t by, const Vector3& torque) const {
  std::vector<JacobianBlock> blocks(bodies_.size(), JacobianBlock::Zero());
  const auto moments = [&](std::size_t body) { return vector_at(request_->inverse_inertia(), body); };
  const Body& own = bodies_[by];
  blocks[by] = acceleration_jacobian(own.pose.orientation, own.velocity.angular, vector_at(request_->inertia(), by),
                                     moments(by), torque);
  blocks[by].rightCols<6>().diagonal().array() -= request_->drag()[by];
  for (std::size_t i = 0; i < request_->block_body().size() / 2; ++i) {
    const std::uint32_t body = request_->block_body()[2 * i];
    if (request_->block_body()[2 * i + 1] != by || !bodies_[body].is_pushed()) continue;
    const Eigen::Map<const JacobianBlock> block(&request_->block()[kBlockNumbers * i]);
    blocks[body] += accelerated_block(bodies_[body].pose.orientation, bodies_[body].inverse_mass, moments(body), block);
  }
  return blocks;
}

ReactionSolver::JointState ReactionSolver::state_of(const Joint& joint) {
  const Discrepancy& d = at_pose(joint);
  const Matrix3 axes = to_rotation_matrix(d.axes);
  const Arms arms = arms_of(d, joint);
  JointState state;
  for (int axis = 0; axis < 3; ++axis) {
    if (holds_always(d, axis)) state.rows[static_cast<std::size_t>(axis)] = row_of_axis(d, axes, axis, arms, joint);
    if (!acts_as_force(d, axis)) continue;
    const Spring spring = spring_of(d, axes, axis, arms, joint);
    add_force(spring.row.direction, spring.force, &state.one, &state.two);
  }
  return state;
}

void ReactionSolver::differentiate(std::uint32_t by, int number, const std::vector<std::size_t>& joints,
                                   const std::vector<JacobianBlock>& blocks) {
  pushes_.assign(bodies_.size(), {});
  std::vector<double>& side = side_;
  side.assign(rows_.size(), 0.0);
  const Body still = bodies_[by];
  const double step = displace(number, longest_ > 0.0 ? longest_ : 1.0, &bodies_[by].pose, &bodies_[by].velocity);
  for (const std::size_t j : joints) {
    const Joint& joint = joints_[j];
    const JointState& from = states_[j];
    const JointState to = state_of(joint);
    const Wrench one = slope(from.one, to.one, step), two = slope(from.two, to.two, step);
    pushes_[joint.body1].force += one.force, pushes_[joint.body1].torque += one.torque;
    pushes_[joint.body2].force += two.force, pushes_[joint.body2].torque += two.torque;
    for (std::size_t r = joint.first_row; r < rows_.size() && rows_[r].place < joint.place + 3; ++r) {
      const std::size_t axis = rows_[r].place - joint.place;
      const ConstraintDirection change = slope(from.rows[axis].direction, to.rows[axis].direction, step);
      side[r] = (to.rows[axis].gamma - from.rows[axis].gamma) / step +
                change.along(bodies_[joint.body1].acceleration, bodies_[joint.body2].acceleration);
      add_force(change, multipliers_[r], &pushes_[joint.body1], &pushes_[joint.body2]);
    }
  }
  bodies_[by] = still;
  changes_.assign(bodies_.size(), {});
  for (std::size_t i = 0; i + 1 < bodies_.size(); ++i) {
    changes_[i] = {blocks[i].col(number).head<3>(), blocks[i].col(number).tail<3>()};
    accelerate(bodies_[i], pushes_[i], &changes_[i]);
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    side[r] = -(side[r] + row.direction.along(changes_[row.body1], changes_[row.body2])) / row.scale;
  }
  factor_.make_consistent(&side);
  factor_.solve(&side);
  for (std::size_t r = 0; r < rows_.size(); ++r)
    add_force(rows_[r].direction, side[r] / rows_[r].scale, &pushes_[rows_[r].body1], &pushes_[rows_[r].body2]);
}

}  // namespace gravitas
