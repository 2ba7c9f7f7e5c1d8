// Velocities at the end of the step, and what acts on them alone.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/island_solver.h"
#include "plugin_sdk/solver/joint_bounce.h"

namespace gravitas {
namespace {

// Arms of a contact of jointed bodies, from where S* has them to where the pose change ends: its points go along with what their
// body turns about the normal (the line on which a wheel rolls steers with it, and stays under its axle while it spins), those
// of two bodies that can be pushed with what both turn by. Where joints hold bodies in directions of the end, points left
// behind would contradict them, and one end of such a line bear everything. What turns further than a tenth of a radian does
// not rest on a line.
void turn_arms(const Vector3& normal, const SolverBody& one, const SolverBody& two, const Twist& change1,
               const Twist& change2, Vector3* arm1, Vector3* arm2) {
  const double turn1 = normal.dot(change1.angular), turn2 = normal.dot(change2.angular);
  double turn = one.is_pushed() ? turn1 : turn2;
  if (one.is_pushed() && two.is_pushed())
    turn = turn1 * turn2 > 0.0 ? std::copysign(std::min(std::fabs(turn1), std::fabs(turn2)), turn1) : 0.0;
  constexpr double kMost = 0.1;
  if (turn == 0.0 || std::fabs(turn) > kMost) return;
  const Quaternion q = exp_rotation(turn * normal);
  *arm1 = q * *arm1, *arm2 = q * *arm2;
}

}  // namespace

void IslandSolver::solve_velocity() {
  BodyMotion trial = turned_trial_velocity();
  const double taken_back = stop_what_is_locked(&trial);
  settings_.may_rest = may_rest();
  if (!drives_yield_) {
    settings_.gives_up = has_unbounded_drive();
    find_velocity(trial);
    drives_yield_ = settings_.gives_up && misses_what_drives_ask(trial);
    drives_contradict_ = drives_yield_ ? summary_.contradiction : 0.0;
    settings_.gives_up = false;
  }
  if (drives_yield_) {
    constexpr int kRoundsOfLoads = 2;  // each leaves what drives give way to a load of the round before
    const bool is_known = let_drives_yield(trial);
    for (int round = 0; is_known && round < kRoundsOfLoads; ++round) {
      find_velocity(trial);
      hold_loads_of_drives();
    }
    find_velocity(trial);
    summary_.contradiction = std::max(summary_.contradiction, drives_contradict_);
  }
  if (taken_back == 0.0 && leads_elsewhere(trial)) {
    velocity_ = trial;
    for (ConeRow& row : cone_.rows) row.multiplier = 0.0;
    keep_impulses();
  }
  std::size_t cone = 0;
  for (EndContact& contact : contacts_)
    if (contact.is_closed) contact.slides = cone_.contacts[cone++].slides;
  if (taken_back == 0.0) return;
  for (const EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k)
      answer_.joint_impulse[3 * joint.row + k] += taken_back * answer_.joint_correction[3 * joint.row + k];
}

bool IslandSolver::has_moved(std::uint32_t body) const {
  const SolverBody& of = bodies_[body];
  return of.trial.position != of.start.position || of.trial.orientation.coeffs() != of.start.orientation.coeffs();
}

bool IslandSolver::is_taken_back(std::uint32_t body) const {
  constexpr double kMost = 0.1;
  // of no way all is rounding
  if (!has_moved(body)) return false;
  const SolverBody& of = bodies_[body];
  const Twist& back = displacement_[body];
  const double turn = log_rotation(shorter_arc(of.trial.orientation * of.start.orientation.conjugate())).norm();
  const double way = (of.trial.position - of.start.position).norm() + gyration_[body] * turn;
  return back.linear.norm() + gyration_[body] * back.angular.norm() > kMost * way;
}

double IslandSolver::stop_what_is_locked(BodyMotion* trial) {
  if (!has_reactions() || !shrinks_slowly_) return 0.0;
  if (std::ranges::none_of(pushed_, [&](std::uint32_t i) { return is_taken_back(i); })) return 0.0;
  double along = 0.0, size = 0.0;
  for (const std::uint32_t i : pushed_) {
    const Twist &d = displacement_[i], &v = (*trial)[i];
    const double mass = bodies_[i].inverse_mass > 0.0 ? 1.0 / bodies_[i].inverse_mass : 0.0;
    const Vector3 moments = moments_of(vector_at(request_.inverse_inertia(), rows_[i]));
    const Vector3 turned = world_inertia(end_[i].pose.orientation, moments) * d.angular;
    along -= mass * v.linear.dot(d.linear) + v.angular.dot(turned);
    size += mass * d.linear.squaredNorm() + d.angular.dot(turned);
  }
  if (!(along > 0.0)) return 0.0;
  // a body from rest comes half as far as its last velocity would take it
  const double share = std::min(along / size, 2.0 / request_.time_step());
  for (const std::uint32_t i : pushed_) {
    (*trial)[i].linear += share * displacement_[i].linear;
    (*trial)[i].angular += share * displacement_[i].angular;
  }
  // drives stall
  const auto stalls = [&](std::uint32_t body) { return bodies_[body].is_pushed() && is_taken_back(body); };
  for (EndJoint& joint : joints_)
    for (JointLaw& law : joint.velocity_laws)
      if (law.is_unbounded_drive() && (stalls(joint.body1) || stalls(joint.body2)))
        law.lower_target = law.upper_target = 0.0;
  return share;
}

bool IslandSolver::leads_elsewhere(const BodyMotion& trial) const {
  constexpr double kNearlyDependent = 1e-3;  // of a diagonal: within some 0.03 rad
  // what asks for a velocity takes by right
  const auto holds_always = [](const JointLaw& law) {
    return !law.is_active() || (law.is_rigid() && !law.may_do_work());
  };
  if (!has_reactions() || !contacts_.empty() || !cone_.holds_all() || !(cone_.least_pivot() < kNearlyDependent))
    return false;
  if (!std::ranges::all_of(joints_,
                           [&](const EndJoint& j) { return std::ranges::all_of(j.velocity_laws, holds_always); }))
    return false;
  // where a step begins nothing has gone astray: what bodies are thrown with, joints take
  if (std::ranges::none_of(pushed_, [&](std::uint32_t i) { return has_moved(i); })) return false;
  double taken = 0.0, all = 0.0;
  for (const std::uint32_t i : pushed_) {
    if (!(bodies_[i].inverse_mass > 0.0)) continue;
    const auto energy = [&](const Twist& of) {
      return kinetic_energy(1.0 / bodies_[i].inverse_mass, moments_of(vector_at(request_.inverse_inertia(), rows_[i])),
                            end_[i].pose.orientation, of);
    };
    taken += energy({velocity_[i].linear - trial[i].linear, velocity_[i].angular - trial[i].angular});
    all += energy(trial[i]);
  }
  return taken > kMuchOfVelocities * kMuchOfVelocities * all;
}

template <class Use>
void IslandSolver::for_active_axes(Use&& use) {
  std::size_t next = 0;
  for (EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k)
      if (joint.velocity_laws[k].is_active()) use(cone_.rows[next++], k, &joint);
}

template <class Use>
void IslandSolver::for_bounces(Use&& use) {
  for_active_axes([&](const ConeRow& row, std::size_t k, EndJoint* joint) {
    if (joint->velocity_laws[k].bounces()) use(row, k, joint);
  });
}

void IslandSolver::find_velocity(const BodyMotion& trial) {
  if (has_bounces()) find_bounces(velocity_of_joints(trial));
  // what rests needs no torque of rolling friction: found without, it is a solution with it, and the next step's guess
  if (may_turn()) {
    build_velocity(false);
    const ConeSummary without = cone_.solve(bodies_, trial, 0.0, settings_);
    summary_.iterations += without.iterations;
    if (without.has_converged) keep_impulses();
  }
  const BodyMotion before = velocity_of_joints(trial);
  for (int round = 0;; ++round) {
    build_velocity(true);
    const ConeSummary solved = cone_.solve(bodies_, trial, 0.0, settings_);
    summary_.iterations += solved.iterations;
    has_velocity_ = solved.has_converged;
    summary_.contradiction = solved.contradiction;
    summary_.residual = solved.residual;
    velocity_ = trial;
    cone_.push(bodies_, &velocity_);
    keep_impulses();
    if (!lower_restitution(before, round)) break;
  }
  if (!has_velocity_ && stops_bounce_) scale_back(trial);
}

bool IslandSolver::has_unbounded_drive() const {
  return std::ranges::any_of(joints_, [](const EndJoint& joint) {
    return std::ranges::any_of(joint.velocity_laws, &JointLaw::is_unbounded_drive);
  });
}

bool IslandSolver::misses_what_drives_ask(const BodyMotion& trial) const {
  constexpr double kMuch = 1e-3;
  if (summary_.contradiction > 0.0) return true;
  if (has_velocity_) return false;
  double asked = largest(trial);
  for (const EndJoint& joint : joints_)
    for (const JointLaw& law : joint.velocity_laws)
      if (law.is_unbounded_drive()) asked = std::max(asked, joint.length * std::fabs(law.lower_target));
  return summary_.residual > kMuch * asked;
}

bool IslandSolver::let_drives_yield(const BodyMotion& trial) {
  constexpr double kGives = 1e-3;       // of what a row gives way to by itself
  constexpr double kTolerance = 1e-10;  // pushes are 1/kGives of what holds
  constexpr int kSteps = 3;             // each leaves kGives of the way
  build_velocity(true);
  for (ConeRow& row : cone_.rows) {
    row.multiplier = 0.0;
    row.law.set_bounce(0.0);
    if (!row.law.is_unbounded_drive()) continue;
    const double masses = bodies_[row.body1].inverse_mass + bodies_[row.body2].inverse_mass;
    row.law.gamma = kGives * row.direction.product(row.direction, masses);
    row.law.yields = true;
  }
  for (ConeContact& contact : cone_.contacts) contact.target = 0.0;
  ConeSettings settings = settings_;
  settings.tolerance = std::max(settings.tolerance, kTolerance);
  BodyMotion reached = trial;
  for (int step = 0; step < kSteps; ++step) {
    const ConeSummary solved = cone_.solve(bodies_, reached, 0.0, settings);
    summary_.iterations += solved.iterations;
    if (!solved.has_converged) return false;
    cone_.push(bodies_, &reached);
  }
  reach_.clear();
  for (EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k) {
      joint.states[k].bounce = 0.0;
      joint.velocity_laws[k].set_bounce(0.0);
    }
  for_velocity_rows([&](const ConeRow& row, JointLaw* law, double* impulse, double*) {
    *impulse = 0.0;
    if (!row.law.yields) return;
    *law = row.law;
    reach_.push_back(row.direction.along(reached[row.body1], reached[row.body2]));
    law->lower_target = law->upper_target = reach_.back();
  });
  for (EndContact& contact : contacts_) {
    contact.law.target = 0.0;
    contact.turning.setZero();
    set_vector(answer_.contact_impulse, contact.row, Vector3::Zero());
  }
  return true;
}

void IslandSolver::hold_loads_of_drives() {
  for_velocity_rows([&, next = std::size_t{0}](const ConeRow&, JointLaw* law, const double* impulse, double*) mutable {
    if (law->yields) law->lower_target = law->upper_target = reach_[next++] + law->gamma * *impulse;
  });
}

template <class Use>
void IslandSolver::for_velocity_rows(Use&& use) {
  for_active_axes([&](const ConeRow& row, std::size_t k, EndJoint* joint) {
    use(row, &joint->velocity_laws[k], &answer_.joint_impulse[3 * joint->row + k], &joint->driven[k]);
  });
}

BodyMotion IslandSolver::turned_trial_velocity() const {
  BodyMotion velocity = start_motion(&SolverBody::trial_velocity);
  // what reactions have turned, has turned its velocity
  if (joints_.empty() || joints_.front().discrepancy.has_forces_applied()) return velocity;
  std::vector<Vector3> moment(bodies_.count() + 1, Vector3::Zero());
  const double share = request_.theta() * request_.time_step();
  for (const EndJoint& joint : joints_) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = 3 * joint.row + k;
      double push = answer_.joint_correction[at];
      const JointLaw& law = joint.velocity_laws[k];
      if (law.is_velocity_only) push += share * (has_yielded(law) ? joint.driven[k] : answer_.joint_impulse[at]);
      if (push == 0.0) continue;
      moment[joint.body1] += push * joint.directions[k].angular1;
      moment[joint.body2] += push * joint.directions[k].angular2;
    }
  }
  for (const std::uint32_t i : pushed_)
    velocity[i].angular =
        turned_by_joints(end_[i].inverse_inertia * moment[i], displacement_[i].angular, velocity[i].angular);
  return velocity;
}

bool IslandSolver::arrives() const {
  return std::ranges::any_of(contacts_, [](const EndContact& c) { return c.is_closed && c.law.target > 0.0; }) ||
         has_bounces();
}

bool IslandSolver::has_bounces() const {
  return stops_bounce_ && std::ranges::any_of(joints_, [](const EndJoint& joint) {
           return std::ranges::any_of(joint.velocity_laws, &JointLaw::bounces);
         });
}

BodyMotion IslandSolver::velocity_of_joints(BodyMotion velocity) {
  if (joints_.empty() || !arrives()) return velocity;
  build_velocity_of_joints();
  // stops that bounce are part of the impact
  for (ConeRow& row : cone_.rows)
    if (row.law.bounces()) row.law.has_lower = row.law.has_upper = false;
  summary_.iterations += cone_.solve(bodies_, velocity, 0.0, settings_).iterations;
  cone_.push(bodies_, &velocity);
  return velocity;
}

bool IslandSolver::may_turn() const {
  return std::ranges::any_of(contacts_, [](const EndContact& c) { return c.is_closed && c.law.has_turning(); }) &&
         std::ranges::all_of(contacts_, [](const EndContact& c) { return c.turning.isZero(0.0); });
}

void IslandSolver::build_velocity(bool with_turning) {
  build_velocity_of_joints();
  for (const EndContact& contact : contacts_)
    if (contact.is_closed) build_velocity(contact, with_turning);
}

void IslandSolver::build_velocity_of_joints() {
  cone_.rows.clear();
  cone_.contacts.clear();
  for (const EndJoint& joint : joints_) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!joint.velocity_laws[k].is_active()) continue;
      ConeRow& row = cone_.rows.emplace_back();
      row.body1 = joint.body1, row.body2 = joint.body2;
      row.direction =
          with_turns(joint.directions[k], end_[joint.body1].inverse_inertia, end_[joint.body2].inverse_inertia);
      row.length = joint.length;
      row.law = joint.velocity_laws[k];
      row.multiplier = answer_.joint_impulse[3 * joint.row + k];
    }
  }
}

void IslandSolver::build_velocity(const EndContact& contact, bool with_turning) {
  const Matrix3 &inverse1 = end_[contact.body1].inverse_inertia, &inverse2 = end_[contact.body2].inverse_inertia;
  const ContactLaw& law = contact.law;
  const bool has_turning = with_turning && law.has_turning() && !(inverse1 + inverse2).isZero(0.0);
  const auto first = static_cast<std::uint32_t>(cone_.rows.size());
  const ConeContact& cone = cone_.contacts.emplace_back(cone_contact(contact, first, has_turning));
  const Vector3 impulse = law.frame.transpose() * vector_at(answer_.contact_impulse, contact.row);
  const auto add = [&](const ConstraintDirection& direction, double length, double multiplier) {
    ConeRow& row = cone_.rows.emplace_back();
    row.body1 = contact.body1, row.body2 = contact.body2;
    row.direction = direction;
    row.length = length;
    row.multiplier = multiplier;
  };
  Vector3 arm1 = contact.arm1, arm2 = contact.arm2;
  if (!joints_.empty())
    turn_arms(law.frame.col(0), bodies_[contact.body1], bodies_[contact.body2], displacement_[contact.body1],
              displacement_[contact.body2], &arm1, &arm2);
  for (int k = 0; k < (cone.has_friction ? 3 : 1); ++k)
    add(with_turns(direction_at(law.frame.col(k), arm1, arm2), inverse1, inverse2), 1.0, impulse[k]);
  cone_.rows[first].softness = contact.softness;
  const double length = std::max(gyration_[contact.body1], gyration_[contact.body2]);
  for (int k = 0; k < (cone.has_turning ? 3 : 0); ++k)
    add(with_turns(turning_about(law.frame.col(k)), inverse1, inverse2), length, contact.turning[k]);
}

void IslandSolver::keep_impulses() {
  std::size_t next = 0;
  for (const EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k)
      answer_.joint_impulse[3 * joint.row + k] =
          joint.velocity_laws[k].is_active() ? cone_.rows[next++].multiplier : 0.0;
  std::size_t cone = 0;
  for (EndContact& contact : contacts_) {
    Vector3 impulse = Vector3::Zero();
    contact.turning.setZero();
    if (contact.is_closed) {
      const ConeContact& rows = cone_.contacts[cone++];
      for (std::uint32_t k = 0; k < (rows.has_friction ? 3U : 1U); ++k)
        impulse += cone_.rows[rows.first + k].multiplier * contact.law.frame.col(static_cast<int>(k));
      for (std::uint32_t k = 0; k < (rows.has_turning ? 3U : 0U); ++k)
        contact.turning[k] = cone_.rows[rows.first + rows.count() - 3 + k].multiplier;
      set_vector(answer_.contact_direction, contact.row, contact.law.frame.col(0));
    }
    set_vector(answer_.contact_impulse, contact.row, impulse);
  }
}

// ---- energy

bool IslandSolver::lower_restitution(const BodyMotion& before, int round) {
  if (round == 0) restitution_.reset();
  if (!restitution_)
    for (EndJoint& joint : joints_) joint.shares.fill(false);
  if (!restitution_ && !arrives()) return false;
  Gain all;
  const std::size_t joint_rows = cone_.contacts.empty() ? cone_.rows.size() : cone_.contacts.front().first;
  for (std::size_t r = 0; r < cone_.rows.size(); ++r) {
    // a drive's or spring's work is real
    if (r < joint_rows && cone_.rows[r].law.may_do_work()) continue;
    add_work(cone_.rows[r], before, velocity_, &all);
  }
  // multipliers of joints do work on what the solution leaves of their rows
  const bool gains = joints_.empty() ? all.is_real() : all.is_to_blame();
  if (restitution_) {
    if (restitution_->goes_on(gains, all.work)) {
      share_restitution();
      return true;
    }
    if (!gains || all_share_) return false;
    share_restitution(all.work, false);
    return true;
  }
  if (!gains) return false;
  bool any_fair = false, any_to_blame = false;
  for_bounces([&](const ConeRow& row, std::size_t k, EndJoint* joint) {
    Gain own;
    add_work(row, before, velocity_, &own);
    const double sign = std::copysign(1.0, row.law.bounce);
    const double arrival = -sign * row.direction.along(before[row.body1], before[row.body2]);
    joint->shares[k] = own.is_to_blame();
    any_to_blame = any_to_blame || joint->shares[k];
    double bounce = std::fabs(row.law.bounce);
    if (round >= kRoundsOfLowering || !lower_to_arrival(own, arrival, &bounce)) return;
    joint->velocity_laws[k].set_bounce(sign * bounce);
    any_fair = true;
  });
  std::size_t cone = 0;
  for (EndContact& contact : contacts_) {
    if (!contact.is_closed) continue;
    const ConeContact& rows = cone_.contacts[cone++];
    Gain own;
    for (std::uint32_t k = 0; k < rows.count(); ++k) add_work(cone_.rows[rows.first + k], before, velocity_, &own);
    const ConeRow& normal = cone_.rows[rows.first];
    const double arrival = -normal.direction.along(before[normal.body1], before[normal.body2]);
    contact.shares = contact.law.target > 0.0 && own.is_to_blame();
    any_to_blame = any_to_blame || contact.shares;
    if (contact.law.target > 0.0 && round < kRoundsOfLowering)
      any_fair = lower_to_arrival(own, arrival, &contact.law.target) || any_fair;
  }
  if (!any_fair) share_restitution(all.work, any_to_blame);
  return true;
}

// Of those that share, or of all.
void IslandSolver::share_restitution(double work, bool only_some) {
  all_share_ = !only_some;
  for (EndJoint& joint : joints_) {
    for (std::size_t k = 0; k < 3; ++k) {
      joint.shares[k] = joint.shares[k] || all_share_;
      joint.whole_bounces[k] = joint.velocity_laws[k].bounce;
    }
  }
  for (EndContact& contact : contacts_) {
    contact.shares = contact.shares || all_share_;
    contact.whole_target = contact.law.target;
  }
  restitution_.emplace(work);
  share_restitution();
}

void IslandSolver::share_restitution() {
  for (EndContact& contact : contacts_)
    if (contact.shares) contact.law.target = restitution_->share() * contact.whole_target;
  for (EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k)
      if (joint.shares[k]) joint.velocity_laws[k].set_bounce(restitution_->share() * joint.whole_bounces[k]);
}

void IslandSolver::find_bounces(const BodyMotion& before) {
  for_bounces([&](const ConeRow& row, std::size_t k, EndJoint* joint) {
    const JointAxisState& axis = joint->states[k];
    const double rate = row.direction.along(before[row.body1], before[row.body2]) - axis.desired_velocity;
    joint->velocity_laws[k].set_bounce(bounce_of(axis, rate, request_.time_step()));
  });
}

// A share f of all impulses gains f L + f^2 (W - L), W the gain of the whole and L = lambda.J v*.
void IslandSolver::scale_back(const BodyMotion& trial) {
  Gain gain;
  double along = 0.0;
  // contacts that give way have a compliance, too
  const std::size_t joint_rows = cone_.contacts.empty() ? cone_.rows.size() : cone_.contacts.front().first;
  for (std::size_t r = 0; r < cone_.rows.size(); ++r) {
    const ConeRow& row = cone_.rows[r];
    if (r < joint_rows && row.multiplier != 0.0 && row.law.may_do_work()) return;
    add_work(row, trial, velocity_, &gain);
    along += row.multiplier * row.direction.along(trial[row.body1], trial[row.body2]);
  }
  if (!gain.is_real()) return;
  const double share = std::max(0.0, -along / (gain.work - along));
  for (ConeRow& row : cone_.rows) row.multiplier *= share;
  velocity_ = trial;
  cone_.push(bodies_, &velocity_);
  keep_impulses();
}

// ---- rows on velocity alone

bool IslandSolver::set_offset(double share) {
  BodyMotion next = start_motion(nullptr);
  const auto push = [&](const ConeRow& row, double impulse) {
    if (impulse == 0.0) return;
    row.direction.push(share * impulse, bodies_[row.body1].inverse_mass, bodies_[row.body2].inverse_mass,
                       next[row.body1], next[row.body2]);
  };
  for_velocity_rows([&](const ConeRow& row, JointLaw* law, double*, double* driven) {
    if (!law->is_velocity_only) return;
    const bool is_drive = law->is_unbounded_drive() || law->yields;
    // drives that yield have moved their bodies as far as these go
    if (is_drive && !drives_yield_) *driven = row.multiplier;
    push(row, is_drive ? *driven : row.multiplier);
  });
  driven_ = next;
  std::size_t cone = 0;
  for (const EndContact& closed : contacts_) {
    if (!closed.is_closed) continue;
    const ConeContact& contact = cone_.contacts[cone++];
    for (std::uint32_t k = 1; k < contact.count(); ++k)
      push(cone_.rows[contact.first + k], closed.displacing_friction * cone_.rows[contact.first + k].multiplier);
  }
  shorten(driven_, &next);
  const bool changes = is_change(next, offset_, 0.0);
  offset_ =
      changes && !joints_.empty() && round_ >= kFreeRounds ? accelerated(offset_, next, &offsets_) : std::move(next);
  keep_moments_of_offset();
  return changes;
}

void IslandSolver::keep_moments_of_offset() {
  offset_moment_.assign(bodies_.count() + 1, Vector3::Zero());
  for (const std::uint32_t i : pushed_) {
    if (offset_[i].angular.isZero(0.0)) continue;
    const Vector3 moments = moments_of(vector_at(request_.inverse_inertia(), rows_[i]));
    offset_moment_[i] = world_inertia(end_[i].pose.orientation, moments) * offset_[i].angular;
  }
}

void IslandSolver::turn_offset() {
  for (const std::uint32_t i : pushed_)
    if (!offset_moment_[i].isZero(0.0)) offset_[i].angular = end_[i].inverse_inertia * offset_moment_[i];
}

}  // namespace gravitas
