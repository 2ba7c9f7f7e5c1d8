// Where the pose change ends: rows and errors there, and what is closed.
#include <algorithm>
#include <limits>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {

bool SequentialSolver::touches(const RelaxationDiscrepancy& joint) const {
  return std::ranges::binary_search(touching_, pair_of(joint.body1, joint.body2));
}

// Newton's steps from the rows at S*, for what these leave of joints by the square of the turn: each with rows at the end of
// the one before, as long as one halves what joints are open by. Where corrections stiffen bodies, the steps know it, and go on
// until what they change moves nothing any more.
void SequentialSolver::close_at_end(const stage::SolverSolveRequest& request) {
  const auto off = [&] { return std::max(open_, kOfSprings * unsprung_); };
  find_ends(request);
  double stiffness = measure_stiffness();
  const bool is_stiff = stiffness > kStiff;
  double before = is_stiff ? std::numeric_limits<double>::infinity() : off();
  for (int step = 0; before > (step == 0 ? kOpen : kClosed) && step < (is_stiff ? kStiffSteps : kPoseSteps); ++step) {
    keep_pose(&before_step_);
    if (is_stiff && step > 0) stiffness = measure_stiffness();
    if (is_stiff) stiffen(request);
    build_at_end(request, is_stiff);
    pose_converged_ = relax_pose();
    posed_at_end_ = true;
    find_ends(request);
    // what is left moves bodies by as much more as they are stiffer
    const double left = std::max(off(), is_stiff ? stiffness * largest_change(before_step_.displacement) : 0.0);
    // sweeps that ran out go on from where they are
    const bool goes_on = left < 0.5 * before || (is_stiff && !pose_converged_ && left < before);
    if (!(left < before)) take_pose(before_step_);
    if (!goes_on) break;
    before = left;
  }
  if (is_stiff) end_unstiffened(request);
  used_up_ = used_up_ || !pose_converged_;
}

// From a displacement to that there is, of what the bodies measure.
double SequentialSolver::largest_change(const BodyMotion& from) const {
  double most = 0.0;
  for (std::uint32_t i = 0; i < bodies_.count(); ++i) {
    const double gyration = bodies_[i].gyration();
    if (!bodies_[i].is_pushed() || !(gyration > 0.0)) continue;
    const Twist &now = solution_.displacement[i], &then = from[i];
    most = std::max(most, (now.linear - then.linear).norm() / gyration + (now.angular - then.angular).norm());
  }
  return most;
}

// What a turn of a body adds to the moments that the corrections exert on it: under tension this holds a light link more than its
// inertia does (end_of_step.h). Returns the largest share of a body's inertia, and of masses by which rods hold them across.
double SequentialSolver::measure_stiffness() {
  double most = 0.0;
  stiffness_.assign(bodies_.count() + 1, Matrix3::Zero());
  for (std::size_t i = 0; i < discrepancies_.size(); ++i) {
    const RelaxationDiscrepancy& d = discrepancies_[i];
    if (const TurnOfSwing turn = turn_of_swing(i); turn.stiffness > 0.0 && !touches(d)) {
      const ConstraintDirection row =
          with_turns(turn.direction, turned_[d.body1].inverse_inertia, turned_[d.body2].inverse_inertia);
      most = std::max(most, turn.stiffness * row.product(row, 0.0));
    }
    if (!ends_[i].is_linear || touches(d)) continue;
    Vector3 push = Vector3::Zero();
    // but for what stands on free axes (add_turn())
    for (std::size_t k = 0; k < 3; ++k)
      if (pose_laws_[3 * i + k].is_active()) push += pushed_[3 * i + k] * ends_[i].directions[k].linear;
    stiffness_[d.body1] += geometric_stiffness(ends_[i].arm1, -push);
    stiffness_[d.body2] += geometric_stiffness(ends_[i].arm2, push);
    if (const double pull = pull_of_rod(i); pull > 0.0)
      most =
          std::max(most, pull / ends_[i].errors[0] * (bodies_[d.body1].inverse_mass + bodies_[d.body2].inverse_mass));
  }
  for (std::uint32_t i = 0; i < bodies_.count(); ++i)
    most = std::max(most, Matrix3(turned_[i].inverse_inertia * stiffness_[i]).norm());
  return most;
}

// stiffened_, by stiffness_.
void SequentialSolver::stiffen(const stage::SolverSolveRequest& request) {
  stiffened_ = turned_;
  for (std::uint32_t i = 0; i < bodies_.count(); ++i) {
    if (!bodies_[i].is_pushed() || stiffness_[i].isZero(0.0)) continue;
    const Twist& change = solution_.displacement[i];
    stiffened_.set_inverse_inertia(
        i, stiffened_inverse(displaced(bodies_[i].trial, change.linear, change.angular).orientation,
                             vector_at(request.inverse_inertia(), i), stiffness_[i]));
  }
}

// A rod that pulls with mu resists to being turned: across it, with mu/length.
void SequentialSolver::add_turns_of_rod(std::size_t i) {
  const double pull = pull_of_rod(i);
  if (!(pull > 0.0)) return;
  const auto [first, second] = orthonormal_basis(ends_[i].directions[0].linear);
  std::size_t axis = 1;
  for (const Vector3& across : {first, second})
    add_turn(i, axis++, direction_at(across, ends_[i].arm1, ends_[i].arm2), ends_[i].errors[0] / pull);
}

void SequentialSolver::add_turn_of_swing(std::size_t i) {
  const TurnOfSwing turn = turn_of_swing(i);
  if (turn.stiffness > 0.0) add_turn(i, 1, turn.direction, 1.0 / turn.stiffness);
}

// What a row that is held resists with to being turned: along an axis that is free, as a row with that compliance, whose
// multiplier vanishes where the steps end.
void SequentialSolver::add_turn(std::size_t i, std::size_t axis, const ConstraintDirection& direction,
                                double compliance) {
  RelaxationDiscrepancy& d = posed_[i];
  d.directions[axis] = with_turns(direction, stiffened_[d.body1].inverse_inertia, stiffened_[d.body2].inverse_inertia);
  JointLaw& law = posed_laws_[3 * i + axis] = JointLaw{};
  law.has_lower = law.has_upper = true;
  law.gamma = compliance;
  law.lower_target = law.upper_target =
      d.directions[axis].along(solution_.displacement[d.body1], solution_.displacement[d.body2]);
}

TurnOfSwing SequentialSolver::turn_of_swing(std::size_t i) const {
  const JointEnd& end = ends_[i];
  if (!end.angle || !pose_laws_[3 * i].is_active() || pushed_[3 * i] == 0.0) return {};
  return gravitas::turn_of_swing(end.directions[0].angular2, end.directions[1].angular2, *end.angle, pushed_[3 * i]);
}

// By which a rod holds its bodies together; 0: it is none, or presses.
double SequentialSolver::pull_of_rod(std::size_t i) const {
  return ends_[i].is_radial && pose_laws_[3 * i].is_active() && ends_[i].errors[0] > 0.0 ? -pushed_[3 * i] : 0.0;
}

// What stiffens only leads there: in the end corrections move the bodies by their inertia alone, unless the steps are so far
// from their end that this would open joints.
void SequentialSolver::end_unstiffened(const stage::SolverSolveRequest& request) {
  const double open = open_;
  keep_pose(&before_step_);
  build_at_end(request, false);
  solution_.displacement = base_;
  pose_joints_.push_all(bodies_, solution_.displacement);
  gaps_.push_all(bodies_, solution_.displacement);
  find_ends(request);
  if (!(open_ > std::max(2.0 * open, kClosed))) return;
  used_up_ = true;
  take_pose(before_step_);
}

// Sweeps that ran out may turn bodies so far that joints are wider open than they were: the largest share of that change is
// made which does not open them, or the one that leaves them least open.
void SequentialSolver::shorten_pose(const stage::SolverSolveRequest& request) {
  if (pose_converged_ || !(open_ > kFarOpen)) return;
  const double were = open_at_trial();
  if (!(open_ > were)) return;
  keep_pose(&before_step_);
  const BodyMotion& whole = before_step_.displacement;
  double best = 1.0, least = open_;
  const auto take = [&](double share) {
    for (std::size_t i = 0; i < whole.size(); ++i) {
      solution_.displacement[i].linear = offset_[i].linear + share * (whole[i].linear - offset_[i].linear);
      solution_.displacement[i].angular = offset_[i].angular + share * (whole[i].angular - offset_[i].angular);
    }
    find_ends(request);
  };
  for (const double share : {0.5, 0.25, 0.125, 0.0}) {
    take(share);
    if (open_ < least) best = share, least = open_;
    if (!(open_ > were)) break;
  }
  if (best == 1.0) {
    take_pose(before_step_);
    return;
  }
  take(best);
  pose_joints_.scale(best);
  gaps_.scale(best);
}

// The most that pose laws miss where nothing is corrected, as a share of what the bodies measure.
double SequentialSolver::open_at_trial() const {
  double open = 0.0;
  for (std::size_t i = 0; i < discrepancies_.size(); ++i)
    if (const double size = size_of(discrepancies_[i]); size > 0.0)
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (const JointLaw& law = pose_laws_[3 * i + axis]; law.gamma == 0.0)
          open = std::max(open, share_of_miss(discrepancies_[i], axis, law, law.missed_by(0.0)));
  return open;
}

// What a row of a joint that does not touch misses, of what its bodies measure and of what these move by.
double SequentialSolver::share_of_miss(const RelaxationDiscrepancy& d, std::size_t axis, const JointLaw& law,
                                       double missed) const {
  const double size = size_of(d), masses = bodies_[d.body1].inverse_mass + bodies_[d.body2].inverse_mass;
  return missed * d.length / size * law.share_of_bodies(d.directions[axis].product(d.directions[axis], masses));
}

// 0: that row does not count.
double SequentialSolver::size_of(const RelaxationDiscrepancy& d) const {
  return touches(d) ? 0.0 : std::max(bodies_[d.body1].gyration(), bodies_[d.body2].gyration());
}

void SequentialSolver::keep_pose(PoseChange* kept) const {
  kept->displacement = solution_.displacement;
  kept->joints = pose_joints_;
  kept->gaps = gaps_;
  kept->ends = ends_;
  kept->open = open_, kept->unsprung = unsprung_;
  kept->is_at_end = posed_at_end_;
  kept->has_stiff_gaps = gaps_are_stiff_;
  kept->has_converged = pose_converged_;
}

void SequentialSolver::take_pose(const PoseChange& kept) {
  solution_.displacement = kept.displacement;
  pose_joints_ = kept.joints;
  gaps_ = kept.gaps;
  ends_ = kept.ends;
  open_ = kept.open, unsprung_ = kept.unsprung;
  posed_at_end_ = kept.is_at_end;
  gaps_are_stiff_ = kept.has_stiff_gaps;
  pose_converged_ = kept.has_converged;
}

// The end of each joint, open_ and unsprung_.
void SequentialSolver::find_ends(const stage::SolverSolveRequest& request) {
  const DiscrepancyColumns columns = columns_of(request);
  turned_ = bodies_;
  turned_.turn(solution_.displacement);
  ends_.resize(discrepancies_.size());
  open_ = unsprung_ = 0.0;
  pose_joints_.store(pushed_);
  for (std::size_t i = 0; i < discrepancies_.size(); ++i) {
    const RelaxationDiscrepancy& d = discrepancies_[i];
    ends_[i] = end_of(columns.at(i), d, turned_, solution_.displacement);
    if (!(size_of(d) > 0.0)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const JointLaw& law = pose_laws_[3 * i + axis];
      const double change = ends_[i].errors[axis] - d.axes[axis].error_at_trial;
      double& most = law.gamma > 0.0 ? unsprung_ : open_;
      most = std::max(most, share_of_miss(d, axis, law, law.missed_by(change + law.gamma * pushed_[3 * i + axis])));
    }
  }
}

// Rows there, which ask for what is missing there: J x with x from S*.
void SequentialSolver::build_at_end(const stage::SolverSolveRequest& request, bool is_stiff) {
  const SolverBodies& bodies = is_stiff ? stiffened_ : turned_;
  posed_ = discrepancies_;
  posed_laws_ = pose_laws_;
  for (std::size_t i = 0; i < posed_.size(); ++i) {
    RelaxationDiscrepancy& d = posed_[i];
    if (!touches(d)) d.directions = ends_[i].directions;
    if (is_stiff)
      for (ConstraintDirection& direction : d.directions)
        direction = with_turns(direction, bodies[d.body1].inverse_inertia, bodies[d.body2].inverse_inertia);
    if (touches(d)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double along = d.directions[axis].along(solution_.displacement[d.body1], solution_.displacement[d.body2]);
      posed_laws_[3 * i + axis].shift(along - (ends_[i].errors[axis] - d.axes[axis].error_at_trial));
    }
    if (is_stiff) add_turns_of_rod(i), add_turn_of_swing(i);
  }
  pose_joints_.store(pushed_);
  pose_joints_.build(bodies, posed_, posed_laws_, pushed_);
  turn_offset(turned_);
  base_ = offset_;
  if (!is_stiff && !gaps_are_stiff_) return;
  build_gaps(is_stiff ? stiffened_ : bodies_, request);
  gaps_are_stiff_ = is_stiff;
  // x0 = delta_k + (M + K)^-1 M (offset - delta_k)
  for (std::uint32_t i = 0; i < bodies_.count() && is_stiff; ++i) {
    const Vector3 missing = offset_[i].angular - solution_.displacement[i].angular;
    if (stiffness_[i].isZero(0.0) || missing.isZero(0.0) || !bodies_[i].is_pushed()) continue;
    const Quaternion end = displaced(bodies_[i].trial, Vector3::Zero(), solution_.displacement[i].angular).orientation;
    const Matrix3 inertia = world_inertia(end, moments_of(vector_at(request.inverse_inertia(), i)));
    base_[i].angular = solution_.displacement[i].angular + stiffened_[i].inverse_inertia * (inertia * missing);
  }
}

// Rows of contacts anew, of bodies with another inertia.
void SequentialSolver::build_gaps(const SolverBodies& bodies, const stage::SolverSolveRequest& request) {
  pressed_.resize(closed_.size());
  gaps_.store(pressed_);
  gaps_.build(bodies, request, settings_.correction_factor, pressed_);
}

// What acts on velocities alone keeps its moment while steps turn the inertia.
void SequentialSolver::turn_offset(const SolverBodies& bodies) {
  for (std::uint32_t i = 0; i < bodies.count(); ++i)
    if (!offset_moment_[i].isZero(0.0)) offset_[i].angular = bodies[i].inverse_inertia * offset_moment_[i];
}

// Of a row at S*, with the directions there.
double SequentialSolver::error_at_end(std::size_t row, std::size_t axis) const {
  const RelaxationDiscrepancy& d = discrepancies_[row];
  if (posed_at_end_ && !touches(d)) return ends_[row].errors[axis];
  return d.axes[axis].error_at_trial +
         d.directions[axis].along(solution_.displacement[d.body1], solution_.displacement[d.body2]);
}

// Adds the contacts and limits that the pose change leaves closed to those that were, and makes the
// laws of the velocities. Returns whether any closed that was not.
bool SequentialSolver::find_closed() {
  bool added = false;
  closed_now_.resize(closed_.size());
  gaps_.find_closed(solution_.displacement, closed_now_);
  for (std::size_t i = 0; i < closed_.size(); ++i) {
    added = added || closed_now_[i] > closed_[i];
    closed_[i] = std::max(closed_[i], closed_now_[i]);
  }
  pose_joints_.store(pushed_);
  for (std::size_t i = 0; i < discrepancies_.size(); ++i) {
    const RelaxationDiscrepancy& d = discrepancies_[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      JointLaw law = velocity_law(d.axes[axis], error_at_end(i, axis), d.slop, time_step_);
      if (law.is_rigid()) law.shift(velocity_shift_[3 * i + axis]);
      // what is pushed is closed, however far the sweeps have come
      const JointLaw& pose = pose_laws_[3 * i + axis];
      if (pose.is_active() && !pose.is_equality()) {
        law.close(pushed_[3 * i + axis] > 0.0, pushed_[3 * i + axis] < 0.0);
      }
      JointLaw& known = velocity_laws_[3 * i + axis];
      const bool adds = (law.has_lower && !known.has_lower) || (law.has_upper && !known.has_upper);
      added = added || (adds && !law.is_equality());
      law.close(known.has_lower, known.has_upper);
      known = law;
    }
  }
  stalled_.stall([&](auto&& visit) {
    for (std::size_t i = 0; i < discrepancies_.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        visit(discrepancies_[i].body1, discrepancies_[i].body2, discrepancies_[i].directions[axis],
              &velocity_laws_[3 * i + axis]);
  });
  return added;
}

void SequentialSolver::turn_trial_velocity() {
  if (pose_joints_.is_empty()) return;
  turn_.assign(bodies_.count() + 1, Twist{});
  pose_joints_.push_all(bodies_, turn_);
  for (std::uint32_t i = 0; i < bodies_.count(); ++i)
    trial_velocity_[i].angular =
        turned_by_joints(turn_[i].angular, solution_.displacement[i].angular, bodies_[i].trial_velocity.angular);
}

// Of the velocities' rows: where the pose change ends; at S*, where contacts' are, of bodies that touch each other as well, whose
// rows would contradict each other by the turn, and of all where drives yield: what jams there is told by rows that depend on
// each other exactly.
void SequentialSolver::take_directions(bool drives_yield) {
  directed_ = discrepancies_;
  if (discrepancies_.empty()) return;
  turned_ = bodies_;
  if (drives_yield) return;
  turned_.turn(solution_.displacement);
  for (std::size_t i = 0; i < directed_.size(); ++i)
    if (!touches(directed_[i]) && !stands(directed_[i])) directed_[i].directions = ends_[i].directions;
}

// What does not turn keeps its rows bit for bit.
bool SequentialSolver::stands(const RelaxationDiscrepancy& joint) const {
  return solution_.displacement[joint.body1].angular.isZero(0.0) &&
         solution_.displacement[joint.body2].angular.isZero(0.0);
}

}  // namespace gravitas
