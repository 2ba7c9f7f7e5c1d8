// What slides over a floor of many bodies feels no seams, and runs against what stands above it.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::turned;

std::string geometry(const std::string& id, const std::string& type, const std::string& properties) {
  return "Geometry { Id = \"" + id + "\" Type = \"" + type + "\" CustomProperties { " + properties + " } }\n";
}

std::string tile(const std::string& id, const std::string& shape, const Vector3& position,
                 const Quaternion& orientation = Quaternion::Identity()) {
  return "Body { Id = \"" + id + "\" Immovable = true GeometryId = \"" + shape + "\" Material = \"Smooth\"" +
         " KineticProperties { Position = " + literal(position) + " Orientation = " + literal(orientation) + " } }\n";
}

// The tops at y = 0 but where `first_raised` and those after it are raised.
std::string strips(int first_raised = 100, double raised = 0.0) {
  std::string bodies;
  for (int i = 0; i < 10; ++i)
    bodies += tile("Strip" + std::to_string(i), "Strip", {1.0 * i, (i < first_raised ? 0.0 : raised) - 0.5, 0.0});
  return bodies;
}

// Squares of 1 m, turned by 0.35 rad against the way of what slides.
std::string squares() {
  const Quaternion turn = turned(Vector3::UnitY(), 0.35);
  std::string bodies;
  for (int i = -3; i < 9; ++i)
    for (int k = -2; k < 5; ++k)
      bodies += tile("Square" + std::to_string(i + 3) + "_" + std::to_string(k + 2), "Square",
                     turn * Vector3(i, 0, k) - 0.5 * Vector3::UnitY(), turn);
  return bodies;
}

struct Method {
  const char* simulator;
  const char* solver;
  double time_step;
};

class Seams : public ::testing::TestWithParam<Method> {
 protected:
  static std::string scene(const std::string& floor, const std::string& shape, double speed, double duration,
                           const Quaternion& attitude = Quaternion::Identity()) {
    const Method& method = GetParam();
    std::string strip_children;
    for (int i = 0; i < 10; ++i)
      strip_children +=
          std::string(i == 0 ? "" : ", ") + "{\"Strip\", {" + std::to_string(i) + ", 0, 0}, {1, 0, 0, 0}}";
    return "Geometries {\n" + geometry("Strip", "Box", "HalfExtents = {0.5, 0.5, 3}") +
           geometry("Square", "Box", "HalfExtents = {0.5, 0.5, 0.5}") +
           geometry("Box", "Box", "HalfExtents = {0.1, 0.1, 0.1}") +
           geometry("Slab", "Box", "HalfExtents = {1.3, 0.1, 0.8}") +
           geometry("Can", "Cylinder", "Radius = 0.1 Height = 0.2") + geometry("Ball", "Sphere", "Radius = 0.1") +
           geometry(
               "Cube", "TriangleMesh",
               "Vertices = {{-0.1, -0.1, -0.1}, {-0.1, -0.1, 0.1}, {-0.1, 0.1, -0.1}, {-0.1, 0.1, 0.1}, {0.1, -0.1, "
               "-0.1}, {0.1, -0.1, 0.1}, {0.1, 0.1, -0.1}, {0.1, 0.1, 0.1}} Faces = {{0, 2, 6}, {6, 4, 0}, {0, 4, 5}, "
               "{5, 1, 0}, {4, 6, 5}, {5, 6, 7}, {3, 2, 0}, {0, 1, 3}, {3, 6, 2}, {7, 6, 3}, {1, 5, 3}, {3, 5, 7}}") +
           geometry("Feet", "Compound",
                    "Children = {{\"Box\", {-0.3, 0, 0}, {1, 0, 0, 0}}, {\"Box\", {0.3, 0, 0}, {1, 0, 0, 0}}}") +
           geometry("Strips", "Compound", "Children = {" + strip_children + "}") +
           "}\nMaterials { Material { Id = \"Smooth\" StaticFrictionCoefficient = 0 } }\n" +
           "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n" +
           "Simulator { Type = \"" + method.simulator +
           "\" CustomProperties { TimeStep = " + literal(method.time_step) + " Duration = " + literal(duration) +
           " } }\n" + "Environment { Id = \"Floor\" ConstraintSolver = \"" + method.solver +
           "\" KineticIntegrator = \"Verlet\"" + " Space { Type = \"Grid\" Bodies {\n" + floor +
           "Body { Id = \"Slider\" GeometryId = \"" + shape +
           "\" MassDensity = 1000 Material = \"Smooth\" Forces = { \"Down\" } KineticProperties { Position = {0.03, "
           "0.1, 0} " +
           "Orientation = " + literal(attitude) + " LinearVelocity = {" + literal(speed) + ", 0, 0} } }\n} } }\n";
  }
  static void expect_passes(const std::string& scene, double way, const std::string& what) {
    SceneRun run(scene);
    while (!run.is_done()) {
      run.step();
      ASSERT_NEAR(run.body("Slider").pose.position.y(), 0.1, 1e-9) << what << " at " << run.time();
    }
    EXPECT_NEAR(run.body("Slider").pose.position.x(), 0.03 + way, 1e-6) << what;
    EXPECT_NEAR(run.body("Slider").pose.position.z(), 0.0, 1e-9) << what;
  }
};

const auto kSeamMethods =
    ::testing::Values(Method{"Basic", "Sequential", 1.0 / 60}, Method{"Basic", "Newton", 1.0 / 60},
                      Method{"Substepping", "Newton", 1.0 / 60}, Method{"Bisection", "Newton", 0.01},
                      Method{"Continuous", "Newton", 0.01});

std::string name_of_seam_method(const ::testing::TestParamInfo<Method>& test) {
  return std::string(test.param.simulator) + test.param.solver;
}

INSTANTIATE_TEST_SUITE_P(EachSimulator, Seams, kSeamMethods, name_of_seam_method);

// Slower than 2 g h, a body has sunk deeper by the end of the trial than it has come over the next strip.
TEST_P(Seams, AreNotFelt) {
  for (const double speed : {0.1, 0.3, 3.0}) {
    const double duration = speed < 1.0 ? 0.7 / speed : 1.0;
    for (const char* shape : {"Box", "Can", "Ball", "Feet"})
      expect_passes(scene(strips(), shape, speed, duration), speed * duration,
                    std::string(shape) + " at " + std::to_string(speed) + " m/s");
  }
}

TEST_P(Seams, AreNotFeltOnTheSlantOrInOneCompound) {
  for (const double speed : {0.5, 3.0}) {
    const double duration = speed < 1.0 ? 1.4 : 1.0;
    for (const char* shape : {"Box", "Slab", "Cube", "Feet"}) {
      expect_passes(scene(squares(), shape, speed, duration), speed * duration, std::string(shape) + " over squares");
      expect_passes(scene(tile("Floor", "Strips", {0, -0.5, 0}), shape, speed, duration), speed * duration,
                    std::string(shape) + " over a compound");
    }
    expect_passes(scene(strips(), "Box", speed, duration, turned(Vector3::UnitY(), 0.3)), speed * duration,
                  "a box with a corner in front");
  }
}

// Blocks of 2 m with their tops flush, turned with all that is in the scene, and how far from where it should be a slider ends that
// begins before their seam, and comes 0.5 mm over it in a step.
class SeamsOfBlocks : public Seams {
 protected:
  static std::string corners(const Vector3& half) {
    std::string vertices;
    for (int i = 0; i < 8; ++i)
      vertices += (i == 0 ? "" : ", ") +
                  literal(Vector3((i & 4) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                                  (i & 1) != 0 ? half.z() : -half.z()));
    return "Vertices = {" + vertices + "}";
  }
  static std::string mesh(const std::string& id, const Vector3& half) {
    return geometry(id, "TriangleMesh",
                    corners(half) +
                        " Faces = {{0, 2, 6}, {6, 4, 0}, {0, 4, 5}, {5, 1, 0}, {4, 6, 5}, {5, 6, 7}, {3, 2, 0}, "
                        "{0, 1, 3}, {3, 6, 2}, {7, 6, 3}, {1, 5, 3}, {3, 5, 7}}");
  }
  static std::string shapes() {
    const Vector3 block(1.0, 0.2, 1.0);
    return geometry("BoxBlock", "Box", "HalfExtents = " + literal(block)) +
           geometry("HullBlock", "ConvexPolyhedron", corners(block)) + mesh("MeshBlock", block) +
           geometry("Box", "Box", "HalfExtents = {0.2, 0.1, 0.2}") +
           geometry("Hull", "ConvexPolyhedron", corners({0.2, 0.1, 0.2})) +
           geometry("Can", "Cylinder", "Radius = 0.2 Height = 0.2") +
           geometry("Cone", "Cone", "Radius = 0.2 Height = 0.2") + geometry("Ball", "Sphere", "Radius = 0.1");
  }
  static std::string two(const std::string& floor, const Quaternion& turn) {
    return tile("Left", floor, turn * Vector3(-1, -0.2, 0), turn) +
           tile("Right", floor, turn * Vector3(1, -0.2, 0), turn);
  }
  static double miss(const std::string& shapes, const std::string& floor, const std::string& slider, double speed,
                     const Quaternion& turn, const Vector3& half = {0.2, 0.1, 0.2}) {
    const Method& method = GetParam();
    const Vector3 start = turn * Vector3(-half.x() - 0.0995, half.y(), 0), velocity = turn * Vector3(speed, 0, 0);
    SceneRun run(
        "Geometries {\n" + shapes +
        "}\nMaterials { Material { Id = \"Smooth\" StaticFrictionCoefficient = 0 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = " +
        literal(Vector3(turn * Vector3(0, -9.81, 0))) + " } } }\nSimulator { Type = \"" + method.simulator +
        "\" CustomProperties { TimeStep = " + literal(method.time_step) + " Duration = " + literal(0.3 / speed) +
        " } }\nEnvironment { ConstraintSolver = \"" + method.solver +
        "\" KineticIntegrator = \"Verlet\" Space { Bodies {\n" + floor + "Body { Id = \"Slider\" GeometryId = \"" +
        slider +
        "\" Mass = 1 Material = \"Smooth\" Forces = { \"Down\" } KineticProperties { Position = " + literal(start) +
        " Orientation = " + literal(turn) + " LinearVelocity = " + literal(velocity) + " } }\n} } }\n");
    const Vector3 centre = run.body("Slider").pose.position;
    run.to_end();
    const Vector3 end = centre + run.time() * velocity;
    return (run.body("Slider").pose.position - end).norm();
  }
  static std::vector<Quaternion> turns() {
    return {Quaternion::Identity(), turned(Vector3(1, 2, 3).normalized(), 0.7)};
  }
};

INSTANTIATE_TEST_SUITE_P(EachSimulator, SeamsOfBlocks, kSeamMethods, name_of_seam_method);

// Of whatever shape. Where a box was the second of a pair, the plane that it rests on was looked for in a place that nobody had set;
// and of a mesh a side was laid flush with nothing, since it has no face there.
TEST_P(SeamsOfBlocks, OfAnyShapeAreNotFelt) {
  for (const Quaternion& turn : turns())
    for (const std::string floor : {"BoxBlock", "HullBlock", "MeshBlock"})
      for (const std::string slider : {"Box", "Hull", "Can", "Cone", "Ball"})
        for (const double speed : {0.2, 1.0})
          EXPECT_LE(miss(shapes(), two(floor, turn), slider, speed, turn), 1e-6)
              << slider << " over " << floor << " at " << speed << ' ' << turn.w();
}

// Which of two meshes comes first in a pair goes by their size, then by where they are.
TEST_P(SeamsOfBlocks, UnderAMeshOfAnySizeAreNotFelt) {
  for (const Quaternion& turn : turns())
    for (const Vector3& half : {Vector3(0.2, 0.1, 0.2), Vector3(1.0, 0.2, 1.0), Vector3(1.7, 0.1, 1.7)})
      for (const double speed : {0.2, 1.0})
        EXPECT_LE(miss(shapes() + mesh("Slab", half), two("MeshBlock", turn), "Slab", speed, turn, half), 1e-6)
            << half.x() << " at " << speed << ' ' << turn.w();
}

// Where its edge is about to touch the side of the next tile, that contact was told in the middle of the side, as if the tile were no
// floor.
TEST(SeamOfBoxes, IsNotFeltByACornerAtIt) {
  const Quaternion turn(0.10818558134882535, 0.23299521886664257, 0.7258353035900393, 0.6381004780094256);
  const Vector3 g(0.47149016201107646, 2.0992480987818842, -9.571152200591495);
  const Vector3 velocity(1.1440389792254329, 0.3917642056826947, -0.26537190624677826);
  SceneRun run(
      "Geometries {\n" +
      geometry("LeftBlock", "Box", "HalfExtents = {0.30577243600444504, 0.04370574237863131, 0.0566303963082901}") +
      geometry("RightBlock", "Box", "HalfExtents = {0.2699342739469488, 0.13431865135707746, 0.1958867945786137}") +
      geometry("Box", "Box", "HalfExtents = {0.02172321225902461, 0.01293871466377237, 0.01972464954166907}") +
      "}\nMaterials { Material { Id = \"Smooth\" StaticFrictionCoefficient = 0 } }\n"
      "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = " +
      literal(g) +
      " } } }\nSimulator { Type = \"Continuous\" CustomProperties { TimeStep = 0.002095779269032781 Duration = "
      "0.10478896345163907 } }\nEnvironment { ConstraintSolver = \"Newton\" Space { Bodies {\n" +
      tile("Right", "RightBlock", {0.31573413853390225, 0.13777131634578224, -0.23973714155719578}, turn) +
      tile("Left", "LeftBlock", {-0.11229205888064643, 0.10543351140048642, -0.056695101486832274}, turn) +
      "Body { Id = \"Slider\" GeometryId = \"Box\" Mass = 0.10973691186284543 Material = \"Smooth\" Forces = { "
      "\"Down\" } KineticProperties { Position = {0.050776208074834725, -0.0175634249325107, -0.022412556690716078} "
      "Orientation = {-0.7239454318899293, -0.6341570338329736, 0.1201832750224909, 0.24352381503815373} "
      "LinearVelocity = " +
      literal(velocity) + " } }\n} } }\n");
  run.to_end();
  const Vector3 up = turn * Vector3::UnitY();
  const Vector3 end = velocity + run.time() * (g - up.dot(g) * up);
  EXPECT_LE((run.body("Slider").twist.linear - end).norm(), 1e-6);
}

// A cylinder that rolls over a seam at a slant touches the next box with an end of its lowest line first: beside its top, on
// its edge.
TEST_P(Seams, AreNotFeltByACylinderThatRolls) {
  const Method& method = GetParam();
  constexpr double kRadius = 0.1, kRolling = 2.0;
  for (const double slant : {0.05, 0.1, 0.2, 0.35, 0.5}) {
    for (const double time_step : {1.0 / 60, 1.0 / 240}) {
      const Quaternion turn = turned(Vector3::UnitY(), slant);
      const Vector3 ahead = turn * Vector3::UnitX(), axis = turn * Vector3::UnitZ();
      SceneRun run(
          "Geometries {\n" + geometry("Strip", "Box", "HalfExtents = {0.5, 0.5, 1}") +
          geometry("Can", "Cylinder", "Radius = 0.1 Height = 0.3") +
          "}\nMaterials { Material { Id = \"Smooth\" StaticFrictionCoefficient = 0.3 } }\n"
          "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
          "Simulator { Type = \"" +
          method.simulator + "\" CustomProperties { TimeStep = " + literal(time_step) +
          " Duration = 0.5 } }\nEnvironment { ConstraintSolver = \"" + method.solver +
          "\" KineticIntegrator = \"Verlet\" Space { Bodies {\n" + tile("Left", "Strip", {-0.5, -0.5, 0}) +
          tile("Right", "Strip", {0.5, -0.5, 0}) +
          "Body { Id = \"Slider\" GeometryId = \"Can\" Mass = 1 Material = \"Smooth\" Forces = { \"Down\" } "
          "KineticProperties { Position = {-0.5, 0.1, 0} Orientation = " +
          literal(turn * turned(Vector3::UnitX(), 0.5 * std::numbers::pi)) + " LinearVelocity = " +
          literal(kRolling * ahead) + " AngularVelocity = " + literal(-kRolling / kRadius * axis) + " } }\n} } }\n");
      run.to_end();
      const Vector3 end = Vector3(-0.5, kRadius, 0.0) + kRolling * run.time() * ahead;
      EXPECT_LE((run.body("Slider").pose.position - end).norm(), 1e-6) << slant << ' ' << time_step;
    }
  }
}

// Two discs on an axle roll from a box to a mesh: normals that were off by 1e-4 rad looked like flights, 125,000 of them.
TEST(SeamOfAMesh, TakesNoMoreInnerSteps) {
  const Quaternion turn = turned(Vector3::UnitY(), 0.3);
  const Vector3 ahead = turn * Vector3::UnitX(), axis = turn * Vector3::UnitZ();
  SceneRun run(
      "Geometries {\n" + geometry("Strip", "Box", "HalfExtents = {1, 0.5, 1}") +
      geometry("Mesh", "TriangleMesh",
               "Vertices = {{0, 0, -1}, {2, 0, -1}, {2, 0, 1}, {0, 0, 1}} Faces = {{0, 2, 1}, {0, 3, 2}}") +
      geometry("Disc", "Cylinder", "Radius = 0.1 Height = 0.1") +
      geometry("Wheels", "Compound",
               "Children = {{\"Disc\", {0, -0.2, 0}, {1, 0, 0, 0}}, {\"Disc\", {0, 0.2, 0}, {1, 0, 0, 0}}}") +
      "}\nMaterials { Material { Id = \"Smooth\" StaticFrictionCoefficient = 0.3 } }\n"
      "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Simulator { Type = \"Continuous\" CustomProperties { Duration = 0.5 TimeStep = 0.0166666666666666 } }\n"
      "Environment { ConstraintSolver = \"Newton\" KineticIntegrator = \"Verlet\" Space { Bodies {\n" +
      tile("Left", "Strip", {-1, -0.5, 0}) + tile("Right", "Mesh", {0, 0, 0}) +
      "Body { Id = \"Slider\" GeometryId = \"Wheels\" Mass = 1 Material = \"Smooth\" Forces = { \"Down\" } "
      "KineticProperties { Position = {-0.4, 0.1, 0} Orientation = " +
      literal(turn * turned(Vector3::UnitX(), 0.5 * std::numbers::pi)) + " LinearVelocity = " + literal(2.0 * ahead) +
      " AngularVelocity = " + literal(-20.0 * axis) + " } }\n} } }\n");
  run.to_end();
  const Vector3 end = Vector3(-0.4, 0.1, 0.0) + 2.0 * run.time() * ahead;
  EXPECT_LE((run.body("Slider").pose.position - end).norm(), 1e-6);
  EXPECT_LE(run.environment().stage_time(kernel::Stage::kSolve).count(), 3000U);
}

// In the bottom of a groove, and edge first in small triangles, the shortest way out of each triangle leads into another.
TEST(SeamOfAMesh, HoldsWhatComesDeep) {
  const auto run_with = [](const std::string& mesh, const std::string& shape, const Vector3& position,
                           const Quaternion& orientation, double speed, double duration) {
    SceneRun run(
        "Geometries {\n" + geometry("Mesh", "TriangleMesh", mesh) + shape +
        "}\nMaterials { Material { Id = \"Smooth\" StaticFrictionCoefficient = 0.3 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Simulator { CustomProperties { TimeStep = 0.0166666666666666 Duration = " +
        literal(duration) + " } }\nEnvironment { ConstraintSolver = \"Newton\" Space { Bodies {\n" +
        tile("Floor", "Mesh", Vector3::Zero()) +
        "Body { Id = \"Slider\" GeometryId = \"Body\" Mass = 1 Material = \"Smooth\" Forces = { \"Down\" } "
        "KineticProperties { Position = " +
        literal(position) + " Orientation = " + literal(orientation) + " LinearVelocity = {0, " + literal(-speed) +
        ", 0} } }\n} } }\n");
    run.to_end();
    return run.body("Slider").pose.position.y();
  };
  const std::string groove =
      "Vertices = {{-3, 2.517, -3}, {-3, 2.517, 3}, {0, 0, -3}, {0, 0, 3}, {3, 2.517, -3}, {3, 2.517, 3}} "
      "Faces = {{0, 1, 3}, {0, 3, 2}, {2, 3, 5}, {2, 5, 4}}";
  conformance::Draw random(7);
  for (int i = 0; i < 40; ++i) {
    const Quaternion turn = random.pose(1.0).orientation;
    EXPECT_GT(run_with(groove, geometry("Body", "Box", "HalfExtents = {0.3, 0.2, 0.1}"), {0, 0.6, 0}, turn, 0.0, 1.5),
              0.0)
        << i;
    EXPECT_GT(run_with(groove, geometry("Body", "Cone", "Radius = 0.25 Height = 0.5"), {0, 0.6, 0}, turn, 0.0, 1.5),
              0.0)
        << i;
  }
  std::string vertices, faces;
  for (int i = 0; i < 7; ++i) {
    vertices += std::string(i == 0 ? "" : ", ") + "{" + literal(0.5 * i - 1.5) + ", 0, -1.5}, {" +
                literal(0.5 * i - 1.5) + ", 0, 1.5}";
    const std::string a = std::to_string(2 * i), b = std::to_string(2 * i + 1), c = std::to_string(2 * i + 2),
                      d = std::to_string(2 * i + 3);
    if (i < 6)
      faces += std::string(i == 0 ? "" : ", ") + "{" + a + ", " + b + ", " + d + "}, {" + a + ", " + d + ", " + c + "}";
  }
  EXPECT_GT(run_with("Vertices = {" + vertices + "} Faces = {" + faces + "}",
                     geometry("Body", "Box", "HalfExtents = {0.3, 0.02, 0.3}"), {0, 0.38, 0},
                     turned(Vector3::UnitZ(), 1.2) * turned(Vector3::UnitX(), 0.1), 6.0, 0.5),
            -0.05);
}

// A ball on the two edges of a gap, however narrow, has nothing else to rest on.
TEST_P(Seams, WithAGapHoldABall) {
  for (const double gap : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 3e-3, 2e-2}) {
    const double place = 0.03 + 0.5 + 0.5 * gap;
    SceneRun run(
        scene(tile("Left", "Strip", {0.03 - 0.5 - 0.5 * gap, -0.5, 0}) + tile("Right", "Strip", {place, -0.5, 0}),
              "Ball", 0.0, 0.5),
        {"Material.Smooth.StaticFrictionCoefficient=0.5"});
    // as low as between the edges, as high as on a tile
    while (!run.is_done()) {
      run.step();
      ASSERT_GE(run.body("Slider").pose.position.y(), std::sqrt(0.01 - 0.25 * gap * gap) - 2e-7) << "gap " << gap;
      ASSERT_LE(run.body("Slider").pose.position.y(), 0.1 + 2e-7) << "gap " << gap;
    }
    EXPECT_NEAR(run.body("Slider").pose.position.x(), 0.03, 1e-3) << "gap " << gap;
  }
}

TEST_P(Seams, OfStepsAreFelt) {
  SceneRun up(scene(strips(1, 0.004), "Box", 0.5, 1.4));
  up.to_end();
  EXPECT_LT(up.body("Slider").pose.position.x(), 0.4 + 1e-6) << "a kerb of 4 mm";
  SceneRun down(scene(strips(1, -0.004), "Box", 0.5, 1.4));
  down.to_end();
  // it may gain what it falls, once it is over the edge
  const double way = down.body("Slider").pose.position.x() - 0.03;
  EXPECT_GE(way, 0.7 - 1e-3) << "a step down by 4 mm";
  EXPECT_LE(way, 0.4 + (0.7 - 0.4) * std::sqrt(1.0 + 2.0 * kG * 0.004 / (0.5 * 0.5)));
  EXPECT_NEAR(down.body("Slider").pose.position.y(), 0.096, 1e-6);
}

}  // namespace
}  // namespace gravitas
