#include "plugin_sdk/solver/reaction_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/elimination_order.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {
namespace {

// True where the error along an axis of points is the target, but for the error of the state.
bool holds_place(const Discrepancy& d, int axis) {
  return holds_always(d, axis) && axis_mode(d.modes, axis) != AxisMode::kDriven && !(d.is_radial() && axis == 0);
}

}  // namespace

bool holds_always(const Discrepancy& d, int axis) {
  if (d.maximum_force[axis] < kUnlimited) return false;
  switch (axis_mode(d.modes, axis)) {
    case AxisMode::kLocked:
      return d.compliance[axis] == 0.0;
    case AxisMode::kLimited:
      return d.compliance[axis] == 0.0 && d.lower[axis] == d.upper[axis];
    case AxisMode::kDriven:
      return d.damping[axis] == 0.0;
    default:
      return false;
  }
}

double ReactionSolver::solve(const stage::SolverReactionsRequest& request) {
  request_ = &request;
  load_bodies();
  load_joints();
  find_holdings();
  if (may_let_go_) let_go_from_start(), let_go_opened();
  double missed = solve_held();
  while (may_let_go_ && change_holdings()) {
    load_bodies();
    missed = solve_held();
  }
  return missed;
}

double ReactionSolver::solve_held() {
  agrees_ = contradicts_ = false;
  load_springs();
  make_rows();
  factorise(0.0);
  const bool is_amplified = factor_.least_pivot() < kNearlyDependent && is_amplifying();
  if (is_amplified) agree_with_joints(Elsewhere::kIsAhead);
  double missed = find_multipliers();
  // Dependent rows contradict each other by what the state is off the joints. Left out in some states that an integrator tries and
  // made to agree in others, they would have it lose its order.
  if (contradicts_ && !agrees_) {
    agree_with_joints(Elsewhere::kIsAsAsked);
    missed = find_multipliers();
  }
  if (!is_amplified || !agrees_) share_out();
  return missed;
}

double ReactionSolver::find_multipliers() {
  constexpr double kOfError = 1e-3;  // of the state, rad: what is missed by less is rounding
  accelerate();
  std::vector<double>& side = multipliers_;
  side.resize(rows_.size());
  double largest = 0.0, most = 0.0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    const double along = row.direction.along(bodies_[row.body1].acceleration, bodies_[row.body2].acceleration);
    side[i] = -(row.gamma + along) / row.scale;
    largest = std::max(largest, row.scale), most = std::max(most, std::fabs(side[i]));
  }
  const double missed = factor_.make_consistent(&side);
  contradicts_ = missed > 0.0 && missed > kOfError * largest_turn() * most;
  factor_.solve(&side);
  for (std::size_t i = 0; i < rows_.size(); ++i) multipliers_[i] /= rows_[i].scale;
  return missed == 0.0 ? 0.0 : largest * missed;  // it was scaled
}

// Rows that depend on each other bear as equal springs would, moments by way of the longer radius of gyration.
void ReactionSolver::share_out() {
  if (factor_.dropped() == 0) return;
  const auto gyration = [&](std::uint32_t body) {
    return radius_of_gyration(bodies_[body].inverse_mass, bodies_[body].inverse_inertia.trace() / 3.0);
  };
  shares_.start(bodies_.size());
  for (const Row& row : rows_) {
    const bool is_angular = row.direction.linear.isZero(0.0);
    const double length = is_angular ? std::max(gyration(row.body1), gyration(row.body2)) : 1.0;
    shares_.add(row, bodies_, EqualSprings::stiffness(length));
  }
  shares_.factorise();
  shares_.share(&multipliers_);
}

void ReactionSolver::write(std::vector<Wrench>* reactions, std::vector<double>* forces) const {
  const auto push = [&](const Row& row, double force) {
    (*forces)[row.place] = force;
    const ConstraintDirection& along = row.direction;
    if (const Body& one = bodies_[row.body1]; one.is_pushed()) {
      Wrench& reaction = (*reactions)[one.row];
      reaction.force -= force * along.linear, reaction.torque += force * along.angular1;
    }
    if (const Body& two = bodies_[row.body2]; two.is_pushed()) {
      Wrench& reaction = (*reactions)[two.row];
      reaction.force += force * along.linear, reaction.torque += force * along.angular2;
    }
  };
  for (std::size_t i = 0; i < rows_.size(); ++i) push(rows_[i], multipliers_[i]);
  for (const Spring& spring : springs_) push(spring.row, spring.force);
}

std::uint32_t ReactionSolver::place_of(std::uint32_t row) const {
  if (row == kNone) return kNone;
  const std::vector<std::uint32_t>& own = mechanism_->bodies;
  const std::uint32_t place = places_[row];
  return place < own.size() && own[place] == row ? place : kNone;
}

void ReactionSolver::set_mechanism(const stage::SolverReactionsRequest& request, const Island& mechanism,
                                   std::span<const std::uint32_t> places) {
  mechanism_ = &mechanism, places_ = places;
  bodies_.clear();
  for (const std::uint32_t row : mechanism.bodies) bodies_.emplace_back().row = row;
  const auto own = static_cast<std::uint32_t>(bodies_.size());
  const auto place = [&](std::uint32_t row) {
    if (const std::uint32_t known = place_of(row); known != kNone) return known;
    if (bodies_.size() == own || bodies_.back().row != row) bodies_.emplace_back().row = row;
    return static_cast<std::uint32_t>(bodies_.size() - 1);
  };
  joints_.clear();
  for (const std::size_t i : mechanism.discrepancies) {
    Joint& joint = joints_.emplace_back();
    joint.place = 3 * i;
    joint.body1 = place(request.discrepancy_body()[2 * i]), joint.body2 = place(request.discrepancy_body()[2 * i + 1]);
  }
  const auto ends_of = [&](const Joint& joint) {
    return RowEnds(joint.body1 < own ? joint.body1 : kNone, joint.body2 < own ? joint.body2 : kNone);
  };
  EliminationOrder().arrange(ends_of, &joints_);
}

void ReactionSolver::load_joints() {
  const DiscrepancyColumns columns{request_->point1(),
                                   request_->point2(),
                                   request_->velocity(),
                                   request_->correction(),
                                   request_->axes(),
                                   request_->mode(),
                                   request_->lower(),
                                   request_->upper(),
                                   request_->compliance(),
                                   request_->damping(),
                                   request_->maximum_force(),
                                   {},
                                   request_->desired_acceleration()};
  const DiscrepancyColumns at_start{
      request_->start_point1(),      request_->start_point2(),  request_->start_velocity(), request_->correction(),
      request_->start_axes(),        request_->start_mode(),    request_->start_lower(),    request_->start_upper(),
      request_->start_compliance(),  request_->start_damping(), request_->maximum_force(),  {},
      request_->start_acceleration()};
  for (Joint& joint : joints_) {
    joint.discrepancy = columns.at(joint.place / 3);
    if (tells_start()) joint.at_start = at_start.at(joint.place / 3);
    joint.is_only_point = is_only_point(request_->discrepancy_body(), request_->mode(), joint.place / 3);
    joint.holdings = {};
  }
}

void ReactionSolver::load_bodies() {
  has_moved_ = is_at_start_ = false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    const std::uint32_t row = body.row;
    if (row == kNone) {
      body.asked = body.pose = {};
      continue;
    }
    body.asked = body.pose = {vector_at(request_->position(), row), quaternion_at(request_->orientation(), row)};
    body.velocity = {vector_at(request_->linear_velocity(), row), vector_at(request_->angular_velocity(), row)};
    if (i >= mechanism_->bodies.size()) continue;  // nothing pushes what holds it
    body.inverse_mass = request_->inverse_mass()[row];
    body.inverse_inertia = world_inverse_inertia(body.pose.orientation, vector_at(request_->inverse_inertia(), row));
  }
}

Pose ReactionSolver::start_of(const Body& body) const {
  if (body.row == kNone) return {};
  return {vector_at(request_->start_position(), body.row), quaternion_at(request_->start_orientation(), body.row)};
}

Twist ReactionSolver::start_velocity_of(const Body& body) const {
  if (body.row == kNone) return {};
  return {vector_at(request_->start_linear_velocity(), body.row),
          vector_at(request_->start_angular_velocity(), body.row)};
}

void ReactionSolver::go_to_start() {
  is_at_start_ = tells_start();
  has_moved_ = !is_at_start_;
  for (Body& body : bodies_) {
    body.pose = start_of(body), body.velocity = start_velocity_of(body);
    if (is_at_start_) body.asked = body.pose;
    if (body.is_pushed())
      body.inverse_inertia =
          world_inverse_inertia(body.pose.orientation, vector_at(request_->inverse_inertia(), body.row));
  }
}

void ReactionSolver::accelerate() {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    const std::size_t row = body.row;
    if (row == kNone) continue;
    if (!body.is_pushed()) {
      body.acceleration = {vector_at(request_->acceleration(), 2 * row),
                           vector_at(request_->acceleration(), 2 * row + 1)};
      continue;
    }
    const double drag = request_->drag()[row];
    const Vector3 force = vector_at(request_->wrench(), 2 * row) + sprung_[i].force;
    const Vector3 torque = vector_at(request_->wrench(), 2 * row + 1) + sprung_[i].torque;
    body.acceleration.linear = body.inverse_mass * force - drag * body.velocity.linear;
    body.acceleration.angular =
        angular_acceleration(body.pose.orientation, body.velocity.angular, vector_at(request_->inertia(), row),
                             vector_at(request_->inverse_inertia(), row), torque) -
        drag * body.velocity.angular;
  }
}

void ReactionSolver::load_springs() {
  // without springs it is zero as it is
  if (!springs_.empty() || sprung_.size() != bodies_.size()) sprung_.assign(bodies_.size(), {});
  springs_.clear();
  for (const Joint& joint : joints_) {
    const Discrepancy& d = at_pose(joint);
    const auto pushes = [&](std::size_t axis) {
      return acts_as_force(d, static_cast<int>(axis)) || joint.holdings[axis].push != 0.0;
    };
    if (!pushes(0) && !pushes(1) && !pushes(2)) continue;
    const Matrix3 axes = to_rotation_matrix(d.axes);
    const Arms arms = arms_of(d, axes, joint);
    for (int axis = 0; axis < 3; ++axis) {
      if (!pushes(static_cast<std::size_t>(axis))) continue;
      const Spring& spring = springs_.emplace_back(spring_of(d, axes, axis, arms, joint));
      add_force(spring.row.direction, spring.force, &sprung_[joint.body1], &sprung_[joint.body2]);
    }
  }
}

ReactionSolver::Spring ReactionSolver::spring_of(const Discrepancy& d, const Matrix3& axes, int axis, const Arms& arms,
                                                 const Joint& joint) const {
  const Row row = row_of_axis(d, axes, axis, arms, joint);
  if (!acts_as_force(d, axis)) return {row, joint.holdings[static_cast<std::size_t>(axis)].push};
  const Vector3 along = d.is_angular() ? Vector3(axes.col(axis)) : row.direction.linear;
  const JointAxisState state = joint_axis_state(d, axis, along, d.point2 - d.point1);
  return {row, force_of(state, row.direction.along(bodies_[joint.body1].velocity, bodies_[joint.body2].velocity))};
}

void ReactionSolver::add_force(const ConstraintDirection& direction, double force, Wrench* one, Wrench* two) {
  one->force -= force * direction.linear, one->torque += force * direction.angular1;
  two->force += force * direction.linear, two->torque += force * direction.angular2;
}

void ReactionSolver::make_rows() {
  rows_.clear();
  longest_ = 0.0;
  for (Joint& joint : joints_) {
    joint.first_row = rows_.size();
    const Discrepancy& d = at_pose(joint);
    const Matrix3 axes = to_rotation_matrix(d.axes);
    const Arms arms = arms_of(d, axes, joint);
    for (int axis = 0; axis < 3; ++axis) {
      Holding& holding = joint.holdings[static_cast<std::size_t>(axis)];
      if (!holding.holds) continue;
      Row row = row_of_axis(d, axes, axis, arms, joint);
      row.holding = &holding;
      const Body &one = bodies_[joint.body1], &two = bodies_[joint.body2];
      row.direction = with_turns(row.direction, one.inverse_inertia, two.inverse_inertia);
      row.scale = std::sqrt(row.direction.product(row.direction, one.inverse_mass + two.inverse_mass));
      row.velocity_error = row.direction.along(one.velocity, two.velocity) - row.direction.linear.dot(d.velocity) -
                           (d.is_angular() ? axes.col(axis).dot(d.velocity) : 0.0);
      row.error = holding.is_velocity ? 0.0 : row.error - holding.target(d, axis);
      longest_ = std::max(longest_, row.reach);
      if (row.scale > 0.0) rows_.push_back(row);
    }
  }
}

const Discrepancy& ReactionSolver::at_pose(const Joint& joint) {
  const Discrepancy& from = told(joint);
  if (!has_moved_) return from;
  const Body &one = bodies_[joint.body1], &two = bodies_[joint.body2];
  Discrepancy& d = carried_;
  d = from;
  if (d.is_swing()) {
    const auto [first, second] = swing_directions(d);
    set_swing({one.pose.orientation * (one.asked.orientation.conjugate() * first),
               two.pose.orientation * (two.asked.orientation.conjugate() * second)},
              held_angle(d), &d);
    const Vector3 then = from.axes * Vector3::UnitX(), now = d.axes * Vector3::UnitX();
    d.velocity = then.dot(d.velocity) * now, d.acceleration = then.dot(d.acceleration) * now;
    return d;
  }
  const Quaternion turn1 = one.pose.orientation * one.asked.orientation.conjugate();
  d.velocity = turn1 * d.velocity, d.acceleration = turn1 * d.acceleration;
  if (d.is_twist()) {
    const Twisting asked = twisting_of(d);
    const Twisting now = asked.turned(turn1, two.pose.orientation * two.asked.orientation.conjugate());
    set_twisting(now, &d);
    // its error and its limits are twists times the cosine
    const double grown = asked.cosine() > 0.0 ? now.cosine() / asked.cosine() : 1.0;
    for (double* limit : {&d.lower.x(), &d.upper.x()})
      if (std::fabs(*limit) < kUnlimited) *limit *= grown;
    return d;
  }
  if (d.is_component()) {
    const TurnComponent asked = turn_component_of(d);
    const TurnComponent now = asked.turned(turn1, two.pose.orientation * two.asked.orientation.conjugate());
    set_turn_component(now, &d);
    const double grown = now.gradient().squaredNorm() / asked.gradient().squaredNorm();
    d.compliance.x() /= grown, d.damping.x() *= grown;
    return d;
  }
  if (d.is_angular()) {
    const Quaternion turn2 = two.pose.orientation * two.asked.orientation.conjugate();
    d.point2 = d.point1 + turn_after(d.point2 - d.point1, turn1, turn2);
  } else {
    const Vector3 error = error_at(d, one.asked, two.asked, one.pose, two.pose);
    d.point1 = carried(d.point1, one.asked, one.pose);
    d.point2 = d.point1 + error;
  }
  d.axes = one.pose.orientation * (one.asked.orientation.conjugate() * d.axes);
  return d;
}

ReactionSolver::Arms ReactionSolver::arms_of(const Discrepancy& d, const Matrix3& axes, const Joint& joint) const {
  if (d.is_angular()) return {};
  const Body &first = bodies_[joint.body1], &second = bodies_[joint.body2];
  // a drive acts where it is in body 1
  const Vector3 at = holds_pose(d) ? d.point2 : d.point1;
  Arms arms{at - first.pose.position, at - second.pose.position, {}, 0.0};
  Vector3 along = second.velocity_at(arms.arm2) - first.velocity_at(arms.arm1);
  // body 1 is pushed at its own point: what an error of the state adds to its arm would turn light bodies
  for (int k = 0; k < 3; ++k) {
    if (!joint.is_only_point || !holds_place(d, k)) continue;
    const Vector3 axis = axes.col(k);
    arms.arm1 -= (axis.dot(d.point2 - d.point1) - joint.holdings[static_cast<std::size_t>(k)].target(d, k)) * axis;
    along -= (axis.dot(along) - axis.dot(d.velocity)) * axis;
  }
  arms.bend = second.centripetal(arms.arm2) - first.centripetal(arms.arm1) - 2.0 * first.velocity.angular.cross(along);
  arms.reach = longer_arm(first, arms.arm1, second, arms.arm2);
  return arms;
}

ReactionSolver::Row ReactionSolver::row_of_axis(const Discrepancy& d, const Matrix3& axes, int axis, const Arms& arms,
                                                const Joint& joint) const {
  Row row = d.is_radial() && axis == 0 ? radial_row(d, arms, joint) : axis_row(d, axes.col(axis), arms, joint);
  row.gamma -= (d.is_angular() ? Vector3(axes.col(axis)) : row.direction.linear).dot(d.acceleration);
  row.place = joint.place + static_cast<std::size_t>(axis);
  return row;
}

ReactionSolver::Row ReactionSolver::axis_row(const Discrepancy& d, const Vector3& axis, const Arms& arms,
                                             const Joint& joint) const {
  Row row{joint.body1, joint.body2, 0, {}, axis.dot(d.point2 - d.point1), 0.0, 0.0, 0.0, 0.0};
  if (d.is_angular()) {
    const Vector3 &w1 = bodies_[joint.body1].velocity.angular, &w2 = bodies_[joint.body2].velocity.angular;
    row.direction = turning_about(axis);
    row.gamma = turning_of(d, axis, w1, w2).dot(w2 - w1);
    return row;
  }
  row.direction = direction_at(axis, arms.arm1, arms.arm2);
  row.reach = arms.reach;
  row.gamma = axis.dot(arms.bend);
  return row;
}

Vector3 ReactionSolver::turning_of(const Discrepancy& d, const Vector3& axis, const Vector3& w1, const Vector3& w2) {
  if (d.is_twist()) {
    const Twisting twisting = twisting_of(d);
    const Vector3 rate = w1.cross(twisting.first) + w2.cross(twisting.second);
    const double cosine = twisting.cosine();
    return cosine > 0.0 ? Vector3((rate - axis.dot(rate) * axis) / (2.0 * cosine)) : w1.cross(axis);
  }
  if (!d.is_swing()) return w1.cross(axis);
  const Vector3 s = d.axes * Vector3::UnitY(), r = exp_rotation(d.point2) * s;
  const double sine = axis.dot(s.cross(r));
  const Vector3 rate = w1.cross(s).cross(r) + s.cross(w2.cross(r));
  return sine > 0.0 ? Vector3((rate - axis.dot(rate) * axis) / sine) : w1.cross(axis);
}

ReactionSolver::Row ReactionSolver::radial_row(const Discrepancy& d, const Arms& arms, const Joint& joint) const {
  const Body &first = bodies_[joint.body1], &second = bodies_[joint.body2];
  const Vector3 error = d.point2 - d.point1;
  const double length = error.norm();
  if (!(length > 0.0)) return axis_row(d, to_rotation_matrix(d.axes).col(0), arms, joint);
  const Vector3 direction = error / length;
  const Vector3 arm1 = d.point1 - first.pose.position, arm2 = d.point2 - second.pose.position;
  const Vector3 rate = second.velocity_at(arm2) - first.velocity_at(arm1);
  const Vector3 across = rate - direction.dot(rate) * direction;
  Row row{joint.body1, joint.body2, 0, direction_at(direction, arm1, arm2), length, 0.0, 0.0, 0.0, 0.0};
  row.gamma = direction.dot(second.centripetal(arm2) - first.centripetal(arm1)) + across.squaredNorm() / length;
  row.reach = std::max(length, longer_arm(first, arm1, second, arm2));
  return row;
}

double ReactionSolver::longer_arm(const Body& one, const Vector3& arm1, const Body& two, const Vector3& arm2) {
  return std::max(one.is_pushed() ? arm1.norm() : 0.0, two.is_pushed() ? arm2.norm() : 0.0);
}

double ReactionSolver::reach_of(const Row& row) const {
  constexpr double kShortest = 1e-3;  // of the longest reach
  if (row.direction.linear.isZero(0.0) || longest_ == 0.0) return 1.0;
  // without an arm nothing turns but others
  return row.reach > kShortest * longest_ ? row.reach : longest_;
}

double ReactionSolver::largest_turn() const {
  double largest = 0.0;
  for (const Row& row : rows_) largest = std::max(largest, std::abs(row.error) / reach_of(row));
  return largest;
}

bool ReactionSolver::is_amplifying() const {
  constexpr double kMuch = 10.0;
  const Row& weakest = rows_[factor_.weakest()];
  std::vector<double> unit(rows_.size(), 0.0);
  unit[factor_.weakest()] = reach_of(weakest);
  double largest = 0.0;
  for (const Twist& change : taken_out(std::move(unit))) {
    largest = std::max(largest, change.angular.norm());
    if (longest_ > 0.0) largest = std::max(largest, change.linear.norm() / longest_);
  }
  return largest > kMuch;
}

void ReactionSolver::agree_with_joints(Elsewhere elsewhere) {
  constexpr int kRounds = 12;
  constexpr double kQuick = 1e-3;  // rounds that leave less of the error do with the factors they have
  const std::vector<Body> asked = bodies_;
  const bool asked_elsewhere = has_moved_;  // at the step's start
  const double far = largest_turn();
  double turn = far, margin = kMargin;
  bool is_factored = margin * turn * turn < factor_.least_pivot();
  for (int round = 0; round < kRounds && turn > kOnJoints && margin < kMostMargin; ++round) {
    const std::vector<Body> before = bodies_;
    const bool is_new = !is_factored, had_moved = has_moved_;
    if (is_new) factorise(margin * turn * turn);
    move(taken_out(errors(&Row::error)));
    const double next = largest_turn();
    is_factored = next < kQuick * turn;
    if (next < 0.5 * turn) {
      turn = next;
      margin = kMargin;
      continue;
    }
    // rounding, old factors, or a row that is dependent but for the error was taken for one that is not
    bodies_ = before;
    has_moved_ = had_moved;
    make_rows();
    if (turn < kRounding) break;
    if (is_new) margin *= kMargin;
  }
  const bool is_stuck = turn > std::max(kRounding, kQuick * far);
  if (turn > kNearEnough || is_stuck) {
    bodies_ = asked;
    has_moved_ = asked_elsewhere;
    turn = far;
    make_rows();
  }
  if (turn > kNearEnough) return factorise(0.0);
  const double least = std::max({kSingular, kMargin * turn * turn, turn > kRounding ? kStuck * turn : 0.0});
  if (has_moved_ || factor_.least_pivot() < least) factorise(least);
  const std::vector<Twist> change = taken_out(errors(&Row::velocity_error));
  if (elsewhere != Elsewhere::kGoesOn) {
    const std::vector<std::uint8_t> which = led_elsewhere(change);
    if (std::ranges::find(which, 1) != which.end()) {
      bodies_ = asked;
      has_moved_ = asked_elsewhere;
      make_rows();
      if (elsewhere == Elsewhere::kIsAsAsked) return factorise(0.0);
      go_ahead(far, which);
      return agree_with_joints(Elsewhere::kGoesOn);
    }
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    bodies_[i].velocity.linear += change[i].linear;
    bodies_[i].velocity.angular += change[i].angular;
  }
  agrees_ = true;
  make_rows();
}

std::vector<std::uint8_t> ReactionSolver::led_elsewhere(const std::vector<Twist>& change) const {
  BodyUnion mechanisms(bodies_.size());
  for (const Row& row : rows_)
    if (bodies_[row.body1].is_pushed() && bodies_[row.body2].is_pushed()) mechanisms.join(row.body1, row.body2);
  std::vector<double> taken(bodies_.size(), 0.0), all(bodies_.size(), 0.0);
  for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (!(body.inverse_mass > 0.0)) continue;
    const auto energy = [&](const Twist& of) {
      return kinetic_energy(1.0 / body.inverse_mass, vector_at(request_->inertia(), body.row), body.pose.orientation,
                            of);
    };
    taken[mechanisms.root(i)] += energy(change[i]), all[mechanisms.root(i)] += energy(body.velocity);
  }
  std::vector<std::uint8_t> are(bodies_.size(), 0);
  for (std::uint32_t i = 0; i < bodies_.size(); ++i)
    are[i] = taken[mechanisms.root(i)] > kMuchOfVelocities * kMuchOfVelocities * all[mechanisms.root(i)] ? 1 : 0;
  return are;
}

void ReactionSolver::go_ahead(double turn_off, const std::vector<std::uint8_t>& which) {
  constexpr double kLeast = 1e-3, kOfError = 20.0;  // rad; of what the state is off by
  double fastest = 0.0;
  for (const Row& row : rows_) {
    if (which[row.body1] == 0 && which[row.body2] == 0) continue;
    const Twist &one = bodies_[row.body1].velocity, &two = bodies_[row.body2].velocity;
    // rods turn where bodies do not
    fastest = std::max({fastest, (two.angular - one.angular).norm(), (two.linear - one.linear).norm() / reach_of(row)});
  }
  if (!(fastest * request_->time_step() > kRounding)) return;  // they rest
  const double time = std::max(kLeast, kOfError * turn_off) / fastest;
  std::vector<Twist> way(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    if (which[i] != 0) way[i] = {time * bodies_[i].velocity.linear, time * bodies_[i].velocity.angular};
  move(way);
}

void ReactionSolver::move(const std::vector<Twist>& change) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body& body = bodies_[i];
    if (!body.is_pushed()) continue;
    body.pose = displaced(body.pose, change[i].linear, change[i].angular);
    body.inverse_inertia =
        world_inverse_inertia(body.pose.orientation, vector_at(request_->inverse_inertia(), body.row));
  }
  has_moved_ = true;
  make_rows();
}

std::vector<double> ReactionSolver::errors(double Row::*of) const {
  std::vector<double> all;
  for (const Row& row : rows_) all.push_back(row.*of);
  return all;
}

std::vector<Twist> ReactionSolver::taken_out(std::vector<double> errors) const {
  for (std::size_t i = 0; i < rows_.size(); ++i) errors[i] /= -rows_[i].scale;
  factor_.solve(&errors);
  std::vector<Twist> change(bodies_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    row.direction.push(errors[i] / row.scale, bodies_[row.body1].inverse_mass, bodies_[row.body2].inverse_mass,
                       change[row.body1], change[row.body2]);
  }
  return change;
}

void ReactionSolver::factorise(double least) {
  constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  first_of_body_.resize(bodies_.size());
  std::ranges::fill(first_of_body_, kNowhere);
  first_.resize(rows_.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    first_[i] = i;
    for (const std::uint32_t body : {rows_[i].body1, rows_[i].body2}) {
      if (!bodies_[body].is_pushed()) continue;
      first_of_body_[body] = std::min(first_of_body_[body], i);
      first_[i] = std::min(first_[i], first_of_body_[body]);
    }
  }
  factor_.start(first_);
  for (std::size_t i = 0; i < rows_.size(); ++i)
    for (std::size_t j = first_[i]; j <= i; ++j)
      if (const double shared = coupling(rows_[i], rows_[j], bodies_); shared != 0.0)
        factor_.entry(i, j) = shared / (rows_[i].scale * rows_[j].scale);
  factor_.factorise(least);
}

}  // namespace gravitas
