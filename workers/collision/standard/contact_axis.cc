// Chooses the contact normal: flat axes first, then, where they cannot decide, the curved families
// or the closest points.
#include "workers/collision/standard/contact_axis.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/geometry/support_map_buffer.h"
#include "workers/collision/standard/pair_functions.h"
#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {
namespace {

// Cross products of unit vectors shorter than this are dropped. The edge contacts they stand for
// are slivers: leaving one out costs less than 1e-8 of an edge length in depth.
constexpr double kParallelEdges = 1e-8;

constexpr double kFacePreference = 0.01;

bool is_box(const Shape& shape) { return shape.type == ShapeType::kBox; }

// whether a later axis of this depth replaces an earlier one
bool beats(const ConvexPair& pair, double depth, double earlier) {
  return depth < earlier - face_preference(pair, earlier);
}

// the shallowest face normal of one shape; `rotation` holds the shape's axes in A as columns
ContactAxis best_face(const ConvexPair& pair, const Shape& shape, const Matrix3& rotation, AxisKind kind) {
  ContactAxis best;
  const int first = is_box(shape) ? 0 : 1;
  const int last = is_box(shape) ? 2 : 1;
  for (int i = first; i <= last; ++i) {
    const Vector3 axis = rotation.col(i);
    const Vector3 normal = axis.dot(pair.p_AB) < 0.0 ? Vector3(-axis) : axis;
    const double depth = pair.depth_along(normal);
    if (depth < best.depth - tie_length(pair)) best = {normal, depth, kind, i};
  }
  return best;
}

// cross products of the line directions of both shapes: all axes of a box, the axis of the cylinder b
void offer_edge_axes(ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  for (int i = 0; i < 3; ++i) {
    if (!is_box(pair.a) && i != 1) continue;
    search->offer(Vector3::Unit(i).cross(pair.R_AB.col(1)), kParallelEdges);
  }
}

// directions from the axis of the cylinder b to the vertices of the box a
void offer_vertices_against_side(ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  const Vector3 axis = pair.R_AB.col(1);
  for (int i = 0; i < 8; ++i) {
    const Vector3 vertex((i & 1) ? -pair.a.size.x() : pair.a.size.x(), (i & 2) ? -pair.a.size.y() : pair.a.size.y(),
                         (i & 4) ? -pair.a.size.z() : pair.a.size.z());
    const Vector3 arm = vertex - pair.p_AB;
    search->offer(arm - axis * axis.dot(arm), kParallelEdges * pair.reach);
  }
}

// the direction between two axes that are parallel or nearly so; any perpendicular if they coincide
void offer_side_against_side(ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  for (const Vector3& axis : {Vector3(Vector3::UnitY()), Vector3(pair.R_AB.col(1))}) {
    const Vector3 radial = pair.p_AB - axis * axis.dot(pair.p_AB);
    search->offer(radial.squaredNorm() > 0.0 ? radial : axis.unitOrthogonal());
  }
}

// every family with a curved feature; the pair is box - cylinder or cylinder - cylinder
void search_curved(ShallowestAxis* search) {
  const ConvexPair& pair = search->pair();
  const double tolerance = 0.1 * tie_length(pair);
  if (is_box(pair.a)) {
    offer_vertices_against_side(search);
    for (int i = 0; i < 3; ++i) {
      search_great_circle(Vector3::Unit(i), Vector3::Unit((i + 1) % 3), Vector3::Unit((i + 2) % 3), tolerance, search);
    }
    return;
  }
  offer_side_against_side(search);
  search_great_circle(Vector3::UnitY(), Vector3::UnitZ(), Vector3::UnitX(), tolerance, search);
  search_great_circle(pair.R_AB.col(1), pair.R_AB.col(2), pair.R_AB.col(0), tolerance, search);
  search_rims(search);
}

}  // namespace

void ShallowestAxis::offer(const Vector3& direction, double shortest) {
  const Direction axis = direction_of(direction, Vector3::UnitY());
  if (!(axis.length > shortest)) return;
  offer_signed(axis.unit.dot(pair_.p_AB) < 0.0 ? Vector3(-axis.unit) : axis.unit);
}

void ShallowestAxis::offer_axis(const ContactAxis& axis) {
  if (axis.depth < best_.depth) best_ = axis;
}

void ShallowestAxis::offer_signed(const Vector3& normal) {
  const double depth = pair_.depth_along(normal);
  if (depth < best_.depth) best_ = {normal, depth, AxisKind::kFree, -1};
}

double face_preference(const ConvexPair& pair, double earlier) {
  return tie_length(pair) + kFacePreference * std::max(earlier, 0.0);
}

void ShallowestAxis::offer_refined(const Vector3& normal) {
  const double depth = pair_.depth_along(normal);
  if (depth < best_.depth + 1e-15 * pair_.reach) best_ = {normal, depth, AxisKind::kFree, -1};
}

bool find_contact_axes(const ConvexPair& pair, double margin, ContactAxes* out) {
  const ContactAxis face_of_a = best_face(pair, pair.a, Matrix3::Identity(), AxisKind::kFaceOfA);
  if (face_of_a.depth < -margin) return false;
  const ContactAxis face_of_b = best_face(pair, pair.b, pair.R_AB, AxisKind::kFaceOfB);
  if (face_of_b.depth < -margin) return false;
  const ContactAxis& shallowest = face_of_b.depth < face_of_a.depth ? face_of_b : face_of_a;
  const ContactAxis& face = beats(pair, face_of_b.depth, face_of_a.depth) ? face_of_b : face_of_a;

  ShallowestAxis search(pair);
  offer_edge_axes(&search);
  if (search.depth() < -margin) return false;

  // with a cylinder only the distance decides whether they overlap
  SupportMapBuffer buffer_a, buffer_b;
  const PlacedPair placed{support_map_of(pair.a, &buffer_a), support_map_of(pair.b, &buffer_b), pair.R_AB, pair.p_AB};
  if (const std::optional<Separation> least = find_distance(placed, margin)) {
    search.offer_signed(least->normal);
    if (search.depth() < -margin) return false;
    refine_axis(least->normal, &search);
  } else {
    search.offer_axis(shallowest);
    search_curved(&search);
  }
  if (std::min(shallowest.depth, search.depth()) < -margin) return false;
  out->preferred = beats(pair, search.depth(), face.depth) ? search.best() : face;
  out->shallowest = search.depth() < shallowest.depth ? search.best() : shallowest;
  return true;
}

}  // namespace gravitas::collision
