// Newton-Euler in the conventions of the columns: bodies in principal axes about the centre of mass, angular
// velocity and torque in world axes.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// Force and torque about the centre of mass, world axes, N and N m.
struct Wrench {
  Vector3 force = Vector3::Zero();
  Vector3 torque = Vector3::Zero();
};

struct Twist {
  Vector3 linear = Vector3::Zero();   // of the centre of mass, world, m/s
  Vector3 angular = Vector3::Zero();  // world, rad/s
};

// sqrt(moment/mass), m, by the mean of the inverse moments: turns rad/s of a body into m/s where the two must be compared. 0 where
// nothing turns the body, 1 m where nothing moves its centre.
inline double radius_of_gyration(double inverse_mass, double inverse_moment) {
  if (!(inverse_moment > 0.0)) return 0.0;
  return inverse_mass > 0.0 ? std::sqrt(inverse_mass / inverse_moment) : 1.0;
}

// Angular acceleration (world, rad/s^2) of a body with orientation q (body to world), angular velocity w
// (world) and principal moments, under a torque (world):
//   alpha = I_w^-1 (tau - w x (I_w w)),   I_w = R I_b R^T.
// § 2.34 lacks the second, gyroscopic term: without it a free rotor's angular momentum drifts by a quarter in
// seconds. A body with inverse moments 0 is not turned.
Vector3 angular_acceleration(const Quaternion& q, const Vector3& w, const Vector3& inertia,
                             const Vector3& inverse_inertia, const Vector3& torque);

// Pose after a translation and a rotation vector (world): (x + d, exp(r) q), the orientation renormalised. What is
// moved by exactly zero, position or orientation, is returned as it is, bit for bit.
inline Pose displaced(const Pose& pose, const Vector3& translation, const Vector3& rotation) {
  Pose moved = pose;
  if (!translation.isZero(0.0)) moved.position += translation;
  if (!rotation.isZero(0.0)) moved.orientation = rotate_by(pose.orientation, rotation);
  return moved;
}

// Momentum change of a wrench's impulse: velocities after an impulse (N s) and angular impulse (N m s).
Twist after_impulse(const Twist& twist, const Quaternion& q, double inverse_mass, const Vector3& inverse_inertia,
                    const Vector3& impulse, const Vector3& angular_impulse);

// Kinetic energy, J.
double kinetic_energy(double mass, const Vector3& inertia, const Quaternion& q, const Twist& twist);

// Angular momentum about the world's origin, kg m^2/s.
Vector3 angular_momentum(double mass, const Vector3& inertia, const Pose& pose, const Twist& twist);

// Axis-aligned world bounds of a box that is fixed in a body: `centre` (body frame, m) and `half_extents` along
// axes turned by `box_orientation` (box to body). A sphere is a box without orientation: see sphere_bounds().
struct Bounds {
  Vector3 lower;
  Vector3 upper;
};
Bounds box_bounds(const Pose& body, const Vector3& centre, const Quaternion& box_orientation,
                  const Vector3& half_extents);
inline Bounds sphere_bounds(const Pose& body, const Vector3& centre, double radius) {
  const Vector3 middle = centre.isZero(0.0) ? body.position : transform_point(body, centre);
  const Vector3 reach = Vector3::Constant(radius);
  return {middle - reach, middle + reach};
}

}  // namespace gravitas
