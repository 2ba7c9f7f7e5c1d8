// Lines and boxes of shapes: counted where their number is known, and on the surface where that is.
#include "plugin_sdk/geometry/outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

namespace gravitas {
namespace {

using Kind = SceneShape::Kind;

std::vector<LineSegment> outline(const SceneShape& shape, double extent = 5.0) {
  std::vector<LineSegment> lines;
  append_outline(shape, {}, extent, &lines);
  return lines;
}

SceneShape shape_of(Kind kind, const Vector3& size) {
  SceneShape shape;
  shape.kind = kind;
  shape.size = size;
  return shape;
}

SceneShape hull_of(const std::vector<Vector3>& points) {
  std::string why;
  SceneShape shape = shape_of(Kind::kConvexPolyhedron, Vector3::Zero());
  shape.polyhedron = std::make_shared<ConvexPolyhedron>(*convex_hull(points, &why));
  return shape;
}

SceneShape mesh_of(const std::vector<Vector3>& vertices, const std::vector<TriangleMesh::Triangle>& triangles) {
  std::string why;
  SceneShape shape = shape_of(Kind::kTriangleMesh, Vector3::Zero());
  shape.mesh = std::make_shared<TriangleMesh>(
      *TriangleMesh::make(vertices, triangles, {.maximum_depth = 48, .minimum_node_size = 2}, &why));
  return shape;
}

TEST(Outline, SolidsWithFlatFacesHaveTheirEdgesOnce) {
  EXPECT_EQ(outline(shape_of(Kind::kBox, {1, 2, 3})).size(), 12U);
  std::vector<Vector3> cube, octahedron;
  for (int i = 0; i < 8; ++i) cube.emplace_back((i & 1) * 2 - 1, (i & 2) - 1, (i & 4) / 2 - 1);
  for (int k = 0; k < 3; ++k)
    for (const double side : {-1.0, 1.0}) octahedron.push_back(side * Vector3::Unit(k));
  EXPECT_EQ(outline(hull_of(cube)).size(), 12U) << "coplanar triangles of a hull are one face";
  EXPECT_EQ(outline(hull_of(octahedron)).size(), 12U);
  // a quadrilateral in two triangles, and a third one that shares an edge with one of them
  EXPECT_EQ(outline(mesh_of({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 1}}, {{0, 1, 2}, {0, 2, 3}, {1, 4, 2}}))
                .size(),
            7U);
}

TEST(Outline, RoundShapesAreDrawnByPointsOfTheirSurface) {
  for (const LineSegment& line : outline(shape_of(Kind::kSphere, {2, 0, 0})))
    for (const Vector3& end : line) EXPECT_NEAR(end.norm(), 2.0, 1e-14);
  for (const LineSegment& line : outline(shape_of(Kind::kCapsule, {0.5, 1, 0})))
    for (const Vector3& end : line) {
      const Vector3 nearest(0.0, std::clamp(end.y(), -1.0, 1.0), 0.0);
      EXPECT_NEAR((end - nearest).norm(), 0.5, 1e-14);
    }
  // arcs are closed: each end begins another line
  const std::vector<LineSegment> sphere = outline(shape_of(Kind::kSphere, {2, 0, 0}));
  for (const LineSegment& line : sphere)
    EXPECT_TRUE(std::ranges::any_of(sphere, [&](const LineSegment& next) { return next[0] == line[1]; }));
}

TEST(Outline, AHalfSpaceReachesToItsExtent) {
  double farthest = 0.0;
  for (const LineSegment& line : outline(shape_of(Kind::kHalfspace, Vector3::Zero()), 7.0))
    for (const Vector3& end : line) {
      EXPECT_EQ(end.y(), 0.0);
      farthest = std::max(farthest, end.cwiseAbs().maxCoeff());
    }
  EXPECT_EQ(farthest, 7.0);
}

TEST(Outline, ChildrenOfACompoundAreDrawnWhereTheyAre) {
  SceneShape compound = shape_of(Kind::kCompound, Vector3::Zero());
  for (const double x : {-3.0, 3.0})
    compound.children.push_back({std::make_shared<SceneShape>(shape_of(Kind::kBox, {1, 1, 1})),
                                 {Vector3(x, 0, 0), Quaternion(0.6, 0.8, 0, 0)}});
  const std::vector<LineSegment> lines = outline(compound);
  ASSERT_EQ(lines.size(), 24U);
  for (std::size_t i = 0; i < lines.size(); ++i)
    EXPECT_NEAR(0.5 * (lines[i][0].x() + lines[i][1].x()), i < 12 ? -3.0 : 3.0, 1.0 + 1e-12);
}

// A shape of which only the support points are known.
TEST(Outline, SupportPointsDrawAnySolid) {
  const SceneShape ball = shape_of(Kind::kSphere, {2, 0, 0});
  std::vector<LineSegment> lines;
  append_outline(*make_support_map(ball), {}, &lines);
  ASSERT_EQ(lines.size(), 3 * std::size_t{kChords});
  for (const LineSegment& line : lines) EXPECT_NEAR(line[0].norm(), 2.0, 1e-12);
}

TEST(Outline, NodesOfATreeHoldTheirTriangles) {
  std::vector<Vector3> vertices;
  std::vector<TriangleMesh::Triangle> triangles;
  for (std::uint32_t i = 0; i < 40; ++i) {
    const double x = i % 8, z = (i * 5) % 7, y = (i * i) % 11;
    vertices.insert(vertices.end(), {{x, y, z}, {x + 1, y, z}, {x, y + 1, z + 1}});
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const SceneShape mesh = mesh_of(vertices, triangles);
  std::vector<OutlineNode> nodes;
  const Pose moved{Vector3(10, 0, 0), Quaternion(0.6, 0, 0.8, 0)};
  append_tree(mesh, moved, &nodes);
  ASSERT_EQ(nodes.size(), mesh.mesh->nodes().size());
  EXPECT_EQ(nodes[0].depth, 0U);
  EXPECT_TRUE(nodes[0].pose.position.isApprox(transform_point(moved, mesh.mesh->box().centre()), 1e-14));
  EXPECT_EQ(nodes[0].half_extents, mesh.mesh->box().half_extents());
  const auto holds = [](const OutlineNode& node, const Vector3& point) {
    const Vector3 own = inverse_transform_point(node.pose, point).cwiseAbs();
    return (own.array() <= node.half_extents.array() + 1e-12).all();
  };
  // some leaf holds each triangle, and the nodes above that leaf do, too
  for (std::uint32_t t = 0; t < mesh.mesh->triangles().size(); ++t) {
    std::vector<bool> path;
    bool is_found = false;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      path.resize(nodes[i].depth);
      path.push_back((path.empty() || path.back()) && std::ranges::all_of(mesh.mesh->corners(t), [&](const Vector3& p) {
                       return holds(nodes[i], transform_point(moved, p));
                     }));
      const bool is_leaf = i + 1 == nodes.size() || nodes[i + 1].depth <= nodes[i].depth;
      is_found = is_found || (is_leaf && path.back());
    }
    EXPECT_TRUE(is_found) << "triangle " << t;
  }
}

}  // namespace
}  // namespace gravitas
