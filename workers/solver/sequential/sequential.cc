// The order of the work, as the head of sequential.h describes it.
#include "workers/solver/sequential/sequential.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "plugin_sdk/body.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/request_check.h"

namespace gravitas {
namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();
// Changes of this many units of rounding count as none.
constexpr double kStillness = 128.0 * kRounding;

// A contact slips if it does so this much faster than a sweep still changes it: what converges
// slowly is further from its end than one change.
constexpr double kSlipToChange = 1e4;

void copy(std::span<const double> from, std::vector<double>& to) { to.assign(from.begin(), from.end()); }

// Finite numbers whose squares or sums are not.
void check_range(double violation, double motion) {
  if (!std::isfinite(violation) || !std::isfinite(motion))
    throw Refusal("velocities, errors or arms so large that their products are not finite");
}

DiscrepancyColumns columns_of(const stage::SolverSolveRequest& r) {
  return {r.point1(), r.point2(), r.velocity(),   r.correction(), r.axes(),         r.mode(),
          r.lower(),  r.upper(),  r.compliance(), r.damping(),    r.maximum_force()};
}

std::uint32_t root_of(std::vector<std::uint32_t>& group, std::uint32_t body) {
  while (group[body] != body) {
    group[body] = group[group[body]];
    body = group[body];
  }
  return body;
}

}  // namespace

SequentialSummary SequentialSolver::solve(const stage::SolverSolveRequest& request,
                                          const stage::SolverSolveReply& reply) {
  check_solver_request(request);
  load(request);
  solve_pose();
  find_closed();
  build_velocity(request);
  solve_velocity();

  const double factor = request.theta() * time_step_;
  if (factor > 0.0 && acts_on_velocity_alone()) {
    set_offset(factor);
    solve_pose();
    if (find_closed()) {
      build_velocity(request);
      solve_velocity();
      set_offset(factor);
      solve_pose();
    }
  }

  const bool has_rows =
      !pose_joints_.is_empty() || !gaps_.is_empty() || !velocity_joints_.is_empty() || !impulses_.is_empty();
  StopReason reason = has_rows ? StopReason::kConverged : StopReason::kNothingToDo;
  if (used_up_) reason = StopReason::kIterations;
  summary_.stop_reason = static_cast<std::uint32_t>(reason);
  write(reply);
  return summary_;
}

void SequentialSolver::load(const stage::SolverSolveRequest& request) {
  summary_ = {};
  used_up_ = false;
  time_step_ = request.time_step();
  coordinates_ = 0.0;
  bodies_.load(request);
  copy(request.discrepancy_warm_impulse(), joint_impulse_);
  copy(request.discrepancy_warm_correction(), joint_correction_);
  copy(request.contact_warm_impulse(), contact_impulse_);
  copy(request.contact_warm_correction(), contact_correction_);
  copy(request.contact_normal(), contact_direction_);

  const DiscrepancyColumns columns = columns_of(request);
  discrepancies_.clear();
  pose_laws_.clear();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Discrepancy discrepancy = columns.at(i);
    const std::uint32_t body1 = bodies_.row(request.discrepancy_body()[2 * i]);
    const std::uint32_t body2 = bodies_.row(request.discrepancy_body()[2 * i + 1]);
    discrepancies_.push_back(relaxation_discrepancy(discrepancy, body1, body2, bodies_, settings_.correction_factor));
    const RelaxationDiscrepancy& r = discrepancies_.back();
    for (const JointAxisState& axis : r.axes) pose_laws_.push_back(pose_law(axis, r.beta, time_step_));
    coordinates_ = std::max(coordinates_, discrepancy.point2.cwiseAbs().maxCoeff());
  }
  pose_joints_.build(bodies_, discrepancies_, pose_laws_, joint_correction_);
  gaps_.build(bodies_, request, settings_.correction_factor, contact_correction_);
  coordinates_ = std::max(coordinates_, gaps_.coordinates());

  trial_velocity_.clear();
  for (std::uint32_t i = 0; i <= bodies_.count(); ++i) trial_velocity_.push_back(bodies_[i].trial_velocity);
  offset_.assign(bodies_.count() + 1, Twist{});
  closed_.assign(request.contact_key().size(), 0);
  velocity_laws_.assign(pose_laws_.size(), JointLaw{});
}

// ---- pose change

// displacement_ and the multipliers of the pose rows, on top of offset_.
void SequentialSolver::solve_pose() {
  displacement_ = offset_;
  const double violation =
      std::max(pose_joints_.largest_violation(displacement_), gaps_.largest_violation(displacement_));
  const double motion = std::max(pose_joints_.largest_motion(displacement_), gaps_.largest_motion(displacement_));
  check_range(violation, motion);
  const double representable = 0.25 * kRounding * coordinates_;
  if (violation <= std::max(representable, kRounding * motion)) {
    // nothing is missing, so zero multipliers are the solution
    pose_joints_.clear_multipliers();
    gaps_.clear_multipliers();
    return;
  }
  pose_joints_.push_all(bodies_, displacement_);
  gaps_.push_all(bodies_, displacement_);
  const double tolerance = std::max(representable, kStillness * std::max(violation, motion));
  bool converged = false;
  for (std::uint32_t i = 0; i < settings_.iterations && !converged; ++i) {
    const double joints = pose_joints_.sweep(bodies_, displacement_);
    const double contacts = gaps_.sweep(bodies_, displacement_);
    converged = std::max(joints, contacts) <= tolerance;
    ++summary_.sweeps;
  }
  used_up_ = used_up_ || !converged;
  displacement_ = offset_;
  pose_joints_.push_all(bodies_, displacement_);
  gaps_.push_all(bodies_, displacement_);
}

// Adds the contacts and limits that the pose change leaves closed to those that were, and makes the
// laws of the velocities. Returns whether any closed that was not.
bool SequentialSolver::find_closed() {
  bool added = false;
  closed_now_.resize(closed_.size());
  gaps_.find_closed(displacement_, closed_now_);
  for (std::size_t i = 0; i < closed_.size(); ++i) {
    added = added || closed_now_[i] > closed_[i];
    closed_[i] = std::max(closed_[i], closed_now_[i]);
  }
  for (std::size_t i = 0; i < discrepancies_.size(); ++i) {
    const RelaxationDiscrepancy& d = discrepancies_[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double moved = d.directions[axis].along(displacement_[d.body1], displacement_[d.body2]);
      const double error = d.axes[axis].error_at_trial + moved;
      const JointLaw law = velocity_law(d.axes[axis], error, d.slop, time_step_);
      JointLaw& known = velocity_laws_[3 * i + axis];
      added = added || (law.has_lower && !known.has_lower) || (law.has_upper && !known.has_upper);
      const bool has_lower = law.has_lower || known.has_lower;
      const bool has_upper = law.has_upper || known.has_upper;
      known = law;
      known.has_lower = has_lower;
      known.has_upper = has_upper;
    }
  }
  return added;
}

// ---- velocity

void SequentialSolver::build_velocity(const stage::SolverSolveRequest& request) {
  velocity_joints_.build(bodies_, discrepancies_, velocity_laws_, joint_impulse_);
  impulses_.build(bodies_, request, closed_, contact_impulse_);
  copy(request.contact_normal(), contact_direction_);
}

// Velocities and impulses, with the bound on energy.
void SequentialSolver::solve_velocity() {
  relax_velocity();
  bound_energy();
  velocity_joints_.store(joint_impulse_);
  std::fill(contact_impulse_.begin(), contact_impulse_.end(), 0.0);
  impulses_.store(contact_impulse_, contact_direction_);
}

// velocity_ and the multipliers of the velocity rows.
void SequentialSolver::relax_velocity() {
  ++summary_.velocity_solutions;
  summary_.residual = 0.0;
  velocity_ = trial_velocity_;
  const double violation =
      std::max(velocity_joints_.largest_violation(velocity_), impulses_.largest_violation(velocity_));
  const double motion = std::max(velocity_joints_.largest_motion(velocity_), impulses_.largest_motion(velocity_));
  check_range(violation, motion);
  if (violation <= kRounding * motion) {
    velocity_joints_.clear_multipliers();
    impulses_.clear_multipliers();
    velocity_converged_ = true;
    return;
  }
  impulses_.let_stick();
  velocity_joints_.push_all(bodies_, velocity_);
  impulses_.push_all(bodies_, velocity_);
  velocity_converged_ = sweep_velocity(kStillness * std::max(violation, motion));
  used_up_ = used_up_ || !velocity_converged_;
  sum_velocity();
}

// Sweeps until nothing changes by more than the tolerance (m/s); false if the sweeps ran out.
bool SequentialSolver::sweep_velocity(double tolerance) {
  const std::uint32_t cap = settings_.iterations;
  for (std::uint32_t done = 1; done <= cap; ++done) {
    const double joints = velocity_joints_.sweep(bodies_, velocity_);
    const double contacts = impulses_.sweep(bodies_, velocity_);
    summary_.residual = std::max(joints, contacts);
    ++summary_.sweeps;
    const bool converged = summary_.residual <= tolerance;
    if (converged || done == cap / 2 || done == cap / 4 * 3) {
      const double slip = kSlipToChange * std::max(summary_.residual, tolerance);
      if (impulses_.let_slide(velocity_, slip)) continue;
    }
    if (converged) return true;
  }
  return false;
}

bool SequentialSolver::acts_on_velocity_alone() const {
  return velocity_joints_.has_velocity_only_impulse() || impulses_.has_friction_impulse();
}

void SequentialSolver::set_offset(double factor) {
  std::fill(offset_.begin(), offset_.end(), Twist{});
  velocity_joints_.push_velocity_only(bodies_, factor, offset_);
  impulses_.push_friction(bodies_, factor, offset_);
}

// ---- energy

void SequentialSolver::bound_energy() {
  const bool bounces = impulses_.has_restitution();
  if (!bounces && velocity_converged_) return;
  for (int round = 0; round < 3; ++round) {
    const std::uint32_t lowered = impulses_.lower_restitution(trial_velocity_, velocity_);
    if (lowered == 0) break;
    summary_.restitutions_lowered += lowered;
    relax_velocity();
  }

  group_bodies();
  add_up_gains(velocity_);
  const std::uint32_t dropped = impulses_.drop_restitution(bodies_, group_, gains_);
  summary_.restitutions_dropped += dropped;
  if (dropped > 0) relax_velocity();
  if (!velocity_converged_) scale_back();
}

// gains_: what each group's bodies gain by the impulses between v* and `after`.
void SequentialSolver::add_up_gains(const BodyMotion& after) {
  gains_.assign(bodies_.count() + 1, Gain{});
  impulses_.add_work(bodies_, trial_velocity_, after, group_, gains_);
  velocity_joints_.add_work(bodies_, trial_velocity_, after, group_, gains_);
}

// Groups that gain although nothing bounces: sweeps that ran out. A share f of all their impulses
// gains f L + f^2 (W - L), W the gain of the whole and L = lambda.u_before: the largest f that
// gains nothing.
void SequentialSolver::scale_back() {
  add_up_gains(trial_velocity_);
  factor_.clear();
  for (const Gain& gain : gains_) factor_.push_back(gain.work);
  add_up_gains(velocity_);
  bool any = false;
  for (std::size_t i = 0; i < factor_.size(); ++i) {
    const double along = factor_[i];
    const bool gains = gains_[i].is_real();
    any = any || gains;
    factor_[i] = gains ? std::max(0.0, -along / (gains_[i].work - along)) : 1.0;
  }
  if (!any) return;
  velocity_joints_.exempt_driven(bodies_, group_, factor_);
  for (const double factor : factor_)
    if (factor < 1.0) ++summary_.groups_scaled_back;
  velocity_joints_.scale(bodies_, group_, factor_);
  impulses_.scale(bodies_, group_, factor_);
  sum_velocity();
}

// velocity_ anew from the multipliers.
void SequentialSolver::sum_velocity() {
  velocity_ = trial_velocity_;
  velocity_joints_.push_all(bodies_, velocity_);
  impulses_.push_all(bodies_, velocity_);
}

// group_[i]: the first of the bodies that joints and contacts connect with body i through bodies
// that can be pushed.
void SequentialSolver::group_bodies() {
  group_.clear();
  for (std::uint32_t i = 0; i <= bodies_.count(); ++i) group_.push_back(i);
  const auto connect = [this](std::uint32_t body1, std::uint32_t body2) {
    if (!bodies_[body1].is_pushed() || !bodies_[body2].is_pushed()) return;
    const std::uint32_t root1 = root_of(group_, body1);
    const std::uint32_t root2 = root_of(group_, body2);
    group_[std::max(root1, root2)] = std::min(root1, root2);
  };
  impulses_.each_pair(connect);
  for (const RelaxationDiscrepancy& d : discrepancies_) connect(d.body1, d.body2);
  for (std::uint32_t i = 0; i <= bodies_.count(); ++i) group_[i] = root_of(group_, i);
}

// ---- answer

void SequentialSolver::write(const stage::SolverSolveReply& reply) {
  const std::size_t count = bodies_.count();
  const std::span<double> linear = reply.linear_velocity().resize(3 * count);
  const std::span<double> angular = reply.angular_velocity().resize(3 * count);
  const std::span<double> change = reply.pose_change().resize(6 * count);
  const bool has_room = linear.size() + angular.size() + change.size() == 12 * count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Twist& v = velocity_[i];
    const Twist& d = displacement_[i];
    const double sum = v.linear.sum() + v.angular.sum() + d.linear.sum() + d.angular.sum();
    if (!std::isfinite(sum))
      throw Refusal("the answer for body " + std::to_string(i) +
                    " is not finite: masses, velocities or errors overflow");
    if (!has_room) continue;
    set_vector(linear, i, v.linear);
    set_vector(angular, i, v.angular);
    set_vector(change, 2 * i, d.linear);
    set_vector(change, 2 * i + 1, d.angular);
  }

  pose_joints_.store(joint_correction_);
  gaps_.store(contact_correction_);
  const auto put = [](const stage::ReplyColumn<double>& column, const std::vector<double>& values) {
    const std::span<double> room = column.resize(values.size());
    if (!room.empty()) std::copy(values.begin(), values.end(), room.begin());
  };
  put(reply.discrepancy_impulse(), joint_impulse_);
  put(reply.discrepancy_correction(), joint_correction_);
  put(reply.contact_impulse(), contact_impulse_);
  put(reply.contact_correction(), contact_correction_);
  put(reply.contact_direction(), contact_direction_);
  reply.iterations().set(summary_.sweeps);
  reply.residual().set(summary_.residual);
  reply.stop_reason().set(summary_.stop_reason);
}

}  // namespace gravitas
