// SolutionCheck of physics_checks.h: sums of what joints and contacts do to each body, and what the body did.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/physics_checks.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/contact_law.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "plugin_sdk/solver/reply.h"

namespace gravitas {
namespace {

// Of the sum of magnitudes that cancel in a balance.
constexpr double kRelative = 1e-10;
// The same where the directions are those at the end, which a method finds step by step.
constexpr double kRelativeAtEnd = 1e-8;
// Of what rows on velocity alone displace, where a method stopped between two rounds.
constexpr double kRoundBefore = 2.0;
// Steps towards the end may turn axes further than that.
constexpr double kBeyondEnd = 2.0;
// Of the momenta and energies themselves.
constexpr double kOfSolution = 1e-13;
// A displacement that changes by less from one look at it to the next has settled, of the coordinates.
constexpr double kSettled = 4e-16;
// Where drives yield to what is in their way (their corrections say so), that is found with pushes which are much larger.
constexpr double kSettledByDrives = 1e-13;
// Rounding of a gap, of the coordinates that it is the difference of.
constexpr double kOfSolvedCoordinates = 1e-12;
// Share of a displacement that a method may leave undone, where it says that it is done.
constexpr double kNearly = 1e-3;
// The same by any turn, however large.
constexpr double kMostLeft = 0.25;
// Speed at which a method may stop, of the fastest body's: it knows one measure for all.
constexpr double kOfFastest = 1e-12;
// Share of the largest correction that none is.
constexpr double kNegligible = 1e-6;

using Push = SolutionCheck::Push;
using Pushes = SolutionCheck::Pushes;

void push_at(const Vector3& arm, const Vector3& impulse, Push* push) {
  push->linear += impulse;
  push->angular += arm.cross(impulse);
  push->size += impulse.norm();
  push->moment += arm.norm() * impulse.norm();
}

void push_couple(const Vector3& impulse, Push* push) {
  push->angular += impulse;
  push->moment += impulse.norm();
}

// Where a method takes the directions of its rows, and pushes two bodies that a point alone holds together: midway, or each
// at its own place; both impulses and corrections then may be along directions on the way from S* to the end.
enum class Directions : std::uint8_t { kOfTrial, kOfTrialAtOwn, kOfEnd };

class Balance {
 public:
  // `displacing`: shares of friction's impulses that displace, by contact (contact_law.h).
  Balance(const stage::SolverSolveRequest& request, const SolutionColumns& answer,
          const std::vector<double>& displacing, std::vector<Pushes>* pushes)
      : request_(request),
        answer_(answer),
        bodies_(request.flags().size()),
        displacing_(displacing),
        pushes_(*pushes) {}

  std::string check() {
    std::string wrong = check_bodies();
    if (!wrong.empty()) return wrong;
    if (wrong = check_energy(); !wrong.empty()) return wrong;
    if (is_unfinished()) return {};
    if (wrong = check_touching(); !wrong.empty()) return wrong;
    if (wrong = check_closing(); !wrong.empty()) return wrong;
    return check_separation();
  }

 private:
  // Islands may be solved in different ways, so each body is judged by itself.
  std::string check_bodies() {
    std::string first;
    std::vector<std::size_t> doubtful;
    for (std::size_t i = 0; i < bodies_; ++i)
      if ((request_.flags()[i] & kMovable) != 0 && (request_.flags()[i] & kKinematic) == 0) doubtful.push_back(i);
    for (const Directions directions : {Directions::kOfTrial, Directions::kOfTrialAtOwn, Directions::kOfEnd}) {
      pushes_.assign(bodies_, Pushes{});
      add_contacts();
      add_discrepancies(directions);
      const double relative = directions == Directions::kOfEnd ? kRelativeAtEnd : kRelative;
      std::string wrong;
      std::erase_if(doubtful, [&](std::size_t i) {
        std::string of_body = check_body(i, relative);
        if (wrong.empty()) wrong = of_body;
        return of_body.empty();
      });
      if (doubtful.empty()) return {};
      if (first.empty()) first = wrong;
    }
    return first;
  }

  bool is_unfinished() const { return tells_unfinished(static_cast<StopReason>(answer_.stop_reason)); }

  // What the pose change turns a body by, rad, and where it carries a point of the trial state.
  Vector3 turn_of(std::uint32_t body) const {
    return body == kNone ? Vector3(Vector3::Zero()) : vector_at(answer_.pose_change, 2 * body + 1);
  }
  // What the points of a contact of jointed bodies may go along with, rad.
  double turned_about(std::size_t contact, const Vector3& normal) const {
    if (request_.mode().empty()) return 0.0;
    const std::uint32_t* bodies = &request_.contact_body()[2 * contact];
    return std::max(std::fabs(normal.dot(turn_of(bodies[0]))), std::fabs(normal.dot(turn_of(bodies[1]))));
  }
  // By how much the axes of a discrepancy of points turn, rad, at most, with the pose change or the part of it that a method
  // knows before what acts on the velocity alone has moved the bodies.
  double turned_on_the_way(std::size_t row, const Discrepancy& d) const {
    const std::uint32_t one = request_.discrepancy_body()[2 * row], two = request_.discrepancy_body()[2 * row + 1];
    const double share = request_.theta() * request_.time_step();
    const auto gained = [&](std::uint32_t body, std::span<const double> after, std::span<const double> before) {
      return body == kNone ? 0.0 : share * (vector_at(after, body) - vector_at(before, body)).norm();
    };
    const auto turned = [&](std::uint32_t body) {
      if (body == kNone) return 0.0;
      // sweeps that ran out may have come anywhere on the way of the free step
      const Quaternion way =
          quaternion_at(request_.trial_orientation(), body) * quaternion_at(request_.orientation(), body).conjugate();
      const double unfinished = is_unfinished() ? log_rotation(shorter_arc(way)).norm() : 0.0;
      return unfinished + turn_of(body).norm() +
             gained(body, answer_.angular_velocity, request_.trial_angular_velocity());
    };
    const auto moved = [&](std::uint32_t body, const Vector3& point) {
      if (body == kNone) return 0.0;
      const double arm = (point - vector_at(request_.trial_position(), body)).norm();
      return vector_at(answer_.pose_change, 2 * body).norm() + arm * turned(body) +
             gained(body, answer_.linear_velocity, request_.trial_linear_velocity());
    };
    const double length = (d.point2 - d.point1).norm();
    if (!d.is_radial() || length == 0.0) return turned(one);
    return turned(one) + (moved(one, d.point1) + moved(two, d.point2)) / length;
  }
  Vector3 carried(std::uint32_t body, const Vector3& point) const {
    if (body == kNone) return point;
    const Vector3 position = vector_at(request_.trial_position(), body);
    return position + vector_at(answer_.pose_change, 2 * body) + exp_rotation(turn_of(body)) * (point - position);
  }

  // Calls push(pushes of the body, arm, sign) for both bodies of a row that acts at a point.
  // `apart`: from there to where body 2 is pushed, and back to where body 1 is.
  template <typename Apply>
  void for_both(std::span<const std::uint32_t> pair, std::size_t row, const Vector3& point, const Vector3& apart,
                Apply&& apply) {
    for (const std::size_t end : {0U, 1U}) {
      const std::uint32_t body = pair[2 * row + end];
      if (body == kNone) continue;
      const double sign = end == 0 ? -1.0 : 1.0;
      const Vector3 position = vector_at(request_.trial_position(), body);
      pushes_[body].coordinates = std::max(pushes_[body].coordinates, point.norm() + position.norm());
      apply(pushes_[body], point + sign * apart - position, sign);
    }
  }

  // A displacement that rows on velocity alone make.
  static void loosen(double size, const Vector3& arm, Pushes* body) {
    body->loose += size;
    body->loose_moment += size * arm.norm();
  }

  void add_contacts() {
    for (std::size_t i = 0; i < request_.contact_key().size(); ++i) {
      const double share = displacing_[i] * request_.theta() * request_.time_step();
      const Vector3 impulse = vector_at(answer_.contact_impulse, i);
      const Vector3 direction = vector_at(answer_.contact_direction, i);
      const double along = direction.dot(impulse), correction = answer_.contact_correction[i];
      const Vector3 friction = impulse - along * direction;
      const Vector3 normal = vector_at(request_.contact_normal(), i);
      const Vector3 turning = vector_at(answer_.contact_turning, i);
      const Vector3 to_surface = 0.5 * request_.contact_depth()[i] * normal;
      const double turned = turned_about(i, normal);
      for_both(request_.contact_body(), i, vector_at(request_.contact_point(), i), -to_surface,
               [&](Pushes& body, const Vector3& arm, double sign) {
                 push_at(arm, sign * impulse, &body.velocity);
                 body.velocity.unreported += turned * arm.norm() * impulse.norm();
                 push_couple(sign * turning, &body.velocity);
                 push_at(arm, sign * correction * normal, &body.pose);
                 push_at(arm, sign * share * friction, &body.pose);
                 push_couple(sign * share * turning, &body.pose);
                 // of an impulse that is taken apart, rounding stays
                 body.pose.size += share * impulse.norm();
                 body.pose.moment += share * impulse.norm() * arm.norm();
                 loosen(share * friction.norm(), arm, &body);
                 body.loose_moment += share * turning.norm();
               });
    }
  }

  // Linear ones turn with body 1, a radial axis with its points, those of swings, twists and components with what they are of.
  Matrix3 axes_of(std::size_t i, const Discrepancy& d, Directions directions) const {
    const std::uint32_t one = request_.discrepancy_body()[2 * i], two = request_.discrepancy_body()[2 * i + 1];
    Matrix3 axes = d.axes.toRotationMatrix();
    if (directions == Directions::kOfEnd && d.is_swing()) {
      const auto [first, second] = swing_directions(d);
      axes.col(0) = swing_between(exp_rotation(turn_of(one)) * first, exp_rotation(turn_of(two)) * second).axis;
    }
    if (directions == Directions::kOfEnd && d.is_twist())
      axes.col(0) = twisting_of(d).turned(exp_rotation(turn_of(one)), exp_rotation(turn_of(two))).bisector();
    if (directions == Directions::kOfEnd && d.is_component()) {
      const TurnComponent trial = turn_component_of(d);
      const TurnComponent end = trial.turned(exp_rotation(turn_of(one)), exp_rotation(turn_of(two)));
      axes.col(0) = end.gradient() / trial.gradient().norm();
    }
    if (directions != Directions::kOfEnd || d.is_angular()) return axes;
    axes = exp_rotation(turn_of(one)).toRotationMatrix() * axes;
    const Vector3 between = carried(two, d.point2) - carried(one, d.point1);
    if (d.is_radial() && between.norm() > 0.0) axes.col(0) = between.normalized();
    return axes;
  }

  void add_discrepancies(Directions directions) {
    const DiscrepancyColumns columns = columns_of(request_);
    const double share = request_.theta() * request_.time_step();
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const Discrepancy d = columns.at(i);
      const Matrix3 axes = axes_of(i, d, directions);
      const Vector3 point = 0.5 * (d.point1 + d.point2);
      // at the end of the step, where the error is closed, it is where either point is
      const bool is_closed = directions == Directions::kOfEnd && !d.is_angular();
      const Vector3 to_point = is_closed ? Vector3(0.5 * (d.point2 - d.point1)) : Vector3(Vector3::Zero());
      // a spring stays open there, and its axes may turn with either body
      const std::uint32_t one = request_.discrepancy_body()[2 * i], two = request_.discrepancy_body()[2 * i + 1];
      const Vector3 open =
          is_closed ? Vector3(0.5 * (carried(two, d.point2) - carried(one, d.point1))) : Vector3(Vector3::Zero());
      const bool turns_at_end = directions == Directions::kOfEnd && d.is_angular();
      const double both_turn = turns_at_end ? turn_of(one).norm() + turn_of(two).norm() : 0.0;
      const bool is_at_own =
          directions == Directions::kOfTrialAtOwn && is_only_point(request_.discrepancy_body(), request_.mode(), i);
      const Vector3 apart =
          is_at_own ? half_of_locked(d, axes, axes.transpose() * (d.point2 - d.point1)) : Vector3(Vector3::Zero());
      const bool turns = directions == Directions::kOfTrialAtOwn && !d.is_angular();
      const double turned = turns ? 1.001 * turned_on_the_way(i, d) : 0.0;
      is_driven_ = is_driven_ || !d.velocity.isZero(0.0);
      for (int axis = 0; axis < 3; ++axis) {
        const AxisMode mode = axis_mode(d.modes, axis);
        // a compliance is read where an error is held
        const bool is_held = mode == AxisMode::kLocked || mode == AxisMode::kLimited || mode == AxisMode::kUnilateral;
        const bool is_soft = is_held && d.compliance[axis] > 0.0;
        is_driven_ = is_driven_ || is_soft;
        const bool on_velocity = is_soft || is_drive(mode);
        const std::size_t k = 3 * i + static_cast<std::size_t>(axis);
        has_yielded_ = has_yielded_ || (on_velocity && !is_soft && answer_.discrepancy_correction[k] != 0.0);
        const Vector3 impulse = answer_.discrepancy_impulse[k] * axes.col(axis);
        const Vector3 correction = answer_.discrepancy_correction[k] * axes.col(axis);
        for_both(request_.discrepancy_body(), i, point, apart, [&](Pushes& body, const Vector3& arm, double sign) {
          body.is_joined = true;
          add(d, arm, sign * impulse, &body.velocity);
          add(d, arm, sign * correction, &body.pose);
          body.velocity.unreported += to_point.cross(impulse).norm();
          body.pose.unreported += to_point.cross(correction).norm();
          const auto off = [&](const Vector3& push) { return open.cross(push).norm() + both_turn * push.norm(); };
          if (is_soft) body.velocity.unreported += off(impulse);
          if (is_soft) body.pose.unreported += off(correction) + share * off(impulse);
          body.velocity.turned += turned * impulse.norm();
          body.velocity.unreported += turned * impulse.norm() * arm.norm();
          const double moved = correction.norm() + (on_velocity ? share * impulse.norm() : 0.0);
          body.pose.turned += kBeyondEnd * turned * moved;
          body.pose.unreported += kBeyondEnd * turned * moved * arm.norm();
          if (on_velocity) add(d, arm, sign * share * impulse, &body.pose);
          if (on_velocity) loosen(share * impulse.norm(), arm, &body);
        });
      }
    }
  }

  static void add(const Discrepancy& d, const Vector3& arm, const Vector3& impulse, Push* push) {
    if (d.is_angular()) {
      push_couple(impulse, push);
    } else {
      push_at(arm, impulse, push);
    }
  }

  Matrix3 inertia_of(std::size_t i) const {
    Vector3 inertia = vector_at(request_.inverse_inertia(), i);
    for (double& moment : inertia) moment = moment > 0.0 ? 1.0 / moment : 0.0;
    return world_inertia(quaternion_at(request_.trial_orientation(), i), inertia);
  }

  std::string check_body(std::size_t i, double relative) const {
    const double inverse_mass = request_.inverse_mass()[i];
    const double mass = inverse_mass > 0.0 ? 1.0 / inverse_mass : 0.0;
    const Matrix3 inertia = inertia_of(i);
    const Twist before{vector_at(request_.trial_linear_velocity(), i), vector_at(request_.trial_angular_velocity(), i)};
    const Twist after{vector_at(answer_.linear_velocity, i), vector_at(answer_.angular_velocity, i)};
    const Twist change{vector_at(answer_.pose_change, 2 * i), vector_at(answer_.pose_change, 2 * i + 1)};
    const double moved = change.linear.norm(), turned = change.angular.norm();
    const Push &velocity = pushes_[i].velocity, &pose = pushes_[i].pose;
    const double settled = (has_yielded_ ? kSettledByDrives : kSettled) * pushes_[i].coordinates;
    // before a method is done, what friction and drives displace may be that of the round before
    const double before_last = is_unfinished() ? kRoundBefore : 0.0;

    std::string wrong = off_by(
        "linear_velocity", i, (mass * (after.linear - before.linear) - velocity.linear).norm(),
        relative * velocity.size + velocity.turned + kOfSolution * mass * (before.linear.norm() + after.linear.norm()),
        "m (v - v*) is the sum of the impulses, N s");
    if (!wrong.empty()) return wrong;
    wrong = off_by(
        "pose_change", i, (mass * change.linear - pose.linear).norm(),
        relative * pose.size + pose.turned + before_last * pushes_[i].loose + mass * (kOfSolution * moved + settled),
        "m delta is the sum of the corrections, kg m");
    if (!wrong.empty()) return wrong;

    // arms and inertia at the end of the step are as good
    const Vector3 turning = inertia * (after.angular - before.angular);
    const auto arms = [&](const Push& push, double made) {
      return relative * push.moment + 2.0 * (push.size * moved + (push.moment + made) * turned) +
             1.001 * push.unreported;
    };
    // so is w*, which may turn with a body that joints turn, and the inertia that impulses meet
    const double spins = before.angular.norm() + (after.angular - before.angular).norm();
    const double along = pushes_[i].is_joined ? 2.0 * inertia.norm() * spins * turned : 0.0;
    const double spin = (inertia * before.angular).norm() + (inertia * after.angular).norm();
    wrong = off_by("angular_velocity", i, (turning - velocity.angular).norm(),
                   arms(velocity, turning.norm()) + along + kOfSolution * spin,
                   "I (w - w*) is the sum of the moments, N m s");
    if (!wrong.empty()) return wrong;
    const Vector3 displaced = inertia * change.angular;
    // a turn settles by what it moves at the radius of gyration
    const double give = vector_at(request_.inverse_inertia(), i).mean();
    const double gyration = give > 0.0 ? radius_of_gyration(inverse_mass, give) : 1.0;
    return off_by("pose_change", i, (displaced - pose.angular).norm(),
                  arms(pose, displaced.norm()) + before_last * pushes_[i].loose_moment +
                      kOfSolution * displaced.norm() + inertia.norm() * settled / gyration,
                  "I delta is the sum of the corrections' moments, kg m^2");
  }

  std::string check_energy() const {
    double before = 0.0, after = 0.0, after_there = 0.0;
    for (std::size_t i = 0; i < bodies_; ++i) {
      const bool moves = !vector_at(request_.trial_linear_velocity(), i).isZero(0.0) ||
                         !vector_at(request_.trial_angular_velocity(), i).isZero(0.0);
      if (is_driven_ || ((request_.flags()[i] & kKinematic) != 0 && moves)) return {};
      if ((request_.flags()[i] & kMovable) == 0) continue;
      const double inverse_mass = request_.inverse_mass()[i];
      const double mass = inverse_mass > 0.0 ? 1.0 / inverse_mass : 0.0;
      const Matrix3 inertia = inertia_of(i);
      const auto energy = [&](std::span<const double> linear, const Vector3& w) {
        return 0.5 * (mass * vector_at(linear, i).squaredNorm() + w.dot(inertia * w));
      };
      before += energy(request_.trial_linear_velocity(), vector_at(request_.trial_angular_velocity(), i));
      const Vector3 w = vector_at(answer_.angular_velocity, i);
      after += energy(answer_.linear_velocity, w);
      after_there += energy(answer_.linear_velocity, exp_rotation(-turn_of(static_cast<std::uint32_t>(i))) * w);
    }
    // with joints the attitudes of S_{n+1} are as good as those of S*
    if (request_.mode().size() > 0) after = std::min(after, after_there);
    if (after <= before * (1.0 + 1e-9)) return {};
    char text[160];
    std::snprintf(text, sizeof text, "kinetic energy grows from %.12g J to %.12g J, and nothing drives", before, after);
    return text;
  }

  // gap(S_{n+1}) = min(0, ...) <= 0 where a contact corrects.
  std::string check_touching() const {
    double largest = 0.0;
    for (const double correction : answer_.contact_correction) largest = std::max(largest, correction);
    for (std::size_t i = 0; i < request_.contact_key().size(); ++i) {
      if (!(answer_.contact_correction[i] > kNegligible * largest)) continue;
      const Vector3 normal = vector_at(request_.contact_normal(), i), point = vector_at(request_.contact_point(), i);
      double apart = 0.0, sizes = 0.0, turned = 0.0, coordinates = point.norm();
      for (const std::size_t end : {0U, 1U}) {
        const std::uint32_t body = request_.contact_body()[2 * i + end];
        const Vector3 linear = vector_at(answer_.pose_change, 2 * body);
        const Vector3 position = vector_at(request_.trial_position(), body);
        const Vector3 swept = turn_of(body).cross(point - position);
        apart += (end == 0 ? -1.0 : 1.0) * normal.dot(linear + swept);
        sizes += linear.norm() + swept.norm();
        turned += turn_of(body).norm();
        coordinates += position.norm();
      }
      const double allowed =
          request_.contact_depth()[i] + (kNearly + turned) * sizes + kOfSolvedCoordinates * coordinates;
      if (apart <= allowed) continue;
      char text[160];
      std::snprintf(text, sizeof text, "contact_correction of row %zu moves apart by %.3g m what overlaps by %.3g m", i,
                    apart, request_.contact_depth()[i]);
      return text;
    }
    return {};
  }

  Pose pose_of(std::uint32_t body, std::span<const double> position, std::span<const double> orientation) const {
    return body == kNone ? Pose{} : Pose{vector_at(position, body), quaternion_at(orientation, body)};
  }
  Pose end_pose(std::uint32_t body, const Pose& trial) const {
    if (body == kNone) return trial;
    return {trial.position + vector_at(answer_.pose_change, 2 * body), exp_rotation(turn_of(body)) * trial.orientation};
  }
  // By how much the pose change moves a point, both ways of moving taken for themselves.
  double moved_by(std::uint32_t body, const Vector3& point) const {
    if (body == kNone) return 0.0;
    const Vector3 arm = point - vector_at(request_.trial_position(), body);
    return vector_at(answer_.pose_change, 2 * body).norm() + turn_of(body).cross(arm).norm();
  }
  bool can_be_pushed(std::uint32_t body) const {
    return body != kNone && (request_.flags()[body] & kMovable) != 0 && request_.inverse_mass()[body] > 0.0;
  }

  // error(S_{n+1}) = (1 - beta) error(S_n) along what is locked, with a beta of 0 ... 1 that the method may choose.
  std::string check_closing() const {
    const DiscrepancyColumns columns = columns_of(request_);
    if (tells_contradiction(static_cast<StopReason>(answer_.stop_reason))) return {};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const std::uint32_t one = request_.discrepancy_body()[2 * i], two = request_.discrepancy_body()[2 * i + 1];
      if (!can_be_pushed(one) && !can_be_pushed(two)) continue;
      const Discrepancy d = columns.at(i);
      const Pose trial1 = pose_of(one, request_.trial_position(), request_.trial_orientation());
      const Pose trial2 = pose_of(two, request_.trial_position(), request_.trial_orientation());
      const Pose start1 = pose_of(one, request_.position(), request_.orientation());
      const Pose start2 = pose_of(two, request_.position(), request_.orientation());
      const Matrix3 axes = d.axes.toRotationMatrix();
      const auto along = [&](int axis, const Vector3& error) {
        return d.is_radial() && axis == 0 ? error.norm() : axes.col(axis).dot(error);
      };
      const Pose end1 = end_pose(one, trial1), end2 = end_pose(two, trial2);
      const Vector3 at_end = error_in_axes_at(d, trial1, trial2, end1, end2);
      const Vector3 at_start = error_in_axes_at(d, trial1, trial2, start1, start2);
      // rows that are linear leave what is of second order in the turn
      const double turned = turn_of(one).norm() + turn_of(two).norm();
      const double left = kNearly + std::min(turned, kMostLeft);
      double sizes = turned, coordinates = 0.0;
      if (!d.is_angular()) {
        sizes = moved_by(one, d.point1) + moved_by(two, d.point2);
        coordinates = d.point1.norm() + trial1.position.norm() + trial2.position.norm();
      }
      for (int axis = 0; axis < 3; ++axis) {
        const bool is_held = axis_mode(d.modes, axis) == AxisMode::kLocked && !(d.compliance[axis] > 0.0) &&
                             d.maximum_force[axis] == kUnlimited;
        if (!is_held) continue;
        const double end = along(axis, at_end), start = along(axis, at_start);
        const double beyond = std::max(end - std::max(start, 0.0), std::min(start, 0.0) - end);
        const double allowed = left * sizes + kOfSolvedCoordinates * (1.0 + coordinates);
        if (beyond <= allowed) continue;
        char text[160];
        std::snprintf(text, sizeof text,
                      "pose_change leaves row %zu of the joints open by %.3g, from %.3g (allowed %.3g)", i, end, start,
                      allowed);
        return text;
      }
    }
    return {};
  }

  std::string check_separation() const {
    double fastest = 0.0;
    for (std::size_t i = 0; i < bodies_; ++i)
      fastest = std::max(fastest, vector_at(request_.trial_linear_velocity(), i).norm());
    for (std::size_t i = 0; i < request_.contact_key().size(); ++i) {
      const Vector3 direction = vector_at(answer_.contact_direction, i);
      const Vector3 impulse = vector_at(answer_.contact_impulse, i), point = vector_at(request_.contact_point(), i);
      if (!(direction.dot(impulse) > 0.0)) continue;
      double sizes = 0.0;
      const auto speed = [&](std::span<const double> linear, std::span<const double> angular,
                             std::span<const double> position) {
        Vector3 relative = Vector3::Zero();
        for (const std::size_t end : {0U, 1U}) {
          const std::uint32_t body = request_.contact_body()[2 * i + end];
          const Vector3 turned = vector_at(angular, body).cross(point - vector_at(position, body));
          relative += (end == 0 ? -1.0 : 1.0) * (vector_at(linear, body) + turned);
          sizes += vector_at(linear, body).norm() + turned.norm();
        }
        return direction.dot(relative);
      };
      const double start = speed(request_.linear_velocity(), request_.angular_velocity(), request_.trial_position());
      const double trial =
          speed(request_.trial_linear_velocity(), request_.trial_angular_velocity(), request_.trial_position());
      const double after = speed(answer_.linear_velocity, answer_.angular_velocity, request_.trial_position());
      // s^2 <= u^2 + 2 |a| gap, and the gap was crossed within the step
      const double arrival = 2.0 * (std::fabs(start) + std::fabs(trial));
      // a speed that moves nothing but by rounding is none
      const double rounding = kSettled * point.norm() / request_.time_step();
      const double allowed = request_.contact_material()[kMaterialColumns * i + kRestitution] * arrival +
                             (1e-3 + turned_about(i, direction)) * sizes + kOfFastest * fastest + rounding;
      if (after <= allowed) continue;
      char text[160];
      std::snprintf(text, sizeof text, "contact_impulse of row %zu pushes what separates at %.3g m/s, allowed %.3g", i,
                    after, allowed);
      return text;
    }
    return {};
  }

  static std::string off_by(const char* what, std::size_t body, double residual, double bound, const char* law) {
    if (residual <= bound) return {};
    char text[256];
    std::snprintf(text, sizeof text, "%s of body %zu breaks a balance by %.3g, allowed %.3g (%s)", what, body, residual,
                  bound, law);
    return text;
  }

  const stage::SolverSolveRequest& request_;
  const SolutionColumns& answer_;
  std::size_t bodies_;
  const std::vector<double>& displacing_;
  std::vector<Pushes>& pushes_;
  bool is_driven_ = false;
  bool has_yielded_ = false;  // a drive, to what is in its way
};

}  // namespace

std::string SolutionCheck::check(const stage::SolverSolveRequest& request, const SolutionColumns& answer) {
  bodies_.load(request);
  find_displacing_friction(
      request, request.contact_key().size(), [](std::size_t k) { return k; },
      [&](std::size_t i, std::size_t end) -> const SolverBody& { return bodies_[request.contact_body()[2 * i + end]]; },
      &displacing_);
  return Balance(request, answer, displacing_, &pushes_).check();
}

}  // namespace gravitas
