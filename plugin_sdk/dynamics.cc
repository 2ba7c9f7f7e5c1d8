#include "plugin_sdk/dynamics.h"

#include "plugin_sdk/math/rotation.h"

namespace gravitas {

Vector3 angular_acceleration(const Quaternion& q, const Vector3& w, const Vector3& inertia,
                             const Vector3& inverse_inertia, const Vector3& torque) {
  // a body whose moments are equal turns alike about every axis
  const auto are_equal = [](const Vector3& moments) { return moments[0] == moments[1] && moments[1] == moments[2]; };
  if (are_equal(inertia) && are_equal(inverse_inertia)) return inverse_inertia.cwiseProduct(torque);
  const Quaternion to_body = q.conjugate();
  const Vector3 w_body = to_body * w;
  const Vector3 torque_body = to_body * torque;
  const Vector3 momentum_body = inertia.cwiseProduct(w_body);
  return q * inverse_inertia.cwiseProduct(torque_body - w_body.cross(momentum_body));
}

Twist after_impulse(const Twist& twist, const Quaternion& q, double inverse_mass, const Vector3& inverse_inertia,
                    const Vector3& impulse, const Vector3& angular_impulse) {
  const Vector3 turn_body = inverse_inertia.cwiseProduct(q.conjugate() * angular_impulse);
  return {twist.linear + inverse_mass * impulse, twist.angular + q * turn_body};
}

double kinetic_energy(double mass, const Vector3& inertia, const Quaternion& q, const Twist& twist) {
  const Vector3 w_body = q.conjugate() * twist.angular;
  return 0.5 * (mass * twist.linear.squaredNorm() + w_body.dot(inertia.cwiseProduct(w_body)));
}

Vector3 angular_momentum(double mass, const Vector3& inertia, const Pose& pose, const Twist& twist) {
  const Vector3 w_body = pose.orientation.conjugate() * twist.angular;
  return pose.orientation * inertia.cwiseProduct(w_body) + mass * pose.position.cross(twist.linear);
}

Bounds box_bounds(const Pose& body, const Vector3& centre, const Quaternion& box_orientation,
                  const Vector3& half_extents) {
  const Matrix3 axes = (body.orientation * box_orientation).toRotationMatrix();
  const Vector3 reach = axes.cwiseAbs() * half_extents;
  const Vector3 middle = transform_point(body, centre);
  return {middle - reach, middle + reach};
}

}  // namespace gravitas
