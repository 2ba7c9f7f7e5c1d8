// Poses to and from homogeneous matrices (§ 2.2.2, (2.15) and (2.16)). The matrix side comes from
// files and other programs, so it is checked before it is believed.
#include "plugin_sdk/math/pose.h"

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kRigidTolerance = 1e-3;

}  // namespace

Matrix4 to_matrix(const Pose& X_AB) {
  Matrix4 result = Matrix4::Identity();
  result.topLeftCorner<3, 3>() = to_rotation_matrix(X_AB.orientation);
  result.topRightCorner<3, 1>() = X_AB.position;
  return result;
}

std::optional<Pose> from_matrix(const Matrix4& matrix) {
  if (!matrix.allFinite()) return std::nullopt;
  if (matrix.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) return std::nullopt;
  const Matrix3 R = matrix.topLeftCorner<3, 3>();
  const Matrix3 excess = R.transpose() * R - Matrix3::Identity();
  // an overflow in the product fails the comparison too
  if (!(excess.cwiseAbs().maxCoeff() <= kRigidTolerance)) return std::nullopt;
  const std::optional<Matrix3> rotation = orthonormalized(R);
  if (!rotation) return std::nullopt;
  return Pose{matrix.topRightCorner<3, 1>(), to_quaternion(*rotation)};
}

}  // namespace gravitas
