#include "plugin_sdk/geometry/ray.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The part of a line inside a convex solid: an intersection of such parts.
struct Inside {
  double from = -kInfinity, to = kInfinity;
  Vector3 normal = Vector3::Zero();  // of the surface at `from`

  void enter(double t, const Vector3& n) {
    if (t > from) from = t, normal = n;
  }
  void leave(double t) { to = std::min(to, t); }
  bool is_empty() const { return !(from <= to); }
  void make_empty() { from = kInfinity, to = -kInfinity; }

  // The part below a plane: n . x <= offset.
  void clip(const Ray& ray, const Vector3& n, double offset) {
    const double rises = n.dot(ray.direction), above = n.dot(ray.origin) - offset;
    if (rises == 0.0) {
      if (above > 0.0) make_empty();
    } else if (rises < 0.0) {
      enter(-above / rises, n);
    } else {
      leave(-above / rises);
    }
  }

  std::optional<RayHit> hit(const Ray& ray) const {
    if (is_empty() || to < 0.0 || from > ray.length) return std::nullopt;
    if (from < 0.0) return RayHit{0.0, -ray.direction};
    return RayHit{from, normal};
  }
};

// The roots of a t^2 + 2 b t + c = 0, ascending; without cancellation.
struct Roots {
  double first, second;
};
std::optional<Roots> roots(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0.0) || a == 0.0) return std::nullopt;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  const double x = q / a, y = q != 0.0 ? c / q : x;
  return Roots{std::min(x, y), std::max(x, y)};
}

Vector3 point_at(const Ray& ray, double t) { return ray.origin + t * ray.direction; }
Vector3 unit(const Vector3& v) { return v / std::sqrt(v.squaredNorm()); }

Inside inside_ball(const Ray& ray, const Vector3& centre, double radius) {
  // from the point of the line nearest to the centre: far origins cancel no digits of the radius
  const Vector3 arm = ray.origin - centre;
  const double nearest = -arm.dot(ray.direction);
  const double off = (arm + nearest * ray.direction).squaredNorm();
  Inside part;
  if (!(off <= radius * radius)) {
    part.make_empty();
    return part;
  }
  const double half = std::sqrt(radius * radius - off);
  part.enter(nearest - half, unit(arm + (nearest - half) * ray.direction));
  part.leave(nearest + half);
  return part;
}

// The infinite cylinder of this radius about y.
Inside inside_tube(const Ray& ray, double radius) {
  const Vector3 d(ray.direction.x(), 0.0, ray.direction.z()), o(ray.origin.x(), 0.0, ray.origin.z());
  Inside part;
  const double squared = d.squaredNorm();
  if (!(squared > 0.0)) {
    if (!(o.squaredNorm() <= radius * radius)) part.make_empty();
    return part;
  }
  const double nearest = -o.dot(d) / squared, off = (o + nearest * d).squaredNorm();
  if (!(off <= radius * radius)) {
    part.make_empty();
    return part;
  }
  const double half = std::sqrt((radius * radius - off) / squared);
  part.enter(nearest - half, unit(o + (nearest - half) * d));
  part.leave(nearest + half);
  return part;
}

Inside inside_capsule(const Ray& ray, double radius, double half) {
  // the union of two balls and a cylinder is convex: its part of a line is the hull of theirs
  Inside tube = inside_tube(ray, radius);
  tube.clip(ray, Vector3::UnitY(), half);
  tube.clip(ray, -Vector3::UnitY(), half);
  const Inside top = inside_ball(ray, Vector3(0.0, half, 0.0), radius);
  const Inside bottom = inside_ball(ray, Vector3(0.0, -half, 0.0), radius);
  Inside whole;
  whole.make_empty();
  for (const Inside& part : {tube, top, bottom}) {
    if (part.is_empty()) continue;
    if (part.from < whole.from) whole.from = part.from, whole.normal = part.normal;
    whole.to = std::max(whole.to, part.to);
  }
  return whole;
}

// x^2 + z^2 <= (k (h - y))^2 below the apex at h, with k = r / (2 h), and above the base.
Inside inside_cone(const Ray& ray, double radius, double half) {
  Inside part;
  part.clip(ray, -Vector3::UnitY(), half);
  part.clip(ray, Vector3::UnitY(), half);
  if (part.is_empty()) return part;
  const double k = radius / (2.0 * half), kk = k * k;
  // from the place nearest to the centre, so that far origins cancel no digits
  const double nearest = -ray.origin.dot(ray.direction);
  const Vector3 &d = ray.direction, o = ray.origin + nearest * ray.direction - Vector3(0.0, half, 0.0);
  const double a = d.x() * d.x() + d.z() * d.z() - kk * d.y() * d.y();
  const double b = o.x() * d.x() + o.z() * d.z() - kk * o.y() * d.y();
  const double c = o.x() * o.x() + o.z() * o.z() - kk * o.y() * o.y();
  const auto normal = [&](double t) {
    const Vector3 x = o + t * d;
    const Vector3 outward(x.x(), -kk * x.y(), x.z());
    return outward.squaredNorm() > 0.0 ? unit(outward) : Vector3(Vector3::UnitY());
  };
  if (a == 0.0) {
    // along the slope: one crossing
    if (b == 0.0) {
      if (c > 0.0) part.make_empty();
    } else {
      const double t = -c / (2.0 * b);
      if (b < 0.0) part.enter(nearest + t, normal(t));
      if (b > 0.0) part.leave(nearest + t);
    }
    return part;
  }
  const std::optional<Roots> crossing = roots(a, b, c);
  if (a > 0.0) {
    if (!crossing) {
      part.make_empty();
      return part;
    }
    part.enter(nearest + crossing->first, normal(crossing->first));
    part.leave(nearest + crossing->second);
    return part;
  }
  // steeper than the slope: inside below the first crossing or beyond the second, whichever lies in the lower half
  if (!crossing) return part;
  if (d.y() < 0.0) {
    part.enter(nearest + crossing->second, normal(crossing->second));
  } else {
    part.leave(nearest + crossing->first);
  }
  return part;
}

std::optional<RayHit> hit_mesh(const TriangleMesh& mesh, const Ray& ray) {
  if (mesh.is_closed() && mesh.box().squared_distance(ray.origin) == 0.0 &&
      mesh.nearest(ray.origin).signed_distance < 0.0)
    return RayHit{0.0, -ray.direction};
  const std::optional<TriangleMesh::Hit> hit = mesh.cast_ray(ray.origin, ray.direction, ray.length);
  if (!hit) return std::nullopt;
  const Vector3& normal = mesh.normal(hit->triangle);
  return RayHit{hit->distance, normal.dot(ray.direction) > 0.0 ? Vector3(-normal) : normal};
}

// The end of the ray.
class EndMap final : public SupportMap {
 public:
  Vector3 support(const Vector3&) const override { return Vector3::Zero(); }
};

}  // namespace

std::optional<RayHit> cast_ray(const SceneShape& shape, const Ray& ray) {
  const Vector3& size = shape.size;
  Inside part;
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      return inside_ball(ray, Vector3::Zero(), size.x()).hit(ray);
    case SceneShape::Kind::kBox:
      for (int i = 0; i < 3; ++i) {
        part.clip(ray, Vector3::Unit(i), size[i]);
        part.clip(ray, -Vector3::Unit(i), size[i]);
      }
      return part.hit(ray);
    case SceneShape::Kind::kCylinder:
      part = inside_tube(ray, size.x());
      part.clip(ray, Vector3::UnitY(), size.y());
      part.clip(ray, -Vector3::UnitY(), size.y());
      return part.hit(ray);
    case SceneShape::Kind::kHalfspace:
      part.clip(ray, Vector3::UnitY(), 0.0);
      return part.hit(ray);
    case SceneShape::Kind::kCapsule:
      return inside_capsule(ray, size.x(), size.y()).hit(ray);
    case SceneShape::Kind::kCone:
      return inside_cone(ray, size.x(), size.y()).hit(ray);
    case SceneShape::Kind::kConvexPolyhedron:
      for (const ConvexPolyhedron::Face& face : shape.polyhedron->faces) part.clip(ray, face.normal, face.offset);
      return part.hit(ray);
    case SceneShape::Kind::kTriangleMesh:
      return hit_mesh(*shape.mesh, ray);
    case SceneShape::Kind::kCompound:
      break;
  }
  std::optional<RayHit> first;
  for (const SceneShape::Child& child : shape.children) {
    const std::optional<RayHit> hit = cast_ray(*child.shape, ray_in(child.pose, ray));
    if (hit && (!first || hit->distance < first->distance)) first = hit_from(child.pose, *hit);
  }
  return first;
}

std::optional<RayHit> cast_ray(const SupportMap& map, const Ray& ray) {
  // from where the line is nearest to the solid's ball, so that far origins cancel no digits
  const double begin = std::clamp(-ray.origin.dot(ray.direction) - 2.0 * map.radius(), 0.0, ray.length);
  const Ray near{point_at(ray, begin), ray.direction, ray.length - begin};
  const EndMap end;
  const double touching = 1e-9 * map.radius();
  constexpr int kSteps = 200;
  double t = 0.0;
  Vector3 normal = -ray.direction;
  for (int i = 0; i < kSteps; ++i) {
    const Separation least = find_separation({map, end, Matrix3::Identity(), point_at(near, t)}, kInfinity);
    const double gap = -least.depth;
    // inside where it starts
    if (!(gap > 0.0) && t == 0.0 && begin == 0.0) return RayHit{0.0, -ray.direction};
    if (gap > 0.0) normal = least.normal;
    const double closing = -normal.dot(ray.direction);
    if (gap > touching && !(closing * (near.length - t) >= gap)) return std::nullopt;
    if (!(gap > touching)) return RayHit{begin + t, normal};
    t += gap / closing;
  }
  return RayHit{begin + t, normal};
}

Ray ray_in(const Pose& shape, const Ray& ray) {
  return {inverse_transform_point(shape, ray.origin), shape.orientation.conjugate() * ray.direction, ray.length};
}

RayHit hit_from(const Pose& shape, const RayHit& hit) { return {hit.distance, shape.orientation * hit.normal}; }

}  // namespace gravitas
