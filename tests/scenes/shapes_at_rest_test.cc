// Every shape on every kind of ground: it stays at its exact rest height in every stable orientation, settles there when
// it was dropped, and slides over flush triangles and boxes without a hop.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;
using harness::turned;

// Grounds whose upper surface is at y = 0 when their frame is at `height`.
struct Ground {
  const char* id;
  double height;
};
constexpr Ground kGrounds[] = {{"Flat", 0}, {"Slab", -0.5}, {"Block", 0}, {"Field", 0}, {"Floor", 0}};

// A stable orientation, and the height of the geometry's origin over the ground in it.
struct Rest {
  const char* shape;
  Vector3 axis;
  double angle;
  double height;
};

std::vector<Rest> rests() {
  const Vector3 x = Vector3::UnitX(), z = Vector3::UnitZ();
  const double quarter = 0.5 * kPi;
  const double cone = std::atan(0.5);         // half angle of the cone, radius 0.4, height 0.8
  const double slope = std::atan2(0.6, 1.0);  // of the wedge's slanted face
  return {{"Ball", x, 0, 0.25},
          {"Brick", x, 0, 0.2},
          {"Brick", x, quarter, 0.3},
          {"Brick", z, quarter, 0.4},
          {"Can", x, 0, 0.25},
          {"Can", x, kPi, 0.25},
          {"Can", x, quarter, 0.3},
          {"Pill", x, quarter, 0.2},
          {"Hat", x, 0, 0.4},
          {"Hat", z, -(quarter + cone), 0.4 * std::sin(cone)},
          {"Wedge", x, 0, 0.2},
          {"Wedge", z, quarter, 0.5},
          {"Wedge", x, quarter, 0.3},
          // the slanted face down: the origin's distance from its plane, through (0.5, -0.2) and (-0.5, 0.4)
          {"Wedge", z, kPi + slope, 0.1 / std::hypot(1.0, 0.6)},
          {"Cube", x, 0, 0.3},
          {"Cube", x, quarter, 0.3},
          {"Table", x, 0, 0.35},
          {"Table", x, kPi, 0.45}};
}

std::vector<std::string> scene_of(const Ground& ground, const std::string& shape, const Vector3& position,
                                  const Quaternion& orientation) {
  return {set("Body.Ground.GeometryId", std::string(ground.id)),
          set("Body.Ground.Position", Vector3(0, ground.height, 0)), set("Body.Thing.GeometryId", shape),
          set("Body.Thing.Position", position), set("Body.Thing.Orientation", orientation)};
}

TEST(ShapesAtRest, StayAtTheirExactHeight) {
  for (const Ground& ground : kGrounds) {
    for (const Rest& rest : rests()) {
      SCOPED_TRACE(std::string(rest.shape) + " on " + ground.id + " turned by " + std::to_string(rest.angle));
      std::vector<std::string> scene =
          scene_of(ground, rest.shape, Vector3(0.3, rest.height, 0.2), turned(rest.axis, rest.angle));
      scene.emplace_back("Simulator.Duration=1");
      SceneRun run("shapes_at_rest.gravitas", scene);
      const Vector3 start = run.body("Thing").pose.position;
      double off = 0.0;
      while (!run.is_done()) {
        run.step();
        off = std::max(off, std::fabs(run.body("Thing").pose.position.y() - start.y()));
      }
      // what the sines of the orientation leave, and rounding
      EXPECT_LE(off, 1e-9);
      EXPECT_LE(run.report().max_penetration(), 1e-9);
    }
  }
}

// Dropped from 5 cm onto a face, a little askew: it ends at the height of that face.
TEST(ShapesAtRest, SettleThereWhenDropped) {
  struct Drop {
    const char* shape;
    double height;
  };
  constexpr Drop kDrops[] = {{"Brick", 0.2},  {"Wedge", 0.2}, {"Cube", 0.3},
                             {"Table", 0.35}, {"Can", 0.25},  {"Hat", 0.4}};
  for (const Ground& ground : kGrounds) {
    for (const Drop& drop : kDrops) {
      SCOPED_TRACE(std::string(drop.shape) + " on " + ground.id);
      SceneRun run("shapes_at_rest.gravitas", scene_of(ground, drop.shape, Vector3(0.3, drop.height + 0.05, 0.2),
                                                       turned(Vector3(1, 0.3, 0.5).normalized(), 0.05)));
      // of the centre of mass over the geometry's origin, upright
      SceneRun upright("shapes_at_rest.gravitas",
                       scene_of(ground, drop.shape, Vector3(0, drop.height, 0), Quaternion::Identity()));
      const double offset = upright.body("Thing").pose.position.y() - drop.height;
      run.to_end();
      const SceneRun::Motion end = run.body("Thing");
      EXPECT_NEAR(end.pose.position.y() - offset, drop.height, 1e-4 * 0.5);
      EXPECT_LE(end.twist.linear.norm() + end.twist.angular.norm(), 1e-6);
    }
  }
}

// Sunk in askew by the landing, a mesh was held by its deepest corner alone: it stayed 12 mm deep and rocked for ever.
// What bounds a body says which pairs are looked at, and nothing else: contacts were told at gaps that went by the declared
// bounds.
TEST(ShapesAtRest, AreTheSameInAnyBound) {
  const auto fallen = [](const std::string& bound, const std::string& shape) {
    std::string bodies = "Body { Id = \"Floor\" GeometryId = \"Ground\" Material = \"Stuff\" }\n";
    for (int i = 0; i < 4; ++i)
      bodies += "Body { Id = \"B" + std::to_string(i) +
                "\" GeometryId = \"Piece\" Material = \"Stuff\" Mass = 1 Forces = {\"Down\"} BoundingVolumeType = \"" +
                bound +
                "\" KineticProperties { Position = " + harness::literal(Vector3(0.2 * i, 0.7 + 0.5 * i, 0.1 * i)) +
                " AngularVelocity = {1, 2, 3} } }\n";
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"Ground\" } Geometry { Id = \"Piece\" " + shape +
        " } }\nMaterials { Material { Id = \"Stuff\" RestitutionCoefficient = 0.3 DynamicFrictionCoefficient = 0.5 } "
        "}\n"
        "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Simulator { CustomProperties { Duration = 1 } }\nEnvironment { Space { Bodies {\n" +
        bodies + "} } }\n");
    run.to_end();
    std::vector<Vector3> places;
    for (int i = 0; i < 4; ++i) places.push_back(run.body("B" + std::to_string(i)).pose.position);
    return places;
  };
  for (const std::string shape : {"Type = \"Sphere\" CustomProperties { Radius = 0.3 }",
                                  "Type = \"Box\" CustomProperties { HalfExtents = {0.5, 0.25, 0.15} }",
                                  "Type = \"Capsule\" CustomProperties { Radius = 0.1 Height = 0.6 }"}) {
    const std::vector<Vector3> right = fallen("AxisAlignedBox", shape);
    for (const char* bound : {"OrientedBox", "Sphere", "None"})
      EXPECT_EQ(fallen(bound, shape), right) << bound << shape;
  }
}

TEST(ShapesAtRest, AMeshComesToRestAsItsHullDoes) {
  const std::string vertices =
      "Vertices = {{-0.10205825317021947, -0.1877919850027808, -0.05149120845061955}, {-0.1864801544411777, "
      "-0.15615848832263804, 0.04782017207280559}, {0.41305541014098746, -0.2734232911297996, -0.14863060885587376}, "
      "{0.3509882720889844, -0.021758394493202576, 0.018670825729707186}, {-0.3355258492802935, 0.3253179151284342, "
      "0.003027138942593488}, {-0.07193480467191435, 0.20877507406104392, 0.13460888145333888}}";
  const std::string faces =
      " Faces = {{4, 2, 0}, {1, 5, 4}, {4, 0, 1}, {1, 0, 2}, {3, 2, 4}, {4, 5, 3}, {3, 1, 2}, {5, 1, 3}}";
  const auto end_of = [](const std::string& type, const std::string& properties) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Box\" Id = \"Half\" CustomProperties { HalfExtents = {0.35, 0.3, 0.7} } }\n"
        "Geometry { Type = \"Compound\" Id = \"Block\" CustomProperties { Children = {{\"Half\", {-0.35, 0, 0}, {1, 0, "
        "0, "
        "0}}, {\"Half\", {0.35, 0, 0}, {1, 0, 0, 0}}} } }\n"
        "Geometry { Type = \"" +
        type + "\" Id = \"Stone\" CustomProperties { " + properties +
        " } } }\nMaterials { Material { Id = \"Rough\" StaticFrictionCoefficient = 0.6 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Simulator { CustomProperties { TimeStep = 0.016666666666666666 Duration = 3 } }\n"
        "Environment { ConstraintSolver = \"Sequential\" KineticIntegrator = \"Verlet\" Space { Bodies {\n"
        "Body { Id = \"Ground\" Immovable = true GeometryId = \"Block\" Material = \"Rough\" "
        "KineticProperties { Position = {0, 0.3, 0} } }\n"
        "Body { Id = \"Thing\" GeometryId = \"Stone\" Mass = 1 Material = \"Rough\" Forces = { \"Down\" } "
        "KineticProperties { Position = {-0.36104876066606084, 0.6529180004796175, -0.02852380537113631} "
        "Orientation = {-0.48394681131049194, -0.31615778481896195, -0.6424732038308962, 0.5030585664513006} } }\n"
        "} } }\n");
    run.to_end();
    return run.body("Thing");
  };
  const SceneRun::Motion mesh = end_of("TriangleMesh", vertices + faces), hull = end_of("ConvexPolyhedron", vertices);
  EXPECT_NEAR(mesh.pose.position.y(), hull.pose.position.y(), 1e-6);
  EXPECT_LE(mesh.twist.linear.norm() + mesh.twist.angular.norm(), 1e-6);
}

// A mesh without thickness, as the floor or far away: the boxes stay where they stand.
TEST(ShapesAtRest, AStackStandsOnAFlatMeshAndBesideOne) {
  const std::string mesh =
      "Geometry { Type = \"TriangleMesh\" Id = \"Sheet\" CustomProperties { Vertices = {{-2, 0, -2}, {-2, 0, 2}, {2, "
      "0, 2}, "
      "{2, 0, -2}} Faces = {{0, 1, 2}, {0, 2, 3}} } }\n";
  const std::string sheet = "Body { Id = \"S\" GeometryId = \"Sheet\" Immovable = true KineticProperties { Position = ";
  for (const std::string& grounds :
       {sheet + "{0, 0, 0} } }\n", sheet + "{50, 0, 0} } }\nBody { Id = \"F\" GeometryId = \"Plane\" }\n"}) {
    std::string boxes;
    for (int i = 0; i < 5; ++i)
      boxes += "Body { Id = \"B" + std::to_string(i) +
               "\" GeometryId = \"Box\" Forces = {\"Down\"} KineticProperties { CanSleep = false Position = " +
               harness::literal(Vector3(0.02 * i, 0.15 + 0.3 * i, 0.03 * (i % 2))) +
               " Orientation = " + harness::literal(turned(Vector3::UnitY(), 0.2 * i)) + " } }\n";
    for (const std::string solver : {"Newton", "Sequential", "Direct"}) {
      SceneRun run(
          "Geometries { Geometry { Type = \"Halfspace\" Id = \"Plane\" } Geometry { Type = \"Box\" Id = \"Box\" "
          "CustomProperties { HalfExtents = {0.1, 0.15, 0.2} } }\n" +
              mesh +
              "}\nForces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } "
              "} }\nEnvironment { Space { Bodies {\n" +
              grounds + boxes + "} } }\n",
          {set("Simulator.TimeStep", 1.0 / 60.0), set("Simulator.Duration", 0.5), "Solver=" + solver});
      run.to_end();
      EXPECT_LT((run.body("B4").pose.position - Vector3(0.08, 1.35, 0)).norm(), 1e-9) << solver << ' ' << grounds;
    }
  }
}

TEST(ShapesAtRest, SlideOverFlushSurfacesWithoutAHop) {
  struct Slide {
    const char* shape;
    double height;
  };
  constexpr Slide kSlides[] = {{"Ball", 0.25}, {"Brick", 0.2},  {"Cube", 0.3},
                               {"Hat", 0.4},   {"Table", 0.35}, {"Wedge", 0.2}};
  for (const Ground& ground : kGrounds) {
    for (const Slide& slide : kSlides) {
      SCOPED_TRACE(std::string(slide.shape) + " on " + ground.id);
      std::vector<std::string> scene =
          scene_of(ground, slide.shape, Vector3(-1.3, slide.height, -0.7), Quaternion::Identity());
      scene.push_back(set("Body.Thing.LinearVelocity", Vector3(4.0, 0, 1.7)));
      scene.emplace_back("Simulator.Duration=1");
      SceneRun run("shapes_at_rest.gravitas", scene);
      const double height = run.body("Thing").pose.position.y();
      while (!run.is_done()) {
        run.step();
        ASSERT_NEAR(run.body("Thing").pose.position.y(), height, 1e-9) << "at " << run.time() << " s";
      }
      EXPECT_GT(run.body("Thing").pose.position.x(), -1.0);
    }
  }
}

}  // namespace
}  // namespace gravitas
