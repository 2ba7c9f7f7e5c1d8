#include "plugin_sdk/collision.h"

#include <cmath>
#include <string>

#include "plugin_sdk/checks.h"

namespace gravitas::collision {
namespace {

void require_finite(const char* what, std::span<const double> column, std::size_t components) {
  const std::size_t i = first_not_finite(column);
  if (i != kNoRow) throw Refusal("body " + std::to_string(i / components) + " has a " + what + " that is not finite");
}

}  // namespace

std::span<const double> shape_parameters(const stage::CollisionManifoldsRequest& request, std::size_t shape) {
  const std::span<const std::uint32_t> begin = request.shape_parameter_begin();
  const std::span<const double> parameters = request.shape_parameter();
  if (shape + 1 >= begin.size() || begin[shape] > begin[shape + 1] || begin[shape + 1] > parameters.size())
    throw Refusal("the parameters of shape " + std::to_string(shape) + " lie outside their column");
  return parameters.subspan(begin[shape], begin[shape + 1] - begin[shape]);
}

void check_bodies(const stage::CollisionManifoldsRequest& request) {
  const std::size_t bodies = request.body_shape().size(), shapes = request.shape_type().size();
  for (std::size_t i = 0; i < request.pair().size(); ++i) {
    const std::uint32_t body = request.pair()[i];
    if (body >= bodies || request.body_shape()[body] >= shapes)
      throw Refusal("pair " + std::to_string(i / 2) + " names a body without shape");
  }
  if (!(request.margin() >= 0.0)) throw Refusal("the margin is negative, or no number");
  require_finite("geometry position", request.geometry_position(), 3);
  require_finite("geometry orientation", request.geometry_orientation(), 4);
  require_finite("position", request.position(), 3);
  require_finite("orientation", request.orientation(), 4);
  require_finite("linear velocity", request.linear_velocity(), 3);
  require_finite("angular velocity", request.angular_velocity(), 3);
}

Pose geometry_pose(const stage::CollisionManifoldsRequest& request, std::uint32_t body) {
  const Pose body_pose{vector_at(request.position(), body), quaternion_at(request.orientation(), body)};
  return compose(body_pose,
                 {vector_at(request.geometry_position(), body), quaternion_at(request.geometry_orientation(), body)});
}

void write_contact(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                   std::size_t pair, const ContactPoint& contact) {
  const auto velocity = [&](std::uint32_t body) {
    const Vector3 arm = contact.point - vector_at(request.position(), body);
    return Vector3(vector_at(request.linear_velocity(), body) + vector_at(request.angular_velocity(), body).cross(arm));
  };
  const Vector3 relative = velocity(request.pair()[2 * pair + 1]) - velocity(request.pair()[2 * pair]);
  if (!relative.allFinite() || !contact.point.allFinite() || !std::isfinite(contact.depth) ||
      !contact.normal.allFinite())
    throw Refusal("a contact of pair " + std::to_string(pair) +
                  " is not finite: sizes, positions or velocities overflow");
  const auto push = [](const stage::ReplyColumn<double>& column, const Vector3& v) {
    column.push(v.x(), v.y(), v.z());
  };
  reply.contact_pair().push(static_cast<std::uint32_t>(pair));
  reply.feature().push(contact.feature);
  push(reply.normal(), contact.normal);
  push(reply.point(), contact.point);
  reply.depth().push(contact.depth);
  push(reply.relative_velocity(), relative);
}

}  // namespace gravitas::collision
