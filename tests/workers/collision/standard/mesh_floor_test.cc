// A flat mesh, however it is divided, is touched as a thick box with the same top.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "plugin_sdk/geometry/support_map_buffer.h"
#include "tests/workers/collision/standard/shape_fixture.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests
using gravitas::test::RandomShapes;
using Triangle = TriangleMesh::Triangle;

constexpr double kHalf = 2.0;  // m, of the square floors
constexpr double kTilts[] = {0.0, 1e-9, 1e-3, 0.1, 0.5};

const Shape& grid(Shapes* shapes, std::uint32_t n, bool alternating) {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t k = 0; k <= n; ++k)
      vertices.emplace_back(kHalf * (2.0 * i / n - 1.0), 0.0, kHalf * (2.0 * k / n - 1.0));
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
      if (alternating && (i + k) % 2 == 1) {
        triangles.push_back({a, a + 1, b});
        triangles.push_back({a + 1, b + 1, b});
      } else {
        triangles.push_back({a, a + 1, b + 1});
        triangles.push_back({a, b + 1, b});
      }
    }
  }
  return shapes->mesh(vertices, triangles);
}

// All triangles meet in one point.
const Shape& fan(Shapes* shapes) {
  return shapes->mesh(
      {{0.31, 0, -0.17}, {-kHalf, 0, -kHalf}, {-kHalf, 0, kHalf}, {kHalf, 0, kHalf}, {kHalf, 0, -kHalf}},
      {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}});
}

// Corners of the right half lie on edges of the left one, and no edge is shared.
const Shape& with_corners_on_edges(Shapes* shapes) {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
  const auto add = [&](double x0, double x1, double z0, double z1) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (const auto& [x, z] : {std::pair(x0, z0), std::pair(x0, z1), std::pair(x1, z1), std::pair(x1, z0)})
      vertices.emplace_back(x, 0.0, z);
    triangles.push_back({first, first + 1, first + 2});
    triangles.push_back({first, first + 2, first + 3});
  };
  for (int i = 0; i < 2; ++i) add(-kHalf, 0.1, kHalf * (i - 1), kHalf * i);
  for (int i = 0; i < 5; ++i) add(0.1, kHalf, kHalf * (0.4 * i - 1), kHalf * (0.4 * i - 0.6));
  return shapes->mesh(vertices, triangles);
}

struct Floor {
  std::string name;
  const Shape* shape;
  Pose pose;
};

std::vector<Floor> floors(Shapes* shapes) {
  return {{"quad", &grid(shapes, 1, false), at(0, 0, 0)},
          {"grid", &grid(shapes, 5, true), at(0, 0, 0)},
          {"fine", &grid(shapes, 40, false), at(0, 0, 0)},
          {"fan", &fan(shapes), at(0, 0, 0)},
          {"corners on edges", &with_corners_on_edges(shapes), at(0, 0, 0)},
          {"closed", &shapes->box_mesh({kHalf, kHalf, kHalf}), at(0, -kHalf, 0)},
          {"upside down", &grid(shapes, 3, false), at(Vector3::Zero(), Vector3::UnitX(), std::numbers::pi)}};
}

struct Mover {
  std::string name;
  Shape shape;
};

std::vector<Mover> movers(Shapes* shapes) {
  RandomShapes random(71);
  return {
      {"box", box(0.2, 0.1, 0.3)},
      {"cylinder", cylinder(0.2, 0.25)},
      {"cone", shapes->cone(0.2, 0.25)},
      {"capsule", shapes->capsule(0.1, 0.2)},
      {"hull of a box", shapes->box_hull({0.2, 0.1, 0.3})},
      {"hull", shapes->hull({{0.3, -0.1, 0.2}, {-0.25, -0.1, 0.15}, {0.05, -0.1, -0.3}, {0.1, 0.2, 0}, {0, 0.1, 0.2}})},
      {"sphere", sphere(0.2)}};
}

// Turned by `tilt` about a level axis, after it was laid on one of its sides.
Quaternion attitude(int side, double tilt, double heading, double yaw) {
  const Vector3 axis(std::cos(heading), 0.0, std::sin(heading));
  const Vector3 laid[] = {Vector3::Zero(), Vector3::UnitX(), Vector3::UnitZ(), 2.0 * Vector3::UnitX()};
  const Vector3& lay = laid[side];
  const Quaternion on_side = lay.isZero(0.0)
                                 ? Quaternion::Identity()
                                 : Quaternion(Eigen::AngleAxisd(0.5 * std::numbers::pi * lay.norm(), lay.normalized()));
  return Quaternion(Eigen::AngleAxisd(tilt, axis)) * Quaternion(Eigen::AngleAxisd(yaw, Vector3::UnitY())) * on_side;
}

// Puts the lowest point of a mover at this height above y = 0.
void lower_to(double height, const Shape& shape, Pose* pose) {
  SupportMapBuffer buffer;
  const SupportMap& map = support_map_of(shape, &buffer);
  const Vector3 down = pose->orientation.conjugate() * Vector3(0, -1, 0);
  pose->position.y() = height + down.dot(map.support(down)) + map.rounding();
}

void expect_same(const ContactList& expected, const ContactList& found, const std::string& what) {
  ASSERT_EQ(expected.size(), found.size()) << what;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    std::size_t nearest = 0;
    for (std::size_t k = 1; k < found.size(); ++k)
      if ((found[k].point - expected[i].point).norm() < (found[nearest].point - expected[i].point).norm()) nearest = k;
    ASSERT_LE((found[nearest].point - expected[i].point).norm(), 1e-12) << what;
    ASSERT_NEAR(found[nearest].depth, expected[i].depth, 1e-12) << what;
    ASSERT_LE((found[nearest].normal - expected[i].normal).norm(), 1e-12) << what;
  }
}

TEST(MeshFloor, IsTouchedAsAThickBoxIs) {
  Shapes shapes;
  const Shape thick = box(kHalf, kHalf, kHalf);
  RandomShapes random(72);
  std::size_t touching = 0;
  for (const Floor& floor : floors(&shapes)) {
    for (const Mover& mover : movers(&shapes)) {
      for (const double tilt : kTilts) {
        for (int side = 0; side < 4; ++side) {
          for (const double height : {2e-3, 1e-7, 0.0, -1e-7, -1e-3, -0.03}) {
            // whose centre is nearly behind a mesh that is seen from its back goes to the front
            if (floor.name == "upside down" && height < -0.01) continue;
            Pose X{Vector3(random.uniform(-1.4, 1.4), 0, random.uniform(-1.4, 1.4)),
                   attitude(side, tilt, random.uniform(0, 6), random.uniform(0, 6))};
            lower_to(height, mover.shape, &X);
            for (const double margin : {3e-3, 0.03}) {
              const std::string what = mover.name + " on " + floor.name + ", side " + std::to_string(side) + ", tilt " +
                                       std::to_string(tilt) + ", height " + std::to_string(height) + ", margin " +
                                       std::to_string(margin);
              const ContactList expected = all_contacts(thick, at(0, -kHalf, 0), mover.shape, X, margin);
              expect_same(expected, all_contacts(*floor.shape, floor.pose, mover.shape, X, margin), what);
              touching += expected.size();
            }
          }
        }
      }
    }
  }
  EXPECT_GT(touching, 20000U);
}

// Seen from a moving frame.
TEST(MeshFloor, IsTheSameWhereverItLies) {
  Shapes shapes;
  RandomShapes random(73);
  const Shape thick = box(kHalf, kHalf, kHalf);
  const Shape& fine = grid(&shapes, 40, true);
  for (int i = 0; i < 300; ++i) {
    const Pose X_WF{random.vector(-5, 5), random.rotation()};
    for (const Mover& mover : movers(&shapes)) {
      Pose X{Vector3(random.uniform(-1.4, 1.4), 0, random.uniform(-1.4, 1.4)),
             attitude(i % 4, kTilts[i % 5], random.uniform(0, 6), random.uniform(0, 6))};
      lower_to(-1e-3, mover.shape, &X);
      const ContactList expected =
          all_contacts(thick, compose(X_WF, at(0, -kHalf, 0)), mover.shape, compose(X_WF, X), 0.01);
      const ContactList found = all_contacts(fine, X_WF, mover.shape, compose(X_WF, X), 0.01);
      ASSERT_EQ(found.size(), expected.size()) << mover.name << ' ' << i;
      // the lowest point of a rim may be 1e-6 rad beside a corner of the polygon that stands for it
      EXPECT_NEAR(found.deepest(), 1e-3, 1e-7) << mover.name << ' ' << i;
      for (std::size_t k = 0; k < found.size(); ++k)
        EXPECT_LE((found[k].normal - X_WF.orientation * Vector3::UnitY()).norm(), 1e-12) << mover.name << ' ' << i;
    }
  }
}

// What slides over seams keeps the names of its contacts.
TEST(MeshFloor, SeamsRenameNothing) {
  Shapes shapes;
  for (const Floor& floor : floors(&shapes)) {
    if (floor.name == "corners on edges") continue;  // its parts are two faces
    for (const Mover& mover : movers(&shapes)) {
      Pose X{Vector3::Zero(), attitude(0, 0.01, 0.4, 0.7)};
      lower_to(-1e-3, mover.shape, &X);
      std::vector<std::uint32_t> names;
      for (int i = 0; i < 300; ++i) {
        X.position.x() = -1.4 + 0.00913 * i, X.position.z() = 0.5 - 0.004 * i;
        const ContactList contacts = all_contacts(*floor.shape, floor.pose, mover.shape, X, 0.02);
        std::vector<std::uint32_t> own;
        for (std::size_t k = 0; k < contacts.size(); ++k) own.push_back(contacts[k].feature);
        if (i > 0) {
          ASSERT_EQ(own, names) << mover.name << " on " << floor.name << ' ' << i;
        }
        names = own;
      }
    }
  }
}

// ---- at borders: the bottom of a brick, clipped to the square

using Polygon = std::vector<Vector3>;

Polygon clipped(const Polygon& polygon, const Vector3& outward, double offset) {
  Polygon inside;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double h = outward.dot(p) - offset, k = outward.dot(q) - offset;
    if (h <= 0.0) inside.push_back(p);
    if ((h < 0.0) != (k < 0.0) && h != 0.0 && k != 0.0) inside.push_back(p + h / (h - k) * (q - p));
  }
  return inside;
}

TEST(MeshFloor, EndsAtItsEdgesAndCorners) {
  Shapes shapes;
  RandomShapes random(74);
  const Vector3 half(0.2, 0.1, 0.3);
  const Shape brick = box(half.x(), half.y(), half.z());
  std::size_t whole = 0, cut = 0;
  for (const Floor& floor : floors(&shapes)) {
    // its parts do not know that they are one face; and a closed mesh tells its sides, too
    if (floor.name == "corners on edges" || floor.name == "closed") continue;
    for (const double tilt : {0.0, 1e-9, 1e-3, 0.1}) {
      for (int i = 0; i < 60; ++i) {
        const double x = kHalf + random.uniform(-0.3, 0.05), z = i % 2 == 0 ? 0.3 : kHalf + random.uniform(-0.35, 0.05);
        Pose X{Vector3(x, 0, z), attitude(0, tilt, random.uniform(0, 6), random.uniform(0, 6))};
        lower_to(-1e-3, brick, &X);
        Polygon bottom;
        for (const auto& [u, v] : {std::pair(1, 1), std::pair(1, -1), std::pair(-1, -1), std::pair(-1, 1)})
          bottom.push_back(transform_point(X, Vector3(u * half.x(), -half.y(), v * half.z())));
        bottom = clipped(clipped(bottom, Vector3::UnitX(), kHalf), Vector3::UnitZ(), kHalf);
        // where its lowest corner is over the square
        double lowest = 1.0;
        for (const Vector3& corner : bottom) lowest = std::min(lowest, corner.y());
        if (!(lowest <= -1e-3 + 1e-12) || transform_point(X, Vector3::Zero()).x() > kHalf || X.position.z() > kHalf)
          continue;
        const ContactList found = all_contacts(*floor.shape, floor.pose, brick, X, 0.2);
        const std::string what = floor.name + ", tilt " + std::to_string(tilt) + ", number " + std::to_string(i);
        ASSERT_EQ(found.size(), std::min<std::size_t>(bottom.size(), 4)) << what;
        for (std::size_t k = 0; k < found.size(); ++k) {
          ASSERT_LE((found[k].normal - Vector3::UnitY()).norm(), 1e-12) << what;
          double nearest = 1.0;
          for (const Vector3& corner : bottom)
            nearest = std::min(nearest, (found[k].point + 0.5 * found[k].depth * Vector3(0, -1, 0) - corner).norm());
          ASSERT_LE(nearest, 1e-9) << what;
        }
        (bottom.size() <= 4 ? whole : cut) += 1;
      }
    }
  }
  EXPECT_GT(whole, 200U);
  EXPECT_GT(cut, 100U);
}

// ---- two faces that meet at an angle

// Two planes through the z axis, at `slope` (rad) below the horizontal (a ridge), or above (a valley), of n strips each.
const Shape& roof(Shapes* shapes, double slope, std::uint32_t n) {
  std::vector<Vector3> vertices;
  std::vector<Triangle> triangles;
  for (std::uint32_t i = 0; i <= 2 * n; ++i) {
    const double s = 2.0 * (static_cast<double>(i) / n - 1.0);
    for (std::uint32_t k = 0; k <= n; ++k)
      vertices.emplace_back(s * std::cos(slope), -std::fabs(s) * std::sin(slope), 2.0 * (2.0 * k / n - 1.0));
  }
  for (std::uint32_t i = 0; i < 2 * n; ++i) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
      triangles.push_back({a, a + 1, b + 1});
      triangles.push_back({a, b + 1, b});
    }
  }
  return shapes->mesh(vertices, triangles);
}

TEST(MeshFloor, InAValleyBothFacesAreTouched) {
  Shapes shapes;
  const Shape can = cylinder(0.2, 0.25), ball = sphere(0.2);
  const Shape& pill = shapes.capsule(0.2, 0.25);
  for (const double slope : {0.1, 0.5, 1.0}) {
    for (const std::uint32_t n : {1U, 4U, 25U}) {
      const Shape& valley = roof(&shapes, -slope, n);
      // the axis along the valley, 1 mm too low to touch
      const double height = (0.2 - 1e-3) / std::cos(slope);
      const Pose X = at(Vector3(0, height, 0.137), Vector3::UnitX(), 0.5 * std::numbers::pi);
      for (const auto& [shape, count] : {std::pair(&ball, 1), std::pair(&can, 2), std::pair(&pill, 2)}) {
        const ContactList found = all_contacts(valley, at(0, 0, 0), *shape, X, 1e-4);
        ASSERT_EQ(found.size(), 2U * count) << slope << ' ' << n;
        int left = 0;
        for (std::size_t k = 0; k < found.size(); ++k) {
          EXPECT_NEAR(found[k].depth, 1e-3, 1e-9) << slope << ' ' << n;
          EXPECT_NEAR(found[k].normal.y(), std::cos(slope), 1e-9) << slope << ' ' << n;
          EXPECT_NEAR(std::fabs(found[k].normal.x()), std::sin(slope), 1e-9) << slope << ' ' << n;
          left += found[k].normal.x() > 0.0 ? 1 : 0;
        }
        EXPECT_EQ(left, count) << slope << ' ' << n;
      }
    }
  }
}

TEST(MeshFloor, OnARidgeItsLineIsTouched) {
  Shapes shapes;
  const Shape brick = box(0.2, 0.1, 0.3);
  for (const double slope : {0.3, 0.5, 1.0}) {
    for (const std::uint32_t n : {1U, 4U, 25U}) {
      const Shape& ridge = roof(&shapes, slope, n);
      const ContactList found = all_contacts(ridge, at(0, 0, 0), brick, at(0.05, 0.099, 0.137), 1e-3);
      ASSERT_EQ(found.size(), 2U) << slope << ' ' << n;
      for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_NEAR(found[k].depth, 1e-3, 1e-12) << slope << ' ' << n;
        EXPECT_NEAR(found[k].normal.y(), 1.0, 1e-12) << slope << ' ' << n;
        EXPECT_NEAR(found[k].point.x(), 0.0, 1e-12) << slope << ' ' << n;
        EXPECT_NEAR(std::fabs(found[k].point.z() - 0.137), 0.3, 1e-12) << slope << ' ' << n;
      }
      // whole on one side it is on that face alone
      const Quaternion turn(Eigen::AngleAxisd(-slope, Vector3::UnitZ()));
      const ContactList beside =
          all_contacts(ridge, at(0, 0, 0), brick, {turn * Vector3(0.6, 0.099, 0.137), turn}, 1e-3);
      ASSERT_EQ(beside.size(), 4U) << slope << ' ' << n;
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(beside[k].depth, 1e-3, 1e-12) << slope << ' ' << n;
        EXPECT_NEAR(beside[k].normal.y(), std::cos(slope), 1e-12) << slope << ' ' << n;
      }
    }
  }
}

}  // namespace
}  // namespace gravitas::collision
