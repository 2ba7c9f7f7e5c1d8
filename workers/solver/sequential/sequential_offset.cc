// What acts on velocities alone, friction and drives, moves the pose as well.
#include <algorithm>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/solver.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {

// Sweeps over what friction and drives displace a light body by, which joints are to take back, may leave much of it:
// the pose change is that without friction's then, or that without any.
void SequentialSolver::solve_pose_with_offset(const stage::SolverSolveRequest& request, double factor) {
  constexpr double kMuchMore = 2.0;  // of what was open before
  const auto is_nought = [](const Twist& of) { return of.linear.isZero(0.0) && of.angular.isZero(0.0); };
  if (!discrepancies_.empty() && std::ranges::all_of(offset_, is_nought)) keep_pose(&before_offset_);
  for (const bool with_friction : {true, false}) {
    set_offset(request, factor, with_friction);
    if (with_friction && !discrepancies_.empty()) guess_pose(request, factor);
    solve_pose(request);
    if (discrepancies_.empty()) return;
    if (!(open_ > std::max(kMuchMore * before_offset_.open, pose_converged_ ? kFarOpen : kRounded))) return;
    used_up_ = true;
    if (!(open_ > kClosed)) return;
  }
  take_pose(before_offset_);
}

bool SequentialSolver::acts_on_velocity_alone() const {
  return velocity_joints_.has_velocity_only_impulse() || impulses_.has_friction_impulse();
}

// The first sweep begins with multipliers that push as the velocities' impulses do, where that misses less than those found
// without the offset: what rests, held by large forces that cancel, is found at once.
void SequentialSolver::guess_pose(const stage::SolverSolveRequest& request, double factor) {
  pose_at_trial(request);
  for (std::size_t i = 0; i < pose_laws_.size(); ++i)
    pushed_[i] = velocity_laws_[i].is_velocity_only ? 0.0 : factor * solution_.joint_impulse[i];
  pressed_.resize(closed_.size());
  for (std::size_t i = 0; i < closed_.size(); ++i) {
    const Vector3 normal = vector_at(request.contact_normal(), i);
    pressed_[i] = factor * normal.dot(vector_at(solution_.contact_impulse, i));
  }
  before_step_.joints = pose_joints_;
  before_step_.gaps = gaps_;
  const double error = error_of_pose();
  pose_joints_.build(bodies_, discrepancies_, pose_laws_, pushed_);
  gaps_.build(bodies_, request, settings_.correction_factor, pressed_);
  if (error_of_pose() < error) return;
  pose_joints_ = before_step_.joints;
  gaps_ = before_step_.gaps;
}

// What the multipliers there are leave of a row at S*, at most.
double SequentialSolver::error_of_pose() {
  solution_.displacement = offset_;
  pose_joints_.push_all(bodies_, solution_.displacement);
  gaps_.push_all(bodies_, solution_.displacement);
  sweep_.begin(bodies_, {&pose_joints_, &gaps_});
  return sweep_.largest_error(solution_.displacement);
}

// Rows of joints at S* again.
void SequentialSolver::pose_at_trial(const stage::SolverSolveRequest& request) {
  if (!posed_at_end_) return;
  if (gaps_are_stiff_) build_gaps(bodies_, request);
  gaps_are_stiff_ = false;
  pose_joints_.store(pushed_);
  pose_joints_.build(bodies_, discrepancies_, pose_laws_, pushed_);
  posed_at_end_ = false;
}

void SequentialSolver::set_offset(const stage::SolverSolveRequest& request, double factor, bool with_friction) {
  std::fill(offset_.begin(), offset_.end(), Twist{});
  velocity_joints_.push_velocity_only(bodies_, factor, offset_);
  if (with_friction) impulses_.push_friction(bodies_, factor, displacing_friction_, offset_);
  // turns by the inertia there, which is taken where the bodies end
  const auto inertia = [&](std::size_t i) {
    return world_inertia(bodies_[i].trial.orientation, moments_of(vector_at(request.inverse_inertia(), i)));
  };
  for (std::size_t i = 0; i < bodies_.count(); ++i)
    offset_moment_[i] =
        offset_[i].angular.isZero(0.0) ? Vector3(Vector3::Zero()) : Vector3(inertia(i) * offset_[i].angular);
}

}  // namespace gravitas
