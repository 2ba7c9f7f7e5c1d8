#include "plugin_sdk/joint_load.h"

#include <algorithm>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {

JointLoad joint_load(const DiscrepancyColumns& rows, std::span<const double> impulses, std::size_t first,
                     std::size_t end, const JointBody& body1, const JointBody& body2, double time_step) {
  const auto inertia = [](const JointBody& body) {
    return InverseInertia{body.inverse_mass, world_inverse_inertia(body.trial.orientation, body.inverse_moments)};
  };
  const InverseInertia inertia1 = inertia(body1), inertia2 = inertia(body2);
  JointLoad load;
  Vector3 sum = Vector3::Zero();
  for (std::size_t row = first; row < end; ++row) {
    const Discrepancy discrepancy = rows.at(row);
    const Vector3 impulse = discrepancy.axes * vector_at(impulses, row);
    load.error = std::max(
        load.error, joint_error(discrepancy, error_at(discrepancy, body1.trial, body2.trial, body1.next, body2.next)));
    load.held = std::max(load.held, held_back(discrepancy, impulse, time_step, body1.trial.position, inertia1,
                                              body2.trial.position, inertia2));
    if (!discrepancy.is_angular()) sum += impulse;
  }
  load.force = sum.norm() / time_step;
  return load;
}

}  // namespace gravitas
