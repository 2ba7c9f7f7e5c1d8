// The pose of one frame in another, with composition, inversion and the conversion to and from the
// homogeneous matrix that scene files and renderers use. A pose is kept as a point and a unit
// quaternion, because seven numbers cannot shear or scale and are renormalised cheaply.
//
// Notation: X_AB is the pose of frame B in frame A, so p_A = X_AB.orientation * p_B +
// X_AB.position. Adjacent letters cancel: X_AC = compose(X_AB, X_BC).
#pragma once

#include <optional>

#include "plugin_sdk/math/types.h"

namespace gravitas {

// X_AB: the origin of B in A (m) and the rotation that takes B's components to A's components
// (unit norm). The default is the identity.
struct Pose {
  Vector3 position = Vector3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

// X_AC = X_AB X_BC. The orientation is the plain quaternion product: its norm drifts by a rounding
// error per product, so a caller that composes along an unbounded chain applies normalized() from
// plugin_sdk/math/rotation.h.
inline Pose compose(const Pose& X_AB, const Pose& X_BC) {
  return Pose{X_AB.orientation * X_BC.position + X_AB.position, X_AB.orientation * X_BC.orientation};
}

// X_BA from X_AB. Precondition: unit orientation (the conjugate is taken for the inverse).
inline Pose inverse(const Pose& X_AB) {
  const Quaternion q_BA = X_AB.orientation.conjugate();
  return Pose{-(q_BA * X_AB.position), q_BA};
}

// p_A from p_B (m).
inline Vector3 transform_point(const Pose& X_AB, const Vector3& p_B) { return X_AB.orientation * p_B + X_AB.position; }

// p_B from p_A (m). Precondition: unit orientation.
inline Vector3 inverse_transform_point(const Pose& X_AB, const Vector3& p_A) {
  return X_AB.orientation.conjugate() * (p_A - X_AB.position);
}

// X_AB from the poses of both frames in W: inverse(X_WA) composed with X_WB. The difference of the
// positions is taken before the rotation, so two frames close together far from the origin keep
// their accuracy.
inline Pose relative(const Pose& X_WA, const Pose& X_WB) {
  return Pose{inverse_transform_point(X_WA, X_WB.position), X_WA.orientation.conjugate() * X_WB.orientation};
}

// The homogeneous matrix [R p; 0 0 0 1] with p_A = R p_B + p. Precondition: unit orientation.
Matrix4 to_matrix(const Pose& X_AB);

// The pose of a homogeneous matrix, or nullopt if the matrix is no rigid transform: an entry is not
// finite, the last row is not exactly (0, 0, 0, 1), or the upper left block R is mirrored or
// deviates from a rotation by more than 1e-3 in any entry of RᵀR - 1. Within that bound R is
// orthonormalised, so that matrices written in single precision or in a few decimals load.
std::optional<Pose> from_matrix(const Matrix4& matrix);

}  // namespace gravitas
