// Clipping of touching features. Everything happens in the frame of A; z is the coordinate along
// the contact normal, and the depth at a place is z of A's surface minus z of B's.
//
// Places on a boundary within the tolerance count as inside: two equal boxes on top of each other
// keep their vertices as contacts, whichever way rounding pushes them.
#include "workers/collision/standard/patch_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/geometry/support_map_buffer.h"
#include "workers/collision/standard/pair_functions.h"
#include "workers/collision/standard/patch_sink.h"
#include "workers/collision/standard/patches.h"
#include "workers/collision/standard/polygon_clip.h"
#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {
namespace {

// ---- face of a box ----

// x: reference face; y: side line of a cylinder. A clipped end keeps the name of its end.
void face_against_line(const BoxFace& x, const Line& y, PatchSink* sink) {
  const Vector3 from = y.ends[0] - x.plane.point;
  const Vector3 to = y.ends[1] - x.plane.point;
  Interval inside{0.0, 1.0};
  clip_to_slab(x.u.dot(from), x.u.dot(to), x.half_u + sink->tolerance(), &inside);
  clip_to_slab(x.v.dot(from), x.v.dot(to), x.half_v + sink->tolerance(), &inside);
  sink->add_clipped_line(y, inside, x.plane, x.code);
}

// Box face x against cap y, one of them exactly perpendicular to the normal. The work is done in
// the plane of the cap, where the rim is a circle.
void face_against_cap(const BoxFace& x, const Cap& y, PatchSink* sink) {
  const Rim& rim = y.rim;
  FlatPolygon polygon;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3 arm = sink->projected(x.vertices[i], y.plane) - rim.centre;
    polygon[i] = {rim.u.dot(arm), rim.v.dot(arm)};
  }
  const auto place = [&](const FlatPoint& p) -> Vector3 { return rim.centre + p.x * rim.u + p.y * rim.v; };

  // corners of the face over the cap
  const double outer = rim.radius + sink->tolerance();
  for (std::size_t i = 0; i < 4; ++i) {
    if (polygon[i].x * polygon[i].x + polygon[i].y * polygon[i].y <= outer * outer) {
      sink->add(place(polygon[i]), x.plane, y.plane, x.vertex_codes[i], y.code());
    }
  }
  // points of the rim over the face
  const RimPoints points = sink->rim_points(rim, x.plane, y.plane);
  for (std::size_t i = 0; i < kRimPointCount; ++i) {
    const Vector3 arm = points[i] - rim.centre;
    if (!polygon_contains(polygon, {rim.u.dot(arm), rim.v.dot(arm)}, sink->tolerance())) continue;
    sink->add(points[i], x.plane, y.plane, x.code, cylinder_rim_quadrant_code(y.bottom, static_cast<int>(i)));
  }
  // crossings of the rim with the edges of the face, entering and leaving
  for (std::size_t i = 0; i < 4; ++i) {
    const FlatPoint& p = polygon[i];
    const FlatPoint& q = polygon[(i + 1) % 4];
    const FlatPoint d{q.x - p.x, q.y - p.y};
    const Interval crossing = circle_crossings(p, d, rim.radius);
    if (crossing.empty()) continue;
    for (const double s : {crossing.from, crossing.to}) {
      if (s < 0.0 || s > 1.0) continue;
      sink->add(place({p.x + s * d.x, p.y + s * d.y}), x.plane, y.plane, x.edge_codes[i], y.code(),
                s == crossing.from ? 0 : 1);
    }
  }
}

// ---- cap of a cylinder ----

// x: reference cap; y: side line of the other cylinder
void cap_against_line(const Cap& x, const Line& y, PatchSink* sink) {
  const Vector3 from = sink->projected(y.ends[0], x.plane) - x.rim.centre;
  const Vector3 along = sink->projected(y.ends[1], x.plane) - x.rim.centre - from;
  Interval inside = circle_crossings({x.rim.u.dot(from), x.rim.v.dot(from)}, {x.rim.u.dot(along), x.rim.v.dot(along)},
                                     x.rim.radius + sink->tolerance());
  inside.from = std::max(inside.from, 0.0);
  inside.to = std::min(inside.to, 1.0);
  sink->add_clipped_line(y, inside, x.plane, x.code());
}

// The point where the rim of y, seen along the axis of x, crosses the rim of x, starting near
// `guess`: Newton's method on the angle, since the tilted rim is an ellipse.
bool rim_crossing(const Cap& x, const Cap& y, const Vector3& guess, Vector3* out) {
  const Rim& rim = y.rim;
  Vector3 arm = guess - rim.centre;
  Vector3 e = direction_of(arm - rim.axis * rim.axis.dot(arm), rim.u).unit;
  for (int i = 0; i < 8; ++i) {
    const Vector3 from_x = rim.centre + rim.radius * e - x.rim.centre;
    const Vector3 flat = from_x - x.rim.axis * x.rim.axis.dot(from_x);
    const Vector3 t = rim.axis.cross(e);
    const double slope = 2.0 * rim.radius * flat.dot(t);
    const double excess = flat.squaredNorm() - x.rim.radius * x.rim.radius;
    if (std::fabs(excess) <= 1e-14 * x.rim.radius * x.rim.radius) break;
    if (!(std::fabs(slope) > 0.0)) return false;
    e = direction_of(e - t * std::clamp(excess / slope, -0.3, 0.3), e).unit;
  }
  *out = rim.centre + rim.radius * e;
  const Vector3 from_x = *out - x.rim.centre;
  const double radial = std::sqrt((from_x - x.rim.axis * x.rim.axis.dot(from_x)).squaredNorm());
  return std::fabs(radial - x.rim.radius) <= 1e-9 * x.rim.radius;
}

void add_rim_inside_cap(const Rim& rim, bool bottom, bool rim_is_x, const Cap& x, const Cap& y, PatchSink* sink) {
  const Cap& other = rim_is_x ? y : x;
  const RimPoints points = sink->rim_points(rim, x.plane, y.plane);
  for (std::size_t i = 0; i < kRimPointCount; ++i) {
    const Vector3 arm = sink->projected(points[i], other.plane) - other.rim.centre;
    if (std::sqrt(arm.squaredNorm()) > other.rim.radius + sink->tolerance()) continue;
    const FeatureCode code = cylinder_rim_quadrant_code(bottom, static_cast<int>(i));
    sink->add(points[i], x.plane, y.plane, rim_is_x ? code : x.code(), rim_is_x ? y.code() : code);
  }
}

// x: reference cap, exactly perpendicular to the normal; y: the other cylinder's cap
void cap_against_cap(const Cap& x, const Cap& y, PatchSink* sink) {
  const Vector3 offset = sink->projected(y.rim.centre, x.plane) - x.rim.centre;
  const Direction towards_y = direction_of(offset, x.rim.u);
  const double distance = towards_y.length;
  const double spread = std::fabs(x.rim.radius - y.rim.radius);

  // one disc over the other: the rim of the smaller one, laid out in the frame of x
  if (distance <= spread + sink->tolerance()) {
    const bool rim_is_x = x.rim.radius <= y.rim.radius;
    const Cap& inner = rim_is_x ? x : y;
    const Rim rim = make_rim(inner.rim.centre, inner.rim.axis, inner.rim.radius, x.rim.u);
    add_rim_inside_cap(rim, inner.bottom, rim_is_x, x, y, sink);
    return;
  }
  // overlapping discs: the lens has its tips at the crossings and its sides towards the centres
  for (const bool rim_is_x : {true, false}) {
    const Cap& cap = rim_is_x ? x : y;
    const Rim rim = make_rim(cap.rim.centre, cap.rim.axis, cap.rim.radius, towards_y.unit);
    add_rim_inside_cap(rim, cap.bottom, rim_is_x, x, y, sink);
  }
  const double along = 0.5 * (distance + (x.rim.radius - y.rim.radius) * (x.rim.radius + y.rim.radius) / distance);
  const double squared = (x.rim.radius - along) * (x.rim.radius + along);
  if (!(squared > 0.0)) return;
  const Vector3 across = x.rim.axis.cross(towards_y.unit) * std::sqrt(squared);
  std::uint32_t repeat = 0;
  for (const double side : {1.0, -1.0}) {
    const Vector3 guess = x.rim.centre + along * towards_y.unit + side * across;
    Vector3 crossing;
    if (rim_crossing(x, y, sink->projected(guess, y.plane), &crossing)) {
      sink->add(crossing, x.plane, y.plane, x.code(), y.code(), repeat);
    }
    ++repeat;
  }
}

// the shape x owns the normal, as its face or cap
void add_reference_contacts(const FacingShape& x, int face, const FacingShape& y, PatchSink* sink) {
  if (x.is_box()) {
    const BoxFace reference = box_face(x, face);
    if (cap_faces(y)) {
      face_against_cap(reference, facing_cap(y, reference.u), sink);
    } else {
      face_against_line(reference, facing_line(y), sink);
    }
    return;
  }
  if (y.is_box()) {
    const BoxFace incident = facing_box_face(y);
    sink->swap_roles();
    face_against_cap(incident, facing_cap(x, incident.u), sink);
    sink->swap_roles();
    return;
  }
  const Cap reference = facing_cap(x, x.R.col(2));
  if (cap_faces(y)) {
    cap_against_cap(reference, facing_cap(y, x.R.col(2)), sink);
  } else {
    cap_against_line(reference, facing_line(y), sink);
  }
}

// ---- lines ----

// Sine of the largest angle at which two lines count as lying along each other.
constexpr double kAlongEachOther = 0.05;
// Below this sine a feature lies in the supporting plane.
constexpr double kInPlane = 1e-7;

// Nearly parallel lines: the two ends of their common stretch. Where they deviate sideways by y,
// the larger cylinder has receded by r - sqrt(r^2 - y^2); an edge against an edge has nothing
// beside it.
void line_against_line(const Line& a, const Line& b, const Vector3& n, PatchSink* sink) {
  const double cosine = a.direction.dot(b.direction);
  const double sine = std::sqrt(a.direction.cross(b.direction).squaredNorm());
  const double radius = std::max(a.radius, b.radius);
  if (sine > (radius > 0.0 ? kAlongEachOther : kInPlane)) return;

  // both lines as points over the coordinate along the line that recedes
  const bool a_recedes = a.radius >= b.radius;
  const Vector3 lead = a_recedes || cosine > 0.0 ? (a_recedes ? a : b).direction : Vector3(-b.direction);
  const Vector3 along = direction_of(lead - n * n.dot(lead), lead).unit;
  const auto station = [&](const Vector3& p) { return along.dot(p - a.ends[1]); };
  const double a0 = station(a.ends[1]);
  const double a1 = station(a.ends[0]);
  const std::size_t lower = cosine > 0.0 ? 1 : 0;
  const double b0 = station(b.ends[lower]);
  const double b1 = station(b.ends[1 - lower]);
  const std::array<double, 2> stretch = {std::min(a1, b1), std::max(a0, b0)};
  if (!(stretch[1] <= stretch[0]) || !(a1 > a0) || !(b1 > b0)) return;

  for (std::size_t i = 0; i < 2; ++i) {
    const double s = stretch[i];
    const Vector3 pa = a.ends[1] + (a.ends[0] - a.ends[1]) * ((s - a0) / (a1 - a0));
    const Vector3 pb = b.ends[lower] + (b.ends[1 - lower] - b.ends[lower]) * ((s - b0) / (b1 - b0));
    const Vector3 apart = pb - pa;
    const double sideways = n.cross(along).dot(apart);
    double receded = 0.0;
    if (radius > 0.0) {
      const double squared = (radius - sideways) * (radius + sideways);
      if (!(squared > 0.0)) continue;
      receded = sideways * sideways / (radius + std::sqrt(squared));
    }
    const double za = n.dot(pa) - (a_recedes ? receded : 0.0);
    const double zb = n.dot(pb) + (a_recedes ? 0.0 : receded);
    sink->add_heights(a_recedes ? pb : pa, za, zb, a.end_codes[i], b.end_codes[cosine > 0.0 ? i : 1 - i]);
  }
}

// the point midway between two crossing lines, each kept to its ends
Vector3 crossing_of(const Line& a, const Line& b) {
  const Vector3 da = a.ends[0] - a.ends[1];
  const Vector3 db = b.ends[0] - b.ends[1];
  const Vector3 r = a.ends[1] - b.ends[1];
  const double bb = db.squaredNorm();
  const double ab = da.dot(db);
  const double determinant = da.cross(db).squaredNorm();
  double s = 0.5;
  if (determinant > 0.0) s = (ab * db.dot(r) - bb * da.dot(r)) / determinant;
  s = std::clamp(s, 0.0, 1.0);
  const double t = std::clamp((db.dot(r) + s * ab) / bb, 0.0, 1.0);
  return 0.5 * (a.ends[1] + s * da + b.ends[1] + t * db);
}

// Whether a line of the shape lies nearly in the supporting plane.
bool has_line_along(const FacingShape& shape) {
  const Contour::Kind kind = contour(shape, kAlongEachOther).kind;
  return kind == Contour::Kind::kLine || (shape.is_box() && kind == Contour::Kind::kFace);
}

FacingShape facing_a(const ConvexPair& pair, const ContactAxis& axis) {
  return {pair.a, Matrix3::Identity(), Vector3::Zero(), axis.normal};
}

FacingShape facing_b(const ConvexPair& pair, const ContactAxis& axis) {
  return {pair.b, pair.R_AB, pair.p_AB, -axis.normal};
}

}  // namespace

void add_patch_contacts(const ConvexPair& pair, const ContactAxis& axis, ContactCandidates* out) {
  const FacingShape a = facing_a(pair, axis);
  const FacingShape b = facing_b(pair, axis);
  PatchSink sink(axis.normal, rounding_length(pair), out);
  if (axis.kind == AxisKind::kFaceOfA) {
    add_reference_contacts(a, axis.face, b, &sink);
  } else if (axis.kind == AxisKind::kFaceOfB) {
    sink.swap_roles();
    add_reference_contacts(b, axis.face, a, &sink);
  } else if (has_line_along(a) && has_line_along(b)) {
    line_against_line(facing_line(a), facing_line(b), axis.normal, &sink);
  }
}

void add_support_contact(const ConvexPair& pair, const ContactAxis& axis, ContactCandidates* out) {
  const FacingShape a = facing_a(pair, axis);
  const FacingShape b = facing_b(pair, axis);
  const Contour on_a = contour(a, kInPlane);
  const Contour on_b = contour(b, kInPlane);
  const Vector3 support_of_a = a.support();
  const Vector3 support_of_b = b.support();
  Vector3 place;
  if (on_a.kind == Contour::Kind::kPoint) {
    place = support_of_a;
  } else if (on_b.kind == Contour::Kind::kPoint) {
    place = support_of_b;
  } else if (on_a.kind == Contour::Kind::kLine && on_b.kind == Contour::Kind::kLine) {
    place = crossing_of(facing_line(a), facing_line(b));
  } else {
    // a face whose rim the other touches: of a face the support is any corner
    SupportMapBuffer buffer_a, buffer_b;
    const Separation least =
        find_separation({support_map_of(pair.a, &buffer_a), support_map_of(pair.b, &buffer_b), pair.R_AB, pair.p_AB},
                        std::numeric_limits<double>::infinity());
    place = 0.5 * (least.point_a + least.point_b);
  }
  const Vector3& n = axis.normal;
  const double middle = 0.5 * (n.dot(support_of_a) + n.dot(support_of_b));
  PatchSink(n, rounding_length(pair), out)
      .add_heights(place, middle + 0.5 * axis.depth, middle - 0.5 * axis.depth, on_a.code, on_b.code);
}

}  // namespace gravitas::collision
