// Sphere against sphere, box, cylinder and half-space: one contact each, in closed form.
//
// With q the point of the other solid closest to the centre c, the normal is along q - c and the
// depth r - |c - q|. That fails when c is inside: then |c - q| = 0, there is no direction, and the
// depth would miss the way from the centre out of the solid. Inside, the nearest face (or the side
// of the cylinder) gives the normal, and the depth is r plus the distance to it.
// (§§ 2.5.3.2, 4.3.2.1, .2, .4 and .15, whose contact points are replaced by the midpoint of the
// two surface points.)
#include <cmath>

#include "workers/collision/standard/pair_functions.h"
#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {
namespace {

// The unit normal out of the other solid towards the sphere's centre, and the signed distance of
// the centre from that solid's surface (m, < 0 inside).
struct Outward {
  Vector3 normal;
  double distance;
};

// One contact of a sphere of radius r at the origin of a. Surface points: -r * outward on the
// sphere and -distance * outward on the other solid.
void write_contact(double r, const Vector3& outward_W, double distance, double margin, Manifold* out) {
  const double depth = r - distance;
  out->count = 0;
  if (!(depth >= -margin)) return;
  out->count = 1;
  out->contacts[0] = {(-0.5 * (r + distance)) * outward_W, -outward_W, depth, 0};
}

// 1 for both zeros: a centred sphere leaves towards the positive side
double sign_of(double x) { return x < 0.0 ? -1.0 : 1.0; }

// c: centre of the sphere in the frame of the box
Outward outward_of_box(const Vector3& half_extents, const Vector3& c) {
  const Vector3 closest = c.cwiseMin(half_extents).cwiseMax(-half_extents);
  const Direction away = direction_of(c - closest, Vector3::UnitY());
  if (away.length > 0.0) return {away.unit, away.length};

  // inside: the nearest face, the earlier axis where two are equally near
  int axis = 0;
  for (int i = 1; i < 3; ++i) {
    if (half_extents[i] - std::fabs(c[i]) < half_extents[axis] - std::fabs(c[axis])) axis = i;
  }
  return {Vector3::Unit(axis) * sign_of(c[axis]), std::fabs(c[axis]) - half_extents[axis]};
}

// c: centre of the sphere in the frame of the cylinder
Outward outward_of_cylinder(double radius, double half_height, const Vector3& c) {
  const Direction radial = direction_of(Vector3(c.x(), 0.0, c.z()), Vector3::UnitX());
  const double beyond_side = radial.length - radius;
  const double beyond_cap = std::fabs(c.y()) - half_height;
  const Vector3 cap_normal = Vector3::UnitY() * sign_of(c.y());
  if (beyond_side > 0.0 && beyond_cap > 0.0) {
    const Direction away = direction_of(radial.unit * beyond_side + cap_normal * beyond_cap, cap_normal);
    return {away.unit, away.length};
  }
  // beside the solid one of the two is positive and larger; inside the larger one is the nearer
  // surface, the cap where both are equally near
  if (beyond_side > beyond_cap) return {radial.unit, beyond_side};
  return {cap_normal, beyond_cap};
}

}  // namespace

void collide_sphere_sphere(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  // coincident centres: b is taken to be above a
  const Direction to_b = direction_of(placement.p_AB_W, Vector3::UnitY());
  write_contact(a.size.x(), -to_b.unit, to_b.length - b.size.x(), margin, out);
}

void collide_sphere_box(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  const Vector3 c = -(placement.R_WB.transpose() * placement.p_AB_W);
  const Outward outward = outward_of_box(b.size, c);
  write_contact(a.size.x(), placement.R_WB * outward.normal, outward.distance, margin, out);
}

void collide_sphere_cylinder(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  const Vector3 c = -(placement.R_WB.transpose() * placement.p_AB_W);
  const Outward outward = outward_of_cylinder(b.size.x(), b.size.y(), c);
  write_contact(a.size.x(), placement.R_WB * outward.normal, outward.distance, margin, out);
}

void collide_sphere_halfspace(const Shape& a, const Shape&, const Placement& placement, double margin, Manifold* out) {
  const Vector3 outward = placement.R_WB.col(1);
  write_contact(a.size.x(), outward, -outward.dot(placement.p_AB_W), margin, out);
}

}  // namespace gravitas::collision
