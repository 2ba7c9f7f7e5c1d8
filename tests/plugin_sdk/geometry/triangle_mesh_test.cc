// Meshes: cleaning, neighbours, and the tree against a look at every triangle.
#include "plugin_sdk/geometry/triangle_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "plugin_sdk/geometry/simplex.h"
#include "plugin_sdk/math/pose.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"

namespace gravitas {
namespace {

using Triangles = std::vector<TriangleMesh::Triangle>;

TriangleMesh made(const std::vector<Vector3>& vertices, const Triangles& triangles, const MeshOptions& options = {}) {
  std::string why;
  auto mesh = TriangleMesh::make(vertices, triangles, options, &why);
  EXPECT_TRUE(mesh) << why;
  return *mesh;
}

const std::vector<Vector3> kTetrahedron = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const Triangles kOutside = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

// A hilly field of n x n squares, or with `closed` a rough ball of 2 n x n.
TriangleMesh field(std::uint32_t n, const MeshOptions& options = {}) {
  std::vector<Vector3> vertices;
  Triangles triangles;
  test::RandomShapes random(7);
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t k = 0; k <= n; ++k) vertices.emplace_back(i, random.uniform(0, 0.5), k);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
      triangles.push_back({a, a + 1, b + 1});
      triangles.push_back({a, b + 1, b});
    }
  }
  return made(vertices, triangles, options);
}

TEST(TriangleMesh, DropsTrianglesWithoutAreaAndCountsThem) {
  std::vector<Vector3> vertices = kTetrahedron;
  vertices.emplace_back(0.5, 0, 0);
  vertices.push_back(vertices[1]);  // equal to vertex 1
  Triangles triangles = kOutside;
  triangles.push_back({0, 1, 4});  // in a line
  triangles.push_back({2, 2, 3});
  triangles.push_back({1, 5, 2});  // two corners in one place
  const TriangleMesh mesh = made(vertices, triangles);
  EXPECT_EQ(mesh.dropped(), 3U);
  EXPECT_EQ(mesh.triangles().size(), 4U);
  EXPECT_TRUE(mesh.is_closed());
}

TEST(TriangleMesh, KeepsNeedles) {
  const TriangleMesh mesh = made({{0, 0, 0}, {1, 0, 0}, {0.5, 1e-6, 0}}, {{0, 1, 2}});
  EXPECT_EQ(mesh.dropped(), 0U);
  EXPECT_EQ(mesh.normal(0), Vector3(0, 0, 1));
}

TEST(TriangleMesh, KnowsNeighboursAndWhetherItIsClosed) {
  const TriangleMesh mesh = made(kTetrahedron, kOutside);
  EXPECT_TRUE(mesh.is_closed());
  for (std::uint32_t t = 0; t < 4; ++t) {
    std::set<std::uint32_t> around{t};
    for (int edge = 0; edge < 3; ++edge) around.insert(mesh.neighbour(t, edge));
    EXPECT_EQ(around.size(), 4U);
  }
  for (std::uint32_t v = 0; v < 4; ++v) EXPECT_EQ(mesh.ring(v).size(), 3U);
  EXPECT_FALSE(made(kTetrahedron, {kOutside[0], kOutside[1], kOutside[2]}).is_closed());
}

TEST(TriangleMesh, TurnsASolidThatIsInsideOut) {
  Triangles inside = kOutside;
  for (auto& t : inside) std::swap(t[1], t[2]);
  const TriangleMesh mesh = made(kTetrahedron, inside);
  for (std::uint32_t t = 0; t < 4; ++t) {
    EXPECT_GT(mesh.normal(t).dot(mesh.corners(t)[0] - Vector3(0.25, 0.25, 0.25)), 0.0);
    for (int edge = 0; edge < 3; ++edge) {
      // the neighbour has both ends of the edge
      const auto& own = mesh.triangles()[t];
      const auto& other = mesh.triangles()[mesh.neighbour(t, edge)];
      for (const std::uint32_t v : {own[static_cast<std::size_t>(edge)], own[static_cast<std::size_t>((edge + 1) % 3)]})
        EXPECT_NE(std::find(other.begin(), other.end(), v), other.end());
    }
  }
}

TEST(TriangleMesh, NamesWhatIsWrong) {
  std::string why;
  EXPECT_FALSE(TriangleMesh::make(kTetrahedron, Triangles{{0, 1, 2}, {0, 1, 4}}, {}, &why));
  EXPECT_EQ(why, "face 1 names vertex 4 of 4");
  std::vector<Vector3> endless = kTetrahedron;
  endless[2].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(TriangleMesh::make(endless, kOutside, {}, &why));
  EXPECT_THAT(why, testing::HasSubstr("vertex 2 is not finite"));
  EXPECT_FALSE(TriangleMesh::make(kTetrahedron, Triangles{{0, 1, 1}}, {}, &why));
  EXPECT_EQ(why, "no triangle has an area");
}

TEST(TriangleMesh, TreeKeepsToItsBounds) {
  MeshOptions options;
  options.maximum_depth = 3;
  const TriangleMesh shallow = field(20, options);
  EXPECT_LE(shallow.nodes().size(), 15U);
  options = {48, 40};
  const TriangleMesh coarse = field(20, options);
  for (const auto& node : coarse.nodes())
    if (node.count > 0) {
      EXPECT_GT(2 * node.count, 40U);
    }
}

TEST(TriangleMesh, FindsWhatALookAtEveryTriangleFinds) {
  const TriangleMesh mesh = field(16);
  test::RandomShapes random(8);
  for (int i = 0; i < 300; ++i) {
    const Vector3 p = random.vector(-2, 18).cwiseProduct(Vector3(1, 0.1, 1));
    const Box3 box = Box3{p, p}.widened(random.uniform(0, 2));
    std::set<std::uint32_t> found, expected;
    mesh.for_each_in(box, [&](std::uint32_t t) { EXPECT_TRUE(found.insert(t).second); });
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t) {
      Box3 own;
      for (const Vector3& corner : mesh.corners(t)) own.extend(corner);
      if (own.overlaps(box)) expected.insert(t);
      const auto x = mesh.corners(t);
      least = std::min(least, closest_on_triangle(x[0] - p, x[1] - p, x[2] - p).point.norm());
    }
    EXPECT_EQ(found, expected);
    const TriangleMesh::Nearest nearest = mesh.nearest(p);
    EXPECT_EQ(std::fabs(nearest.signed_distance), least);
    EXPECT_NEAR((nearest.point - p).norm(), least, 1e-14);

    const Vector3 way = random.direction();
    double first = 30.0;
    for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t)
      if (const auto at = ray_on_triangle(p, way, mesh.corners(t))) first = std::min(first, *at);
    const auto hit = mesh.cast_ray(p, way, 30.0);
    EXPECT_EQ(hit.has_value(), first < 30.0);
    if (hit) {
      EXPECT_EQ(hit->distance, first);
    }
  }
}

// Along edges and through corners of flush triangles no ray slips through.
TEST(TriangleMesh, RaysDoNotSlipBetweenTriangles) {
  const TriangleMesh mesh = made({{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}, {{0, 2, 1}, {0, 3, 2}});
  for (int i = 0; i <= 20; ++i) {
    const double t = i / 20.0;
    for (const Vector3& p : {Vector3(t, 1, t), Vector3(t, 1, 0), Vector3(0, 1, t)}) {
      const auto hit = mesh.cast_ray(p, Vector3(0, -1, 0), 2.0);
      ASSERT_TRUE(hit) << p.transpose();
      EXPECT_EQ(hit->distance, 1.0);
    }
  }
}

TEST(TriangleMesh, TellsInsideFromOutsideEverywhereRoundASolid) {
  // a prism with a sharp edge, where the nearest triangle's own normal tells the wrong side
  const TriangleMesh mesh =
      made({{0, 0, 0}, {4, 0.1, 0}, {4, -0.1, 0}, {0, 0, 1}, {4, 0.1, 1}, {4, -0.1, 1}},
           {{0, 1, 2}, {3, 5, 4}, {0, 3, 4}, {0, 4, 1}, {0, 2, 5}, {0, 5, 3}, {1, 4, 5}, {1, 5, 2}});
  ASSERT_TRUE(mesh.is_closed());
  test::RandomShapes random(9);
  int inside = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3 p{random.uniform(-1, 5), random.uniform(-0.2, 0.2), random.uniform(-0.5, 1.5)};
    const bool is_inside = p.x() < 4 && std::fabs(p.y()) < 0.025 * p.x() && p.z() > 0 && p.z() < 1;
    inside += is_inside ? 1 : 0;
    EXPECT_EQ(mesh.nearest(p).signed_distance < 0.0, is_inside) << p.transpose();
  }
  EXPECT_GT(inside, 100);
}

TEST(TriangleMesh, TellsTheWayOutUpToItsSurface) {
  const TriangleMesh mesh =
      made({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
  ASSERT_TRUE(mesh.is_closed());
  test::RandomShapes random(10);
  for (int i = 0; i < 2000; ++i) {
    // anywhere, and within 1e-17 ... 1e-3 m of a face, an edge or a corner
    Vector3 p = random.vector(-0.5, 1.5);
    if (i % 2 == 0) {
      const TriangleMesh::Nearest foot = mesh.nearest(p);
      p = foot.point + std::pow(10.0, random.uniform(-17, -3)) * random.direction();
    }
    const TriangleMesh::Nearest nearest = mesh.nearest(p);
    EXPECT_NEAR(nearest.outward.squaredNorm(), 1.0, 1e-14);
    EXPECT_LE((p - nearest.signed_distance * nearest.outward - nearest.point).norm(), 1e-9 * 2.0);
    if (std::fabs(nearest.signed_distance) > 1e-6) {
      EXPECT_LE((p - nearest.signed_distance * nearest.outward - nearest.point).norm(), 1e-15);
    }
  }
  EXPECT_LE((mesh.nearest({0.25, 0.25, 0.0}).outward + Vector3::UnitZ()).norm(), 1e-15);
}

// A cube has six, whichever way it is turned, and is divided; what is bent by 1e-6 is two.
TEST(TriangleMesh, FlatFacesAreNamedByTheirLowestTriangle) {
  test::RandomShapes random(8);
  for (int i = 0; i < 20; ++i) {
    const Pose pose{random.vector(-1, 1), random.rotation()};
    std::vector<Vector3> vertices;
    Triangles triangles;
    constexpr std::uint32_t n = 6;
    for (int axis = 0; axis < 3; ++axis) {
      for (const double side : {-1.0, 1.0}) {
        const auto first = static_cast<std::uint32_t>(vertices.size());
        for (std::uint32_t u = 0; u <= n; ++u)
          for (std::uint32_t v = 0; v <= n; ++v) {
            Vector3 x;
            x[axis] = side, x[(axis + 1) % 3] = 2.0 * u / n - 1.0, x[(axis + 2) % 3] = 2.0 * v / n - 1.0;
            vertices.push_back(i == 0 ? x : transform_point(pose, x));
          }
        for (std::uint32_t u = 0; u < n; ++u)
          for (std::uint32_t v = 0; v < n; ++v) {
            const std::uint32_t a = first + u * (n + 1) + v, b = a + n + 1;
            triangles.push_back(side > 0.0 ? TriangleMesh::Triangle{a, b, b + 1} : TriangleMesh::Triangle{a, b + 1, b});
            triangles.push_back(side > 0.0 ? TriangleMesh::Triangle{a, b + 1, a + 1}
                                           : TriangleMesh::Triangle{a, a + 1, b + 1});
          }
      }
    }
    const TriangleMesh mesh = made(vertices, triangles);
    for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t)
      EXPECT_EQ(mesh.flat_face(t), t / (2 * n * n) * (2 * n * n)) << i << ' ' << t;
  }
  for (const double bend : {0.0, 1e-6}) {
    const TriangleMesh mesh = made({{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, {1, bend, 1}}, {{0, 2, 1}, {1, 2, 3}});
    EXPECT_EQ(mesh.flat_face(1), bend == 0.0 ? 0U : 1U);
  }
}

}  // namespace
}  // namespace gravitas
