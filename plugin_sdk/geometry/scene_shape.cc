#include "plugin_sdk/geometry/scene_shape.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr int kDeepestNesting = 8;
constexpr std::uint32_t kChildColumns = 11;

Property length(const char* name, const char* meaning) {
  return Property::number(name, "m").above(0.0).required().means(meaning);
}

std::vector<TypeDeclaration> declared_types() {
  const auto vertices = [] { return Property::table("Vertices", 3, "m", "geometry"); };
  return {{"Sphere", "Ball about the origin.", {length("Radius", "Radius.")}},
          {"Box",
           "Cuboid about the origin.",
           {Property::vector("HalfExtents", "m", "geometry")
                .above(0.0)
                .required()
                .means("Half the edge along each axis.")}},
          {"Cylinder",
           "Cylinder about the y axis, centred on the origin.",
           {length("Radius", "Radius."), length("Height", "Distance between the end faces.")}},
          {"Halfspace", "Everything at y <= 0 of its frame is solid.", {}},
          {"Capsule",
           "Cylinder about the y axis with a half ball on either end, centred on the origin.",
           {length("Radius", "Radius."), length("Height", "Distance between the centres of the half balls.")}},
          {"Cone",
           "Cone about the y axis, its apex at +Height/2, its base at -Height/2.",
           {length("Radius", "Radius of the base."), length("Height", "Distance of the apex from the base.")}},
          {"ConvexPolyhedron",
           "Solid with flat faces and no dents.",
           {vertices().required().means("Corners: a row each."),
            Property::table("Faces", 3, "1", "geometry")
                .at_least(0.0)
                .means("Triangles of indices of Vertices, all counter-clockwise seen from outside or all clockwise; in "
                       "a scene "
                       "rows may be longer. Absent: the convex hull of the vertices.")}},
          {"TriangleMesh",
           "Surface of triangles; if it is closed, the solid within.",
           {vertices().means(
                "Corners: a row each. In a scene, File may stand instead of Vertices and Faces: a Wavefront OBJ "
                "file, its path relative to the scene."),
            Property::table("Faces", 3, "1", "geometry")
                .at_least(0.0)
                .means("Triangles of indices of Vertices, counter-clockwise seen from outside (a closed mesh that is "
                       "inside out is turned round); in a scene rows may be longer."),
            Property::number("Scale", "1").above(0.0).defaults_to({1.0}).means("Factor on the vertices."),
            Property::integer("MaximumDepth")
                .at_least(1.0)
                .at_most(60.0)
                .defaults_to({48.0})
                .means("Of the tree of bounding boxes."),
            Property::integer("MinimumNodeSize")
                .at_least(1.0)
                .at_most(1e6)
                .defaults_to({4.0})
                .means("A node of the tree with no more triangles is not divided.")}},
          {"Compound",
           "Several bounded shapes as one.",
           {Property::table("Children", kChildColumns, "1", "geometry")
                .required()
                .means("In a scene {\"GeometryId\", {px, py, pz}, {qw, qx, qy, qz}, MassDensity}, the density being "
                       "optional; a "
                       "plugin receives type (two halves), first parameter, pose, density."),
            Property::table("Parameters", 1, "1", "geometry")
                .means("Properties of the children, one after the other; filled by the scene reader.")}}};
}

// ---- reading

struct Wrong {
  std::string why;
};

std::vector<Vector3> read_vertices(PropertyCursor* cursor) {
  const std::span<const double> numbers = cursor->table(3);
  std::vector<Vector3> vertices;
  vertices.reserve(numbers.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); i += 3) vertices.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return vertices;
}

std::vector<TriangleMesh::Triangle> read_triangles(PropertyCursor* cursor) {
  const std::span<const double> numbers = cursor->table(3);
  std::vector<TriangleMesh::Triangle> triangles(numbers.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (!(numbers[i] >= 0.0 && numbers[i] < 4294967295.0) || numbers[i] != std::floor(numbers[i]))
      throw Wrong{"face " + std::to_string(i / 3) + " has an index that is none"};
    triangles[i / 3][i % 3] = static_cast<std::uint32_t>(numbers[i]);
  }
  return triangles;
}

std::shared_ptr<const ConvexPolyhedron> read_polyhedron(PropertyCursor* cursor) {
  const std::vector<Vector3> vertices = read_vertices(cursor);
  std::vector<std::vector<std::uint32_t>> faces;
  for (const TriangleMesh::Triangle& t : read_triangles(cursor)) faces.push_back({t[0], t[1], t[2]});
  std::string why;
  std::optional<ConvexPolyhedron> made =
      faces.empty() ? convex_hull(vertices, &why) : make_convex_polyhedron(vertices, faces, &why);
  if (!made) throw Wrong{why};
  return std::make_shared<ConvexPolyhedron>(std::move(*made));
}

std::shared_ptr<const TriangleMesh> read_mesh(PropertyCursor* cursor) {
  std::vector<Vector3> vertices = read_vertices(cursor);
  const std::vector<TriangleMesh::Triangle> triangles = read_triangles(cursor);
  const double scale = cursor->number();
  if (!(scale > 0.0)) throw Wrong{"Scale is not positive"};
  if (scale != 1.0)
    for (Vector3& v : vertices) v *= scale;
  const auto count = [&](double least, double most) {
    const std::int64_t given = cursor->integer();
    return static_cast<std::uint32_t>(std::clamp(static_cast<double>(given), least, most));
  };
  MeshOptions options;
  options.maximum_depth = count(1.0, 60.0);
  options.minimum_node_size = count(1.0, 1e6);
  std::string why;
  std::optional<TriangleMesh> made = TriangleMesh::make(vertices, triangles, options, &why);
  if (!made) throw Wrong{why};
  return std::make_shared<TriangleMesh>(std::move(*made));
}

SceneShape read(std::uint64_t type, std::span<const double> parameters, int depth);

std::vector<SceneShape::Child> read_children(PropertyCursor* cursor, int depth) {
  if (depth >= kDeepestNesting) throw Wrong{"compounds are nested more than eight deep"};
  const std::span<const double> rows = cursor->table(kChildColumns);
  const std::span<const double> parameters = cursor->table(1);
  const std::size_t count = rows.size() / kChildColumns;
  if (count == 0) throw Wrong{"the compound has no child"};
  std::vector<SceneShape::Child> children;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string what = "child " + std::to_string(i);
    const std::span<const double> row = rows.subspan(i * kChildColumns, kChildColumns);
    const double begin = row[2];
    const double end = i + 1 < count ? rows[(i + 1) * kChildColumns + 2] : static_cast<double>(parameters.size());
    const auto is_half = [](double x) { return x >= 0.0 && x < 4294967296.0 && x == std::floor(x); };
    if (!is_half(row[0]) || !is_half(row[1])) throw Wrong{what + " is of no type"};
    if (!(begin >= 0.0 && begin <= end && end <= static_cast<double>(parameters.size())) ||
        begin != std::floor(begin) || end != std::floor(end))
      throw Wrong{what + " has its parameters outside their list"};
    SceneShape::Child child;
    child.pose.position = {row[3], row[4], row[5]};
    child.pose.orientation = Quaternion(row[6], row[7], row[8], row[9]);
    child.density = row[10];
    const double norm = child.pose.orientation.squaredNorm();
    if (!child.pose.position.allFinite() || !(std::fabs(norm - 1.0) <= 1e-9))
      throw Wrong{what + " has a pose that is none"};
    if (!(child.density >= 0.0) || !std::isfinite(child.density)) throw Wrong{what + " has a density that is none"};
    const std::uint64_t type = static_cast<std::uint64_t>(row[0]) << 32 | static_cast<std::uint64_t>(row[1]);
    try {
      child.shape = std::make_shared<SceneShape>(read(
          type, parameters.subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin)), depth + 1));
    } catch (const Wrong& wrong) {
      throw Wrong{what + ": " + wrong.why};
    }
    if (child.shape->is_unbounded()) throw Wrong{what + " is unbounded"};
    children.push_back(std::move(child));
  }
  return children;
}

SceneShape read(std::uint64_t type, std::span<const double> parameters, int depth) {
  const std::vector<TypeDeclaration>& types = scene_shape_types();
  std::size_t kind = 0;
  while (kind < types.size() && type_id(types[kind].name) != type) ++kind;
  if (kind == types.size()) throw Wrong{"is of a type that this plugin does not know"};
  PropertyCursor cursor(parameters);
  SceneShape shape;
  shape.kind = static_cast<SceneShape::Kind>(kind);
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      shape.size = Vector3::Constant(cursor.number());
      break;
    case SceneShape::Kind::kBox:
      shape.size = cursor.vector();
      break;
    case SceneShape::Kind::kHalfspace:
      shape.size.setOnes();
      break;
    case SceneShape::Kind::kCylinder:
    case SceneShape::Kind::kCapsule:
    case SceneShape::Kind::kCone: {
      const double radius = cursor.number();
      shape.size = Vector3(radius, 0.5 * cursor.number(), radius);
      break;
    }
    case SceneShape::Kind::kConvexPolyhedron:
      shape.polyhedron = read_polyhedron(&cursor);
      shape.size.setOnes();
      break;
    case SceneShape::Kind::kTriangleMesh:
      shape.mesh = read_mesh(&cursor);
      shape.size.setOnes();
      break;
    case SceneShape::Kind::kCompound:
      shape.children = read_children(&cursor, depth);
      shape.size.setOnes();
      break;
  }
  if (!shape.size.allFinite() || !(shape.size.minCoeff() > 0.0))
    throw Wrong{"has a size that is not finite and positive"};
  return shape;
}

// ---- places

// The farthest coordinate along a unit direction of the shape's frame.
double support_value(const SceneShape& shape, const Vector3& d) {
  const double radial = std::sqrt(d.x() * d.x() + d.z() * d.z());
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      return shape.size.x();
    case SceneShape::Kind::kBox:
      return shape.size.dot(d.cwiseAbs());
    case SceneShape::Kind::kCylinder:
      return shape.size.x() * radial + shape.size.y() * std::fabs(d.y());
    case SceneShape::Kind::kCapsule:
      return shape.size.x() + shape.size.y() * std::fabs(d.y());
    case SceneShape::Kind::kCone:
      return std::max(shape.size.y() * d.y(), shape.size.x() * radial - shape.size.y() * d.y());
    case SceneShape::Kind::kConvexPolyhedron:
      return d.dot(shape.polyhedron->vertices[shape.polyhedron->support(d)]);
    case SceneShape::Kind::kTriangleMesh: {
      double farthest = -std::numeric_limits<double>::infinity();
      for (const Vector3& v : shape.mesh->vertices()) farthest = std::max(farthest, d.dot(v));
      return farthest;
    }
    case SceneShape::Kind::kCompound: {
      double farthest = -std::numeric_limits<double>::infinity();
      for (const SceneShape::Child& child : shape.children)
        farthest = std::max(
            farthest, d.dot(child.pose.position) + support_value(*child.shape, child.pose.orientation.conjugate() * d));
      return farthest;
    }
    case SceneShape::Kind::kHalfspace:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

// The greatest distance of a point of the shape from c.
double farthest_from(const SceneShape& shape, const Vector3& c) {
  const double radial = std::sqrt(c.x() * c.x() + c.z() * c.z()), height = std::fabs(c.y());
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      return std::sqrt(c.squaredNorm()) + shape.size.x();
    case SceneShape::Kind::kBox:
      return std::sqrt((c.cwiseAbs() + shape.size).squaredNorm());
    case SceneShape::Kind::kCylinder:
      return std::sqrt((radial + shape.size.x()) * (radial + shape.size.x()) +
                       (height + shape.size.y()) * (height + shape.size.y()));
    case SceneShape::Kind::kCapsule:
      return shape.size.x() + std::sqrt(radial * radial + (height + shape.size.y()) * (height + shape.size.y()));
    case SceneShape::Kind::kCone: {
      const double below = c.y() + shape.size.y(), above = shape.size.y() - c.y();
      return std::sqrt(std::max(radial * radial + above * above,
                                (radial + shape.size.x()) * (radial + shape.size.x()) + below * below));
    }
    case SceneShape::Kind::kConvexPolyhedron:
    case SceneShape::Kind::kTriangleMesh: {
      double farthest = 0.0;
      const auto& vertices = shape.polyhedron ? shape.polyhedron->vertices : shape.mesh->vertices();
      for (const Vector3& v : vertices) farthest = std::max(farthest, (v - c).squaredNorm());
      return std::sqrt(farthest);
    }
    case SceneShape::Kind::kCompound: {
      double farthest = 0.0;
      for (const SceneShape::Child& child : shape.children)
        farthest = std::max(farthest, farthest_from(*child.shape, inverse_transform_point(child.pose, c)));
      return farthest;
    }
    case SceneShape::Kind::kHalfspace:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

const std::vector<TypeDeclaration>& scene_shape_types() {
  static const std::vector<TypeDeclaration> types = declared_types();
  return types;
}

std::optional<SceneShape> read_scene_shape(std::uint64_t type, std::span<const double> parameters, std::string* why) {
  try {
    return read(type, parameters, 0);
  } catch (const Wrong& wrong) {
    *why = wrong.why;
    return std::nullopt;
  }
}

std::uint64_t type_of(const SceneShape& shape) {
  return type_id(scene_shape_types()[static_cast<std::size_t>(shape.kind)].name);
}

std::vector<double> flattened_shape(const SceneShape& shape) {
  std::vector<double> out;
  const auto put_table = [&](std::span<const Vector3> vertices, std::span<const std::uint32_t> triangles) {
    out.push_back(static_cast<double>(vertices.size()));
    for (const Vector3& v : vertices) out.insert(out.end(), {v.x(), v.y(), v.z()});
    const std::size_t count = triangles.size() / 3;
    out.push_back(static_cast<double>(count));
    for (const std::uint32_t i : triangles) out.push_back(i);
  };
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      return {shape.size.x()};
    case SceneShape::Kind::kBox:
      return {shape.size.x(), shape.size.y(), shape.size.z()};
    case SceneShape::Kind::kCylinder:
    case SceneShape::Kind::kCapsule:
    case SceneShape::Kind::kCone:
      return {shape.size.x(), 2.0 * shape.size.y()};
    case SceneShape::Kind::kHalfspace:
      return {};
    case SceneShape::Kind::kConvexPolyhedron:
      put_table(shape.polyhedron->vertices, shape.polyhedron->triangles());
      return out;
    case SceneShape::Kind::kTriangleMesh: {
      std::vector<std::uint32_t> triangles;
      for (const TriangleMesh::Triangle& t : shape.mesh->triangles())
        triangles.insert(triangles.end(), t.begin(), t.end());
      put_table(shape.mesh->vertices(), triangles);
      const MeshOptions& options = shape.mesh->options();
      out.insert(out.end(),
                 {1.0, static_cast<double>(options.maximum_depth), static_cast<double>(options.minimum_node_size)});
      return out;
    }
    case SceneShape::Kind::kCompound: {
      std::vector<double> parameters;
      out.push_back(static_cast<double>(shape.children.size()));
      for (const SceneShape::Child& child : shape.children) {
        const std::uint64_t type = type_of(*child.shape);
        const Vector3& p = child.pose.position;
        const Quaternion& q = child.pose.orientation;
        out.insert(out.end(), {static_cast<double>(type >> 32), static_cast<double>(type & 0xFFFFFFFFU),
                               static_cast<double>(parameters.size()), p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(),
                               child.density});
        const std::vector<double> own = flattened_shape(*child.shape);
        parameters.insert(parameters.end(), own.begin(), own.end());
      }
      out.push_back(static_cast<double>(parameters.size()));
      out.insert(out.end(), parameters.begin(), parameters.end());
      return out;
    }
  }
  return out;
}

MassProperties mass_properties(const SceneShape& shape, double density) {
  switch (shape.kind) {
    case SceneShape::Kind::kSphere:
      return sphere_mass_properties(shape.size.x(), density);
    case SceneShape::Kind::kBox:
      return box_mass_properties(shape.size, density);
    case SceneShape::Kind::kCylinder:
      return cylinder_mass_properties(shape.size.x(), 2.0 * shape.size.y(), density);
    case SceneShape::Kind::kCapsule:
      return capsule_mass_properties(shape.size.x(), 2.0 * shape.size.y(), density);
    case SceneShape::Kind::kCone:
      return cone_mass_properties(shape.size.x(), 2.0 * shape.size.y(), density);
    case SceneShape::Kind::kConvexPolyhedron:
      return solid_mass_properties(shape.polyhedron->vertices, shape.polyhedron->triangles(), density);
    case SceneShape::Kind::kTriangleMesh: {
      std::vector<std::uint32_t> triangles;
      for (const TriangleMesh::Triangle& t : shape.mesh->triangles())
        triangles.insert(triangles.end(), t.begin(), t.end());
      return shape.mesh->is_closed() ? solid_mass_properties(shape.mesh->vertices(), triangles, density)
                                     : shell_mass_properties(shape.mesh->vertices(), triangles, density);
    }
    case SceneShape::Kind::kCompound: {
      std::vector<MassProperties> parts;
      for (const SceneShape::Child& child : shape.children)
        parts.push_back(
            transformed(mass_properties(*child.shape, child.density > 0.0 ? child.density : density), child.pose));
      return combined(parts);
    }
    case SceneShape::Kind::kHalfspace:
      break;
  }
  return {};
}

Box3 local_box(const SceneShape& shape) { return local_box(shape, Matrix3::Identity()); }

Box3 local_box(const SceneShape& shape, const Matrix3& R) {
  Box3 box;
  for (int i = 0; i < 3; ++i) {
    box.upper[i] = support_value(shape, R.col(i));
    box.lower[i] = -support_value(shape, -R.col(i));
  }
  return box;
}

Ball bounding_ball(const SceneShape& shape) {
  const Vector3 centre = local_box(shape).centre();
  return {centre, farthest_from(shape, centre)};
}

}  // namespace gravitas
