#include "plugin_sdk/conformance/constrained_bodies.h"

#include <algorithm>
#include <cmath>

namespace gravitas::conformance {
namespace {

constexpr stage::Method kSolverSolve = stage::Method::kSolverSolve;

Vector3 inverse_moments(const ConstrainedBody& body) {
  Vector3 inverse = Vector3::Zero();
  for (int k = 0; k < 3; ++k)
    if (body.moments[k] > 0.0) inverse[k] = 1.0 / body.moments[k];
  return inverse;
}

void add_row(MessageColumns* request, const char* column, const Vector3& v) { append(&request->f64(column), v); }
void add_row(MessageColumns* request, const char* column, const Quaternion& q) { append(&request->f64(column), q); }

}  // namespace

std::uint32_t ConstrainedBodies::add(const ConstrainedBody& body) {
  bodies.push_back(body);
  trial_pose.push_back(body.pose);
  trial_twist.push_back(body.twist);
  wrench.push_back({});
  return static_cast<std::uint32_t>(bodies.size() - 1);
}

void ConstrainedBodies::make_trial(const Vector3& gravity) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    trial_twist[i] = bodies[i].twist;
    if (is_pushed(i)) {
      trial_twist[i].linear += time_step * gravity;
      wrench[i].force = bodies[i].mass * gravity;
    }
    trial_pose[i] = displaced(bodies[i].pose, time_step * trial_twist[i].linear, time_step * trial_twist[i].angular);
  }
}

Vector3 ConstrainedBodies::at_trial(std::uint32_t body, const Vector3& point) const {
  return body == kNone ? point : carried(point, bodies[body].pose, trial_pose[body]);
}

void ConstrainedBodies::add_ball_joint(std::uint32_t body1, std::uint32_t body2, const Vector3& point) {
  BodyJoint joint{.body1 = body1, .body2 = body2, .discrepancy = {}};
  joint.discrepancy.point1 = at_trial(body1, point);
  joint.discrepancy.point2 = at_trial(body2, point);
  joints.push_back(joint);
}

// At S_n.
void ConstrainedBodies::append_start(MessageColumns* request) const {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const ConstrainedBody& body = bodies[i];
    request->u32("flags").push_back(kHasShape | (body.kinematic ? kKinematic : is_pushed(i) ? kMovable : 0U));
    request->f64("inverse_mass").push_back(is_pushed(i) ? 1.0 / body.mass : 0.0);
    add_row(request, "inverse_inertia", is_pushed(i) ? inverse_moments(body) : Vector3::Zero());
    add_row(request, "position", body.pose.position);
    add_row(request, "orientation", body.pose.orientation);
    add_row(request, "linear_velocity", body.twist.linear);
    add_row(request, "angular_velocity", body.twist.angular);
    add_row(request, "wrench", wrench[i].force);
    add_row(request, "wrench", wrench[i].torque);
  }
}

void ConstrainedBodies::append_trial(MessageColumns* request) const {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    add_row(request, "trial_position", trial_pose[i].position);
    add_row(request, "trial_orientation", trial_pose[i].orientation);
    add_row(request, "trial_linear_velocity", trial_twist[i].linear);
    add_row(request, "trial_angular_velocity", trial_twist[i].angular);
  }
}

void ConstrainedBodies::append_joints(MessageColumns* request) const {
  for (const BodyJoint& joint : joints) {
    const Discrepancy& d = joint.discrepancy;
    request->u32("discrepancy_body").push_back(joint.body1);
    request->u32("discrepancy_body").push_back(joint.body2);
    add_row(request, "point1", d.point1);
    add_row(request, "point2", d.point2);
    add_row(request, "velocity", d.velocity);
    request->f64("correction").push_back(d.correction);
    add_row(request, "axes", d.axes);
    request->u32("mode").push_back(d.modes);
    add_row(request, "lower", d.lower);
    add_row(request, "upper", d.upper);
    add_row(request, "compliance", d.compliance);
    add_row(request, "damping", d.damping);
    add_row(request, "maximum_force", d.maximum_force);
  }
}

void ConstrainedBodies::append_contacts(MessageColumns* request) const {
  for (const BodyContact& contact : contacts) {
    request->u32("contact_body").push_back(contact.body1);
    request->u32("contact_body").push_back(contact.body2);
    add_row(request, "contact_normal", contact.normal);
    add_row(request, "contact_point", contact.point);
    request->f64("contact_depth").push_back(contact.depth);
    request->u64("contact_key").push_back(contact.key);
    std::vector<double>& material = request->f64("contact_material");
    material.insert(material.end(), {contact.restitution, contact.friction, contact.friction, contact.rolling_friction,
                                     contact.spinning_friction, 0.0});
    add_row(request, "contact_warm_impulse", contact.warm_impulse);
    request->f64("contact_warm_correction").push_back(contact.warm_correction);
  }
}

MessageColumns ConstrainedBodies::request() const {
  MessageColumns columns = empty_request(kSolverSolve);
  columns.f64("time_step") = {time_step};
  columns.f64("theta") = {theta};
  append_start(&columns);
  append_trial(&columns);
  append_joints(&columns);
  for (const BodyJoint& joint : joints) {
    add_row(&columns, "discrepancy_warm_impulse", joint.warm_impulse);
    add_row(&columns, "discrepancy_warm_correction", joint.warm_correction);
    add_row(&columns, "discrepancy_applied_force", Vector3::Zero());
    columns.f64("restitution").push_back(joint.discrepancy.restitution);
  }
  append_contacts(&columns);
  return columns;
}

MessageColumns ConstrainedBodies::reactions_request() const {
  MessageColumns columns = empty_request(stage::Method::kSolverReactions);
  columns.f64("time_step") = {time_step};
  append_start(&columns);
  for (std::size_t i = 0; i < bodies.size(); ++i)
    add_row(&columns, "inertia", is_pushed(i) ? bodies[i].moments : Vector3::Zero());
  for (const char* of : {"position", "orientation", "linear_velocity", "angular_velocity"})
    columns.f64(std::string("start_") + of) = columns.f64(of);
  append_joints(&columns);
  for (const BodyJoint& joint : joints) add_row(&columns, "desired_acceleration", joint.discrepancy.acceleration);
  return columns;
}

Solution ConstrainedBodies::ask(Inquiry* inquiry) const {
  const MessageColumns reply = inquiry->answer(kSolverSolve, request());
  inquiry->expect_unit("contact_direction", reply.f64("contact_direction"), 3);
  Solution solution(reply);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (is_pushed(i)) continue;
    const std::string of = " of body " + std::to_string(i) + ", which nothing can push,";
    inquiry->expect_near("velocity" + of, solution.velocity(i), trial_twist[i].linear, 0.0);
    inquiry->expect_near("angular velocity" + of, solution.turning(i), trial_twist[i].angular, 0.0);
    inquiry->expect_near("translation" + of, solution.translation(i), Vector3::Zero(), 0.0);
    inquiry->expect_near("rotation" + of, solution.rotation(i), Vector3::Zero(), 0.0);
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const std::string of = " of contact " + std::to_string(i);
    const Vector3 impulse = solution.contact_impulse(i), normal = solution.contact_direction(i);
    const double along = normal.dot(impulse), rounding = 1e-9 * impulse.norm();
    inquiry->expect(along >= -rounding, "normal impulse" + of + " is " + number_text(along) + " N s: it pulls");
    inquiry->expect_at_most("friction impulse" + of + " (normal impulse " + number_text(along) + ", coefficient " +
                                number_text(contacts[i].friction) + ")",
                            (impulse - along * normal).norm(), contacts[i].friction * along + rounding);
    const Vector3 turning = solution.contact_turning(i);
    const double spinning = normal.dot(turning), pressed = along + rounding, turned = 1e-9 * turning.norm();
    inquiry->expect_at_most("spinning friction" + of + " (normal impulse " + number_text(along) + ")",
                            std::fabs(spinning), contacts[i].spinning_friction * pressed + turned);
    inquiry->expect_at_most("rolling friction" + of + " (normal impulse " + number_text(along) + ")",
                            (turning - spinning * normal).norm(), contacts[i].rolling_friction * pressed + turned);
    inquiry->expect(solution.contact_correction(i) >= 0.0,
                    "correction" + of + " is " + number_text(solution.contact_correction(i)) + ": it pulls");
  }
  return solution;
}

Pose ConstrainedBodies::committed(const Solution& solution, std::uint32_t body) const {
  return displaced(trial_pose[body], solution.translation(body), solution.rotation(body));
}

Vector3 ConstrainedBodies::relative_velocity(const BodyContact& contact, const std::vector<Twist>& twists) const {
  const auto velocity = [&](std::uint32_t body) {
    return Vector3(twists[body].linear + twists[body].angular.cross(contact.point - trial_pose[body].position));
  };
  return velocity(contact.body2) - velocity(contact.body1);
}

std::vector<Twist> ConstrainedBodies::twists(const Solution& solution) const {
  std::vector<Twist> twists;
  for (std::size_t i = 0; i < bodies.size(); ++i) twists.push_back({solution.velocity(i), solution.turning(i)});
  return twists;
}

double ConstrainedBodies::energy(const std::vector<Twist>& twists) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (is_pushed(i)) sum += kinetic_energy(bodies[i].mass, bodies[i].moments, trial_pose[i].orientation, twists[i]);
  return sum;
}

}  // namespace gravitas::conformance
