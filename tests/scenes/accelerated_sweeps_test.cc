// What the default solver holds up better by accelerated sweeps than by as many plain ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

struct Building {
  std::string shapes, bodies;
  std::vector<std::string> stones;

  void add(const std::string& shape, const Vector3& place) {
    const std::string id = "S" + std::to_string(stones.size());
    bodies += "Body { Id = \"" + id + "\" GeometryId = \"" + shape +
              "\" Material = \"Stone\" Mass = 10 KineticProperties { Position = " + literal(place) +
              " CanSleep = false } Forces = { \"Down\" } }\n";
    stones.push_back(id);
  }
  std::string scene() const {
    return "Geometries { Geometry { Type = \"Halfspace\" Id = \"Flat\" }\n" + shapes +
           "}\nMaterials { Material { Id = \"Stone\" StaticFrictionCoefficient = 0.5 } }\n"
           "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
           "Simulator { CustomProperties { Duration = 2 } }\nEnvironment { Space { Bodies {\n"
           "Body { Id = \"Ground\" GeometryId = \"Flat\" Material = \"Stone\" Immovable = true }\n" +
           bodies + "} } }\n";
  }
  // The longest way of a stone, m.
  double moves(bool is_accelerated) const {
    SceneRun run(scene(), {set("Solver.NesterovAcceleration", std::string(is_accelerated ? "true" : "false"))});
    std::vector<Vector3> start;
    for (const std::string& id : stones) start.push_back(run.body(id).pose.position);
    run.to_end();
    double longest = 0.0;
    for (std::size_t i = 0; i < stones.size(); ++i)
      longest = std::max(longest, (run.body(stones[i]).pose.position - start[i]).norm());
    return longest;
  }
};

TEST(AcceleratedSweeps, HoldUpAPyramidOfTenRows) {
  constexpr int kRows = 10;
  Building pyramid;
  pyramid.shapes = "Geometry { Type = \"Box\" Id = \"Cube\" CustomProperties { HalfExtents = {0.5, 0.5, 0.5} } }\n";
  for (int row = 0; row < kRows; ++row)
    for (int k = 0; k < kRows - row; ++k)
      pyramid.add("Cube", Vector3(1.02 * (k - 0.5 * (kRows - row - 1)), 0.5 + row, 0));
  EXPECT_LT(pyramid.moves(true), 1e-6);
  EXPECT_GT(pyramid.moves(false), 1e-4);
}

// A half circle of 14 stones, a sixth of its radius thick.
TEST(AcceleratedSweeps, HoldUpAnArch) {
  constexpr int kStones = 14;
  constexpr double kRadius = 5.0, kThickness = 0.8, kDepth = 1.0, kAngle = kPi / kStones;
  Building arch;
  for (int i = 0; i < kStones; ++i) {
    const double middle = (i + 0.5) * kAngle;
    const Vector3 place = kRadius * Vector3(std::cos(middle), std::sin(middle), 0);
    std::string vertices;
    for (const double z : {-0.5 * kDepth, 0.5 * kDepth})
      for (const double side : {-0.5, 0.5})
        for (const double angle : {middle - 0.5 * kAngle, middle + 0.5 * kAngle}) {
          const Vector3 corner = (kRadius + side * kThickness) * Vector3(std::cos(angle), std::sin(angle), 0);
          vertices += (vertices.empty() ? "" : ", ") + literal(Vector3(corner - place + Vector3(0, 0, z)));
        }
    const std::string shape = "Stone" + std::to_string(i);
    arch.shapes +=
        "Geometry { Type = \"ConvexPolyhedron\" Id = \"" + shape + "\" CustomProperties { Vertices = {" + vertices +
        "} Faces = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}} } }\n";
    arch.add(shape, place);
  }
  EXPECT_LT(arch.moves(true), 1e-8);
  EXPECT_GT(arch.moves(false), 1e-4);
}

// A suspension bridge of ropes, twenty knots on a parabola with a deck of 40 kg under each, begins where it is in balance, and
// hangs: what the pose change pushes is taut, also while sweeps have not come to their end.
TEST(AcceleratedSweeps, HoldUpABridgeOfRopes) {
  constexpr int kKnots = 20;
  constexpr double kSag = 6.0, kWidth = 2.0;
  const auto knot = [](int i) {
    const double share = static_cast<double>(i) / (kKnots + 1);
    return Vector3(kWidth * i, -4.0 * kSag * share * (1.0 - share), 0.0);
  };
  const auto name = [](const char* letter, int i) { return letter + std::to_string(i); };
  std::string bodies, ropes;
  const auto add = [&](const std::string& id, double mass, const Vector3& place) {
    bodies += "Body { Id = \"" + id + "\" Mass = " + literal(mass) +
              " PrincipalMoments = {1, 1, 1} Forces = { \"Down\" } KineticProperties { Position = " + literal(place) +
              " CanSleep = false } }\n";
  };
  const auto tie = [&](const std::string& from, const std::string& to, const Vector3& start, const Vector3& end) {
    ropes += "Constraint { Type = \"Distance\" Id = \"" + from + "to" + to + "\" Body1 = \"" + from + "\" Body2 = \"" +
             to + "\" CustomProperties { BindPoint1 = " + literal(start) + " BindPoint2 = " + literal(end) +
             " MaximumDistance = " + literal((end - start).norm()) + " } }\n";
  };
  for (int i = 1; i <= kKnots; ++i) {
    const Vector3 deck(kWidth * i, -kSag - 2.0, 0.0);
    add(name("K", i), 10.0, knot(i)), add(name("D", i), 40.0, deck);
    tie(name("K", i), name("D", i), knot(i), deck);
    tie(i == 1 ? "" : name("K", i - 1), name("K", i), knot(i - 1), knot(i));
  }
  tie("", name("K", kKnots), knot(kKnots + 1), knot(kKnots));
  SceneRun run(
      "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Simulator { CustomProperties { TimeStep = 0.0166666666666666 Duration = 4 } }\n"
      "Environment { Space { Bodies {\n" +
      bodies + "} } Constraints {\n" + ropes + "} }\n");
  run.to_end();
  EXPECT_LE(run.report().max_joint_error(), 1e-5);
  for (int i = 1; i <= kKnots; ++i) EXPECT_LE((run.body(name("K", i)).pose.position - knot(i)).norm(), 1e-3) << i;
}

}  // namespace
}  // namespace gravitas
