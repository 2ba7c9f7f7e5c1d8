// How wrenches change with the states of bodies, and what that makes of their accelerations: for implicit integrators.
//
// A state is moved by (dx, r, dv, dw) in world axes: x + dx, exp(r) q, v + dv, w + dw. A wrench is (force, torque about the
// centre of mass) in world axes, so a block d(wrench of a)/d(state of b) has six rows and twelve columns.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/pose.h"
#include "schemas/stage_frames.h"

namespace gravitas {

inline constexpr std::size_t kBlockNumbers = 72;
inline constexpr std::size_t kMostBlocksOfApplication = 4;
// Bodies of a scene with joints that answer in derivatives: with more, blocks for all pairs are more than one would move.
inline constexpr std::size_t kMostJoinedBodies = 128;
using JacobianBlock = Eigen::Matrix<double, 6, 12, Eigen::RowMajor>;

// The blocks of all wrenches in one state (Integrator.Derivative), those of joints' reactions included; blocks of the same
// two bodies are summed by who uses them. Bodies that are in no block feel nobody.
class WrenchJacobian {
 public:
  // False where it cannot be had: differences of wrenches do then.
  bool is_known() const { return is_known_; }
  std::size_t size() const { return bodies_.size() / 2; }
  // Whose wrench, and by whose state.
  std::uint32_t body(std::size_t block) const { return bodies_[2 * block]; }
  std::uint32_t by(std::size_t block) const { return bodies_[2 * block + 1]; }
  Eigen::Map<const JacobianBlock> operator[](std::size_t block) const {
    return Eigen::Map<const JacobianBlock>(&numbers_[kBlockNumbers * block]);
  }

 private:
  friend class Derivatives;  // fills it

  bool is_known_ = false;
  std::vector<std::uint32_t> bodies_;
  std::vector<double> numbers_;
};

// Moves number 0 ... 11 of (dx, r, dv, dw).
void move_state(int number, double by, Pose* pose, Twist* twist);

// d(linear, angular acceleration)/d(state) of a body under a wrench that stays as it is in world axes: what the moving
// inertia and the gyroscopic term make,
//
//   d alpha = r x alpha - I^-1 (r x u + w x (r x I w - I (r x w)) + dw x I w + w x I dw),    u = tau - w x I w.
JacobianBlock acceleration_jacobian(const Quaternion& orientation, const Vector3& angular_velocity,
                                    const Vector3& inertia, const Vector3& inverse_inertia, const Vector3& torque);

// d(accelerations)/d(state) from d(wrench)/d(state).
JacobianBlock accelerated_block(const Quaternion& orientation, double inverse_mass, const Vector3& inverse_inertia,
                                const JacobianBlock& block);

}  // namespace gravitas
