// The pose change: Newton's method on what rows miss at the end of the step.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/island_solver.h"

namespace gravitas {

void IslandSolver::solve_pose() {
  // where the steps before did not end, or were shortened to, is no place to begin
  if (round_ > 0 && !joints_.empty() && (!has_pose_ || is_shortened_)) forget_corrections();
  find_pose();
  if (!yields_ && contradicts()) {
    yields_ = true;
    forget_corrections();
    find_pose();
  }
  const double share = shorten(offset_, &displacement_);
  is_shortened_ = share < 1.0;
  if (!is_shortened_) return;
  for (ConeRow& row : cone_.rows) row.multiplier *= share;
  keep_corrections();
  move_to_end();
}

void IslandSolver::find_pose() {
  constexpr double kSlow = 0.3;  // of the step before
  constexpr std::size_t kStepsAlone = 3;
  constexpr double kAboveRounding = 1e-6;  // of the pose change: towards a locked place steps halve
  settings_.is_rough = true;
  ShrinkingSteps steps;
  AndersonAcceleration acceleration;
  double last_change = 0.0;
  NearestPose nearest;
  BodyMotion x0, next;
  for (bool is_last = false; !is_last;) {
    settings_.may_rest = may_rest();
    stiffen();
    turn_offset();
    build_pose();
    start_step(&x0);
    ConeSummary solved = cone_.solve(bodies_, x0, representable(), settings_);
    // where the steps end: before, redundant rows are off by the square of a turn
    pose_contradiction_ = solved.contradiction;
    next = x0;
    cone_.push(bodies_, &next);
    const double change = largest_change(next, displacement_), size = largest(next);
    // factors without what the corrections stiffen lead away
    const bool may_chord = solved.iterations > 0 && cone_.holds_all() && turns_little(next) && has_corrections();
    const bool has_ended = steps.end_with(change, size, 4.0 * representable()) || joints_.empty();
    is_last = has_ended || steps.count() == kPoseSteps;
    if (is_last && solved.iterations > 0 && !joints_.empty()) {
      cone_.refine(bodies_, x0, representable(), settings_, &solved);
      next = x0;
      cone_.push(bodies_, &next);
    }
    summary_.iterations += solved.iterations;
    has_pose_ = solved.has_converged && (has_ended || !is_last);
    missed_ = solved.residual;
    // the steps know how directions turn, but not inertia: bodies with a small moment end slowly, or run away
    const double least = has_reactions() ? kAboveRounding * size : 0.0;
    shrinks_slowly_ = shrinks_slowly_ || (steps.count() > kStepsAlone && change > std::max(least, kSlow * last_change));
    last_change = change;
    // reactions leave so little to close that only where rows become dependent steps shrink slowly
    if (shrinks_slowly_ && !is_last && !has_reactions()) next = accelerated(displacement_, next, &acceleration);
    displacement_.swap(next);
    move_to_end();
    keep_corrections();
    const bool goes_on = !has_reactions() || steps.count() < kStepsAlone || keep_nearest(&nearest);
    if (shrinks_slowly_ && has_reactions())
      is_last = is_last || !goes_on;
    else if (!is_last && may_chord)
      is_last = follow_chords(change);
  }
  if (shrinks_slowly_ && nearest.has_change()) take(nearest.change);
  settings_.is_rough = false;
}

bool IslandSolver::keep_nearest(NearestPose* nearest) const {
  constexpr int kIdleSteps = 4;
  constexpr double kLetsGo = 0.1;
  // a row that became dependent is left out, and what it pushed is in none of the others
  double most = 0.0;
  for (const ConeRow& row : cone_.rows) most = std::max(most, std::fabs(row.multiplier));
  if (most < kLetsGo * nearest->push) return false;
  nearest->push = std::max(nearest->push, most);
  const double now = open();
  if (!(now < nearest->open)) return ++nearest->idle < kIdleSteps;
  nearest->open = now, nearest->idle = 0, nearest->change = pose_change();
  // what pushed along directions as they were before, told along those of here
  auto of = nearest->change.of_joints.begin();
  std::size_t next = 0;
  for (const EndJoint& joint : joints_) {
    Vector3 push = Vector3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      if (joint.pose_laws[k].is_active())
        push += cone_.rows[next].multiplier * cone_.rows[next].direction.linear, ++next;
    next += joint.turns;
    for (std::size_t k = 0; k < 3; ++k, ++of)
      if (joint.pose_laws[k].is_active() && !joint.discrepancy.is_angular()) *of = push.dot(joint.directions[k].linear);
  }
  return true;
}

BodyMotion IslandSolver::accelerated(const BodyMotion& from, const BodyMotion& image,
                                     AndersonAcceleration* acceleration) const {
  // turns in the measure of ways
  const auto packed = [&](const BodyMotion& motion) {
    Eigen::VectorXd all(static_cast<Eigen::Index>(6 * pushed_.size()));
    Eigen::Index at = 0;
    for (const std::uint32_t i : pushed_) {
      all.segment<3>(at) = motion[i].linear, all.segment<3>(at + 3) = gyration_[i] * motion[i].angular;
      at += 6;
    }
    return all;
  };
  const Eigen::VectorXd mixed = acceleration->next(packed(from), packed(image));
  BodyMotion next = image;
  Eigen::Index at = 0;
  for (const std::uint32_t i : pushed_) {
    next[i].linear = mixed.segment<3>(at);
    if (gyration_[i] > 0.0) next[i].angular = mixed.segment<3>(at + 3) / gyration_[i];
    at += 6;
  }
  return next;
}

bool IslandSolver::contradicts() const {
  double deepest = 0.0;
  for (const EndContact& contact : contacts_) deepest = std::max(deepest, contact.gap_target);
  const double moved = largest_change(displacement_, offset_);
  const bool is_missed = !has_pose_ && missed_ > kOfDepth * deepest;
  if (!is_missed && !(moved > kOfOverlap * deepest)) return false;
  // what the step alone made overlap had room before it, and only deep in each other bodies are pushed in circles
  double smallest = std::numeric_limits<double>::infinity();
  for (const std::uint32_t i : pushed_) smallest = std::min(smallest, kOfSize * gyration_[i]);
  return deepest > smallest && deepest > largest_way() && (is_missed || moved > most_of(moved));
}

void IslandSolver::forget_corrections() {
  for (const EndJoint& joint : joints_)
    for (std::size_t k = 0; k < 3; ++k) answer_.joint_correction[3 * joint.row + k] = 0.0;
  for (const EndContact& contact : contacts_) answer_.contact_correction[contact.row] = 0.0;
  move_to_end(start_motion(nullptr));
}

// A contact's compliance, of its response: pairs of movable bodies give way, each more than those before it, so that of a
// circle of equals one is left open; what does not move hardly gives way.
std::vector<double> IslandSolver::yielding() const {
  constexpr double kLeast = 0.1, kMost = 1.0, kOfImmovable = 1e-6;
  const auto is_of_two = [&](const EndContact& c) {
    return bodies_[c.body1].is_pushed() && bodies_[c.body2].is_pushed();
  };
  std::vector<double> share;
  double pairs = -1.0;
  std::uint32_t one = kNone, two = kNone;
  for (const EndContact& contact : contacts_) {
    if (!is_of_two(contact)) {
      share.push_back(-1.0);
      continue;
    }
    if (contact.body1 != one || contact.body2 != two) pairs += 1.0;
    one = contact.body1, two = contact.body2;
    share.push_back(pairs);
  }
  for (double& of : share) {
    const double place = pairs > 0.0 ? of / pairs : 0.0;
    of = of < 0.0 ? kOfImmovable : kLeast + (kMost - kLeast) * place * place;
  }
  return share;
}

bool IslandSolver::follow_chords(double before) {
  BodyMotion x0, next;
  for (;;) {
    place_unstiffened();
    turn_offset();
    if (build_pose()) return false;  // other rows than have factors
    start_step(&x0);
    pose_contradiction_ = cone_.correct(bodies_, x0, representable());
    ++summary_.iterations;
    next = x0;
    cone_.push(bodies_, &next);
    const double change = largest_change(next, displacement_), size = largest(next);
    if (!(change <= before)) return false;
    displacement_.swap(next);
    move_to_end();
    keep_corrections();
    if (!(change <= kRateOfChords * before) || pose_contradiction_ > 0.0) return false;
    const double enough = std::max(4.0 * representable(), 1e-14 * size);
    if (are_closed() && (change == 0.0 || change * (change / before) <= enough)) return true;
    // what is open still is no chord's to close
    if (change <= enough) return false;
    before = change;
  }
}

bool IslandSolver::turns_little(const BodyMotion& next) const {
  return std::ranges::all_of(
      pushed_, [&](std::uint32_t i) { return (next[i].angular - displacement_[i].angular).norm() <= kTurnOfChords; });
}

bool IslandSolver::has_corrections() const {
  return std::ranges::any_of(joints_, [&](const EndJoint& joint) {
    const double* of = &answer_.joint_correction[3 * joint.row];
    return of[0] != 0.0 || of[1] != 0.0 || of[2] != 0.0;
  });
}

bool IslandSolver::are_closed() const {
  return std::ranges::all_of(joints_, [&](const EndJoint& joint) {
    const double rounding = kEpsilon * (joint.discrepancy.is_angular() ? 1.0 : coordinates_);
    for (std::size_t k = 0; k < 3; ++k) {
      const JointLaw& law = joint.pose_laws[k];
      const double change = joint.errors[static_cast<Eigen::Index>(k)] - joint.states[k].error_at_trial;
      if (law.is_equality() && law.gamma == 0.0 && !(std::fabs(law.lower_target - change) <= kLeftByChords * rounding))
        return false;
    }
    return true;
  });
}

double IslandSolver::shorten(const BodyMotion& from, BodyMotion* motion) const {
  if (contacts_.empty()) return 1.0;
  // what takes back where friction or drives alone would bring bodies ends near S*
  const double moved = std::min(largest_change(*motion, from), largest(*motion)), most = most_of(moved);
  if (!(moved > most)) return 1.0;
  const double share = most / moved;
  for (const std::uint32_t i : pushed_) {
    (*motion)[i].linear = from[i].linear + share * ((*motion)[i].linear - from[i].linear);
    (*motion)[i].angular = from[i].angular + share * ((*motion)[i].angular - from[i].angular);
  }
  return share;
}

double IslandSolver::most_of(double moved) const {
  const double of_overlap = kOfOverlap * sum_of_overlaps(joints_, contacts_);
  return moved > of_overlap ? of_overlap + kOfWay * sum_of_ways() : of_overlap;
}

template <class Use>
void IslandSolver::for_ways(Use&& use) const {
  for (const std::uint32_t i : pushed_) use(way_of(bodies_[i], gyration_[i], request_.time_step()));
  for (const EndContact& c : contacts_)
    use(way_of(vector_at(request_.contact_point(), c.row), bodies_[c.body1], bodies_[c.body2]));
}

double IslandSolver::sum_of_ways() const {
  double sum = 0.0;
  for_ways([&](double way) { sum += way; });
  for (const std::uint32_t i : pushed_) sum += driven_[i].linear.norm() + gyration_[i] * driven_[i].angular.norm();
  for (const EndJoint& joint : joints_) {
    const SolverBody &one = bodies_[joint.body1], &two = bodies_[joint.body2];
    for (std::size_t k = 0; k < 3; ++k) {
      const JointLaw& law = joint.pose_laws[k];
      if (law.gamma == 0.0) continue;
      const ConstraintDirection row = with_turns(joint.directions[k], one.inverse_inertia, two.inverse_inertia);
      const double response = row.product(row, one.inverse_mass + two.inverse_mass);
      sum += joint.length * law.missed_by(0.0) * law.share_of_bodies(response);
    }
  }
  return sum;
}

double IslandSolver::largest_way() const {
  double largest = 0.0;
  for_ways([&](double way) { largest = std::max(largest, way); });
  return largest;
}

bool IslandSolver::build_pose() {
  bool changes = false;
  cone_.rows.clear();
  cone_.contacts.clear();
  for (EndJoint& joint : joints_) {
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
    const std::size_t turns = std::exchange(joint.turns, 0);
    build_turns_of_rod(&joint);
    build_turn_of_swing(&joint);
    changes = changes || joint.turns != turns;
  }
  for (const EndContact& contact : contacts_) {
    ConeRow& row = cone_.rows.emplace_back();
    row.body1 = contact.body1, row.body2 = contact.body2;
    row.direction = with_turns(contact.gap_row, end_[contact.body1].stiffened, end_[contact.body2].stiffened);
    row.law.has_lower = true;
    row.law.lower_target = contact.gap_target;
    row.softness = contact.softness;
    row.multiplier = answer_.contact_correction[contact.row];
  }
  if (!yields_) return changes;
  ConeRow* row = cone_.rows.data() + cone_.rows.size() - contacts_.size();
  for (const double share : yielding()) {
    const double masses = bodies_[row->body1].inverse_mass + bodies_[row->body2].inverse_mass;
    row->law.gamma = share * row->direction.product(row->direction, masses);
    ++row;
  }
  return changes;
}

// A rod that pulls with mu resists to being turned: across it, with mu/length.
void IslandSolver::build_turns_of_rod(EndJoint* joint) {
  const bool is_rod = joint->discrepancy.is_radial() && joint->pose_laws[0].is_active() && joint->errors[0] > 0.0;
  const double pull = -answer_.joint_correction[3 * joint->row];
  if (!is_rod || !(pull > 0.0)) return;
  const auto [first, second] = orthonormal_basis(joint->directions[0].linear);
  for (const Vector3& across : {first, second})
    add_turn(direction_at(across, joint->own_arm1(), joint->own_arm2()), joint->errors[0] / pull, joint);
}

void IslandSolver::build_turn_of_swing(EndJoint* joint) {
  if (!joint->discrepancy.is_swing() || !joint->pose_laws[0].is_active()) return;
  const TurnOfSwing turn =
      turn_of_swing(joint->directions[0].angular2, joint->directions[1].angular2,
                    joint->errors[0] + held_angle(joint->discrepancy), answer_.joint_correction[3 * joint->row]);
  if (turn.stiffness > 0.0) add_turn(turn.direction, 1.0 / turn.stiffness, joint);
}

// What a row that is held resists with to being turned: a row with that compliance, beside it, whose multiplier vanishes where the
// steps end.
void IslandSolver::add_turn(const ConstraintDirection& direction, double compliance, EndJoint* joint) {
  ++joint->turns;
  ConeRow& row = cone_.rows.emplace_back();
  row.body1 = joint->body1, row.body2 = joint->body2;
  row.direction = with_turns(direction, end_[joint->body1].stiffened, end_[joint->body2].stiffened);
  row.length = joint->length;
  row.law.has_lower = row.law.has_upper = true;
  row.law.gamma = compliance;
  row.start = -row.direction.along(displacement_[joint->body1], displacement_[joint->body2]);
}

void IslandSolver::keep_corrections() {
  std::size_t next = 0;
  for (const EndJoint& joint : joints_) {
    for (std::size_t k = 0; k < 3; ++k)
      answer_.joint_correction[3 * joint.row + k] =
          joint.pose_laws[k].is_active() ? cone_.rows[next++].multiplier : 0.0;
    next += joint.turns;
  }
  for (const EndContact& contact : contacts_) answer_.contact_correction[contact.row] = cone_.rows[next++].multiplier;
}

double IslandSolver::gap_of(const EndContact& contact) const {
  return contact.gap + contact.gap_row.along(displacement_[contact.body1], displacement_[contact.body2]);
}

// A face that comes down about an edge meets with all its corners at once, but those nearer to the edge are within their slop
// before. Of a pair that arrives, what comes in the time that the slop takes comes with it, if it is nearly there: one by one
// they bounce otherwise.
void IslandSolver::close_together(std::span<EndContact> of_pair, double time) {
  constexpr double kNearly = 100.0;  // slops
  for (EndContact& contact : of_pair) {
    const double way = std::min(time * contact.law.arrival, kNearly * contact.slop);
    contact.is_closed = contact.is_closed || gap_of(contact) <= contact.slop + way;
  }
}

bool IslandSolver::find_closed() {
  bool any = false;
  for (std::size_t first = 0, end = 0; first < contacts_.size(); first = end) {
    double time = 0.0;
    for (; end < contacts_.size() && contacts_[end].is_of_pair(contacts_[first]); ++end) {
      EndContact& contact = contacts_[end];
      // what is pushed is closed, however far the steps have come
      const bool closes = gap_of(contact) <= contact.slop || answer_.contact_correction[contact.row] > 0.0;
      if (contact.is_closed || !closes) continue;
      contact.is_closed = any = true;
      if (contact.law.arrival > 0.0) time = std::max(time, 2.0 * contact.slop / contact.law.arrival);
    }
    if (time > 0.0) close_together(std::span(contacts_).subspan(first, end - first), time);
  }
  for (EndJoint& joint : joints_) {
    for (std::size_t k = 0; k < 3; ++k) {
      const JointLaw known = joint.velocity_laws[k];
      JointLaw& law = joint.velocity_laws[k] = velocity_law_of(joint, k);
      law.close(known.has_lower, known.has_upper);
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

JointLaw IslandSolver::velocity_law_of(const EndJoint& joint, std::size_t k) const {
  return velocity_law(joint.states[k], joint.errors[static_cast<Eigen::Index>(k)], joint.slop, request_.time_step());
}

}  // namespace gravitas
