#include "kernel/state.h"

#include <algorithm>

namespace gravitas::kernel {

State::State(Arena* arena, const EnvironmentDescription& d) {
  const std::uint64_t n = d.bodies.size();
  const std::uint64_t joints = d.constraints.size();
  // room that ordinary scenes do not outgrow (commit makes more), and none where nothing can touch
  const std::uint64_t contacts = d.collision.plugins.empty() ? 0 : std::max<std::uint64_t>(16, 8 * n);
  position = Column<double>(arena, 3 * n, 0), orientation = Column<double>(arena, 4 * n, 0);
  linear_velocity = Column<double>(arena, 3 * n, 0), angular_velocity = Column<double>(arena, 3 * n, 0);
  intact = Column<std::uint32_t>(arena, joints, 0);
  plugin_state = Column<double>(arena, 0, 0);
  state_changed = Column<std::uint32_t>(arena, n, 0);
  contact_body = Column<std::uint32_t>(arena, 0, 2 * contacts);
  contact_feature = Column<std::uint32_t>(arena, 0, contacts);
  contact_key = Column<std::uint64_t>(arena, 0, contacts);
  contact_impulse = Column<double>(arena, 0, 3 * contacts);
  contact_correction = Column<double>(arena, 0, contacts);
  discrepancy_constraint = Column<std::uint32_t>(arena, 0, 8 * joints);
  discrepancy_impulse = Column<double>(arena, 0, 24 * joints);
  discrepancy_correction = Column<double>(arena, 0, 24 * joints);
  touching = Column<std::uint32_t>(arena, 0, 2 * contacts);
  rested = Column<std::uint32_t>(arena, d.sleep.energy > 0.0 ? n : 0, 0);
  rest_wrench = Column<double>(arena, 0, d.sleep.energy > 0.0 && !d.force.plugins.empty() ? 6 * n : 0);
}

void State::write(const EnvironmentDescription& d) const {
  for (std::size_t i = 0; i < d.bodies.size(); ++i) {
    const BodyDescription& body = d.bodies[i];
    set_vector(position.span(), i, body.pose.position);
    set_quaternion(orientation.span(), i, body.pose.orientation);
    set_vector(linear_velocity.span(), i, body.twist.linear);
    set_vector(angular_velocity.span(), i, body.twist.angular);
  }
  std::ranges::fill(intact.span(), 1U);
  for (const Column<double>* column : {&position, &orientation, &linear_velocity, &angular_velocity})
    for (double& value : column->span()) value += 0.0;  // -0 is 0
}

}  // namespace gravitas::kernel
