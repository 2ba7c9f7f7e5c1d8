// Polyhedra: faces merged and checked, hulls, and every refusal with the face it names.
#include "plugin_sdk/geometry/convex_polyhedron.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/plugin_sdk/geometry/random_shapes.h"

namespace gravitas {
namespace {

using Faces = std::vector<std::vector<std::uint32_t>>;
using testing::HasSubstr;

std::vector<Vector3> box_corners(const Vector3& half) {
  std::vector<Vector3> corners;
  for (int i = 0; i < 8; ++i)
    corners.emplace_back((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(),
                         (i & 4) ? half.z() : -half.z());
  return corners;
}

Faces box_faces() { return {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}; }

std::string refusal(const std::vector<Vector3>& vertices, const Faces& faces) {
  std::string why;
  EXPECT_FALSE(make_convex_polyhedron(vertices, faces, &why).has_value());
  return why;
}

TEST(ConvexPolyhedron, KeepsTheFacesOfABox) {
  std::string why;
  const auto box = make_convex_polyhedron(box_corners({1, 2, 3}), box_faces(), &why);
  ASSERT_TRUE(box) << why;
  ASSERT_EQ(box->faces.size(), 6U);
  EXPECT_EQ(box->vertices.size(), 8U);
  for (const ConvexPolyhedron::Face& face : box->faces) {
    EXPECT_EQ(face.count, 4U);
    // an axis, and as far along it as the box reaches
    EXPECT_EQ(face.normal.cwiseAbs().maxCoeff(), 1.0);
    EXPECT_EQ(face.offset, Vector3(1, 2, 3).dot(face.normal.cwiseAbs()));
  }
}

TEST(ConvexPolyhedron, MergesCoplanarTrianglesAndTakesEitherOrder) {
  Faces triangles;
  for (const auto& face : box_faces()) {
    triangles.push_back({face[0], face[1], face[2]});
    triangles.push_back({face[0], face[2], face[3]});
  }
  for (const bool is_reversed : {false, true}) {
    Faces faces = triangles;
    if (is_reversed)
      for (auto& face : faces) std::reverse(face.begin(), face.end());
    std::string why;
    const auto box = make_convex_polyhedron(box_corners({1, 2, 3}), faces, &why);
    ASSERT_TRUE(box) << why;
    ASSERT_EQ(box->faces.size(), 6U);
    for (const ConvexPolyhedron::Face& face : box->faces) {
      EXPECT_EQ(face.count, 4U);
      EXPECT_GT(face.offset, 0.0);  // outward
    }
  }
}

// A vertex in the middle of the edge from 0 to 1, to which triangles of both faces go: the box is one of eight corners, and
// its triangles have areas.
TEST(ConvexPolyhedron, LeavesOutWhatLiesWithinAnEdge) {
  std::vector<Vector3> corners = box_corners({1, 1, 1});
  corners.push_back(0.5 * (corners[0] + corners[1]));
  const std::vector<std::vector<std::uint32_t>> faces = {{0, 4, 6, 2}, {1, 3, 7, 5}, {8, 1, 5}, {8, 5, 4},
                                                         {8, 4, 0},    {2, 6, 7, 3}, {8, 0, 2}, {8, 2, 3},
                                                         {8, 3, 1},    {4, 5, 7, 6}};
  std::string why;
  const auto solid = make_convex_polyhedron(corners, faces, &why);
  ASSERT_TRUE(solid) << why;
  EXPECT_EQ(solid->vertices.size(), 8U);
  EXPECT_EQ(solid->faces.size(), 6U);
  const std::vector<std::uint32_t> triangles = solid->triangles();
  ASSERT_EQ(triangles.size(), 36U);
  for (std::size_t i = 0; i < 36; i += 3) {
    const Vector3 &a = solid->vertices[triangles[i]], &b = solid->vertices[triangles[i + 1]],
                  &c = solid->vertices[triangles[i + 2]];
    EXPECT_NEAR((b - a).cross(c - a).norm(), 4.0, 1e-14);
  }
}

TEST(ConvexPolyhedron, NamesTheFaceThatIsWrong) {
  const std::vector<Vector3> corners = box_corners({1, 1, 1});
  Faces faces = box_faces();
  faces[3] = {2, 6, 7, 9};
  EXPECT_THAT(refusal(corners, faces), HasSubstr("face 3 names vertex 9 of 8"));
  faces[3] = {2, 6, 6, 3};
  EXPECT_THAT(refusal(corners, faces), HasSubstr("face 3 names vertex 6 twice"));
  faces[3] = {2, 3, 7, 6};
  EXPECT_THAT(refusal(corners, faces), HasSubstr("face 3 runs along the edge"));
  faces = box_faces();
  faces.pop_back();
  EXPECT_THAT(refusal(corners, faces), HasSubstr("has no neighbour at the edge"));
  std::vector<Vector3> dented = corners;
  dented[7] = Vector3(0.2, 0.2, 0.2);
  Faces triangles;
  for (const auto& face : box_faces()) {
    const bool is_dented = std::count(face.begin(), face.end(), 7U) > 0;
    // cut so that the dent is an edge of the triangles
    const std::size_t at =
        is_dented ? static_cast<std::size_t>(std::find(face.begin(), face.end(), 7U) - face.begin()) : 0;
    triangles.push_back({face[at], face[(at + 1) % 4], face[(at + 2) % 4]});
    triangles.push_back({face[at], face[(at + 2) % 4], face[(at + 3) % 4]});
  }
  EXPECT_THAT(refusal(dented, triangles), HasSubstr("is not convex: vertex"));
  std::vector<Vector3> bent = corners;
  bent[7] = Vector3(1, 1.1, 1);
  EXPECT_THAT(refusal(bent, box_faces()), HasSubstr("is not flat"));
  std::vector<Vector3> flat = corners;
  for (Vector3& v : flat) v.x() = 0.0;
  EXPECT_THAT(refusal(flat, box_faces()), HasSubstr("has no area"));
  EXPECT_THAT(refusal({corners[0], corners[1], corners[2]}, faces), HasSubstr("fewer than 4 vertices"));
  std::vector<Vector3> endless = corners;
  endless[5].y() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(refusal(endless, box_faces()), HasSubstr("vertex 5 is not finite"));
}

TEST(ConvexPolyhedron, TakesNeedlesAndSheets) {
  for (const Vector3& half :
       {Vector3(1e-6, 1, 1e-6), Vector3(1, 1e-6, 1), Vector3(1e6, 1, 1), Vector3(1e-6, 1e-6, 1e-6)}) {
    std::string why;
    const auto box = make_convex_polyhedron(box_corners(half), box_faces(), &why);
    ASSERT_TRUE(box) << why;
    EXPECT_EQ(box->faces.size(), 6U);
    const auto hull = convex_hull(box_corners(half), &why);
    ASSERT_TRUE(hull) << why;
    EXPECT_EQ(hull->faces.size(), 6U);
  }
}

TEST(ConvexHull, LeavesOutWhatIsInsideAndMergesFaces) {
  std::vector<Vector3> points = box_corners({1, 2, 3});
  test::RandomShapes random(3);
  for (int i = 0; i < 200; ++i) points.push_back(random.vector(-0.9, 0.9));
  points.emplace_back(0.5, 2, 0);  // in a face
  points.emplace_back(1, 2, 0.5);  // in an edge
  std::string why;
  const auto hull = convex_hull(points, &why);
  ASSERT_TRUE(hull) << why;
  EXPECT_EQ(hull->faces.size(), 6U);
  EXPECT_EQ(hull->vertices.size(), 8U);
  for (const Vector3& v : hull->vertices) EXPECT_EQ(v.cwiseAbs(), Vector3(1, 2, 3));
}

TEST(ConvexHull, HoldsEveryPointAndOnlyWithinItsFaces) {
  test::RandomShapes random(4);
  for (int i = 0; i < 50; ++i) {
    std::vector<Vector3> points;
    for (int k = 0; k < 60; ++k) points.push_back(random.vector(-1, 1).cwiseProduct(Vector3(1, 0.01, 1)));
    std::string why;
    const auto hull = convex_hull(points, &why);
    ASSERT_TRUE(hull) << why;
    for (const ConvexPolyhedron::Face& face : hull->faces)
      for (const Vector3& p : points) EXPECT_LE(face.normal.dot(p), face.offset + 1e-12);
    // Euler: V - E + F = 2, an edge belonging to two faces
    std::size_t edges = 0;
    for (const ConvexPolyhedron::Face& face : hull->faces) edges += face.count;
    EXPECT_EQ(hull->vertices.size() + hull->faces.size() - edges / 2, 2U);
  }
}

TEST(ConvexHull, RefusesWhatSpansNoSolid) {
  std::string why;
  std::vector<Vector3> plane;
  for (int i = 0; i < 20; ++i) plane.emplace_back(i % 5, i / 5, 0.0);
  EXPECT_FALSE(convex_hull(plane, &why));
  EXPECT_THAT(why, HasSubstr("in one plane"));
  EXPECT_FALSE(convex_hull(std::vector<Vector3>(9, Vector3::Ones()), &why));
  EXPECT_THAT(why, HasSubstr("no extent"));
  EXPECT_FALSE(convex_hull(std::vector<Vector3>(3), &why));
  EXPECT_THAT(why, HasSubstr("fewer than 4"));
}

}  // namespace
}  // namespace gravitas
