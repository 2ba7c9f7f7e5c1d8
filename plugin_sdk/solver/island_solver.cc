// What an island is made of, and the order in which its end is found.
#include "plugin_sdk/solver/island_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/joint_bounce.h"

namespace gravitas {

IslandSolver::IslandSolver(const stage::SolverSolveRequest& request, const SolverBodies& all, const Island& island,
                           const ConeSettings& settings, ConeProblem* cone, SolverSolution* answer)
    : request_(request), island_(island), settings_(settings), answer_(*answer), cone_(*cone) {
  // its own bodies, and those that it is held by
  rows_.reserve(island.bodies.size() + 2 * (island.discrepancies.size() + island.contacts.size()) + 1);
  rows_.assign(island.bodies.begin(), island.bodies.end());
  // what holds a pair comes one after the other
  const auto add = [&](std::uint32_t row) {
    if (row != rows_.back() && row != rows_[rows_.size() - std::min<std::size_t>(rows_.size(), 2)])
      rows_.push_back(row);
  };
  for (const std::uint32_t row : island.discrepancies)
    for (const std::size_t end : {0U, 1U}) add(all.row(request.discrepancy_body()[2 * row + end]));
  for (const std::uint32_t row : island.contacts)
    for (const std::size_t end : {0U, 1U}) add(request.contact_body()[2 * row + end]);
  rows_.push_back(all.row(kNone));
  std::sort(rows_.begin(), rows_.end());
  rows_.erase(std::unique(rows_.begin(), rows_.end()), rows_.end());
  bodies_ = all.subset(rows_);
}

ConeSummary IslandSolver::solve(Host& host) {
  load();
  cone_.start(&host);
  const double share = request_.theta() * request_.time_step();
  guess_offset(share);
  int failures = 0;
  double last_change = 0.0;
  for (; round_ < kRounds; ++round_) {
    const BodyMotion before = displacement_;
    // impulses that wander from round to round are held more
    if (round_ == kFreeRounds) settings_.proximal *= 10.0;
    solve_pose();
    last_change = largest_change(before, displacement_);
    const bool closes = find_closed();
    // velocities are known to their residual; of rows that depend on each other, all impulses that move alike are right
    has_settled_ =
        round_ > 0 && has_velocity_ && !closes && !is_change(before, displacement_, 4.0 * share * summary_.residual);
    if (has_settled_) break;
    solve_velocity();
    host.mark_progress();
    has_settled_ = !set_offset(share);
    if (has_settled_) break;
    // what two rounds cannot solve the others could not either; sweeps that no steps followed go on from round to round
    const bool goes_on = settings_.method == ConeMethod::kGaussSeidel && cone_.is_large();
    failures = has_velocity_ || goes_on ? 0 : failures + 1;
    if (failures == 2) break;
  }
  if (!has_settled_ && !contacts_.empty() && !joints_.empty()) leave_out_wandering(last_change);
  // where they do not settle, the pose change stays that of the impulses before: it must not move rows away
  summary_.contradiction = std::max(summary_.contradiction, pose_contradiction_);
  summary_.has_converged = has_settled_ && has_pose_ && has_velocity_;
  store();
  return summary_;
}

void IslandSolver::leave_out_wandering(double last_change) {
  constexpr double kMuch = 1e-3;  // of the smallest radius of gyration
  double smallest = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : pushed_) smallest = std::min(smallest, gyration_[i]);
  const double before = open();
  if (!(std::max(last_change, before) > kMuch * smallest)) return;
  const PoseChange kept = pose_change();
  offset_ = driven_;
  keep_moments_of_offset();
  forget_corrections();
  solve_pose();
  if (open() > std::max(before, kMuch * smallest)) {
    take(kept);
    return;
  }
  find_closed();
  solve_velocity();
}

IslandSolver::PoseChange IslandSolver::pose_change() const {
  PoseChange change{displacement_, offset_, offset_moment_, {}, {}, has_pose_, pose_contradiction_};
  for (const EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k) change.of_joints.push_back(answer_.joint_correction[3 * joint.row + k]);
  for (const EndContact& contact : contacts_) change.of_contacts.push_back(answer_.contact_correction[contact.row]);
  return change;
}

void IslandSolver::take(const PoseChange& change) {
  offset_ = change.offset;
  offset_moment_ = change.offset_moment;
  has_pose_ = change.has_converged;
  pose_contradiction_ = change.contradiction;
  auto of_joint = change.of_joints.begin();
  for (const EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k) answer_.joint_correction[3 * joint.row + k] = *of_joint++;
  auto of_contact = change.of_contacts.begin();
  for (const EndContact& contact : contacts_) answer_.contact_correction[contact.row] = *of_contact++;
  move_to_end(change.displacement);
}

double IslandSolver::open() const {
  double open = 0.0;
  for (const EndJoint& joint : joints_) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double change = joint.errors[static_cast<Eigen::Index>(k)] - joint.states[k].error_at_trial;
      const JointLaw& law = joint.pose_laws[k];
      if (law.gamma == 0.0) open = std::max(open, law.missed_by(change) * joint.length);
    }
  }
  return open;
}

// ---- what does not change within the step

void IslandSolver::load() {
  velocity_ = start_motion(&SolverBody::trial_velocity);
  displacement_ = offset_ = driven_ = start_motion(nullptr);
  end_.resize(bodies_.count() + 1);
  gyration_.reserve(end_.size());
  pushed_.reserve(island_.bodies.size());
  for (std::uint32_t i = 0; i <= bodies_.count(); ++i) {
    end_[i] = {bodies_[i].trial, bodies_[i].inverse_inertia, bodies_[i].inverse_inertia};
    gyration_.push_back(bodies_[i].gyration());
  }
  for (const std::uint32_t row : island_.bodies) {
    pushed_.push_back(place_of(row));
    coordinates_ = std::max(coordinates_, bodies_[pushed_.back()].trial.position.cwiseAbs().maxCoeff());
  }
  const DiscrepancyColumns columns = columns_of(request_);
  joints_.reserve(island_.discrepancies.size());
  contacts_.reserve(island_.contacts.size());
  for (const std::uint32_t row : island_.discrepancies) load_joint(columns, row);
  if (island_.contacts.empty()) return;
  find_joined();
  for (const std::uint32_t row : island_.contacts) load_contact(row);
  std::vector<double> displacing;
  find_displacing_friction(
      request_, contacts_.size(), [&](std::size_t k) { return contacts_[k].row; },
      [&](std::size_t i, std::size_t end) -> const SolverBody& {
        return bodies_[place_of(request_.contact_body()[2 * i + end])];
      },
      &displacing);
  for (std::size_t k = 0; k < contacts_.size(); ++k) contacts_[k].displacing_friction = displacing[k];
}

std::uint32_t IslandSolver::place_of(std::uint32_t row) const {
  if (row == kNone) return static_cast<std::uint32_t>(bodies_.count());
  return static_cast<std::uint32_t>(std::lower_bound(rows_.begin(), rows_.end(), row) - rows_.begin());
}

BodyMotion IslandSolver::start_motion(Twist SolverBody::*of) const {
  BodyMotion motion(bodies_.count() + 1);
  if (of != nullptr)
    for (std::uint32_t i = 0; i < bodies_.count(); ++i) motion[i] = bodies_[i].*of;
  return motion;
}

void IslandSolver::load_joint(const DiscrepancyColumns& columns, std::uint32_t row) {
  EndJoint& joint = joints_.emplace_back();
  joint.row = row;
  joint.body1 = place_of(request_.discrepancy_body()[2 * row]);
  joint.body2 = place_of(request_.discrepancy_body()[2 * row + 1]);
  joint.discrepancy = columns.at(row);
  if (has_reactions() && request_.discrepancy_applied_force()[3 * row] != 0.0)
    add_turns(turns_to_limit(joint.discrepancy), &joint.discrepancy);
  const Discrepancy& d = joint.discrepancy;
  joint.axes = to_rotation_matrix(d.axes);
  joint.is_only_point = is_only_point(request_.discrepancy_body(), request_.mode(), row);
  const SolverBody &one = bodies_[joint.body1], &two = bodies_[joint.body2];
  const Vector3 middle = 0.5 * (d.point1 + d.point2);
  const Vector3 start_error = error_in_axes_at(d, one.trial, two.trial, one.start, two.start);
  joint.slop = d.is_angular() ? 1e-9 : closing_slop(middle, one, two);
  joint.length = d.is_angular() ? std::max(one.gyration(), two.gyration()) : 1.0;
  if (!d.is_angular()) coordinates_ = std::max(coordinates_, d.point2.cwiseAbs().maxCoeff());
  // of a body at the origin whose turn is given, steps would go on among the roundings of its angle
  if (d.is_twist() && axis_mode(d.modes, 0) == AxisMode::kLocked)
    coordinates_ = std::max(coordinates_, kHalfTurn * joint.length);
  for (int k = 0; k < 3; ++k)
    joint.states[static_cast<std::size_t>(k)] = joint_axis_state(d, k, joint.axes.col(k), start_error);
  set_bounces(d, one, two, request_.discrepancy_warm_impulse().subspan(3 * std::size_t{row}, 3), &joint.states);
  for (const JointAxisState& axis : joint.states) stops_bounce_ = stops_bounce_ || axis.bounce != 0.0;
  for (int k = 0; k < 3; ++k) {
    const auto place = static_cast<std::size_t>(k);
    if (has_reactions()) hold_what_bears(request_.discrepancy_applied_force()[3 * row + place], &joint.states[place]);
    joint.pose_laws[place] = pose_law(joint.states[place], d.correction, request_.time_step());
    const auto at = 3 * row + static_cast<std::uint32_t>(k);
    answer_.joint_correction[at] =
        joint.pose_laws[place].is_active() ? request_.discrepancy_warm_correction()[at] : 0.0;
    answer_.joint_impulse[at] = request_.discrepancy_warm_impulse()[at];
  }
}

void IslandSolver::find_joined() {
  for (const EndJoint& joint : joints_) {
    for (const JointAxisState& axis : joint.states) {
      if (!velocity_law(axis, axis.error_at_trial, joint.slop, request_.time_step()).is_unbounded_drive()) continue;
      joined_.clear();
      return;
    }
    joined_.emplace_back(std::minmax({joint.body1, joint.body2}));
  }
  std::ranges::sort(joined_);
}

void IslandSolver::load_contact(std::uint32_t row) {
  EndContact& contact = contacts_.emplace_back();
  contact.row = row;
  contact.body1 = place_of(request_.contact_body()[2 * row]);
  contact.body2 = place_of(request_.contact_body()[2 * row + 1]);
  const SolverBody &one = bodies_[contact.body1], &two = bodies_[contact.body2];
  const Vector3 normal = vector_at(request_.contact_normal(), row);
  const Vector3 point = vector_at(request_.contact_point(), row);
  if (std::ranges::binary_search(joined_, std::pair(std::minmax({contact.body1, contact.body2}))))
    contact.softness = kOfJoined;
  contact.gap_row = ConstraintDirection::through(point, normal, one, two);
  contact.gap = -request_.contact_depth()[row];
  const Vector3 to_surface = (-0.5 * contact.gap) * normal;
  contact.gap_target = 0.0 - contact.gap;
  contact.slop = closing_slop(point, one, two);
  contact.law = contact_law(request_, row, one, two);
  contact.arm1 = point + to_surface - one.trial.position;
  contact.arm2 = point - to_surface - two.trial.position;
  coordinates_ = std::max(coordinates_, point.cwiseAbs().maxCoeff());
  answer_.contact_correction[row] = std::max(0.0, request_.contact_warm_correction()[row]);
  set_vector(answer_.contact_impulse, row, vector_at(request_.contact_warm_impulse(), row));
  set_vector(answer_.contact_direction, row, normal);
}

// ---- the first guess

void IslandSolver::guess_offset(double share) {
  for (EndJoint& joint : joints_) {
    move_to_end(&joint);
    for (std::size_t k = 0; k < 3; ++k) {
      if (slips(joint, k)) joint.states[k].mode = AxisMode::kFree;
      if (is_spring(joint.states[k])) load_spring(k, &joint);
      if (!is_drive(joint.states[k].mode)) continue;
      // with reactions S* has what a drive does in the step; what it did in an impact before would press its arm through stops
      const double impulse = has_reactions() ? 0.0 : answer_.joint_impulse[3 * joint.row + k];
      push_at_trial(joint, joint.directions[k], share * impulse, &offset_);
      if (velocity_law_of(joint, k).is_unbounded_drive()) joint.driven[k] = impulse;
    }
  }
  driven_ = offset_;
  for (const EndContact& contact : contacts_) {
    const Vector3 impulse = vector_at(answer_.contact_impulse, contact.row);
    const Vector3 normal = contact.law.frame.col(0);
    const Vector3 friction = impulse - normal.dot(impulse) * normal;
    push_at_trial(contact, direction_at(friction, contact.arm1, contact.arm2), share, &offset_);
  }
  keep_moments_of_offset();
}

bool IslandSolver::slips(const EndJoint& joint, std::size_t k) const {
  constexpr double kAll = 1.0 - 1e-3;  // of a bound that may change on the way
  const JointAxisState& axis = joint.states[k];
  if (!has_reactions() || !is_drive(axis.mode) || axis.maximum_force >= kUnlimited) return false;
  const double applied = request_.discrepancy_applied_force()[3 * joint.row + k];
  if (std::fabs(applied) < kAll * axis.maximum_force) return false;
  const double rate =
      joint.directions[k].along(bodies_[joint.body1].trial_velocity, bodies_[joint.body2].trial_velocity);
  return (rate - axis.desired_velocity) * applied < 0.0;
}

void IslandSolver::load_spring(std::size_t k, EndJoint* joint) {
  const double h = request_.time_step(), theta = request_.theta();
  const double approach =
      joint->directions[k].along(bodies_[joint->body1].trial_velocity, bodies_[joint->body2].trial_velocity);
  joint->pose_laws[k] = spring_pose_law(joint->states[k], approach, theta, h);
  const std::size_t at = 3 * joint->row + k;
  if (joint->pose_laws[k].is_active())
    answer_.joint_correction[at] = request_.discrepancy_warm_correction()[at] + theta * h * answer_.joint_impulse[at];
}

template <class Row>
void IslandSolver::push_at_trial(const Row& row, const ConstraintDirection& direction, double amount,
                                 BodyMotion* x) const {
  if (amount == 0.0) return;
  const SolverBody &one = bodies_[row.body1], &two = bodies_[row.body2];
  with_turns(direction, one.inverse_inertia, two.inverse_inertia)
      .push(amount, one.inverse_mass, two.inverse_mass, (*x)[row.body1], (*x)[row.body2]);
}

// ---- the end of the step

void IslandSolver::move_to_end(BodyMotion displacement) {
  displacement_ = std::move(displacement);
  move_to_end();
}

void IslandSolver::move_to_end() {
  for (const std::uint32_t i : pushed_) {
    const Twist& d = displacement_[i];
    end_[i].pose = displaced(bodies_[i].trial, d.linear, d.angular);
    end_[i].turn = to_rotation_matrix(exp_rotation(d.angular));
    end_[i].inverse_inertia =
        d.angular.isZero(0.0)
            ? bodies_[i].inverse_inertia
            : world_inverse_inertia(end_[i].pose.orientation, vector_at(request_.inverse_inertia(), rows_[i]));
  }
  for (EndJoint& joint : joints_) move_to_end(&joint);
}

void IslandSolver::stiffen() {
  stiffness_.assign(bodies_.count() + 1, Matrix3::Zero());
  for (const EndJoint& joint : joints_) {
    if (joint.discrepancy.is_angular()) continue;
    Vector3 push = Vector3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      push += answer_.joint_correction[3 * joint.row + k] * joint.directions[k].linear;
    const bool is_rod = joint.discrepancy.is_radial();
    stiffness_[joint.body1] += geometric_stiffness(is_rod ? joint.own_arm1() : joint.arm1, -push);
    stiffness_[joint.body2] += geometric_stiffness(is_rod ? joint.own_arm2() : joint.arm2, push);
  }
  for (const std::uint32_t i : pushed_) {
    EndBody& end = end_[i];
    end.is_stiffened = !stiffness_[i].isZero(0.0);
    if (end.is_stiffened)
      end.stiffened =
          stiffened_inverse(end.pose.orientation, vector_at(request_.inverse_inertia(), rows_[i]), stiffness_[i]);
  }
  place_unstiffened();
}

void IslandSolver::place_unstiffened() {
  for (const std::uint32_t i : pushed_)
    if (!end_[i].is_stiffened) end_[i].stiffened = end_[i].inverse_inertia;
}

void IslandSolver::start_step(BodyMotion* x0) const {
  *x0 = offset_;
  for (const std::uint32_t i : pushed_) {
    const Vector3 missing = offset_[i].angular - displacement_[i].angular;
    if (missing.isZero(0.0) || !end_[i].is_stiffened) continue;
    const Vector3 moments = moments_of(vector_at(request_.inverse_inertia(), rows_[i]));
    (*x0)[i].angular =
        displacement_[i].angular + end_[i].stiffened * (world_inertia(end_[i].pose.orientation, moments) * missing);
  }
}

void IslandSolver::move_to_end(EndJoint* joint) const {
  const Vector3 turn = displacement_[joint->body2].angular - displacement_[joint->body1].angular;
  move_joint(bodies_[joint->body1], bodies_[joint->body2], end_[joint->body1], end_[joint->body2], turn, joint);
}

// ---- sizes, m

double IslandSolver::largest_change(const BodyMotion& a, const BodyMotion& b) const {
  double most = 0.0;
  for (const std::uint32_t i : pushed_)
    most = std::max(most, (a[i].linear - b[i].linear).norm() + gyration_[i] * (a[i].angular - b[i].angular).norm());
  return most;
}

double IslandSolver::largest(const BodyMotion& a) const {
  double most = 0.0;
  for (const std::uint32_t i : pushed_) most = std::max(most, a[i].linear.norm() + gyration_[i] * a[i].angular.norm());
  return most;
}

bool IslandSolver::is_change(const BodyMotion& a, const BodyMotion& b, double known) const {
  const double size = std::max({largest(a), largest(b), largest(displacement_)});
  return largest_change(a, b) > std::max({known, kEpsilon * coordinates_, 1e-14 * size});
}

void IslandSolver::store() {
  for (const std::uint32_t i : pushed_) {
    answer_.velocity[rows_[i]] = velocity_[i];
    answer_.displacement[rows_[i]] = displacement_[i];
  }
  for (const EndContact& contact : contacts_)
    set_vector(answer_.contact_turning, contact.row, contact.law.frame * contact.turning);
  // by what drives moved their bodies before something was in the way
  const double share = request_.theta() * request_.time_step();
  for (const EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = 3 * joint.row + k;
      if (has_yielded(joint.velocity_laws[k]))
        answer_.joint_correction[at] = share * (joint.driven[k] - answer_.joint_impulse[at]);
      else if (joint.pose_laws[k].gamma > 0.0)
        answer_.joint_correction[at] -= share * answer_.joint_impulse[at];
    }
}

}  // namespace gravitas
