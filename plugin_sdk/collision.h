// What every collision plugin does with its requests and replies beside geometry: rows checked, poses composed, answers
// written. All throw Refusal with the reason.
#pragma once

#include <span>

#include "plugin_sdk/body.h"
#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/geometry/outline.h"
#include "plugin_sdk/geometry/ray.h"
#include "plugin_sdk/geometry/time_of_impact.h"
#include "plugin_sdk/math/motion.h"
#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::collision {

// The columns that all requests of the slot have, named as there.
struct ShapeColumns {
  std::span<const std::uint64_t> shape_hash, shape_type;
  std::span<const std::uint32_t> shape_parameter_begin;
  std::span<const double> shape_parameter;

  // The flattened properties of a shape.
  std::span<const double> parameters(std::size_t shape) const;
};

struct BodyColumns {
  std::span<const std::uint32_t> body_shape;
  std::span<const double> geometry_position, geometry_orientation, position, orientation;

  Pose pose(std::uint32_t body) const { return {vector_at(position, body), quaternion_at(orientation, body)}; }
  // Of a body's shape in its body, and in the world.
  Pose geometry(std::uint32_t body) const {
    return {vector_at(geometry_position, body), quaternion_at(geometry_orientation, body)};
  }
  Pose placed(std::uint32_t body) const {
    // most shapes lie in their body as they are: composing with the identity would change no bit
    const Pose X_WB = pose(body), X_BS = geometry(body);
    const bool is_same = X_BS.position.isZero(0.0) && X_BS.orientation.w() == 1.0 && X_BS.orientation.vec().isZero(0.0);
    return is_same ? X_WB : compose(X_WB, X_BS);
  }
};

template <typename Request>
ShapeColumns shapes_of(const Request& request) {
  return {request.shape_hash(), request.shape_type(), request.shape_parameter_begin(), request.shape_parameter()};
}
template <typename Request>
BodyColumns bodies_of(const Request& request) {
  return {request.body_shape(), request.geometry_position(), request.geometry_orientation(), request.position(),
          request.orientation()};
}
// A shape cast is a time of impact without rotation: the body that is cast has the displacement of the cast, the others
// rest. A sweep that turns on its way is asked the same way.
// A ball about its centre does not turn: it is the same in all attitudes.
Motion motion_of(const stage::CollisionTimesOfImpactRequest& request, std::uint32_t body);

inline Ray ray_of(const stage::CollisionRaysRequest& request, std::uint32_t ray) {
  return {vector_at(request.origin(), ray), vector_at(request.direction(), ray), request.length()[ray]};
}

// Bits of CollisionDebugGeometryRequest.kinds.
enum DebugKind : std::uint32_t { kOutlines = 1U << 0, kTrees = 1U << 1 };

// The pairs (or candidates) name bodies with shapes, the margin (or target) is one, and every number of a body is
// finite; of rays, that they exist and have unit directions; of motions, that what is in a pair turns
// by no more than 1e8 rad and all stay within 1e100 m; the extent of debug geometry is finite and not negative.
void check_request(const stage::CollisionManifoldsRequest& request);
void check_request(const stage::CollisionTimesOfImpactRequest& request);
void check_request(const stage::CollisionRaysRequest& request);
void check_request(const stage::CollisionDebugGeometryRequest& request);

// Appends a contact of a pair, with the velocity of b relative to a at its point.
void write_contact(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                   std::size_t pair, const ContactPoint& contact);
void write_impact(const stage::CollisionTimesOfImpactReply& reply, std::size_t pair, const Impact& impact);
void write_hit(const stage::CollisionRaysReply& reply, std::size_t candidate, const RayHit& hit);
// Appends what is asked for of a shape of the scene language, or the lines of another one.
void write_debug_geometry(const stage::CollisionDebugGeometryRequest& request,
                          const stage::CollisionDebugGeometryReply& reply, std::size_t shape, const SceneShape& known);
void write_outline(const stage::CollisionDebugGeometryReply& reply, std::size_t shape,
                   std::span<const LineSegment> lines);

}  // namespace gravitas::collision
