// Collision `Standard` (§ 4.3): spheres, boxes, cylinders and half-spaces; see narrow_phase.h for
// the methods.
//
// Pairs are independent of each other, so they are computed on the host's threads, each into its
// own place, and written in order.
#include "plugin_sdk/plugin.h"

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "workers/collision/standard/narrow_phase.h"

namespace gravitas::collision {
namespace {

class Standard final : public CollisionPlugin {
 public:
  static PluginDeclaration declaration() {
    const auto length = [](const char* name, const char* meaning) {
      return Property::number(name, "m").above(0.0).required().means(meaning);
    };
    return {.name = "Standard",
            .version = "1.0",
            .slot = Slot::kCollision,
            .meaning = "Closed forms where there are any, separating axes and clipping elsewhere.",
            .types = {{"Sphere", "Ball about the origin.", {length("Radius", "Radius.")}},
                      {"Box",
                       "Cuboid about the origin.",
                       {Property::vector("HalfExtents", "m", "geometry")
                            .above(0.0)
                            .required()
                            .means("Half the edge along each axis.")}},
                      {"Cylinder",
                       "Cylinder about the y axis, centred on the origin.",
                       {length("Radius", "Radius."), length("Height", "Distance between the end faces.")}},
                      {"Halfspace", "Everything at y <= 0 of its frame is solid.", {}}}};
  }
  explicit Standard(PropertyCursor) {}

  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host& host) override {
    read_shapes(request);
    const std::span<const std::uint32_t> pair = request.pair();
    const std::size_t pairs = pair.size() / 2;
    check_pairs(request);
    check_bodies(request);
    manifolds_.resize(pairs);
    host.parallel_for(pairs, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) {
        const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
        collide(shapes_[request.body_shape()[a]], geometry_pose(request, a), shapes_[request.body_shape()[b]],
                geometry_pose(request, b), request.margin(), &manifolds_[i]);
      }
    });
    for (std::size_t i = 0; i < pairs; ++i)
      for (int k = 0; k < manifolds_[i].count; ++k)
        write_contact(request, reply, i, manifolds_[i].contacts[static_cast<std::size_t>(k)]);
  }

 private:
  void read_shapes(const stage::CollisionManifoldsRequest& request) {
    shapes_.clear();
    const std::span<const std::uint32_t> begin = request.shape_parameter_begin();
    const std::span<const double> parameters = request.shape_parameter();
    for (std::size_t i = 0; i < request.shape_type().size(); ++i) {
      if (i + 1 >= begin.size() || begin[i] > begin[i + 1] || begin[i + 1] > parameters.size())
        throw Refusal("the parameters of shape " + std::to_string(i) + " lie outside their column");
      shapes_.push_back(read_shape(request.shape_type()[i],
                                   PropertyCursor(parameters.subspan(begin[i], begin[i + 1] - begin[i])), i));
    }
  }

  static Shape read_shape(std::uint64_t type, PropertyCursor parameters, std::size_t row) {
    Shape shape;
    if (type == type_id("Sphere")) {
      shape.size = Vector3::Constant(parameters.number());
    } else if (type == type_id("Box")) {
      shape = {ShapeType::kBox, parameters.vector()};
    } else if (type == type_id("Cylinder")) {
      const double radius = parameters.number();
      shape = {ShapeType::kCylinder, Vector3(radius, 0.5 * parameters.number(), radius)};
    } else if (type == type_id("Halfspace")) {
      return {ShapeType::kHalfspace, Vector3::Ones()};
    } else {
      throw Refusal("shape " + std::to_string(row) + " is of a type that this plugin does not know");
    }
    if (!shape.size.allFinite() || !(shape.size.minCoeff() > 0.0))
      throw Refusal("shape " + std::to_string(row) + " has a size that is not finite and positive");
    return shape;
  }

  void check_pairs(const stage::CollisionManifoldsRequest& request) const {
    const std::size_t bodies = request.body_shape().size();
    for (std::size_t i = 0; i < request.pair().size(); ++i) {
      const std::uint32_t body = request.pair()[i];
      if (body >= bodies || request.body_shape()[body] >= shapes_.size())
        throw Refusal("pair " + std::to_string(i / 2) + " names a body without shape");
    }
    if (!(request.margin() >= 0.0)) throw Refusal("the margin is negative, or no number");
  }

  static void check_bodies(const stage::CollisionManifoldsRequest& request) {
    const auto require_finite = [](const char* what, std::span<const double> column, std::size_t components) {
      const std::size_t i = first_not_finite(column);
      if (i != kNoRow)
        throw Refusal("body " + std::to_string(i / components) + " has a " + what + " that is not finite");
    };
    require_finite("geometry position", request.geometry_position(), 3);
    require_finite("geometry orientation", request.geometry_orientation(), 4);
    require_finite("position", request.position(), 3);
    require_finite("orientation", request.orientation(), 4);
    require_finite("linear velocity", request.linear_velocity(), 3);
    require_finite("angular velocity", request.angular_velocity(), 3);
  }

  static Pose geometry_pose(const stage::CollisionManifoldsRequest& request, std::uint32_t body) {
    const Pose body_pose{vector_at(request.position(), body), quaternion_at(request.orientation(), body)};
    return compose(body_pose,
                   {vector_at(request.geometry_position(), body), quaternion_at(request.geometry_orientation(), body)});
  }

  static void write_contact(const stage::CollisionManifoldsRequest& request,
                            const stage::CollisionManifoldsReply& reply, std::size_t pair,
                            const ContactPoint& contact) {
    const auto velocity = [&](std::uint32_t body) {
      const Vector3 arm = contact.point - vector_at(request.position(), body);
      return Vector3(vector_at(request.linear_velocity(), body) +
                     vector_at(request.angular_velocity(), body).cross(arm));
    };
    const Vector3 relative = velocity(request.pair()[2 * pair + 1]) - velocity(request.pair()[2 * pair]);
    if (!relative.allFinite() || !contact.point.allFinite() || !std::isfinite(contact.depth))
      throw Refusal("a contact of pair " + std::to_string(pair) +
                    " is not finite: sizes, positions or velocities overflow");
    const auto push = [](const stage::ReplyColumn<double>& column, const Vector3& v) {
      column.push(v.x(), v.y(), v.z());
    };
    reply.contact_pair().push(pair);
    reply.feature().push(contact.feature);
    push(reply.normal(), contact.normal);
    push(reply.point(), contact.point);
    reply.depth().push(contact.depth);
    push(reply.relative_velocity(), relative);
  }

  // scratch, filled anew in every call
  std::vector<Shape> shapes_;
  std::vector<Manifold> manifolds_;
};

}  // namespace
}  // namespace gravitas::collision

GRAVITAS_PLUGIN(gravitas::collision::Standard)
