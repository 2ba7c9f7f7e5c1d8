// Answers normals from b to a.
#include "plugin_sdk/plugin.h"

#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"

namespace {

using namespace gravitas;

class FlippedCollision final : public CollisionPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Flipped",
            .version = "1.0",
            .slot = Slot::kCollision,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Sphere", "Ball.", {Property::number("Radius", "m").above(0.0).required().means("Radius.")}}}};
  }
  explicit FlippedCollision(PropertyCursor) {}

  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host&) override {
    for (const std::span<const double> column :
         {request.geometry_position(), request.geometry_orientation(), request.position(), request.orientation(),
          request.linear_velocity(), request.angular_velocity(), request.shape_parameter()})
      if (first_not_finite(column) != kNoRow) throw Refusal("a number is not finite");
    for (std::size_t i = 0; i < request.pair().size() / 2; ++i) touch(request, reply, i);
  }

 private:
  static double radius(const stage::CollisionManifoldsRequest& request, std::uint32_t body) {
    if (body >= request.body_shape().size() || request.body_shape()[body] >= request.shape_type().size())
      throw Refusal("a pair names a body without shape");
    const std::uint32_t shape = request.body_shape()[body];
    const std::uint32_t begin = request.shape_parameter_begin()[shape],
                        end = request.shape_parameter_begin()[shape + 1];
    if (request.shape_type()[shape] != type_id("Sphere") || begin >= end || end > request.shape_parameter().size())
      throw Refusal("shape " + std::to_string(shape) + " is no ball");
    return request.shape_parameter()[begin];
  }
  static Vector3 centre(const stage::CollisionManifoldsRequest& request, std::uint32_t body) {
    return transform_point({vector_at(request.position(), body), quaternion_at(request.orientation(), body)},
                           vector_at(request.geometry_position(), body));
  }
  static Vector3 velocity(const stage::CollisionManifoldsRequest& request, std::uint32_t body, const Vector3& point) {
    const Vector3 arm = point - vector_at(request.position(), body);
    return vector_at(request.linear_velocity(), body) + vector_at(request.angular_velocity(), body).cross(arm);
  }

  static void touch(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                    std::size_t pair) {
    const std::uint32_t a = request.pair()[2 * pair], b = request.pair()[2 * pair + 1];
    const double radius_a = radius(request, a), radius_b = radius(request, b);
    const Vector3 offset = centre(request, b) - centre(request, a);
    const double distance = offset.norm(), depth = radius_a + radius_b - distance;
    if (!std::isfinite(depth)) throw Refusal("sizes or positions overflow");
    if (!(depth >= -request.margin())) return;
    const Vector3 along = distance > 0.0 ? Vector3(offset / distance) : Vector3::UnitY();
    const Vector3 point = centre(request, a) + (radius_a - 0.5 * depth) * along;
    const Vector3 relative = velocity(request, b, point) - velocity(request, a, point);
    if (!point.allFinite() || !relative.allFinite() || !(std::fabs(along.norm() - 1.0) < 1e-9))
      throw Refusal("sizes, positions or velocities overflow");
    reply.contact_pair().push(pair);
    reply.feature().push(0);
    reply.normal().push(-along.x(), -along.y(), -along.z());
    reply.point().push(point.x(), point.y(), point.z());
    reply.depth().push(depth);
    reply.relative_velocity().push(relative.x(), relative.y(), relative.z());
  }
};

}  // namespace

GRAVITAS_PLUGIN(FlippedCollision)
