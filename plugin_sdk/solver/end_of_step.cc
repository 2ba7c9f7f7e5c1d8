// Rows of an island at the end of the step, and the loop that finds where it is.
#include "plugin_sdk/solver/end_of_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/reply.h"
#include "plugin_sdk/solver/request_check.h"
#include "plugin_sdk/solver/stalled_drives.h"

namespace gravitas {
namespace {

class IslandSolver {
 public:
  IslandSolver(const stage::SolverSolveRequest& request, const SolverBodies& all, const Island& island,
               const ConeSettings& settings, ConeProblem* cone, SolverSolution* answer)
      : request_(request), island_(island), settings_(settings), answer_(*answer), cone_(*cone) {
    // its own bodies, and those that it is held by
    rows_ = island.bodies;
    for (const std::uint32_t row : island.discrepancies)
      for (const std::size_t end : {0U, 1U}) rows_.push_back(all.row(request.discrepancy_body()[2 * row + end]));
    for (const std::uint32_t row : island.contacts)
      for (const std::size_t end : {0U, 1U}) rows_.push_back(request.contact_body()[2 * row + end]);
    rows_.push_back(all.row(kNone));
    std::sort(rows_.begin(), rows_.end());
    rows_.erase(std::unique(rows_.begin(), rows_.end()), rows_.end());
    bodies_ = all.subset(rows_);
  }

  ConeSummary solve(Host& host) {
    load();
    cone_.start();
    const double share = request_.theta() * request_.time_step();
    guess_offset(share);
    int failures = 0;
    for (; round_ < kRounds; ++round_) {
      const BodyMotion before = displacement_;
      // impulses that wander from round to round are held more
      if (round_ == kFreeRounds) settings_.proximal *= 10.0;
      solve_pose();
      const bool closes = find_closed();
      // velocities are known to their residual; of rows that depend on each other, all impulses that move alike are right
      has_settled_ =
          round_ > 0 && has_velocity_ && !closes && !is_change(before, displacement_, 4.0 * share * summary_.residual);
      if (has_settled_) break;
      solve_velocity();
      host.mark_progress();
      has_settled_ = !set_offset(share);
      if (has_settled_) break;
      // what two rounds cannot solve the others could not either; sweeps go on from round to round
      failures = has_velocity_ || settings_.method == ConeMethod::kGaussSeidel ? 0 : failures + 1;
      if (failures == 2) break;
    }
    // where they do not settle, the pose change stays that of the impulses before: it must not move rows away
    summary_.contradiction = std::max(summary_.contradiction, pose_contradiction_);
    summary_.has_converged = has_settled_ && has_pose_ && has_velocity_;
    store();
    return summary_;
  }

 private:
  static constexpr int kRounds = 12, kFreeRounds = 4, kRoundsOfLowering = 4, kPoseSteps = 30;
  // Corrections move a body by no more than so many times the ways to S* and what is overlapped or missed there, summed.
  static constexpr double kOfWay = 16.0, kOfOverlap = 2.0;

  // ---- what does not change within the step

  void load() {
    velocity_ = start_motion(&SolverBody::trial_velocity);
    displacement_ = offset_ = start_motion(nullptr);
    end_.resize(bodies_.count() + 1);
    for (std::uint32_t i = 0; i <= bodies_.count(); ++i) {
      end_[i] = {bodies_[i].trial, bodies_[i].inverse_inertia, bodies_[i].inverse_inertia};
      gyration_.push_back(bodies_[i].gyration());
    }
    for (const std::uint32_t row : island_.bodies) pushed_.push_back(place_of(row));
    const DiscrepancyColumns columns = columns_of(request_);
    joints_.reserve(island_.discrepancies.size());
    contacts_.reserve(island_.contacts.size());
    for (const std::uint32_t row : island_.discrepancies) load_joint(columns, row);
    for (const std::uint32_t row : island_.contacts) load_contact(row);
  }

  // Place of a row of the request (kNone: the world) among the island's bodies.
  std::uint32_t place_of(std::uint32_t row) const {
    if (row == kNone) return static_cast<std::uint32_t>(bodies_.count());
    return static_cast<std::uint32_t>(std::lower_bound(rows_.begin(), rows_.end(), row) - rows_.begin());
  }

  BodyMotion start_motion(Twist SolverBody::*of) const {
    BodyMotion motion(bodies_.count() + 1);
    if (of != nullptr)
      for (std::uint32_t i = 0; i < bodies_.count(); ++i) motion[i] = bodies_[i].*of;
    return motion;
  }

  void load_joint(const DiscrepancyColumns& columns, std::uint32_t row) {
    EndJoint& joint = joints_.emplace_back();
    joint.row = row;
    joint.body1 = place_of(request_.discrepancy_body()[2 * row]);
    joint.body2 = place_of(request_.discrepancy_body()[2 * row + 1]);
    joint.discrepancy = columns.at(row);
    const Discrepancy& d = joint.discrepancy;
    joint.axes = to_rotation_matrix(d.axes);
    const SolverBody &one = bodies_[joint.body1], &two = bodies_[joint.body2];
    const Vector3 middle = 0.5 * (d.point1 + d.point2);
    const Vector3 start_error = error_at(d, one.trial, two.trial, one.start, two.start);
    joint.slop = d.is_angular() ? 1e-9 : closing_slop(middle, one, two);
    joint.length = d.is_angular() ? std::max(one.gyration(), two.gyration()) : 1.0;
    if (!d.is_angular()) coordinates_ = std::max(coordinates_, d.point2.cwiseAbs().maxCoeff());
    for (int k = 0; k < 3; ++k) {
      const auto place = static_cast<std::size_t>(k);
      joint.states[place] = joint_axis_state(d, k, joint.axes.col(k), start_error);
      joint.pose_laws[place] = pose_law(joint.states[place], d.correction, request_.time_step());
      const auto at = 3 * row + static_cast<std::uint32_t>(k);
      answer_.joint_correction[at] = request_.discrepancy_warm_correction()[at];
      answer_.joint_impulse[at] = request_.discrepancy_warm_impulse()[at];
    }
  }

  void load_contact(std::uint32_t row) {
    EndContact& contact = contacts_.emplace_back();
    contact.row = row;
    contact.body1 = place_of(request_.contact_body()[2 * row]);
    contact.body2 = place_of(request_.contact_body()[2 * row + 1]);
    const SolverBody &one = bodies_[contact.body1], &two = bodies_[contact.body2];
    const Vector3 normal = vector_at(request_.contact_normal(), row);
    const Vector3 point = vector_at(request_.contact_point(), row);
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

  // offset_ as the impulses of the step before make it: what rests or moves steadily is found in one round.
  void guess_offset(double share) {
    for (EndJoint& joint : joints_) {
      move_to_end(&joint);
      for (std::size_t k = 0; k < 3; ++k)
        if (velocity_law_of(joint, k).is_velocity_only)
          push_at_trial(joint, joint.directions[k], share * answer_.joint_impulse[3 * joint.row + k], &offset_);
    }
    for (const EndContact& contact : contacts_) {
      const Vector3 impulse = vector_at(answer_.contact_impulse, contact.row);
      const Vector3 normal = contact.law.frame.col(0);
      const Vector3 friction = impulse - normal.dot(impulse) * normal;
      push_at_trial(contact, direction_at(friction, contact.arm1, contact.arm2), share, &offset_);
    }
  }

  template <class Row>
  void push_at_trial(const Row& row, const ConstraintDirection& direction, double amount, BodyMotion* x) const {
    if (amount == 0.0) return;
    const SolverBody &one = bodies_[row.body1], &two = bodies_[row.body2];
    with_turns(direction, one.inverse_inertia, two.inverse_inertia)
        .push(amount, one.inverse_mass, two.inverse_mass, (*x)[row.body1], (*x)[row.body2]);
  }

  // ---- the end of the step

  // Bodies, rows and errors at S* (+) displacement_.
  void move_to_end() {
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

  // What a turn of a body adds to the moments that the corrections mu exert on it: the arm r of a push p turns along, so
  // K = (p.r) 1 - (p r^T + r p^T)/2. Under tension this holds a light link between heavy ones more than its inertia does,
  // and without it steps that take the directions anew each time run away (T h^2/(m l) > 1).
  void stiffen() {
    std::vector<Matrix3> stiffness(bodies_.count() + 1, Matrix3::Zero());
    for (const EndJoint& joint : joints_) {
      if (joint.discrepancy.is_angular()) continue;
      Vector3 push = Vector3::Zero();
      for (std::size_t k = 0; k < 3; ++k)
        push += answer_.joint_correction[3 * joint.row + k] * joint.directions[k].linear;
      stiffness[joint.body1] += geometric_stiffness(joint.arm1, -push);
      stiffness[joint.body2] += geometric_stiffness(joint.arm2, push);
    }
    for (const std::uint32_t i : pushed_) {
      end_[i].stiffened = stiffness[i].isZero(0.0)
                              ? end_[i].inverse_inertia
                              : stiffened_inverse(end_[i].pose.orientation,
                                                  vector_at(request_.inverse_inertia(), rows_[i]), stiffness[i]);
    }
  }

  // Newton's step for delta = offset + M^-1 J^T mu with the stiffness: x0 = delta_k + (M + K)^-1 M (offset - delta_k).
  BodyMotion start_of_step() const {
    BodyMotion x0 = offset_;
    for (const std::uint32_t i : pushed_) {
      const Vector3 missing = offset_[i].angular - displacement_[i].angular;
      if (missing.isZero(0.0) || end_[i].stiffened == end_[i].inverse_inertia) continue;
      const Vector3 moments = moments_of(vector_at(request_.inverse_inertia(), rows_[i]));
      x0[i].angular =
          displacement_[i].angular + end_[i].stiffened * (world_inertia(end_[i].pose.orientation, moments) * missing);
    }
    return x0;
  }

  void move_to_end(EndJoint* joint) const {
    const Vector3 turn = displacement_[joint->body2].angular - displacement_[joint->body1].angular;
    move_joint(bodies_[joint->body1], bodies_[joint->body2], end_[joint->body1], end_[joint->body2], turn, joint);
  }

  // What moves is found to rounding, as errors would add up over steps; but in the end positions and velocities must agree.
  bool may_rest() const { return summary_.iterations == 0 || round_ >= kFreeRounds; }

  // ---- pose change

  void solve_pose() {
    settings_.is_rough = true;
    ShrinkingSteps steps;
    for (bool is_last = false; !is_last;) {
      settings_.may_rest = may_rest();
      move_to_end();
      stiffen();
      build_pose();
      const double representable = 0.25 * kEpsilon * coordinates_;
      const BodyMotion x0 = start_of_step();
      ConeSummary solved = cone_.solve(bodies_, x0, representable, settings_);
      // where the steps end: before, redundant rows are off by the square of a turn
      pose_contradiction_ = solved.contradiction;
      BodyMotion next = x0;
      cone_.push(bodies_, &next);
      is_last = steps.end_with(largest_change(next, displacement_), largest(next), 4.0 * representable) ||
                joints_.empty() || steps.count() == kPoseSteps;
      if (is_last && solved.iterations > 0 && !joints_.empty()) {
        cone_.refine(bodies_, x0, representable, settings_, &solved);
        next = x0;
        cone_.push(bodies_, &next);
      }
      summary_.iterations += solved.iterations;
      has_pose_ = solved.has_converged;
      displacement_ = std::move(next);
      keep_corrections();
    }
    settings_.is_rough = false;
    const double share = shorten(offset_, &displacement_);
    for (ConeRow& row : cone_.rows) row.multiplier *= share;
    keep_corrections();
    move_to_end();
  }

  // Contacts that leave a body no room ask for ways without end along what is nearly flat between them. The share of the way
  // from `from` that is left.
  double shorten(const BodyMotion& from, BodyMotion* motion) const {
    if (contacts_.empty()) return 1.0;
    const double moved = largest_change(*motion, from);
    double most = kOfOverlap * sum_of_overlaps(joints_, contacts_);
    if (moved > most) most += kOfWay * sum_of_ways();
    if (!(moved > most)) return 1.0;
    const double share = most / moved;
    for (const std::uint32_t i : pushed_) {
      (*motion)[i].linear = from[i].linear + share * ((*motion)[i].linear - from[i].linear);
      (*motion)[i].angular = from[i].angular + share * ((*motion)[i].angular - from[i].angular);
    }
    return share;
  }

  double sum_of_ways() const {
    double sum = 0.0;
    for (const std::uint32_t i : pushed_) sum += way_of(bodies_[i], gyration_[i], request_.time_step());
    for (const EndContact& c : contacts_)
      sum += way_of(vector_at(request_.contact_point(), c.row), bodies_[c.body1], bodies_[c.body2]);
    return sum;
  }

  void build_pose() {
    cone_.rows.clear();
    cone_.contacts.clear();
    for (const EndJoint& joint : joints_) {
      for (std::size_t k = 0; k < 3; ++k) {
        if (!joint.pose_laws[k].is_active()) continue;
        ConeRow& row = cone_.rows.emplace_back();
        row.body1 = joint.body1, row.body2 = joint.body2;
        row.direction = with_turns(joint.directions[k], end_[joint.body1].stiffened, end_[joint.body2].stiffened);
        row.length = joint.length;
        row.law = joint.pose_laws[k];
        row.multiplier = answer_.joint_correction[3 * joint.row + k];
        // e(delta_k) - e* + J (x - delta_k)
        row.start = joint.errors[static_cast<Eigen::Index>(k)] - joint.states[k].error_at_trial -
                    row.direction.along(displacement_[joint.body1], displacement_[joint.body2]);
      }
    }
    for (const EndContact& contact : contacts_) {
      ConeRow& row = cone_.rows.emplace_back();
      row.body1 = contact.body1, row.body2 = contact.body2;
      row.direction = with_turns(contact.gap_row, end_[contact.body1].stiffened, end_[contact.body2].stiffened);
      row.law.has_lower = true;
      row.law.lower_target = contact.gap_target;
      row.multiplier = answer_.contact_correction[contact.row];
    }
  }

  void keep_corrections() {
    std::size_t next = 0;
    for (const EndJoint& joint : joints_)
      for (std::size_t k = 0; k < 3; ++k)
        answer_.joint_correction[3 * joint.row + k] =
            joint.pose_laws[k].is_active() ? cone_.rows[next++].multiplier : 0.0;
    for (const EndContact& contact : contacts_) answer_.contact_correction[contact.row] = cone_.rows[next++].multiplier;
  }

  // Contacts and limits that the end of the step closes, beside those that were.
  bool find_closed() {
    bool any = false;
    for (EndContact& contact : contacts_) {
      const double gap =
          contact.gap + contact.gap_row.along(displacement_[contact.body1], displacement_[contact.body2]);
      if (contact.is_closed || gap > contact.slop) continue;
      contact.is_closed = any = true;
    }
    for (EndJoint& joint : joints_) {
      for (std::size_t k = 0; k < 3; ++k) {
        const JointLaw known = joint.velocity_laws[k];
        JointLaw& law = joint.velocity_laws[k] = velocity_law_of(joint, k);
        law.has_lower = law.has_lower || known.has_lower;
        law.has_upper = law.has_upper || known.has_upper;
        const bool changes = law.has_lower != known.has_lower || law.has_upper != known.has_upper;
        any = any || (changes && !law.is_equality());
      }
    }
    stalled_.stall([&](auto&& visit) {
      for (EndJoint& j : joints_)
        for (std::size_t k = 0; k < 3; ++k) visit(j.body1, j.body2, j.directions[k], &j.velocity_laws[k]);
    });
    // with others closed, what slid may stick
    if (any)
      for (EndContact& contact : contacts_) contact.slides = false;
    return any;
  }

  JointLaw velocity_law_of(const EndJoint& joint, std::size_t k) const {
    return velocity_law(joint.states[k], joint.errors[static_cast<Eigen::Index>(k)], joint.slop, request_.time_step());
  }

  // ---- velocity

  void solve_velocity() {
    const BodyMotion trial = start_motion(&SolverBody::trial_velocity);
    settings_.may_rest = may_rest();
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
    std::size_t cone = 0;
    for (EndContact& contact : contacts_)
      if (contact.is_closed) contact.slides = cone_.contacts[cone++].slides;
  }

  bool arrives() const {
    return std::ranges::any_of(contacts_, [](const EndContact& c) { return c.is_closed && c.law.target > 0.0; });
  }
  // What the joints alone make of v*, where something arrives: what an impact gains is counted from there.
  BodyMotion velocity_of_joints(BodyMotion velocity) {
    if (joints_.empty() || !arrives()) return velocity;
    build_velocity_of_joints();
    summary_.iterations += cone_.solve(bodies_, velocity, 0.0, settings_).iterations;
    cone_.push(bodies_, &velocity);
    return velocity;
  }
  bool may_turn() const {
    return std::ranges::any_of(contacts_, [](const EndContact& c) { return c.is_closed && c.law.has_turning(); }) &&
           std::ranges::all_of(contacts_, [](const EndContact& c) { return c.turning.isZero(0.0); });
  }

  void build_velocity(bool with_turning) {
    build_velocity_of_joints();
    for (const EndContact& contact : contacts_)
      if (contact.is_closed) build_velocity(contact, with_turning);
  }

  void build_velocity_of_joints() {
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

  void build_velocity(const EndContact& contact, bool with_turning) {
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
    for (int k = 0; k < (cone.has_friction ? 3 : 1); ++k)
      add(with_turns(direction_at(law.frame.col(k), contact.arm1, contact.arm2), inverse1, inverse2), 1.0, impulse[k]);
    const double length = std::max(bodies_[contact.body1].gyration(), bodies_[contact.body2].gyration());
    for (int k = 0; k < (cone.has_turning ? 3 : 0); ++k)
      add(with_turns(turning_about(law.frame.col(k)), inverse1, inverse2), length, contact.turning[k]);
  }

  void keep_impulses() {
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

  // Work of all rows: lambda (J before + J after)/2 sums to the change of kinetic energy, from what the joints allow to what
  // joints and contacts do. Lowers e s where it is positive; true if anything was, and the velocities are to be found anew.
  bool lower_restitution(const BodyMotion& before, int round) {
    if (!arrives() || round >= kRoundsOfLowering) return false;
    Gain all;
    for (std::size_t r = 0; r < cone_.rows.size(); ++r) {
      // a drive's or spring's work is real
      if (r < cone_.contacts.front().first &&
          (cone_.rows[r].law.is_velocity_only || cone_.rows[r].law.lower_target != 0.0))
        continue;
      add_work(cone_.rows[r], before, velocity_, &all);
    }
    // multipliers of joints do work on what the solution leaves of their rows
    if (!(joints_.empty() ? all.is_real() : all.is_to_blame())) return false;
    bool any = false;
    std::size_t cone = 0;
    for (EndContact& contact : contacts_) {
      if (!contact.is_closed) continue;
      const ConeContact& rows = cone_.contacts[cone++];
      Gain own;
      for (std::uint32_t k = 0; k < rows.count(); ++k) add_work(cone_.rows[rows.first + k], before, velocity_, &own);
      const ConeRow& normal = cone_.rows[rows.first];
      const double arrival = -normal.direction.along(before[normal.body1], before[normal.body2]);
      if (contact.law.target > 0.0) any = lower_target(own, arrival, &contact.law.target, &contact.lowered) || any;
    }
    // no one contact is to blame, or lowering was not enough
    if (!any || round + 1 == kRoundsOfLowering)
      for (EndContact& contact : contacts_) contact.law.target = 0.0;
    return true;
  }

  // ---- rows on velocity alone

  // offset_ from the present impulses. False if that changes nothing.
  bool set_offset(double share) {
    BodyMotion next = start_motion(nullptr);
    const std::size_t scalars = cone_.contacts.empty() ? cone_.rows.size() : cone_.contacts.front().first;
    const auto push = [&](const ConeRow& row) {
      if (row.multiplier == 0.0) return;
      row.direction.push(share * row.multiplier, bodies_[row.body1].inverse_mass, bodies_[row.body2].inverse_mass,
                         next[row.body1], next[row.body2]);
    };
    for (std::size_t r = 0; r < scalars; ++r)
      if (cone_.rows[r].law.is_velocity_only) push(cone_.rows[r]);
    const BodyMotion driven = next;
    for (const ConeContact& contact : cone_.contacts)
      for (std::uint32_t k = 1; k < contact.count(); ++k) push(cone_.rows[contact.first + k]);
    shorten(driven, &next);
    const bool changes = is_change(next, offset_, 0.0);
    offset_ = std::move(next);
    return changes;
  }

  // ---- sizes, m

  double largest_change(const BodyMotion& a, const BodyMotion& b) const {
    double most = 0.0;
    for (const std::uint32_t i : pushed_)
      most = std::max(most, (a[i].linear - b[i].linear).norm() + gyration_[i] * (a[i].angular - b[i].angular).norm());
    return most;
  }
  double largest(const BodyMotion& a) const {
    double most = 0.0;
    for (const std::uint32_t i : pushed_)
      most = std::max(most, a[i].linear.norm() + gyration_[i] * a[i].angular.norm());
    return most;
  }

  // By more than rounding, and than `known`.
  bool is_change(const BodyMotion& a, const BodyMotion& b, double known) const {
    const double size = std::max({largest(a), largest(b), largest(displacement_)});
    return largest_change(a, b) > std::max({known, kEpsilon * coordinates_, 1e-14 * size});
  }

  void store() {
    for (const std::uint32_t i : pushed_) {
      answer_.velocity[rows_[i]] = velocity_[i];
      answer_.displacement[rows_[i]] = displacement_[i];
    }
    for (const EndContact& contact : contacts_)
      set_vector(answer_.contact_turning, contact.row, contact.law.frame * contact.turning);
  }

  const stage::SolverSolveRequest& request_;
  const Island& island_;
  ConeSettings settings_;
  SolverSolution& answer_;
  ConeProblem& cone_;

  SolverBodies bodies_;                // the island's
  std::vector<std::uint32_t> rows_;    // of the request, of each; rising, the world last
  std::vector<std::uint32_t> pushed_;  // places of those that can be pushed
  std::vector<EndJoint> joints_;
  std::vector<EndContact> contacts_;
  std::vector<EndBody> end_;
  std::vector<double> gyration_;  // radii, m
  double coordinates_ = 0.0, pose_contradiction_ = 0.0;
  BodyMotion velocity_, displacement_, offset_;
  ConeSummary summary_;
  int round_ = 0;
  StalledDrives stalled_;
  bool has_settled_ = true, has_pose_ = true, has_velocity_ = true;
};

}  // namespace

void solve_end_of_step(const stage::SolverSolveRequest& request, const ConeSettings& settings,
                       const stage::SolverSolveReply& reply, Host& host) {
  check_solver_request(request);
  SolverBodies bodies;
  bodies.load(request);
  SolverSolution answer;
  set_unpushed(request, bodies, &answer);
  IslandFinder finder;
  const std::span<const Island> islands = finder.find(request, bodies);
  std::vector<ConeSummary> summaries(islands.size());
  host.parallel_for_each(islands.size(), [&](std::uint64_t i) {
    // its matrices are large; memory is all that stays of them
    thread_local ConeProblem cone;
    summaries[i] = IslandSolver(request, bodies, islands[i], settings, &cone, &answer).solve(host);
    host.mark_progress();
  });
  write(answer, outcome_of(summaries), reply);
}

}  // namespace gravitas
