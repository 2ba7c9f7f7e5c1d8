// How far apart two surfaces that meet in a trial are in another state.
#include "kernel/environment.h"
#include "plugin_sdk/discrepancy.h"

namespace gravitas::kernel {

double Environment::gap_at(std::size_t contact, const State& state) const {
  const Vector3 point = vector_at(data_.contact_point.span(), contact);
  const Vector3 normal = vector_at(data_.contact_normal.span(), contact);
  const Vector3 half = 0.5 * data_.contact_depth[contact] * normal;
  const auto carry = [&](const Vector3& from, std::uint32_t body) {
    return carried(from, pose_of(data_.trial_position, data_.trial_orientation, body),
                   pose_of(state.position, state.orientation, body));
  };
  return normal.dot(carry(point - half, data_.contact_body[2 * contact + 1]) -
                    carry(point + half, data_.contact_body[2 * contact]));
}

}  // namespace gravitas::kernel
