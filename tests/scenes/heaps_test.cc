// Heaps that fall and come to rest without one body ending in another.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;

std::string body(const std::string& id, const Vector3& place, const Quaternion& attitude, const std::string& more) {
  return "Body { Id = \"" + id + "\" Material = \"Rough\" " + more +
         " KineticProperties { CanSleep = false Position = " + literal(place) + " Orientation = " + literal(attitude) +
         " } }\n";
}

std::string scene(const std::string& shape, double duration, const std::string& bodies) {
  return "Geometries { Geometry { Type = \"Halfspace\" Id = \"Flat\" } Geometry { Id = \"Piece\" " + shape +
         " } }\nMaterials { Material { Id = \"Rough\" DynamicFrictionCoefficient = 0.5 } }\n"
         "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { CustomProperties { Duration = " +
         literal(duration) + " } }\nEnvironment { Space { Bodies {\n" + bodies + "} } }\n";
}

const std::string kPiece = "GeometryId = \"Piece\" Mass = 1 Forces = {\"Down\"}", kFlat = "GeometryId = \"Flat\"";

// Balls that others push aside must not end in balls that do not move: there were 8 cm of overlap.
TEST(Heaps, OfBallsDoNotOverlap) {
  constexpr int kCount = 216;
  constexpr double kRadiusOfBall = 0.1;
  conformance::Draw draw(216);
  std::string bodies = body("Floor", Vector3::Zero(), Quaternion::Identity(), kFlat);
  std::vector<std::string> ids;
  for (int i = 0; i < kCount; ++i) {
    ids.push_back("B" + std::to_string(i));
    const Vector3 place = Vector3(0, 0.3, 0) + 0.25 * Vector3(i % 6, i / 36, i / 6 % 6) + draw.vector(0.01);
    bodies += body(ids.back(), place, Quaternion::Identity(), kPiece);
  }
  SceneRun run(scene("Type = \"Sphere\" CustomProperties { Radius = 0.1 }", 1.5, bodies));
  double deepest = 0.0;
  while (!run.is_done()) {
    run.step();
    std::vector<Vector3> places;
    for (const std::string& id : ids) places.push_back(run.body(id).pose.position);
    for (std::size_t i = 0; i < places.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        deepest = std::max(deepest, 2.0 * kRadiusOfBall - (places[i] - places[k]).norm());
  }
  EXPECT_LT(deepest, 0.02);
}

// Depth of two cubes by the fifteen separating axes, m.
double depth_of(double half, const Pose& a, const Pose& b) {
  const Matrix3 A = a.orientation.toRotationMatrix(), B = b.orientation.toRotationMatrix();
  double least = 2.0 * half;
  const auto try_axis = [&](const Vector3& axis) {
    if (axis.norm() < 1e-6) return;
    const Vector3 n = axis.normalized();
    const double reach = half * ((A.transpose() * n).cwiseAbs().sum() + (B.transpose() * n).cwiseAbs().sum());
    least = std::min(least, reach - std::fabs(n.dot(b.position - a.position)));
  };
  for (int i = 0; i < 3; ++i) {
    try_axis(A.col(i));
    try_axis(B.col(i));
    for (int k = 0; k < 3; ++k) try_axis(A.col(i).cross(B.col(k)));
  }
  return least;
}

// How deep, in m, any two of 64 cubes lie in each other, and how fast one still is, in m/s, 2.5 s after they are let go.
struct Rest {
  double deepest = 0.0, fastest = 0.0;
};

Rest rest_of_cubes(std::uint64_t seed) {
  constexpr int kCount = 64;
  constexpr double kHalf = 0.25, kWall = 1.5;
  conformance::Draw draw(seed);
  std::string bodies = body("Floor", Vector3::Zero(), Quaternion::Identity(), kFlat);
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0.0 ? "Left" : "Right";
    bodies += body(name, {side * kWall, 0, 0}, harness::turned(Vector3::UnitZ(), side * 0.5 * kPi), kFlat);
    bodies += body(name + "Back", {0, 0, side * kWall}, harness::turned(Vector3::UnitX(), -side * 0.5 * kPi), kFlat);
  }
  std::vector<std::string> ids;
  for (int i = 0; i < kCount; ++i) {
    ids.push_back("C" + std::to_string(i));
    const Vector3 place = 0.75 * Vector3(i % 4 - 1.5, i / 16 + 1, i / 4 % 4 - 1.5);
    bodies += body(ids.back(), place, draw.rotation(), kPiece);
  }
  SceneRun run(scene("Type = \"Box\" CustomProperties { HalfExtents = {0.25, 0.25, 0.25} }", 2.5, bodies));
  run.to_end();
  Rest rest;
  for (const std::string& one : ids) {
    rest.fastest = std::max(rest.fastest, run.body(one).twist.linear.norm());
    for (const std::string& other : ids)
      if (one < other) rest.deepest = std::max(rest.deepest, depth_of(kHalf, run.body(one).pose, run.body(other).pose));
  }
  return rest;
}

// The report counts the overlap of the initial state, from which the first step has freed the ball.
TEST(Heaps, TheirFirstOverlapIsInTheReport) {
  SceneRun run(scene("Type = \"Sphere\" CustomProperties { Radius = 0.5 }", 1.0,
                     body("Floor", Vector3::Zero(), Quaternion::Identity(), kFlat) +
                         body("Ball", Vector3(0, 0.4, 0), Quaternion::Identity(), kPiece)));
  run.to_end();
  EXPECT_NEAR(run.body("Ball").pose.position.y(), 0.5, 1e-9);
  EXPECT_NEAR(run.report().max_penetration(), 0.1, 1e-12);
}

// Bodies of one place, of which some push each other away in a circle: they part, none through the floor, and none with speed
// (there were 8 cm below it).
TEST(Heaps, OfOnePlacePart) {
  const std::string box = "Type = \"Box\" CustomProperties { HalfExtents = {0.2, 0.2, 0.2} }";
  const std::string cylinder = "Type = \"Cylinder\" CustomProperties { Radius = 0.2 Height = 0.4 }";
  for (const char* solver : {"Newton", "Direct"}) {
    for (const auto& [shape, count] : {std::pair(box, 3), std::pair(box, 4), std::pair(cylinder, 3)}) {
      std::string bodies = body("Floor", Vector3::Zero(), Quaternion::Identity(), kFlat);
      std::vector<std::string> ids;
      for (int i = 0; i < count; ++i) {
        ids.push_back("B" + std::to_string(i));
        bodies += body(ids.back(), Vector3(0, 0.2, 0), Quaternion::Identity(), kPiece);
      }
      SceneRun run(scene(shape, 1.0, bodies), {harness::set("Solver", std::string(solver))});
      while (!run.is_done()) {
        run.step();
        for (const std::string& id : ids) {
          EXPECT_GE(run.body(id).pose.position.y(), 0.2 - 1e-6) << solver << ", " << count;
          EXPECT_LE(run.body(id).twist.linear.norm(), 1e-3) << solver << ", " << count;
        }
      }
      for (const std::string& one : ids)
        for (const std::string& other : ids)
          if (one < other)
            EXPECT_GE((run.body(one).pose.position - run.body(other).pose.position).norm(), 0.4 - 1e-6)
                << solver << ", " << count;
    }
  }
}

// Cubes that lie on each other crosswise touch in all of their common face, else they rock from edge to edge for ever: there
// were 15 to 60 mm of overlap, and 0.5 m/s.
// A heap is chaos, and in one of five a cube still tips: the median of three.
TEST(Heaps, OfCubesComeToRest) {
  std::vector<double> deepest, fastest;
  for (std::uint64_t seed = 64; seed < 67; ++seed) {
    const Rest rest = rest_of_cubes(seed);
    deepest.push_back(rest.deepest), fastest.push_back(rest.fastest);
  }
  std::ranges::sort(deepest), std::ranges::sort(fastest);
  EXPECT_LT(deepest[1], 1e-3);
  EXPECT_LT(fastest[1], 0.1);
}

}  // namespace
}  // namespace gravitas
