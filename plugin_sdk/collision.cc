#include "plugin_sdk/collision.h"

#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/checks.h"

namespace gravitas::collision {
namespace {

constexpr double kMostTurning = 1e8;  // rad: rounded to 1e-8 rad, the angles say where a metre is to 1e-8 m
constexpr double kFarthest = 1e100;   // m: squares of lengths stay finite

void require_finite(const char* row, const char* what, std::span<const double> column, std::size_t components) {
  const std::size_t i = first_not_finite(column);
  if (i != kNoRow) throw Refusal(row + std::to_string(i / components) + " has a " + what + " that is not finite");
}

// `row` of `what` names the body.
void require_shape(const ShapeColumns& shapes, const BodyColumns& bodies, std::uint32_t body, const char* what,
                   std::size_t row) {
  if (body >= bodies.body_shape.size() || bodies.body_shape[body] >= shapes.shape_type.size())
    throw Refusal(what + std::to_string(row) + " names a body without shape");
}

void check_bodies(const BodyColumns& bodies) {
  require_finite("body ", "geometry position", bodies.geometry_position, 3);
  require_finite("body ", "geometry orientation", bodies.geometry_orientation, 4);
  require_finite("body ", "position", bodies.position, 3);
  require_finite("body ", "orientation", bodies.orientation, 4);
}

template <typename Request>
void check_pairs(const Request& request) {
  const ShapeColumns shapes = shapes_of(request);
  const BodyColumns bodies = bodies_of(request);
  for (std::size_t i = 0; i < request.pair().size(); ++i)
    require_shape(shapes, bodies, request.pair()[i], "pair ", i / 2);
  check_bodies(bodies);
}

void push(const stage::ReplyColumn<double>& column, const Vector3& v) { column.push(v.x(), v.y(), v.z()); }

}  // namespace

std::span<const double> ShapeColumns::parameters(std::size_t shape) const {
  const std::span<const std::uint32_t> begin = shape_parameter_begin;
  if (shape + 1 >= begin.size() || begin[shape] > begin[shape + 1] || begin[shape + 1] > shape_parameter.size())
    throw Refusal("the parameters of shape " + std::to_string(shape) + " lie outside their column");
  return shape_parameter.subspan(begin[shape], begin[shape + 1] - begin[shape]);
}

Motion motion_of(const stage::CollisionTimesOfImpactRequest& request, std::uint32_t body) {
  const bool is_ball = request.shape_type()[request.body_shape()[body]] == type_id("Sphere");
  const bool turns = !is_ball || !vector_at(request.geometry_position(), body).isZero(0.0);
  return {vector_at(request.displacement(), body), turns ? vector_at(request.rotation(), body) : Vector3::Zero()};
}

void check_request(const stage::CollisionManifoldsRequest& request) {
  check_pairs(request);
  if (!(request.margin() >= 0.0)) throw Refusal("the margin is negative, or no number");
  require_finite("body ", "linear velocity", request.linear_velocity(), 3);
  require_finite("body ", "angular velocity", request.angular_velocity(), 3);
}

void check_request(const stage::CollisionTimesOfImpactRequest& request) {
  check_pairs(request);
  if (!(request.target_gap() >= 0.0) || !std::isfinite(request.target_gap()))
    throw Refusal("the target gap is negative, or no finite number");
  const BodyColumns bodies = bodies_of(request);
  for (const std::span<const double> lengths : {bodies.geometry_position, bodies.position, request.displacement()})
    for (std::size_t i = 0; i < lengths.size(); ++i)
      if (!(std::fabs(lengths[i]) <= kFarthest))
        throw Refusal("body " + std::to_string(i / 3) + " is, or goes, farther than 1e100 m");
  require_finite("body ", "rotation", request.rotation(), 3);
  for (const std::uint32_t body : request.pair())
    if (!(motion_of(request, body).rotation.squaredNorm() <= kMostTurning * kMostTurning))
      throw Refusal("body " + std::to_string(body) +
                    " turns by more than 1e8 rad in the interval; allowed: a shorter TimeStep");
}

void check_request(const stage::CollisionRaysRequest& request) {
  const ShapeColumns shapes = shapes_of(request);
  const BodyColumns bodies = bodies_of(request);
  const std::size_t rays = request.length().size();
  for (std::size_t i = 0; i < request.candidate().size(); i += 2) {
    if (request.candidate()[i] >= rays)
      throw Refusal("candidate " + std::to_string(i / 2) + " names a ray that does not exist");
    require_shape(shapes, bodies, request.candidate()[i + 1], "candidate ", i / 2);
  }
  check_bodies(bodies);
  require_finite("ray ", "origin", request.origin(), 3);
  require_finite("ray ", "length", request.length(), 1);
  for (std::size_t i = 0; i < rays; ++i) {
    if (!(request.length()[i] >= 0.0)) throw Refusal("ray " + std::to_string(i) + " has a negative length");
    if (!(std::fabs(vector_at(request.direction(), i).squaredNorm() - 1.0) <= 1e-9))
      throw Refusal("ray " + std::to_string(i) + " has a direction that is no unit vector");
  }
}

void check_request(const stage::CollisionDebugGeometryRequest& request) {
  if (!(request.extent() >= 0.0) || !std::isfinite(request.extent()))
    throw Refusal("the extent is negative, or no finite number");
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
  reply.contact_pair().push(static_cast<std::uint32_t>(pair));
  reply.feature().push(contact.feature);
  push(reply.normal(), contact.normal);
  push(reply.point(), contact.point);
  reply.depth().push(contact.depth);
  push(reply.relative_velocity(), relative);
}

void write_impact(const stage::CollisionTimesOfImpactReply& reply, std::size_t pair, const Impact& impact) {
  if (!impact.point.allFinite() || !impact.normal.allFinite() || !std::isfinite(impact.depth) ||
      !std::isfinite(impact.fraction))
    throw Refusal("the impact of pair " + std::to_string(pair) +
                  " is not finite: sizes, positions or motions overflow");
  reply.impact_pair().push(static_cast<std::uint32_t>(pair));
  reply.fraction().push(impact.fraction);
  push(reply.normal(), impact.normal);
  push(reply.point(), impact.point);
  reply.depth().push(impact.depth);
}

void write_hit(const stage::CollisionRaysReply& reply, std::size_t candidate, const RayHit& hit) {
  if (!hit.normal.allFinite() || !std::isfinite(hit.distance))
    throw Refusal("the hit of candidate " + std::to_string(candidate) + " is not finite: sizes or positions overflow");
  reply.hit_candidate().push(static_cast<std::uint32_t>(candidate));
  reply.distance().push(hit.distance);
  push(reply.normal(), hit.normal);
}

void write_outline(const stage::CollisionDebugGeometryReply& reply, std::size_t shape,
                   std::span<const LineSegment> lines) {
  for (const LineSegment& line : lines) {
    if (!line[0].allFinite() || !line[1].allFinite())
      throw Refusal("a line of shape " + std::to_string(shape) + " is not finite: sizes overflow");
    reply.line_shape().push(shape);
    push(reply.line_from(), line[0]);
    push(reply.line_to(), line[1]);
  }
}

void write_debug_geometry(const stage::CollisionDebugGeometryRequest& request,
                          const stage::CollisionDebugGeometryReply& reply, std::size_t shape, const SceneShape& known) {
  if ((request.kinds() & kOutlines) != 0) {
    std::vector<LineSegment> lines;
    append_outline(known, {}, request.extent(), &lines);
    write_outline(reply, shape, lines);
  }
  if ((request.kinds() & kTrees) == 0) return;
  std::vector<OutlineNode> nodes;
  append_tree(known, {}, &nodes);
  for (const OutlineNode& node : nodes) {
    if (!node.pose.position.allFinite() || !node.half_extents.allFinite())
      throw Refusal("a node of shape " + std::to_string(shape) + " is not finite: sizes overflow");
    const Quaternion& q = node.pose.orientation;
    reply.node_shape().push(shape);
    reply.node_depth().push(node.depth);
    push(reply.node_centre(), node.pose.position);
    push(reply.node_half_extents(), node.half_extents);
    reply.node_orientation().push(q.w(), q.x(), q.y(), q.z());
  }
}

}  // namespace gravitas::collision
