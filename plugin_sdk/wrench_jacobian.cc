#include "plugin_sdk/wrench_jacobian.h"

#include "plugin_sdk/math/rotation.h"

namespace gravitas {

void move_state(int number, double by, Pose* pose, Twist* twist) {
  const Vector3 change = by * Vector3::Unit(number % 3);
  if (number < 3) *pose = displaced(*pose, change, Vector3::Zero());
  if (number >= 3 && number < 6) *pose = displaced(*pose, Vector3::Zero(), change);
  if (number >= 6) (number < 9 ? twist->linear : twist->angular) += change;
}

JacobianBlock acceleration_jacobian(const Quaternion& orientation, const Vector3& angular_velocity,
                                    const Vector3& inertia, const Vector3& inverse_inertia, const Vector3& torque) {
  const Matrix3 moments = world_inertia(orientation, inertia);
  const Matrix3 inverse = world_inverse_inertia(orientation, inverse_inertia);
  const Vector3 &w = angular_velocity, momentum = moments * w, left = torque - w.cross(momentum);
  JacobianBlock block = JacobianBlock::Zero();
  // columns of r: -(a x r) of what turns along
  const Matrix3 turned_momentum = moments * skew(w) - skew(momentum);
  block.block<3, 3>(3, 3) = inverse * (skew(left) - skew(w) * turned_momentum) - skew(inverse * left);
  block.block<3, 3>(3, 9) = inverse * (skew(momentum) - skew(w) * moments);
  return block;
}

JacobianBlock accelerated_block(const Quaternion& orientation, double inverse_mass, const Vector3& inverse_inertia,
                                const JacobianBlock& block) {
  JacobianBlock accelerated;
  accelerated.topRows<3>() = inverse_mass * block.topRows<3>();
  accelerated.bottomRows<3>() = world_inverse_inertia(orientation, inverse_inertia) * block.bottomRows<3>();
  return accelerated;
}

}  // namespace gravitas
