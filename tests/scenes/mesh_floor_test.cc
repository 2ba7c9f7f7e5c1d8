// A mesh as floor is like a thick box with the same top: what falls on it comes to lie in the same place, and what slides over
// it feels no seams.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

#include "plugin_sdk/conformance/draw.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::literal;
using harness::SceneRun;

// A level rectangle at y = 0 of n x m divided rectangles.
std::string divided_rectangle(double half_x, double half_z, std::uint32_t n, std::uint32_t m) {
  std::string vertices, faces;
  for (std::uint32_t i = 0; i <= n; ++i)
    for (std::uint32_t k = 0; k <= m; ++k)
      vertices += std::string(vertices.empty() ? "" : ", ") +
                  literal(Vector3(half_x * (2.0 * i / n - 1.0), 0.0, half_z * (2.0 * k / m - 1.0)));
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t k = 0; k < m; ++k) {
      const std::uint32_t a = i * (m + 1) + k, b = a + m + 1;
      const auto add = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
        faces += std::string(faces.empty() ? "{" : ", {") + std::to_string(p) + ", " + std::to_string(q) + ", " +
                 std::to_string(r) + "}";
      };
      if ((i + k) % 2 == 0) {
        add(a, a + 1, b + 1), add(a, b + 1, b);
      } else {
        add(a, a + 1, b), add(a + 1, b + 1, b);
      }
    }
  }
  return "Type = \"TriangleMesh\" CustomProperties { Vertices = {" + vertices + "} Faces = {" + faces + "} }";
}

std::string on_floor(const std::string& simulator, double duration, const std::string& floor, double floor_height,
                     const std::string& shape, double friction, const std::string& state) {
  return "Geometries { Geometry { Id = \"Floor\" " + floor + " } Geometry { Id = \"Body\" " + shape + R"( } }
Materials { Material { Id = "M" StaticFrictionCoefficient = )" +
         literal(friction) + " DynamicFrictionCoefficient = " + literal(friction) + R"( } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = ")" +
         simulator + "\" CustomProperties { TimeStep = " + literal(1.0 / 60.0) + " Duration = " + literal(duration) +
         R"( } }
Environment { Space { Bodies {
  Body { Id = "Floor" GeometryId = "Floor" Material = "M" Immovable = true KineticProperties { Position = )" +
         literal(Vector3(0.0, floor_height, 0.0)) + R"( } }
  Body { Id = "Body" GeometryId = "Body" Material = "M" MassDensity = 1000 Forces = { "Down" }
         KineticProperties { )" +
         state + " } }\n} } }\n";
}

constexpr double kHalfFloor = 5.0;
const std::string kThickFloor = "Type = \"Box\" CustomProperties { HalfExtents = {5, 2, 5} }";

struct Fall {
  const char* simulator;
  std::string shape;
  std::uint32_t finest;  // divisions of a side
  double tolerance;      // m
};

class FallOnAMesh : public ::testing::TestWithParam<Fall> {};

// Before, 15 of 25 boxes lay up to 36 mm elsewhere with `Basic`, 23 of them up to 57 mm with `Continuous`.
TEST_P(FallOnAMesh, EndsWhereThatOnABoxDoes) {
  const Fall& fall = GetParam();
  conformance::Draw draw(57);
  for (int i = 0; i < 10; ++i) {
    const Vector3 place(draw.uniform(-1.0, 1.0), 0.8, draw.uniform(-1.0, 1.0));
    const std::string state = "Position = " + literal(place) + " Orientation = " + literal(draw.rotation()) +
                              " AngularVelocity = " + literal(2.0 * draw.direction());
    const auto end = [&](const std::string& floor, double height) {
      SceneRun run(on_floor(fall.simulator, 0.6, floor, height, fall.shape, 0.5, state));
      run.to_end();
      return run.body("Body").pose;
    };
    const Pose expected = end(kThickFloor, -2.0);
    for (const std::uint32_t n : {1U, fall.finest}) {
      const Pose found = end(divided_rectangle(kHalfFloor, kHalfFloor, n, n), 0.0);
      EXPECT_LE((found.position - expected.position).norm(), fall.tolerance) << i << ' ' << n;
      // of what reaches 0.35 m from its centre
      EXPECT_LE(0.35 * angle_between(found.orientation, expected.orientation), fall.tolerance) << i << ' ' << n;
    }
  }
}

// Over a strip of 40 quads whose seams lie across, and one of 40 x 3.
TEST(SlideOnAMesh, FeelsNoSeams) {
  for (const char* simulator : {"Basic", "Substepping", "Continuous"}) {
    for (const char* shape : {"Type = \"Box\" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} }",
                              "Type = \"Cylinder\" CustomProperties { Radius = 0.15 Height = 0.2 }"}) {
      for (const std::uint32_t across : {1U, 3U}) {
        for (const double turn : {0.0, 0.3}) {
          SceneRun run(on_floor(simulator, 1.0, divided_rectangle(2.0, 1.0, 40, across), 0.0, shape, 0.0,
                                "Position = {-1.75, 0.1, 0.03} LinearVelocity = {3.5, 0, 0} Orientation = " +
                                    literal(harness::turned(Vector3::UnitY(), turn))));
          const double energy = run.kinetic_energy();
          while (!run.is_done()) {
            run.step();
            const SceneRun::Motion motion = run.body("Body");
            ASSERT_NEAR(motion.pose.position.y(), 0.1, 1e-9) << simulator << shape << across << ' ' << run.time();
            ASSERT_LE((motion.twist.linear - Vector3(3.5, 0, 0)).norm(), 1e-9) << simulator << shape << across;
            ASSERT_LE(motion.twist.angular.norm(), 1e-9) << simulator << shape << across;
          }
          EXPECT_NEAR(run.kinetic_energy(), energy, 1e-8 * energy) << simulator << shape << across;
          EXPECT_NEAR(run.body("Body").pose.position.x(), 1.75, 1e-9) << simulator << shape << across;
        }
      }
    }
  }
}

std::string falling_solid(const std::string& type, const std::string& size) {
  return "Type = \"" + type + "\" CustomProperties { " + size + " }";
}
const std::string kFallingCube = falling_solid("Box", "HalfExtents = {0.2, 0.2, 0.2}");
INSTANTIATE_TEST_SUITE_P(
    EachShape, FallOnAMesh,
    ::testing::Values(
        Fall{"Basic", kFallingCube, 37, 1e-9}, Fall{"Substepping", kFallingCube, 37, 1e-9},
        Fall{"Continuous", kFallingCube, 1, 1e-5},
        Fall{"Basic", falling_solid("Cylinder", "Radius = 0.2 Height = 0.4"), 37, 1e-9},
        Fall{"Basic", falling_solid("Cone", "Radius = 0.2 Height = 0.4"), 37, 1e-9},
        Fall{"Basic", falling_solid("Capsule", "Radius = 0.15 Height = 0.4"), 37, 1e-9},
        Fall{"Basic", falling_solid("Sphere", "Radius = 0.2"), 37, 1e-9},
        Fall{"Basic",
             falling_solid("ConvexPolyhedron",
                           "Vertices = {{-0.2, -0.1, -0.2}, {0.3, -0.1, -0.2}, {0, -0.1, 0.3}, {0, 0.3, 0}}"),
             37, 1e-9}));

}  // namespace
}  // namespace gravitas
