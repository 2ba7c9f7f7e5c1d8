#include "plugin_sdk/constraint.h"

#include <cmath>
#include <string>

namespace gravitas {
namespace {

void push_vector(const stage::ReplyColumn<double>& column, const Vector3& v) { column.push(v.x(), v.y(), v.z()); }

Pose pose_of(std::span<const double> position, std::span<const double> orientation, std::uint32_t body) {
  if (body == kNone) return {};
  if (3 * (std::size_t{body} + 1) > position.size() || 4 * (std::size_t{body} + 1) > orientation.size())
    throw Refusal("it names body " + std::to_string(body) + ", which does not exist");
  return {vector_at(position, body), quaternion_at(orientation, body)};
}

}  // namespace

namespace detail {

JointBodies bodies_of(std::span<const std::uint32_t> constraint_body, std::span<const double> position,
                      std::span<const double> orientation, std::size_t joint) {
  return {pose_of(position, orientation, constraint_body[2 * joint]),
          pose_of(position, orientation, constraint_body[2 * joint + 1]), constraint_body[2 * joint + 1] != kNone};
}

JointBodies bodies_of(const stage::ConstraintBindRequest& request, std::size_t joint) {
  JointBodies bodies = bodies_of(request.constraint_body(), request.position(), request.orientation(), joint);
  bodies.is_kept = joint < request.constraint_kept().size() && request.constraint_kept()[joint] != 0;
  return bodies;
}

JointBodies bodies_of(const stage::ConstraintDiscrepanciesRequest& request, std::size_t joint) {
  JointBodies bodies = bodies_of(request.constraint_body(), request.position(), request.orientation(), joint);
  const auto of = [](std::span<const double> column, std::uint32_t body) {
    return body != kNone && 3 * (std::size_t{body} + 1) <= column.size() ? vector_at(column, body) : Vector3::Zero();
  };
  const std::uint32_t body1 = request.constraint_body()[2 * joint], body2 = request.constraint_body()[2 * joint + 1];
  bodies.spin1 = of(request.angular_velocity(), body1);
  bodies.spin2 = of(request.angular_velocity(), body2);
  bodies.start_spin1 = of(request.start_angular_velocity(), body1);
  bodies.start_spin2 = of(request.start_angular_velocity(), body2);
  bodies.velocity1 = of(request.linear_velocity(), body1);
  bodies.velocity2 = of(request.linear_velocity(), body2);
  bodies.time_step = request.time_step();
  bodies.time = request.time();
  bodies.elapsed = request.time() - request.start_time();
  const auto inverse_mass_of = [&](std::uint32_t body) {
    return body < request.inverse_mass().size() ? request.inverse_mass()[body] : 0.0;
  };
  bodies.inverse_mass1 = inverse_mass_of(body1), bodies.inverse_mass2 = inverse_mass_of(body2);
  bodies.inverse_inertia1 = of(request.inverse_inertia(), body1);
  bodies.inverse_inertia2 = of(request.inverse_inertia(), body2);
  return bodies;
}

std::span<const double> slice(std::span<const double> numbers, std::span<const std::uint32_t> begin, std::size_t row) {
  if (row + 1 >= begin.size() || begin[row] > begin[row + 1] || begin[row + 1] > numbers.size())
    throw Refusal("its parameters lie outside their column");
  return numbers.subspan(begin[row], begin[row + 1] - begin[row]);
}

void push_bound(const stage::ConstraintBindReply& reply, std::span<const double> numbers) {
  for (const double number : numbers) {
    if (!std::isfinite(number))
      throw Refusal(
          "it binds to numbers that are not finite: its properties or the poses of its bodies are not, or too large");
    reply.bound().push(number);
  }
}

void push_discrepancy(const stage::ConstraintDiscrepanciesReply& reply, std::size_t joint, const Discrepancy& d) {
  if (!d.point1.allFinite() || !d.point2.allFinite() || !d.velocity.allFinite() || !std::isfinite(d.correction) ||
      !d.axes.coeffs().allFinite() || !d.lower.allFinite() || !d.upper.allFinite() || !d.compliance.allFinite() ||
      !d.damping.allFinite() || !d.maximum_force.allFinite() || !std::isfinite(d.restitution) ||
      !d.acceleration.allFinite())
    throw Refusal(
        "it has a discrepancy that is not finite: its bound numbers or the poses of its bodies are not, or too large");
  if ((d.lower.array() > d.upper.array()).any() || d.compliance.minCoeff() < 0.0 || d.damping.minCoeff() < 0.0 ||
      d.maximum_force.minCoeff() < 0.0 || d.restitution < 0.0 || d.restitution > 1.0 ||
      std::fabs(d.axes.norm() - 1.0) > 1e-6)
    throw Refusal(
        "it has a discrepancy with crossed limits, negative numbers, a restitution above 1 or axes that are not unit: "
        "its bound numbers are none of a joint of this type");
  reply.constraint().push(joint);
  push_vector(reply.point1(), d.point1);
  push_vector(reply.point2(), d.point2);
  push_vector(reply.velocity(), d.velocity);
  reply.correction().push(d.correction);
  reply.axes().push(d.axes.w(), d.axes.x(), d.axes.y(), d.axes.z());
  reply.mode().push(d.modes);
  push_vector(reply.lower(), d.lower);
  push_vector(reply.upper(), d.upper);
  push_vector(reply.compliance(), d.compliance);
  push_vector(reply.damping(), d.damping);
  push_vector(reply.maximum_force(), d.maximum_force);
  reply.restitution().push(d.restitution);
  push_vector(reply.desired_acceleration(), d.acceleration);
}

}  // namespace detail

Discrepancy point_discrepancy(const Vector3& anchor1_in_body1, const Vector3& anchor2_in_body2,
                              const JointBodies& bodies) {
  Discrepancy d;
  d.point1 = transform_point(bodies.pose1, anchor1_in_body1);
  d.point2 = transform_point(bodies.pose2, anchor2_in_body2);
  return d;
}

}  // namespace gravitas
