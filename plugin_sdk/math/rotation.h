// Rotations: conversions between quaternions, matrices and rotation vectors, repair of drifted
// ones, tangent frames, and inertia tensors in the world frame.
//
// A rotation is kept as a unit quaternion. Quaternions q and -q are the same attitude; wherever a
// function has to choose, it takes the one with w >= 0, which is the shorter way round from the
// identity. Rotation vectors are axis times angle (rad). Every function is a fixed sequence of IEEE
// operations (see transcendental.h), so equal arguments give equal bits.
//
// Non-finite arguments give non-finite results, never an error, except where std::optional says so.
#pragma once

#include <optional>

#include "plugin_sdk/math/types.h"

namespace gravitas {

inline constexpr double kWholeTurn = 6.28318530717958647692;  // rad
inline constexpr double kHalfTurn = 0.5 * kWholeTurn;

// q / |q|, of any finite nonzero q, also where |q|^2 would overflow or underflow. The sign is kept.
// A zero q gives NaN.
Quaternion normalized(const Quaternion& q);

// Of q and -q the one with w >= 0; q itself when w = 0.
Quaternion shorter_arc(const Quaternion& q);

// Of q and -q the one nearer to the reference: non-negative four-dimensional dot product. Errors
// and interpolations between two attitudes are taken through it.
Quaternion shorter_arc(const Quaternion& q, const Quaternion& reference);

// The matrix of a unit quaternion, R v = q v q*. Its entries deviate from a rotation by twice the
// deviation of |q| from 1. Source: § 2.2.2, (2.15).
Matrix3 to_rotation_matrix(const Quaternion& q);

// The unit quaternion, w >= 0, of a rotation matrix. Precondition: orthonormal with determinant 1,
// up to rounding; orthonormalized() makes it so. Source: § 2.2.2, (2.16), corrected: the seed
// divides by the root of 1 + trace at any angle, which loses all digits towards half a turn. Here
// the component of largest magnitude is found first, which is w, x, y or z as the largest of the
// trace, r11, r22 and r33, and the others are divided by it; it is at least 1/2.
Quaternion to_quaternion(const Matrix3& rotation);

// The quaternion of the rotation by |v| radians about v:
//   exp(v) = (cos(|v|/2), sin(|v|/2) v/|v|),
// by its series near zero, without cancellation or overflow for any finite v. Not folded to w >= 0:
// angles beyond pi keep their sign of w, as continuity in v demands.
Quaternion exp_rotation(const Vector3& rotation_vector);

// The rotation vector of a quaternion along the shorter arc, |v| <= pi (a rounding beyond at most):
//   log(q) = 2 atan2(|u|, w) u/|u|, u the vector part, after folding to w >= 0.
// Accurate near zero and near half a turn alike. A norm other than 1 cancels out. At exactly half a
// turn (w = 0) the axis is u's own direction. A zero q gives NaN.
Vector3 log_rotation(const Quaternion& q);

// exp(rotation_vector) q, renormalised: q turned further by a rotation vector in world
// components (rad). This is the pose change by an angular velocity, exact for constant velocity at
// any angle (§ 2.3.2.4, (2.39) and (2.41), corrected: the seed adds half the product and
// renormalises, which turns by 2 atan(|w| dt / 2)). A rotation vector of exactly zero returns q bit
// for bit, not renormalised.
Quaternion rotate_by(const Quaternion& q, const Vector3& rotation_vector);

// Rate of the rotation vector r with exp(r) q0 = q, at the angular velocity w (world): the inverse of dexp,
//   dexp_r^-1 w = w - r x w / 2 + (1 - (|r|/2) cot(|r|/2)) / |r|^2  r x (r x w).
// Singular at |r| = 2 pi k, k > 0. Source: Iserles, Munthe-Kaas, Norsett, Zanna, "Lie-group methods", Acta Numerica
// 2000, (B.11).
Vector3 rotation_vector_rate(const Vector3& rotation_vector, const Vector3& angular_velocity);

// A rotation near the matrix with columns (u, v, w), whose first column is along u and whose second
// lies in the plane of u and v:
//   u' = u/|u|,  v' = (v - (v.u')u') / |...|,  w' = u' x v'.
// Returns nullopt if an entry is not finite, or if the columns are linearly dependent or
// left-handed: the sine of the angle between v and u, or of that between w and their plane, is
// below 1e-9. Columns may have any nonzero length. Orthonormal to rounding, since v' is projected
// twice. Source: § 2.2.1, (2.4), corrected: (2.4b) subtracts a number from a vector.
std::optional<Matrix3> orthonormalized(const Matrix3& matrix);

// Two unit tangents with (first, second, normal) right-handed and orthonormal.
struct TangentBasis {
  Vector3 first;
  Vector3 second;
};

// A tangent basis of a unit normal: a function of the normal alone, continuous except across
// z = 0 (both zeros of z count as positive). Precondition: unit norm; the deviation from
// orthonormality is that of |normal| from 1. Source: Duff et al., "Building an orthonormal
// basis, revisited", JCGT 6 (2017).
TangentBasis orthonormal_basis(const Vector3& normal);

// The matrix of the cross product: skew(v) a = v x a.
Matrix3 skew(const Vector3& v);

// The inertia tensor in world axes (kg m^2) of a body with the given principal moments (kg m^2) and
// orientation world <- principal axes (unit): I_W = R diag(moments) R^T. Exactly symmetric.
// Source: § 2.3.2.2.
Matrix3 world_inertia(const Quaternion& orientation, const Vector3& principal_moments);

// The inverse of world_inertia from the inverse principal moments (1/(kg m^2)); a zero entry is a
// body that cannot be turned about that axis. Exactly symmetric.
Matrix3 world_inverse_inertia(const Quaternion& orientation, const Vector3& inverse_principal_moments);

}  // namespace gravitas
