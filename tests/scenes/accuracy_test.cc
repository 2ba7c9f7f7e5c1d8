// `Continuous` with an Accuracy where reactions jump (friction that turns back, drives that reach their speed), and where they
// only seem to.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

class AccuracyAtJumps : public ::testing::Test {
 protected:
  static constexpr double kAccuracy = 1e-9;

  static std::vector<std::string> settings(double time_step, double duration, double accuracy = kAccuracy) {
    return {set("Simulator.TimeStep", time_step),
            set("Simulator.Duration", duration),
            "Simulator=Continuous",
            set("Simulator.Accuracy", accuracy),
            "Integrator=Verlet",
            "Solver=Newton"};
  }
  static std::string scene(const std::string& bodies, const std::string& joints) {
    return "Geometries { Geometry { Type = \"Halfspace\" Id = \"Ground\" CustomProperties { } }\n"
           "Geometry { Type = \"Box\" Id = \"Cube\" CustomProperties { HalfExtents = {0.5, 0.05, 0.5} } } }\n"
           "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0.3 } }\n"
           "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
           "Environment { Space { Bodies {\n" +
           bodies + "} }\nConstraints {\n" + joints + "} }\n";
  }
};

// Thrown up a slope that it slides back down on.
TEST_F(AccuracyAtJumps, FrictionTurnsBack) {
  constexpr double kSlope = 0.6, kFriction = 0.3, kEnd = 1.0;
  const double up = kG * (std::sin(kSlope) + kFriction * std::cos(kSlope));
  const double down = kG * (std::sin(kSlope) - kFriction * std::cos(kSlope));
  const Quaternion tilt = harness::turned(Vector3::UnitZ(), kSlope);
  const Vector3 along = tilt * Vector3::UnitX();
  for (const double speed : {1.3, 15.0 / 7.0, 3.1})
    for (const double time_step : {1.0 / 60.0, 1.0 / 240.0}) {
      const std::string q = harness::literal(tilt);
      SceneRun run(
          scene("Body { Id = \"Slope\" GeometryId = \"Ground\" Material = \"M\" KineticProperties { Orientation = " +
                    q + " } }\n" +
                    "Body { Id = \"Box\" GeometryId = \"Cube\" Material = \"M\" Mass = 1 Forces = {\"G\"} "
                    "KineticProperties { Position = " +
                    harness::literal(Vector3(0.05 * (tilt * Vector3::UnitY()))) + " Orientation = " + q +
                    " LinearVelocity = " + harness::literal(Vector3(speed * along)) + " } }\n",
                ""),
          settings(time_step, kEnd));
      run.to_end();
      const double rise = speed / up, fall = kEnd - rise;
      const double way = 0.5 * speed * rise - 0.5 * down * fall * fall;
      EXPECT_NEAR(run.body("Box").pose.position.dot(along), way, 10.0 * kAccuracy) << speed << ' ' << time_step;
      EXPECT_NEAR(run.body("Box").twist.linear.dot(along), -down * fall, 10.0 * kAccuracy) << speed << ' ' << time_step;
    }
}

// A ball with backspin, which was taken for one that bounces in the shortest of trials, by the way that it makes in them: 1500 solutions
// and more of a step.
TEST_F(AccuracyAtJumps, ASlideWithBackspinIsNone) {
  constexpr double kRadius = 0.02, kFriction = 0.3, kEnd = 0.1;
  for (const double spin : {-900.0, 0.0, 900.0}) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"Ground\" CustomProperties { } }\n"
        "Geometry { Type = \"Sphere\" Id = \"Ball\" CustomProperties { Radius = 0.02 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0.3 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies { Body { Id = \"Plane\" GeometryId = \"Ground\" Material = \"M\" }\n"
        "Body { Id = \"Ball\" GeometryId = \"Ball\" Material = \"M\" Mass = 0.05 Forces = {\"G\"} KineticProperties { "
        "Position = {0, 0.02, 0} LinearVelocity = {60, 0, 0} AngularVelocity = {0, 0, " +
            harness::literal(spin) + "} } } } } }\n",
        settings(1.0 / 60.0, kEnd, 1e-6));
    run.to_end();
    const double slowed = kFriction * kG * kEnd;
    EXPECT_NEAR(run.body("Ball").twist.linear.x(), 60.0 - slowed, 1e-8) << spin;
    EXPECT_NEAR(run.body("Ball").twist.angular.z(), spin - slowed * kRadius / (0.4 * kRadius * kRadius), 1e-6) << spin;
    EXPECT_NEAR(run.body("Ball").pose.position.x(), 60.0 * kEnd - 0.5 * slowed * kEnd, 1e-8) << spin;
    for (const auto& stage : run.report().stages())
      if (stage.stage() == "solve") EXPECT_LT(stage.calls(), 6U * 30U) << spin;
  }
}

// Two bodies in free flight bounce until they stay together: from then on a contact without friction does no work. Its gaps of
// rounding crumbled the steps, and what was left of them lost a sixth of the energy.
TEST_F(AccuracyAtJumps, LastingContactsDoNoWork) {
  for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Cylinder\" Id = \"Y\" CustomProperties { Radius = 0.12 Height = 0.3 } }\n"
        "Geometry { Type = \"Capsule\" Id = \"C\" CustomProperties { Radius = 0.08 Height = 0.25 } } }\n"
        "Materials { Material { Id = \"M\" RestitutionCoefficient = 0.3 StaticFrictionCoefficient = 0 } }\n"
        "Environment { Space { Bodies {\n"
        "Body { Id = \"A\" GeometryId = \"C\" Material = \"M\" Mass = 1 KineticProperties { Position = {0, 0.5, 0} "
        "Orientation "
        "= {-0.05185843992237382, -0.11144044551988258, 0.08262137298655965, -0.988971909629876} LinearVelocity = "
        "{0.5114303325363797, -2.1873862180463366, -0.3045465414104413} AngularVelocity = {-1.2441649335730771, "
        "2.7506502454605735, 3.850330504494139} } }\n"
        "Body { Id = \"B\" GeometryId = \"Y\" Material = \"M\" Mass = 1 KineticProperties { Position = {0.03, -0.5, "
        "0.02} "
        "Orientation = {-0.3008801430883417, 0.4206685901620578, -0.019226908050685342, -0.8556514493372964} "
        "LinearVelocity = {0.06080178550706238, 2.0177402948205736, -0.4521461604490816} AngularVelocity = "
        "{3.389375765769463, -4.62947484558819, 0.7838191415598976} } }\n"
        "} } }\n",
        settings(1.0 / 60.0, 0.3, accuracy));
    while (run.time() < 0.199) run.step();
    const double together = run.energy();
    run.to_end();
    // what it loses within the step where the bounces end
    EXPECT_NEAR(run.energy(), together, 2e-3 * together) << accuracy;
  }
}

// A disc of the given energy falls nearly flat on a floor without friction and rises again: its weight is on one point of the
// rim, which goes all around it within some milliseconds. That fast but smooth change was taken for jumps.
TEST_F(AccuracyAtJumps, FastChangesAreNone) {
  for (const double accuracy : {1e-6, 1e-8, 1e-10}) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"F\" }\n"
        "Geometry { Type = \"Cylinder\" Id = \"B\" CustomProperties { Radius = 0.2 Height = 0.04 } } }\n"
        "Materials { Material { Id = \"M\" RestitutionCoefficient = 0 StaticFrictionCoefficient = 0 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies {\n"
        "Body { Id = \"Floor\" GeometryId = \"F\" Material = \"M\" }\n"
        "Body { Id = \"Disc\" GeometryId = \"B\" Material = \"M\" Mass = 1 Forces = {\"G\"} KineticProperties {\n"
        "Position = {0, 0.0963048883417878, 0} Orientation = {0.9800665778412416, 0.19866933079506122, 0, 0}\n"
        "LinearVelocity = {0.2, 0, 0} AngularVelocity = {0, 7.84212198800577, 0.7788366846173009} } }\n"
        "} } }\n",
        settings(1.0 / 60.0, 0.2, accuracy));
    const double start = run.energy();
    run.to_end();
    EXPECT_NEAR(run.energy(), start, 20.0 * accuracy * start) << accuracy;
  }
}

// Two links with springs in their hinges, which touch nothing, against `Smooth` with a method of order 8.
TEST_F(AccuracyAtJumps, SprungLinksAreSmooth) {
  const std::string links =
      "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Environment { Space { Bodies {\n"
      "Body { Id = \"L0\" Mass = 2.1 PrincipalMoments = {0.0026, 0.0258, 0.0258} Forces = {\"G\"} KineticProperties { "
      "Position = {0.124, 0.1077, 0} } }\n"
      "Body { Id = \"L1\" Mass = 1.2 PrincipalMoments = {0.0014, 0.0137, 0.0137} Forces = {\"G\"} KineticProperties { "
      "Position = {0.341, 0.0903, 0} } }\n"
      "} }\nConstraints {\n"
      "Constraint { Type = \"Revolute\" Id = \"J0\" Body2 = \"L0\" CustomProperties { BindAxisPoint1 = {0, 0, 0} "
      "BindAxisPoint2 = {0, 0, 1} Stiffness = 38 RestAngle = 0.38 } }\n"
      "Constraint { Type = \"Revolute\" Id = \"J1\" Body1 = \"L0\" Body2 = \"L1\" CustomProperties { BindAxisPoint1 = "
      "{0.248, 0.2154, 0} BindAxisPoint2 = {0.248, 0.2154, 1} Stiffness = 45 RestAngle = -0.6 } }\n"
      "} }\n";
  const auto end = [&](const std::vector<std::string>& settings) {
    SceneRun run(links, settings);
    run.to_end();
    return run.body("L1").pose.position;
  };
  const Vector3 exact = end({set("Simulator.TimeStep", 1.0 / 60.0), set("Simulator.Duration", 0.1), "Simulator=Smooth",
                             "Integrator=DormandPrince853", set("Integrator.Accuracy", 1e-12), "Solver=Direct"});
  for (const double accuracy : {1e-6, 1e-8})
    EXPECT_LT((end(settings(1.0 / 60.0, 0.1, accuracy)) - exact).norm(), 20.0 * accuracy) << accuracy;
}

// A cam, an eccentric disc that a motor turns, presses a follower against a spring. Trials so short that rounding keeps the two
// apart were taken for jumps, and every step crumbled: 8700 solutions each.
TEST_F(AccuracyAtJumps, PressedContactsAreClosed) {
  for (const double accuracy : {1e-6, 1e-7, 1e-8}) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Cylinder\" Id = \"Disc\" CustomProperties { Radius = 0.06 Height = 0.1 } }\n"
        "Geometry { Type = \"Box\" Id = \"Bar\" CustomProperties { HalfExtents = {0.1, 0.02, 0.05} } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies {\n"
        "Body { Id = \"Cam\" GeometryId = \"Disc\" Material = \"M\" Mass = 1 Forces = {\"G\"} KineticProperties { "
        "Position = {0, -0.02, 0} Orientation = {0.7071067811865476, 0.7071067811865475, 0, 0} "
        "LinearVelocity = {0.5, 0, 0} AngularVelocity = {0, 0, 25} } }\n"
        "Body { Id = \"Follower\" GeometryId = \"Bar\" Material = \"M\" Mass = 0.5 Forces = {\"G\"} KineticProperties "
        "{ "
        "Position = {0, 0.06, 0} } }\n"
        "} }\nConstraints {\n"
        "Constraint { Type = \"AngularMotor\" Id = \"M\" Body2 = \"Cam\" CustomProperties { "
        "BindAxisPoint1 = {0, 0, -0.1} BindAxisPoint2 = {0, 0, 0.1} AngularSpeed = 25 } }\n"
        "Constraint { Type = \"Slider\" Id = \"S\" Body2 = \"Follower\" CustomProperties { BindPoint = {0, 0.06, 0} "
        "Axis = {0, 1, 0} Stiffness = 400 RestPosition = -0.0125 } }\n"
        "} }\n",
        settings(0.001, 0.02, accuracy));
    run.to_end();
    EXPECT_NEAR(run.body("Follower").pose.position.y(), 0.08 - 0.02 * std::cos(25.0 * 0.02), 10.0 * accuracy);
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 20U * 100U) << accuracy;
  }
}

// A ball rolls on a board that a spring lifts: what crumbled was left as single inner steps made it, 1.4e-4 rad/s off.
TEST_F(AccuracyAtJumps, BallsRollOnSprungBoards) {
  const auto spin = [](double accuracy) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Box\" Id = \"P\" CustomProperties { HalfExtents = {1, 0.03, 0.2} } }\n"
        "Geometry { Type = \"Sphere\" Id = \"B\" CustomProperties { Radius = 0.1 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0.5 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies {\n"
        "Body { Id = \"Board\" GeometryId = \"P\" Material = \"M\" Mass = 3 Forces = {\"G\"} }\n"
        "Body { Id = \"Ball\" GeometryId = \"B\" Material = \"M\" Mass = 1 Forces = {\"G\"} KineticProperties { "
        "Position = {0.8, 0.13, 0} } }\n"
        "} }\nConstraints { Constraint { Type = \"Revolute\" Id = \"H\" Body2 = \"Board\" CustomProperties { "
        "BindAxisPoint1 = {-0.9, 0, 0} BindAxisPoint2 = {-0.9, 0, 1} Stiffness = 60 RestAngle = 2 LowerLimit = -0.01 "
        "UpperLimit = 1 } } } }\n",
        settings(1.0 / 60.0, 0.1, accuracy));
    run.to_end();
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 6U * 1000U) << accuracy;
    return run.body("Ball").twist.angular.z();
  };
  const double fine = spin(1e-8);
  for (const double accuracy : {1e-5, 1e-6, 1e-7}) EXPECT_NEAR(spin(accuracy), fine, 20.0 * accuracy) << accuracy;
}

// A ball that rolls on a turning plane: its velocity turns at 2/7 of the plane's rate. The first inner step of each attempt, which
// puts right what the start misses within the accuracy, was taken for an error and for a jump: 22,000 solutions at 1e-8, and the
// more the finer (470,000 at 1e-10).
TEST_F(AccuracyAtJumps, BallsRollOnTurningPlanes) {
  constexpr double kRate = 3.0, kEnd = 2.0, kTurn = 2.0 / 7.0 * kRate;
  const Vector3 start(1.0, 0.1, 0.0), velocity(0.5, 0.0, 0.2);
  const double angle = kTurn * kEnd;
  const Vector3 end = start + (std::sin(angle) / kTurn) * velocity +
                      ((1.0 - std::cos(angle)) / kTurn) * Vector3::UnitY().cross(velocity);
  for (const double accuracy : {1e-6, 1e-7, 1e-8, 1e-9, 1e-10}) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"H\" }\n"
        "Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = 0.1 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 5 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies {\n"
        "Body { Id = \"Plane\" GeometryId = \"H\" Material = \"M\" Kinematic = true KineticProperties { "
        "AngularVelocity = {0, 3, 0} } }\n"
        "Body { Id = \"Ball\" GeometryId = \"S\" Material = \"M\" Mass = 1 Forces = {\"G\"} KineticProperties { "
        "Position = {1, 0.1, 0} LinearVelocity = {0.5, 0, 0.2} AngularVelocity = {32, 0, -5} } }\n"
        "} } }\n",
        settings(1.0 / 60.0, kEnd, accuracy));
    run.to_end();
    EXPECT_LT((run.body("Ball").pose.position - end).norm(), accuracy + 1e-10) << accuracy;
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 60U * 120U) << accuracy;
  }
}

// A thin coin that wobbles as it comes to lie down rolls on its rim, and keeps its energy, whatever it would be if it bounced. The
// point where it rolls comes down faster than it would fall: that was taken for an impact in each inner step, and the shorter
// these the more of them.
TEST_F(AccuracyAtJumps, CoinsRollOnTheirRims) {
  constexpr double kRadius = 0.1, kTilt = 0.1;
  const Quaternion tilt = harness::turned(Vector3::UnitZ(), kTilt);
  const auto run_with = [&](double restitution, double accuracy) {
    const std::string e = harness::literal(restitution);
    const Vector3 centre = tilt * Vector3(kRadius, 0.0005, 0);  // over where its rim touches the ground
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"H\" }\n"
        "Geometry { Type = \"Cylinder\" Id = \"C\" CustomProperties { Radius = 0.1 Height = 0.001 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 5 RestitutionCoefficient = " +
            e +
            " } }\n"
            "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
            "Environment { Space { Bodies {\n"
            "Body { Id = \"Ground\" GeometryId = \"H\" Material = \"M\" Immovable = true }\n"
            "Body { Id = \"Coin\" GeometryId = \"C\" Material = \"M\" Mass = 1 Forces = {\"G\"} "
            "KineticProperties { Position = " +
            harness::literal(centre) + " Orientation = " + harness::literal(tilt) + " AngularVelocity = " +
            harness::literal(Vector3(std::sqrt(4.0 * kG * std::sin(kTilt) / kRadius) * centre.normalized())) +
            " } }\n} } }\n",
        settings(1.0 / 240.0, 0.1, accuracy));
    const double before = run.energy();
    run.to_end();
    EXPECT_NEAR(run.energy(), before, 20.0 * accuracy) << restitution << ' ' << accuracy;
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 24U * 100U)
        << restitution << ' ' << accuracy;
    return run.body("Coin").pose.position;
  };
  for (const double accuracy : {1e-4, 1e-6})
    EXPECT_LT((run_with(0.3, accuracy) - run_with(0.0, accuracy)).norm(), 2.0 * accuracy) << accuracy;
}

// What is large: the first inner step of each attempt puts right more than the accuracy of a start that solvers take for exact, and the
// estimate of three attempts had half of that still, which was taken for a jump: 11,000 solutions a step, and 6e-5 of the energy off.
//
// Euler's disk, steady: its centre rests, its axis turns about the vertical.
TEST_F(AccuracyAtJumps, LargeDisksRollOnTheirRims) {
  constexpr double kTilt = 0.35, kStep = 1.0 / 24.0, kEnd = 6.0 * kStep;
  const Vector3 down(std::cos(kTilt), -std::sin(kTilt), 0.0), axis(std::sin(kTilt), std::cos(kTilt), 0.0);
  for (const double radius : {15.0, 50.0})
    for (const double accuracy : {1e-7, 1e-8, 1e-9}) {
      const double height = 0.01 * radius, across = (3.0 * radius * radius + height * height) / 12.0;
      const Vector3 arm = radius * down - 0.5 * height * axis;
      const double rate = std::sqrt(
          kG * arm.x() * radius /
          (std::sin(kTilt) * (across * radius * std::cos(kTilt) - 0.25 * radius * radius * height * std::sin(kTilt))));
      const Vector3 start(0.0, -arm.y(), 0.0);
      SceneRun run(
          "Geometries { Geometry { Type = \"Halfspace\" Id = \"H\" }\n"
          "Geometry { Type = \"Cylinder\" Id = \"C\" CustomProperties { Radius = " +
              harness::literal(radius) + " Height = " + harness::literal(height) +
              " } } }\nMaterials { Material { Id = \"M\" StaticFrictionCoefficient = 5 } }\n"
              "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} "
              "} } }\nEnvironment { Space { Bodies {\n"
              "Body { Id = \"Ground\" GeometryId = \"H\" Material = \"M\" Immovable = true }\n"
              "Body { Id = \"Disk\" GeometryId = \"C\" Material = \"M\" Mass = 1000 Forces = {\"G\"} "
              "KineticProperties { Position = " +
              harness::literal(start) +
              " Orientation = " + harness::literal(harness::turned(Vector3::UnitZ(), -kTilt)) + " AngularVelocity = " +
              harness::literal(Vector3(-rate * std::sin(kTilt) / radius * arm)) + " } }\n} } }\n",
          settings(kStep, kEnd, accuracy));
      const Quaternion before = run.body("Disk").pose.orientation;
      run.to_end();
      const Vector3 now = run.body("Disk").pose.orientation * (before.conjugate() * axis);
      const Vector3 turned = harness::turned(Vector3::UnitY(), rate * kEnd) * axis;
      EXPECT_LT((run.body("Disk").pose.position - start).norm(), 20.0 * accuracy) << radius << ' ' << accuracy;
      EXPECT_LT((now - turned).norm(), 20.0 * accuracy) << radius << ' ' << accuracy;
      EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 6U * 80U) << radius << ' ' << accuracy;
    }
}

// A rod on a floor without friction: all of the energy of its fall is in its turn and in the speed of its centre.
TEST_F(AccuracyAtJumps, LargeRodsFallOver) {
  constexpr double kLength = 100.0, kRadius = 1.0, kStart = 0.5, kStep = 0.05;
  const Quaternion tilt = harness::turned(Vector3::UnitZ(), -kStart);
  for (const double accuracy : {1e-7, 1e-8, 1e-9}) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"H\" }\n"
        "Geometry { Type = \"Capsule\" Id = \"C\" CustomProperties { Radius = 1 Height = 100 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies {\n"
        "Body { Id = \"Floor\" GeometryId = \"H\" Material = \"M\" Immovable = true }\n"
        "Body { Id = \"Rod\" GeometryId = \"C\" Material = \"M\" Mass = 12 PrincipalMoments = {10000, 100, 10000} "
        "Forces = {\"G\"} KineticProperties { Position = " +
            harness::literal(Vector3(0.0, kRadius + 0.5 * kLength * std::cos(kStart), 0.0)) +
            " Orientation = " + harness::literal(tilt) + " } } } } }\n",
        settings(kStep, 40.0 * kStep, accuracy));
    const Quaternion before = run.body("Rod").pose.orientation;
    run.to_end();
    const auto rod = run.body("Rod");
    const Vector3 along = rod.pose.orientation * (before.conjugate() * (tilt * Vector3::UnitY()));
    const double fallen = 0.5 * kLength * (std::cos(kStart) - along.y());
    const double lever = 0.5 * kLength * along.x();
    EXPECT_NEAR(-rod.twist.angular.z(), std::sqrt(2.0 * kG * fallen / (kLength * kLength / 12.0 + lever * lever)),
                20.0 * accuracy)
        << accuracy;
    EXPECT_NEAR(rod.pose.position.y(), kRadius + 0.5 * kLength * along.y(), 20.0 * accuracy) << accuracy;
    EXPECT_NEAR(rod.pose.position.x(), 0.0, 1e-9) << accuracy;
    EXPECT_GT(fallen, 5.0) << accuracy;
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 40U * 60U) << accuracy;
  }
}

// A ball at rest in a groove, down a slope about X: of the ground's halves the left one has friction, rolling and spinning, too, the
// right one is of the material given, M the same or Ice, which has none.
constexpr double kGrooveSlope = 0.5, kGrooveAngle = 0.8, kGrooveBall = 0.25, kGrooveRolling = 0.003;
std::string groove_beside(const std::string& right) {
  const Quaternion slope = harness::turned(Vector3::UnitX(), kGrooveSlope);
  const auto half = [&](const std::string& material, double angle) {
    return "Body { Id = \"Half" + std::to_string(angle > 0.0) + "\" GeometryId = \"H\" Material = \"" + material +
           "\" KineticProperties { Orientation = " +
           harness::literal(Quaternion(slope * harness::turned(Vector3::UnitZ(), angle))) + " } }\n";
  };
  return "Geometries { Geometry { Type = \"Halfspace\" Id = \"H\" }\n"
         "Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = " +
         harness::literal(kGrooveBall) +
         " } } }\n"
         "Materials { Material { Id = \"Ice\" StaticFrictionCoefficient = 0 } Material { Id = \"M\" "
         "StaticFrictionCoefficient = 0.6 "
         "RollingFrictionCoefficient = " +
         harness::literal(kGrooveRolling) + " SpinningFrictionCoefficient = " + harness::literal(kGrooveRolling) +
         " } }\n"
         "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Environment { Space { Bodies {\n" +
         half("M", kGrooveAngle) + half(right, -kGrooveAngle) +
         "Body { Id = \"Ball\" GeometryId = \"S\" Material = \"M\" Mass = 20 Forces = {\"G\"} KineticProperties { "
         "Position = " +
         harness::literal(Vector3(slope * Vector3(0.0, kGrooveBall / std::cos(kGrooveAngle), 0.0))) + " } } } } }\n";
}

// Where one half has no friction the ball rolls on the other alone, which bears N = m g cos(slope)/(2 cos(half angle)):
// 7/5 a = g sin(slope) - rolling N/(m r).
TEST_F(AccuracyAtJumps, ABallRollsInAGrooveOfWhichOneHalfIsSmooth) {
  constexpr double kStep = 1.0 / 240.0, kEnd = 30.0 * kStep;
  const double normal = kG * std::cos(kGrooveSlope) / (2.0 * std::cos(kGrooveAngle));  // per kg
  const double speed = 5.0 / 7.0 * (kG * std::sin(kGrooveSlope) - kGrooveRolling * normal / kGrooveBall) * kEnd;
  for (const double accuracy : {1e-5, 1e-6, 1e-7}) {
    SceneRun run(groove_beside("Ice"), settings(kStep, kEnd, accuracy));
    run.to_end();
    EXPECT_NEAR(run.body("Ball").twist.linear.norm(), speed, accuracy);
  }
}

// Rolling and spinning friction go by how the two halves squeeze the ball, and that may be anything. Solvers found it otherwise in
// steps of another length, which was taken for a jump: 7,000 solutions a step, and 1 % of the speed.
TEST_F(AccuracyAtJumps, BallsRollInGrooves) {
  constexpr double kStep = 1.0 / 240.0, kEnd = 30.0 * kStep;
  const Quaternion slope = harness::turned(Vector3::UnitX(), kGrooveSlope);
  std::vector<Vector3> speeds;
  for (const double accuracy : {1e-5, 1e-6, 1e-7}) {
    SceneRun run(groove_beside("M"), settings(kStep, kEnd, accuracy));
    run.to_end();
    const auto ball = run.body("Ball");
    const Vector3 along = slope.conjugate() * ball.twist.linear, turning = ball.twist.angular;
    // it touches both, and slips on neither
    EXPECT_LT((along - along.z() * Vector3::UnitZ()).norm(), accuracy) << accuracy;
    EXPECT_LT((turning - along.z() / (kGrooveBall * std::cos(kGrooveAngle)) * Vector3::UnitX()).norm(), accuracy)
        << accuracy;
    EXPECT_NEAR((slope.conjugate() * ball.pose.position).y(), kGrooveBall / std::cos(kGrooveAngle), accuracy)
        << accuracy;
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 30U * 20U) << accuracy;
    speeds.push_back(ball.twist.linear);
  }
  // slower than without friction, by 1/(1 + 2/5 (R/r)^2) of the slope's pull
  const double share = 1.0 / (1.0 + 0.4 / (std::cos(kGrooveAngle) * std::cos(kGrooveAngle)));
  EXPECT_LT(speeds[2].norm(), 0.99 * share * kG * std::sin(kGrooveSlope) * kEnd);
  EXPECT_LT((speeds[1] - speeds[2]).norm(), 1e-6);
  EXPECT_LT((speeds[0] - speeds[2]).norm(), 1e-5);
}

// Six hinged rods between stops, with a rope from the first to the last, fall from level. Each stop and rope that closed was
// searched for to 1e-10 of the step: 24,000 solutions in a second, 0.7 s for one step.
TEST_F(AccuracyAtJumps, StopsOfAChainAreForetold) {
  constexpr double kLength = 0.4;
  const std::vector<double> masses = {1.934, 0.627, 1.505, 1.41, 1.146, 1.992};
  const std::vector<double> spins = {0.896, 0.671, -0.384, 0.162, -0.213, 0.899};
  const std::vector<double> stops = {0.123, 0.394, 0.342, 0.163, 0.389, 0.318};
  std::string bodies, joints;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const std::string id = std::to_string(i), before = std::to_string(i - 1);
    const Vector3 end(kLength * static_cast<double>(i), 0, 0);
    bodies += "Body { Id = \"" + id + "\" Mass = " + harness::literal(masses[i]) +
              " PrincipalMoments = {0.01, 0.02, 0.02} Forces = {\"G\"} KineticProperties { Position = " +
              harness::literal(Vector3(end + Vector3(0.5 * kLength, 0, 0))) +
              " AngularVelocity = " + harness::literal(Vector3(0, 0, spins[i])) + " } }\n";
    joints += "Constraint { Type = \"Revolute\" Id = \"H" + id + "\" " +
              (i > 0 ? "Body1 = \"" + before + "\" Body2 = \"" + id : "Body1 = \"" + id) +
              "\" CustomProperties { BindAxisPoint1 = " + harness::literal(end) +
              " BindAxisPoint2 = " + harness::literal(Vector3(end + Vector3::UnitZ())) +
              " LowerLimit = " + harness::literal(-stops[i]) + " UpperLimit = " + harness::literal(stops[i]) + " } }\n";
  }
  joints +=
      "Constraint { Type = \"Distance\" Id = \"Rope\" Body1 = \"0\" Body2 = \"5\" CustomProperties { "
      "BindPoint1 = {0.1, 0, 0} BindPoint2 = {2.3, 0, 0} MaximumDistance = 2.2 } }\n";
  const auto run_to_end = [&](double accuracy, std::size_t most_solutions) {
    SceneRun run(scene(bodies, joints), settings(1.0 / 60.0, 1.0, accuracy));
    run.to_end();
    EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), most_solutions) << accuracy;
    return run.body("5").pose.position;
  };
  EXPECT_LT((run_to_end(1e-4, 6'000) - run_to_end(1e-7, 15'000)).norm(), 1e-5);
}

// A load that falls through the speed of a drive of half its weight: pushed down before, held after.
TEST_F(AccuracyAtJumps, DrivesReachTheirSpeed) {
  constexpr double kEnd = 0.5;
  for (const double speed : {0.5, 0.775, 1.1})
    for (const double time_step : {1.0 / 60.0, 1.0 / 240.0}) {
      SceneRun run(
          scene("Body { Id = \"Ground\" GeometryId = \"Ground\" Material = \"M\" KineticProperties { Position = {0, "
                "-9, 0} } }\n"
                "Body { Id = \"Load\" GeometryId = \"Cube\" Material = \"M\" Mass = 2 Forces = {\"G\"} }\n",
                "Constraint { Type = \"Slider\" Id = \"J\" Body2 = \"Load\" CustomProperties { BindPoint = {0, 0, 0} "
                "Axis = {0, 1, 0} MaximumForce = 9.81 Speed = " +
                    harness::literal(-speed) + " } }\n"),
          settings(time_step, kEnd));
      run.to_end();
      const double reached = speed / (1.5 * kG);
      EXPECT_NEAR(run.body("Load").twist.linear.y(), -speed - 0.5 * kG * (kEnd - reached), 10.0 * kAccuracy)
          << speed << ' ' << time_step;
    }
}

// A box that leans on another, whose side a ball hits, comes down flat on it about an edge: all corners meet at once, whatever
// the accuracy. Corner by corner it would leave at 0.2 m/s instead of 0.05; with the coarsest accuracy it is 3 mm/s off.
TEST_F(AccuracyAtJumps, FacesThatLandAboutAnEdgeMeetAtOnce) {
  const std::string text = R"(
Geometries {
  Geometry { Type = "Box" Id = "Floor" CustomProperties { HalfExtents = {4, 0.3, 4} } }
  Geometry { Type = "Box" Id = "Brick" CustomProperties { HalfExtents = {0.2, 0.1, 0.3} } }
  Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.15 } }
}
Materials { Material { Id = "M" RestitutionCoefficient = 0.3 StaticFrictionCoefficient = 0.4 } }
Forces { Force { Type = "Gravity" Id = "G" CustomProperties { Acceleration = {0.7, -9.81, 0.3} } } }
Environment { Space { Bodies {
  Body { Id = "F" GeometryId = "Floor" Material = "M" Immovable = true KineticProperties { Position = {0, -0.3, 0} } }
  Body { Id = "Lower" GeometryId = "Brick" Material = "M" Mass = 1 KineticProperties { Position = {0, 0.1, 0} } Forces = {"G"} }
  Body { Id = "Upper" GeometryId = "Brick" Material = "M" Mass = 2 KineticProperties { Position = {0.05, 0.3, 0.02} Orientation = {0.9800665778412416, 0, 0.19866933079506122, 0} } Forces = {"G"} }
  Body { Id = "B" GeometryId = "Ball" Material = "M" Mass = 1.5 KineticProperties { Position = {-1.2, 0.25, 0.1} LinearVelocity = {5, 0.2, 0} AngularVelocity = {0, 3, 1} } Forces = {"G"} }
} } }
)";
  const auto velocity = [&](const std::string& solver, double accuracy) {
    std::vector<std::string> all = settings(1.0 / 120.0, 0.36, accuracy);
    all.back() = "Solver=" + solver;
    SceneRun run(text, all);
    run.to_end();
    return run.body("Upper").twist.linear;
  };
  const Vector3 expected = velocity("Direct", 1e-7);
  EXPECT_LT(expected.y(), 0.1);
  for (const std::string solver : {"Direct", "Newton"})
    for (const double accuracy : {1e-4, 2e-5, 7e-6, 1e-6})
      EXPECT_LT((velocity(solver, accuracy) - expected).norm(), 5e-3) << solver << ' ' << accuracy;
}

}  // namespace
}  // namespace gravitas
