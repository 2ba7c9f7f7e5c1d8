#include "plugin_sdk/geometry/outline.h"

#include <algorithm>
#include <utility>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// Lines in the frame of a shape, put where it is.
class Pen {
 public:
  Pen(const Pose& pose, std::vector<LineSegment>* lines) : pose_(pose), lines_(*lines) {}

  void line(const Vector3& from, const Vector3& to) {
    lines_.push_back({transform_point(pose_, from), transform_point(pose_, to)});
  }

  // From centre + x towards centre + y, over so many chords of a whole turn.
  void arc(const Vector3& centre, const Vector3& x, const Vector3& y, std::uint32_t chords) {
    const auto at = [&](std::uint32_t i) {
      // quarters are exact, so that arcs meet the lines that begin there
      const std::uint32_t quarter = i / (kChords / 4) % 4, rest = i % (kChords / 4);
      const double angle = kWholeTurn * rest / kChords;
      const double c = rest == 0 ? 1.0 : math::cos(angle), s = rest == 0 ? 0.0 : math::sin(angle);
      const double cosine = quarter == 0 ? c : quarter == 1 ? -s : quarter == 2 ? -c : s;
      const double sine = quarter == 0 ? s : quarter == 1 ? c : quarter == 2 ? -s : -c;
      return Vector3(centre + cosine * x + sine * y);
    };
    for (std::uint32_t i = 0; i < chords; ++i) line(at(i), at(i + 1));
  }

 private:
  Pose pose_;
  std::vector<LineSegment>& lines_;
};

Vector3 axis(int k) { return Vector3::Unit(k); }

void draw_box(const Vector3& half, Pen* pen) {
  const auto corner = [&](unsigned i) {
    return Vector3((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                   (i & 4) != 0 ? half.z() : -half.z());
  };
  for (unsigned i = 0; i < 8; ++i)
    for (const unsigned axis : {1U, 2U, 4U})
      if ((i & axis) == 0) pen->line(corner(i), corner(i | axis));
}

// Circles at both ends and lines along the sides; a cone's upper end is a point.
void draw_round(double lower_radius, double upper_radius, double half_height, Pen* pen) {
  const Vector3 up = half_height * axis(1);
  pen->arc(-up, lower_radius * axis(0), lower_radius * axis(2), kChords);
  if (upper_radius > 0.0) pen->arc(up, upper_radius * axis(0), upper_radius * axis(2), kChords);
  for (const int k : {0, 2})
    for (const double side : {1.0, -1.0})
      pen->line(lower_radius * side * axis(k) - up, upper_radius * side * axis(k) + up);
}

void draw_capsule(double radius, double half_height, Pen* pen) {
  draw_round(radius, radius, half_height, pen);
  const Vector3 up = half_height * axis(1);
  for (const int k : {0, 2}) {
    pen->arc(up, radius * axis(k), radius * axis(1), kChords / 2);
    pen->arc(-up, radius * axis(k), -radius * axis(1), kChords / 2);
  }
}

void draw_polyhedron(const ConvexPolyhedron& solid, Pen* pen) {
  for (const ConvexPolyhedron::Face& face : solid.faces) {
    const std::span<const std::uint32_t> corners = solid.corners_of(face);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t a = corners[i], b = corners[(i + 1) % corners.size()];
      // the face on the other side goes along it the other way
      if (a < b) pen->line(solid.vertices[a], solid.vertices[b]);
    }
  }
}

void draw_mesh(const TriangleMesh& mesh, Pen* pen) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const TriangleMesh::Triangle& t : mesh.triangles())
    for (std::size_t k = 0; k < 3; ++k) edges.push_back(std::minmax({t[k], t[(k + 1) % 3]}));
  std::ranges::sort(edges);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  for (const auto& [a, b] : edges) pen->line(mesh.vertices()[a], mesh.vertices()[b]);
}

void draw_halfspace(double extent, Pen* pen) {
  const Vector3 x = extent * axis(0), z = extent * axis(2);
  for (const double side : {-1.0, 0.0, 1.0}) {
    pen->line(side * x - z, side * x + z);
    pen->line(side * z - x, side * z + x);
  }
}

}  // namespace

void append_outline(const SceneShape& shape, const Pose& pose, double extent, std::vector<LineSegment>* lines) {
  Pen pen(pose, lines);
  const double radius = shape.size.x();
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      for (int k = 0; k < 3; ++k) pen.arc(Vector3::Zero(), radius * axis(k), radius * axis((k + 1) % 3), kChords);
      return;
    case SceneShape::Kind::kBox:
      return draw_box(shape.size, &pen);
    case SceneShape::Kind::kCylinder:
      return draw_round(radius, radius, shape.size.y(), &pen);
    case SceneShape::Kind::kCone:
      return draw_round(radius, 0.0, shape.size.y(), &pen);
    case SceneShape::Kind::kCapsule:
      return draw_capsule(radius, shape.size.y(), &pen);
    case SceneShape::Kind::kHalfspace:
      return draw_halfspace(extent, &pen);
    case SceneShape::Kind::kConvexPolyhedron:
      return draw_polyhedron(*shape.polyhedron, &pen);
    case SceneShape::Kind::kTriangleMesh:
      return draw_mesh(*shape.mesh, &pen);
    case SceneShape::Kind::kCompound:
      for (const SceneShape::Child& child : shape.children)
        append_outline(*child.shape, compose(pose, child.pose), extent, lines);
  }
}

void append_outline(const SupportMap& map, const Pose& pose, std::vector<LineSegment>* lines) {
  std::vector<LineSegment> directions;
  for (int k = 0; k < 3; ++k) Pen({}, &directions).arc(Vector3::Zero(), axis(k), axis((k + 1) % 3), kChords);
  const auto surface = [&](const Vector3& d) { return Vector3(map.support(d) + map.rounding() * d); };
  for (const LineSegment& d : directions) {
    const Vector3 from = surface(d[0]), to = surface(d[1]);
    if (from != to) lines->push_back({transform_point(pose, from), transform_point(pose, to)});
  }
}

void append_tree(const SceneShape& shape, const Pose& pose, std::vector<OutlineNode>* nodes) {
  for (const SceneShape::Child& child : shape.children) append_tree(*child.shape, compose(pose, child.pose), nodes);
  if (!shape.mesh) return;
  struct Place {
    std::uint32_t node, depth;
  };
  std::vector<Place> open = {{0, 0}};
  while (!open.empty()) {
    const Place here = open.back();
    open.pop_back();
    const TriangleMesh::Node& node = shape.mesh->nodes()[here.node];
    nodes->push_back(
        {here.depth, {transform_point(pose, node.box.centre()), pose.orientation}, node.box.half_extents()});
    if (node.count > 0) continue;
    open.push_back({node.first + 1, here.depth + 1});
    open.push_back({node.first, here.depth + 1});
  }
}

}  // namespace gravitas
