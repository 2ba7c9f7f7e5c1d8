// The order of the work, as the head of sequential.h describes it.
#include "workers/solver/sequential/sequential.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "plugin_sdk/body.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/cone_problem.h"
#include "plugin_sdk/solver/contact_law.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/joint_bounce.h"
#include "plugin_sdk/solver/request_check.h"
#include "workers/solver/sequential/shock_propagation.h"

namespace gravitas {
namespace {

// Changes of this many units of rounding count as none.
constexpr double kStillness = 128.0 * kEpsilon;
// With shock propagation: and so many of the largest load.
constexpr double kLoadRounding = 8.0 * kEpsilon;

// Rows that are off by a smaller share of what meets do not contradict each other.
constexpr double kLeastContradiction = 1e-9;

// A contact slips if it does so this much faster than a sweep still changes it: what converges
// slowly is further from its end than one change.
constexpr double kSlipToChange = 1e4;

void copy(std::span<const double> from, std::vector<double>& to) { to.assign(from.begin(), from.end()); }

// Finite numbers whose squares or sums are not.
void check_range(double violation, double motion) {
  if (!std::isfinite(violation) || !std::isfinite(motion))
    throw Refusal("velocities, errors or arms so large that their products are not finite");
}

}  // namespace

SequentialSummary SequentialSolver::solve(const stage::SolverSolveRequest& request,
                                          const stage::SolverSolveReply& reply) {
  check_solver_request(request);
  const SequentialSummary summary = solve(request);
  write(solution_, summary.outcome(), reply);
  return summary;
}

SequentialSummary SequentialSolver::solve(const stage::SolverSolveRequest& request) {
  load(request);
  solve_rows(request);
  const bool contradicts = reconcile();
  if (contradicts) {
    used_up_ = false;
    solve_rows(request);
  }
  const bool has_rows =
      !pose_joints_.is_empty() || !gaps_.is_empty() || !velocity_joints_.is_empty() || !impulses_.is_empty();
  summary_.stop_reason = has_rows ? StopReason::kConverged : StopReason::kNothingToDo;
  if (contradicts || drives_contradict_) summary_.stop_reason = StopReason::kContradiction;
  if (used_up_) summary_.stop_reason = together(summary_.stop_reason, StopReason::kIterations);
  share_out();
  pose_joints_.store(solution_.joint_correction);
  for (std::size_t i = 0; i < pose_laws_.size(); ++i)
    if (!pose_laws_[i].is_active()) solution_.joint_correction[i] = 0.0;
  for (std::size_t i = 0; i < moved_.size(); ++i)
    if (velocity_laws_[i].is_unbounded_drive())
      solution_.joint_correction[i] = request.theta() * time_step_ * (moved_[i] - solution_.joint_impulse[i]);
  for_springs([&](std::size_t i) {
    solution_.joint_correction[i] -= request.theta() * time_step_ * solution_.joint_impulse[i];
  });
  gaps_.store(solution_.contact_correction);
  return summary_;
}

void SequentialSolver::solve_rows(const stage::SolverSolveRequest& request) {
  begin(request);
  moved_.clear();
  solve_pose(request);
  find_closed();
  build_velocity(request);
  solve_velocity();
  let_drives_yield(request);

  const double factor = request.theta() * time_step_;
  if (factor > 0.0 && acts_on_velocity_alone()) {
    solve_pose_with_offset(request, factor);
    if (find_closed()) {
      moved_.assign(velocity_laws_.size(), 0.0);
      velocity_joints_.store(moved_);
      build_velocity(request);
      solve_velocity();
      // drives that now yield have moved their bodies as far as these go
      if (let_drives_yield(request)) {
        velocity_joints_.take_drives(moved_);
      } else {
        moved_.clear();
      }
      solve_pose_with_offset(request, factor);
    }
  }
}

// Sweeps ran out, or rows that were left out are not met: was something asked for that no motion can do? Rows that hold
// always and contradict each other then get the nearest targets that agree, and true is returned. Rows of loops and of frames
// contradict each other, too, because they are taken at S*, where joints are open, and not where they close: by the square of
// the step's turn, and by that times what is open. That is none.
bool SequentialSolver::reconcile() {
  if (!used_up_ && !pose_joints_.leaves_out() && !velocity_joints_.leaves_out()) return false;
  double spin = 0.0, turn = 0.0, reach = 0.0, open = 0.0;
  for (const RelaxationDiscrepancy& d : discrepancies_)
    for (const std::uint32_t i : {d.body1, d.body2}) {
      spin = std::max({spin, bodies_[i].trial_velocity.angular.norm(), solution_.velocity[i].angular.norm()});
      turn = std::max({turn, solution_.displacement[i].angular.norm(), time_step_ * spin});
    }
  for (std::size_t i = 0; i < pose_laws_.size(); ++i) {
    const RelaxationDiscrepancy& d = discrepancies_[i / 3];
    const ConstraintDirection& direction = d.directions[i % 3];
    reach = std::max({reach, d.length * direction.angular1.norm(), d.length * direction.angular2.norm()});
    if (pose_laws_[i].is_rigid()) open = std::max(open, d.length * std::fabs(d.axes[i % 3].error_at_trial));
  }
  const double fastest =
      std::max(velocity_joints_.largest_motion(trial_velocity_), velocity_joints_.largest_motion(solution_.velocity));
  const double moved = std::max(kLeastContradiction, 4.0 * turn * turn) * fastest + 4.0 * open * spin;
  const double placed = std::max(kLeastContradiction, 4.0 * turn * turn) * reach + 4.0 * open * turn;
  std::vector<double> shift(pose_laws_.size(), 0.0);
  if (used_up_ || velocity_joints_.largest_left_out(solution_.velocity) > moved)
    shifted_velocity_ = reconcile(directed_, velocity_laws_, trial_velocity_, moved, &velocity_shift_);
  if (used_up_ || pose_joints_.largest_left_out(solution_.displacement) > placed)
    shifted_pose_ = reconcile(discrepancies_, pose_laws_, BodyMotion(trial_velocity_.size()), placed, &shift);
  for (std::size_t i = 0; i < shift.size(); ++i) pose_laws_[i].shift(shift[i]);
  return shifted_velocity_ > 0.0 || shifted_pose_ > 0.0;
}

ConeRow SequentialSolver::row_of(const RelaxationDiscrepancy& d, std::size_t axis, const JointLaw& law) {
  ConeRow row;
  row.body1 = d.body1, row.body2 = d.body2;
  row.direction = d.directions[axis];
  row.length = d.length;
  row.law = law;
  return row;
}

double SequentialSolver::reconcile(const std::vector<RelaxationDiscrepancy>& discrepancies,
                                   const RelaxationJoints::Laws& laws, const BodyMotion& start, double smallest,
                                   std::vector<double>* shift) const {
  ConeProblem problem;
  std::vector<std::size_t> place;
  for (std::size_t i = 0; i < laws.size(); ++i) {
    if (!laws[i].is_rigid()) continue;
    problem.rows.push_back(row_of(discrepancies[i / 3], i % 3, laws[i]));
    place.push_back(i);
  }
  if (place.empty() || problem.reconcile(bodies_, start, smallest) == 0.0) return 0.0;
  double largest = 0.0;
  for (std::size_t k = 0; k < place.size(); ++k) {
    // beside what drives yield
    const double change = problem.rows[k].law.lower_target - laws[place[k]].lower_target;
    (*shift)[place[k]] += change;
    largest = std::max(largest, std::fabs(change) * problem.rows[k].length);
  }
  return largest;
}

void SequentialSolver::load(const stage::SolverSolveRequest& request) {
  summary_ = {};
  used_up_ = drives_yield_ = drives_contradict_ = posed_at_end_ = gaps_are_stiff_ = false;
  time_step_ = request.time_step();
  coordinates_ = 0.0;
  bodies_.load(request);
  const DiscrepancyColumns columns = columns_of(request);
  discrepancies_.clear();
  pose_laws_.clear();
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const Discrepancy discrepancy = columns.at(i);
    const std::uint32_t body1 = bodies_.row(request.discrepancy_body()[2 * i]);
    const std::uint32_t body2 = bodies_.row(request.discrepancy_body()[2 * i + 1]);
    discrepancies_.push_back(relaxation_discrepancy(discrepancy, body1, body2,
                                                    is_only_point(request.discrepancy_body(), request.mode(), i),
                                                    bodies_, settings_.correction_factor));
    RelaxationDiscrepancy& r = discrepancies_.back();
    set_bounces(discrepancy, bodies_[body1], bodies_[body2], request.discrepancy_warm_impulse().subspan(3 * i, 3),
                &r.axes);
    for (std::size_t k = 0; k < 3; ++k) pose_laws_.push_back(pose_law_of(r, k, request.theta()));
    coordinates_ = std::max(coordinates_, discrepancy.point2.cwiseAbs().maxCoeff());
  }
  touching_.clear();
  if (!discrepancies_.empty())
    for (std::size_t i = 0; i < request.contact_key().size(); ++i)
      touching_.push_back(pair_of(request.contact_body()[2 * i], request.contact_body()[2 * i + 1]));
  std::ranges::sort(touching_);
  velocity_shift_.assign(pose_laws_.size(), 0.0);
  shifted_pose_ = shifted_velocity_ = 0.0;
  trial_velocity_.clear();
  for (std::uint32_t i = 0; i <= bodies_.count(); ++i) trial_velocity_.push_back(bodies_[i].trial_velocity);
  find_displacing_friction(
      request, request.contact_key().size(), [](std::size_t k) { return k; },
      [&](std::size_t i, std::size_t end) -> const SolverBody& { return bodies_[request.contact_body()[2 * i + end]]; },
      &displacing_friction_);
}

JointLaw SequentialSolver::pose_law_of(const RelaxationDiscrepancy& d, std::size_t axis, double theta) const {
  const JointAxisState& state = d.axes[axis];
  if (!is_spring(state)) return pose_law(state, d.beta, time_step_);
  const double approach = d.directions[axis].along(bodies_[d.body1].trial_velocity, bodies_[d.body2].trial_velocity);
  return spring_pose_law(state, approach, theta, time_step_);
}

// Corrections of springs are what they push beyond theta h of their impulse, but while the pose change is solved.
template <class Use>
void SequentialSolver::for_springs(Use&& use) const {
  for (std::size_t i = 0; i < pose_laws_.size(); ++i)
    if (pose_laws_[i].gamma > 0.0) use(i);
}

// Rows and multipliers as before the first sweep.
void SequentialSolver::begin(const stage::SolverSolveRequest& request) {
  copy(request.discrepancy_warm_impulse(), solution_.joint_impulse);
  copy(request.discrepancy_warm_correction(), solution_.joint_correction);
  for_springs([&](std::size_t i) {
    solution_.joint_correction[i] += request.theta() * time_step_ * solution_.joint_impulse[i];
  });
  copy(request.contact_warm_impulse(), solution_.contact_impulse);
  copy(request.contact_warm_correction(), solution_.contact_correction);
  copy(request.contact_normal(), solution_.contact_direction);
  pose_joints_.build(bodies_, discrepancies_, pose_laws_, solution_.joint_correction);
  gaps_.build(bodies_, request, settings_.correction_factor, solution_.contact_correction);
  coordinates_ = std::max(coordinates_, gaps_.coordinates());
  offset_.assign(bodies_.count() + 1, Twist{});
  offset_moment_.assign(bodies_.count() + 1, Vector3::Zero());
  closed_.assign(request.contact_key().size(), 0);
  velocity_laws_.assign(pose_laws_.size(), JointLaw{});
  pushed_.resize(pose_laws_.size());
}

// ---- pose change

// solution_.displacement and the multipliers of the pose rows, on top of offset_: of rows at S*, then of rows where that ends.
void SequentialSolver::solve_pose(const stage::SolverSolveRequest& request) {
  pose_at_trial(request);
  base_ = offset_;
  pose_converged_ = relax_pose();
  used_up_ = used_up_ || !pose_converged_;
  if (discrepancies_.empty()) return;
  close_at_end(request);
  shorten_pose(request);
}

// Returns whether sweeps came to their end.
bool SequentialSolver::relax_pose() {
  solution_.displacement = base_;
  const double violation =
      std::max(pose_joints_.largest_violation(solution_.displacement), gaps_.largest_violation(solution_.displacement));
  const double motion =
      std::max(pose_joints_.largest_motion(solution_.displacement), gaps_.largest_motion(solution_.displacement));
  check_range(violation, motion);
  const double representable = std::max(0.25 * kEpsilon * coordinates_, kStillness * shifted_pose_);
  if (violation <= std::max(representable, kEpsilon * motion)) {
    // nothing is missing, so zero multipliers are the solution
    pose_joints_.clear_multipliers();
    gaps_.clear_multipliers();
    return true;
  }
  double tolerance = std::max(representable, kStillness * std::max(violation, motion));
  sweep_.begin(bodies_, {&pose_joints_, &gaps_});
  pose_joints_.push_all(bodies_, solution_.displacement);
  if (begins_by_layers(pose_joints_, gaps_)) {
    tolerance = choose_start(BodyMotion(solution_.displacement), tolerance, &gaps_, &solution_.displacement);
  } else {
    gaps_.push_all(bodies_, solution_.displacement);
  }
  bool converged = false;
  for (std::uint32_t i = 0, cap = most_sweeps(gaps_.is_empty()); i < cap && !converged; ++i) {
    converged = sweep_.sweep(bodies_, solution_.displacement) <= tolerance;
    count_sweep();
  }
  solution_.displacement = base_;
  pose_joints_.push_all(bodies_, solution_.displacement);
  gaps_.push_all(bodies_, solution_.displacement);
  return converged;
}

template <typename Contacts>
bool SequentialSolver::begins_by_layers(const RelaxationJoints& joints, const Contacts& contacts) const {
  if (settings_.shock_propagation != ShockPropagation::kStacks)
    return settings_.shock_propagation == ShockPropagation::kAlways;
  return joints.is_empty() && is_stack(bodies_, contacts);
}

// Contacts' multipliers to begin with: those there are or, where they leave smaller errors, those by layers. x: `base`
// without contacts, then with them. Returns the tolerance of the sweeps: what rests under many times its mass moves by the
// rounding of that load, which no sweep makes less.
template <typename Contacts>
double SequentialSolver::choose_start(const BodyMotion& base, double tolerance, Contacts* contacts, BodyMotion* x) {
  const auto with_load = [&] { return std::max(tolerance, kLoadRounding * contacts->largest_push()); };
  contacts->push_all(bodies_, *x);
  const double error = sweep_.largest_error(*x);
  if (error <= with_load()) return with_load();
  const Contacts known = *contacts;
  BodyMotion by_layers = base;
  start_by_layers(bodies_, tolerance, contacts, &by_layers);
  if (sweep_.largest_error(by_layers) < error) {
    *x = by_layers;
  } else {
    *contacts = known;
  }
  return with_load();
}

// ---- velocity

void SequentialSolver::build_velocity(const stage::SolverSolveRequest& request) {
  turn_trial_velocity();
  take_directions(drives_yield_);
  velocity_joints_.build(bodies_, directed_, velocity_laws_, solution_.joint_impulse);
  impulses_.build(bodies_, request, closed_, solution_.contact_impulse);
  if (drives_yield_) impulses_.drop_restitution(), velocity_joints_.drop_bounces();
  copy(request.contact_normal(), solution_.contact_direction);
}

// Velocities and impulses, with the bound on energy.
void SequentialSolver::solve_velocity() {
  used_up_before_velocity_ = used_up_;
  if (velocity_joints_.has_bounces()) velocity_joints_.find_bounces(discrepancies_, velocity_of_joints(), time_step_);
  relax_velocity();
  bound_energy();
  velocity_joints_.store(solution_.joint_impulse);
  impulses_.store(&solution_);
}

// solution_.velocity and the multipliers of the velocity rows.
void SequentialSolver::relax_velocity() {
  ++summary_.velocity_solutions;
  summary_.residual = 0.0;
  solution_.velocity = trial_velocity_;
  const double violation =
      std::max(velocity_joints_.largest_violation(solution_.velocity), impulses_.largest_violation(solution_.velocity));
  const double motion =
      std::max(velocity_joints_.largest_motion(solution_.velocity), impulses_.largest_motion(solution_.velocity));
  check_range(violation, motion);
  if (violation <= std::max(kEpsilon * motion, kStillness * shifted_velocity_)) {
    velocity_joints_.clear_multipliers();
    impulses_.clear_multipliers();
    velocity_converged_ = true;
    return;
  }
  impulses_.let_stick();
  double tolerance = kStillness * std::max({violation, motion, shifted_velocity_});
  sweep_.begin(bodies_, {&velocity_joints_, &impulses_});
  velocity_joints_.push_all(bodies_, solution_.velocity);
  if (begins_by_layers(velocity_joints_, impulses_)) {
    tolerance = choose_start(BodyMotion(solution_.velocity), tolerance, &impulses_, &solution_.velocity);
  } else {
    impulses_.push_all(bodies_, solution_.velocity);
  }
  velocity_converged_ = sweep_velocity(tolerance);
  used_up_ = used_up_ || !velocity_converged_;
  sum_velocity();
}

void SequentialSolver::count_sweep() {
  constexpr std::uint32_t kSilence = 64;
  if (++summary_.sweeps % kSilence == 0 && host_ != nullptr) host_->mark_progress();
}

// Sweeps until nothing changes by more than the tolerance (m/s); false if the sweeps ran out.
bool SequentialSolver::sweep_velocity(double tolerance) {
  const std::uint32_t cap = most_sweeps(impulses_.is_empty());
  for (std::uint32_t done = 1; done <= cap; ++done) {
    summary_.residual = sweep_.sweep(bodies_, solution_.velocity);
    count_sweep();
    const bool converged = summary_.residual <= tolerance;
    if (converged || done == cap / 2 || done == cap / 4 * 3) {
      const double slip = kSlipToChange * std::max(summary_.residual, tolerance);
      if (impulses_.let_slide(solution_.velocity, slip)) {
        sweep_.forget_acceleration();
        continue;
      }
    }
    if (converged) return true;
  }
  return false;
}

// ---- drives that something is in the way of

// Where a drive without bound, or what is in its way, misses by much of what it asks for: velocities anew, in which drives ask
// for what joints, limits and contacts let them reach, and what they press does not bounce. Returns whether there was any.
bool SequentialSolver::let_drives_yield(const stage::SolverSolveRequest& request) {
  constexpr double kMissed = 0.1;
  if (std::ranges::none_of(velocity_laws_, &JointLaw::is_unbounded_drive)) return false;
  double asked = std::max(velocity_joints_.largest_motion(trial_velocity_), impulses_.largest_motion(trial_velocity_));
  for (std::size_t i = 0; i < velocity_laws_.size(); ++i)
    if (velocity_laws_[i].is_unbounded_drive())
      asked = std::max(asked, discrepancies_[i / 3].length * std::fabs(velocity_laws_[i].lower_target));
  const double missed = std::max({velocity_joints_.largest_violation(solution_.velocity, true),
                                  velocity_joints_.largest_left_out(solution_.velocity),
                                  impulses_.largest_violation(solution_.velocity)});
  if (!(missed > kMissed * asked)) return false;
  take_directions(true);
  std::vector<double> unused(velocity_laws_.size());
  const bool contradict =
      reconcile(directed_, velocity_laws_, trial_velocity_, kLeastContradiction * (asked + missed), &unused) > 0.0;
  if (!find_reach()) {
    // the velocities that stand are those of the rows before
    take_directions(drives_yield_);
    return false;
  }
  drives_yield_ = true;
  drives_contradict_ = drives_contradict_ || contradict;
  used_up_ = used_up_before_velocity_;
  copy(request.discrepancy_warm_impulse(), solution_.joint_impulse);
  copy(request.contact_warm_impulse(), solution_.contact_impulse);
  build_velocity(request);
  solve_velocity();
  return true;
}

// The shifts of drives without bound: to what they reach where they give way a little and nothing else does.
bool SequentialSolver::find_reach() {
  constexpr double kGives = 1e-3;  // of what a row gives way to by itself
  constexpr int kSteps = 3;        // each leaves kGives of the way
  ConeProblem problem;
  std::vector<std::size_t> place;
  for (std::size_t i = 0; i < velocity_laws_.size(); ++i) {
    if (!velocity_laws_[i].is_active()) continue;
    ConeRow& row = problem.rows.emplace_back(row_of(directed_[i / 3], i % 3, velocity_laws_[i]));
    place.push_back(i);
    row.law.set_bounce(0.0);
    if (!row.law.is_unbounded_drive()) continue;
    row.law.shift(-velocity_shift_[i]);
    const double masses = bodies_[row.body1].inverse_mass + bodies_[row.body2].inverse_mass;
    row.law.gamma = kGives * row.direction.product(row.direction, masses);
    row.law.yields = true;
  }
  impulses_.append_cones(bodies_, &problem);
  ConeSettings settings;
  settings.tolerance = 1e-10;
  BodyMotion reached = trial_velocity_;
  for (int step = 0; step < kSteps; ++step) {
    if (!problem.solve(bodies_, reached, 0.0, settings).has_converged) return false;
    problem.push(bodies_, &reached);
  }
  for (std::size_t k = 0; k < place.size(); ++k) {
    const ConeRow& row = problem.rows[k];
    if (!row.law.yields) continue;
    const std::size_t i = place[k];
    velocity_shift_[i] = row.direction.along(reached[row.body1], reached[row.body2]) - row.law.lower_target;
    velocity_laws_[i].shift(row.law.lower_target + velocity_shift_[i] - velocity_laws_[i].lower_target);
  }
  return true;
}

// ---- energy

void SequentialSolver::bound_energy() {
  const bool bounces = impulses_.has_restitution() || velocity_joints_.has_bounces();
  if (!bounces && velocity_converged_) return;
  const BodyMotion before = bounces ? velocity_of_joints() : trial_velocity_;
  for (int round = 0; round < 3; ++round) {
    const std::uint32_t lowered = impulses_.lower_to_arrival(before, solution_.velocity) +
                                  velocity_joints_.lower_to_arrival(before, solution_.velocity);
    if (lowered == 0) break;
    summary_.restitutions_lowered += lowered;
    relax_velocity();
  }

  group_bodies();
  add_up_gains(before, solution_.velocity);
  if (std::ranges::any_of(gains_, &Gain::is_real)) share_restitution(before);
  if (!velocity_converged_) scale_back();
}

// gains_ as they are; by group, first the contacts and stops to blame, then all.
void SequentialSolver::share_restitution(const BodyMotion& before) {
  std::vector<bool> only_some(group_.size(), false);
  impulses_.mark_sharing(bodies_, before, solution_.velocity, group_, &only_some);
  velocity_joints_.mark_sharing(bodies_, before, solution_.velocity, group_, &only_some);
  const auto share_all = [&](const std::vector<bool>& which) {
    impulses_.share_all(bodies_, group_, which);
    velocity_joints_.share_all(group_, which);
  };
  std::vector<bool> all = only_some;
  all.flip();
  share_all(all);
  shared_.assign(bodies_.count() + 1, std::nullopt);
  for (;; add_up_gains(before, solution_.velocity)) {
    shares_.assign(shared_.size(), std::numeric_limits<double>::quiet_NaN());
    all.assign(group_.size(), false);
    bool any = false;
    for (std::uint32_t i = 0; i < shared_.size(); ++i) {
      const bool gains = gains_[i].is_real();
      bool goes_on = shared_[i] ? shared_[i]->goes_on(gains, gains_[i].work) : gains;
      if (!goes_on && shared_[i] && gains && only_some[i]) {
        // those to blame do not suffice
        only_some[i] = false, goes_on = true;
        all[i] = true;
        shared_[i].reset();
      }
      if (!goes_on) continue;
      if (!shared_[i]) shared_[i].emplace(gains_[i].work);
      shares_[i] = shared_[i]->share();
      any = true;
    }
    share_all(all);
    const std::uint32_t changed = any ? impulses_.share_restitution(bodies_, group_, shares_) +
                                            velocity_joints_.share_restitution(group_, shares_)
                                      : 0;
    summary_.restitutions_shared += changed;
    if (changed == 0) break;
    relax_velocity();
  }
}

// What the joints alone make of v*: what an impact gains is counted from there.
BodyMotion SequentialSolver::velocity_of_joints() {
  BodyMotion velocity = trial_velocity_;
  if (discrepancies_.empty()) return velocity;
  RelaxationJoints joints = velocity_joints_;
  joints.leave_out_bounces();
  ContactImpulses none;
  const double motion = joints.largest_motion(velocity);
  sweep_.begin(bodies_, {&joints, &none});
  joints.push_all(bodies_, velocity);
  // what stops give back goes by it
  const std::uint32_t cap = velocity_joints_.has_bounces() ? most_sweeps(true) : settings_.iterations;
  for (std::uint32_t done = 0; done < cap; ++done)
    if (sweep_.sweep(bodies_, velocity) <= kStillness * motion) break;
  return velocity;
}

// gains_: what each group's bodies gain by the impulses between `before` and `after`.
void SequentialSolver::add_up_gains(const BodyMotion& before, const BodyMotion& after) {
  gains_.assign(bodies_.count() + 1, Gain{});
  impulses_.add_work(bodies_, before, after, group_, gains_);
  velocity_joints_.add_work(bodies_, before, after, group_, gains_);
}

// Groups that gain although nothing bounces: sweeps that ran out. A share f of all their impulses
// gains f L + f^2 (W - L), W the gain of the whole and L = lambda.u_before: the largest f that
// gains nothing.
void SequentialSolver::scale_back() {
  add_up_gains(trial_velocity_, trial_velocity_);
  factor_.clear();
  for (const Gain& gain : gains_) factor_.push_back(gain.work);
  add_up_gains(trial_velocity_, solution_.velocity);
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

// solution_.velocity anew from the multipliers.
void SequentialSolver::sum_velocity() {
  solution_.velocity = trial_velocity_;
  velocity_joints_.push_all(bodies_, solution_.velocity);
  impulses_.push_all(bodies_, solution_.velocity);
}

// group_[i]: the first of the bodies that joints and contacts connect with body i through bodies
// that can be pushed.
void SequentialSolver::group_bodies() {
  BodyUnion joined(bodies_.count() + 1);
  const auto connect = [&](std::uint32_t body1, std::uint32_t body2) {
    if (bodies_[body1].is_pushed() && bodies_[body2].is_pushed()) joined.join(body1, body2);
  };
  impulses_.each_pair(connect);
  for (const RelaxationDiscrepancy& d : discrepancies_) connect(d.body1, d.body2);
  group_.clear();
  for (std::uint32_t i = 0; i <= bodies_.count(); ++i) group_.push_back(joined.root(i));
}

}  // namespace gravitas
