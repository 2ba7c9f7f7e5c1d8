// Bodies that turn far in a step: free, on joints, and where joined ones with a small moment hit the ground.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

// ---- free

class FreeSpin : public ::testing::TestWithParam<const char*> {
 protected:
  static SceneRun thrown(const std::string& radius_and_height, const Vector3& spin) {
    return SceneRun("Geometries { Geometry { Type = \"Cylinder\" Id = \"C\" CustomProperties { " + radius_and_height +
                        " } } }\nSimulator { CustomProperties { TimeStep = 0.0166666666666666 Duration = 5 } }\n"
                        "Environment { Space { Bodies { Body { Id = \"B\" GeometryId = \"C\" Mass = 1 "
                        "KineticProperties { AngularVelocity = " +
                        literal(spin) + " } } } } }\n",
                    {set("Integrator", std::string(GetParam()))});
  }
};

INSTANTIATE_TEST_SUITE_P(Of, FreeSpin, ::testing::Values("SemiImplicitEuler", "Verlet", "SymplecticSplitting"),
                         [](const auto& which) { return std::string(which.param); });

// Pencils and discs that wobble keep their energy and momentum at any spin.
TEST_P(FreeSpin, KeepsEnergyAndMomentum) {
  for (const std::string shape : {"Radius = 0.01 Height = 1", "Radius = 0.3 Height = 0.05"}) {
    for (const double spin : {1.0, 10.0, 100.0, 1e4}) {
      SceneRun run = thrown(shape, {0.1 * spin, spin, 0.0});
      const double energy = run.energy();
      const Vector3 momentum = run.angular_momentum();
      run.to_end();
      EXPECT_LE(std::fabs(run.energy() / energy - 1.0), 1e-13) << shape << ' ' << spin;
      EXPECT_LE((run.angular_momentum() - momentum).norm(), 1e-10 * momentum.norm()) << shape << ' ' << spin;
    }
  }
}

// ---- after an impact

// A ball that slides through its impact leaves with u' = u - mu (1 + e) v and w = 5/2 mu (1 + e) v / r: by 1e4 and 1e8 rad in the step.
TEST(SpinOfAnImpact, OfABallIsAnyNumberOfTurnsAStep) {
  for (const double radius : {3e-3, 1e-7}) {
    SceneRun run("Geometries { Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = " + literal(radius) +
                 " } }\nGeometry { Type = \"Box\" Id = \"P\" CustomProperties { HalfExtents = {9, 0.001, 9} } } }\n"
                 "Materials { Material { Id = \"M\" RestitutionCoefficient = 1 StaticFrictionCoefficient = 0.1 } }\n"
                 "Simulator { Type = \"Continuous\" CustomProperties { TimeStep = 0.1 Duration = 0.3 } }\n"
                 "Environment { Space { Bodies {\n"
                 "Body { Id = \"Plate\" GeometryId = \"P\" Material = \"M\" Immovable = true }\n"
                 "Body { Id = \"Ball\" GeometryId = \"S\" Material = \"M\" Mass = 1 KineticProperties { "
                 "Position = {0, 1, 0} LinearVelocity = {3000, -2300, 0} } } } } }\n");
    run.to_end();
    const double impulse = 0.1 * 2.0 * 2300.0, met = (1.0 - 0.001 - radius) / 2300.0, after = 0.3 - met;
    const Vector3 velocity(3000.0 - impulse, 2300.0, 0.0);
    const auto ball = run.body("Ball");
    EXPECT_LE((ball.twist.linear - velocity).norm(), 1e-9 * velocity.norm()) << radius;
    EXPECT_LE((ball.twist.angular * radius + Vector3(0, 0, 2.5 * impulse)).norm(), 1e-9 * impulse) << radius;
    const Vector3 place = Vector3(3000.0 * met, 0.001 + radius, 0.0) + after * velocity;
    EXPECT_LE((ball.pose.position - place).norm(), 1e-8 * place.norm()) << radius;
  }
}

// ---- on joints

class SpinOnJoints : public ::testing::TestWithParam<const char*> {
 protected:
  // A wheel of 2 kg beside a beam of 10 kg in free space, on an axis along z.
  static std::string wheel(const std::string& joint, double spin, double wobble) {
    return "Geometries { Geometry { Type = \"Cylinder\" Id = \"Wheel\" CustomProperties { Radius = 0.3 Height = 0.2 } "
           "}\n"
           "Geometry { Type = \"Box\" Id = \"Beam\" CustomProperties { HalfExtents = {0.5, 0.1, 0.1} } } }\n"
           "Simulator { CustomProperties { TimeStep = 0.0166666666666666 Duration = 2 } }\n"
           "Environment { CollisionFilter { DefaultAllow = false } Space { Bodies {\n"
           "Body { Id = \"B\" GeometryId = \"Beam\" Mass = 10 KineticProperties { Position = {0, 0.6, 0} "
           "LinearVelocity = {1, 0, 0} AngularVelocity = " +
           literal(Vector3(0, wobble, 0)) +
           " } }\nBody { Id = \"W\" GeometryId = \"Wheel\" Mass = 2 KineticProperties { Position = {0, 0.3, 0.5} "
           "Orientation = {0.70710678118654752, 0.70710678118654752, 0, 0} LinearVelocity = " +
           literal(Vector3(1.0 + 0.5 * wobble, 0, 0)) + " AngularVelocity = " + literal(Vector3(0, wobble, spin)) +
           " } } } }\nConstraints { Constraint { Id = \"J\" Body1 = \"B\" Body2 = \"W\" " + joint + " } } }\n";
  }
  static SceneRun run(const std::string& text) { return SceneRun(text, {set("Solver", std::string(GetParam()))}); }
};

INSTANTIATE_TEST_SUITE_P(Each, SpinOnJoints, ::testing::Values("Sequential", "Newton", "Direct"),
                         [](const auto& which) { return std::string(which.param); });

// Nothing brakes a wheel: its spin stays to second order of the wobble's turn in a step, at 0.5 to 3.3 rad a step.
TEST_P(SpinOnJoints, AWheelKeepsItsSpin) {
  const std::string hinge =
      "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0.3, 0.5} BindAxisPoint2 = {0, 0.3, 1.5} }";
  const std::string axle =
      "Type = \"Axle\" CustomProperties { BindPoint = {0, 0.3, 0.5} SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1} }";
  for (const std::string& joint : {hinge, axle}) {
    for (const double spin : {30.0, 60.0, 120.0, 200.0}) {
      SceneRun scene_run = run(wheel(joint, spin, 0.3));
      const double energy = scene_run.energy();
      scene_run.to_end();
      // in its own axes
      const SceneRun::Motion w = scene_run.body("W");
      EXPECT_NEAR((w.pose.orientation.conjugate() * w.twist.angular).y(), spin, 1e-3 * spin) << joint;
      EXPECT_NEAR(scene_run.energy(), energy, 2e-3 * energy) << joint << spin;
      EXPECT_LE(scene_run.report().max_joint_error(), 1e-6) << joint << spin;
    }
  }
}

// A motor that turns a wheel by 1 to 2.7 rad a step; to first order both then turn steadily.
TEST_P(SpinOnJoints, AFastMotorKeepsItsSpeed) {
  for (const double speed : {60.0, 80.0, 160.0}) {
    SceneRun scene_run =
        run(wheel("Type = \"AngularMotor\" CustomProperties { BindAxisPoint1 = {0, 0.3, 0.5} "
                  "BindAxisPoint2 = {0, 0.3, 1.5} AngularSpeed = " +
                      literal(speed) + " }",
                  0.0, 0.0));
    scene_run.steps(10);
    const double energy = scene_run.energy();
    scene_run.to_end();
    const Vector3 relative = scene_run.body("W").twist.angular - scene_run.body("B").twist.angular;
    EXPECT_NEAR(relative.norm(), speed, 1e-3 * speed) << speed;
    EXPECT_NEAR(scene_run.energy(), energy, 5e-2 * energy) << speed;
  }
}

// ---- against the ground

// Capsules in a row on ball joints or hinges fall, turning, and hit the ground, which turns them about their axes by up to a
// radian in the step: joints stay closed but where the rounds of such a step do not settle, and nothing gains energy.
TEST(SpinAtImpact, JointsOfCapsulesStayClosed) {
  conformance::Draw random(11);
  for (int sample = 0; sample < 24; ++sample) {
    const int count = sample % 2 == 0 ? 2 : 6;
    const bool has_hinges = sample % 4 == 3;
    const Quaternion attitude = random.rotation();
    const Vector3 spin = random.vector(3.0), middle(0, 1.6 + 0.15 * count, 0);
    const Vector3 along = attitude * Vector3::UnitY(), across = attitude * Vector3::UnitX();
    std::string bodies, joints;
    for (int i = 0; i < count; ++i) {
      const Vector3 offset = (i - 0.5 * (count - 1)) * 0.3 * along;
      const std::string id = std::to_string(i);
      bodies += "Body { Id = \"B" + id +
                "\" GeometryId = \"Capsule\" Mass = 2 Forces = { \"Down\" } KineticProperties { " +
                "Position = " + literal(Vector3(middle + offset)) + " Orientation = " + literal(attitude) +
                " LinearVelocity = " + literal(Vector3(spin.cross(offset))) + " AngularVelocity = " + literal(spin) +
                " } }\n";
      if (i == 0) continue;
      const Vector3 point = middle + offset - 0.15 * along;
      joints += "Constraint { Id = \"J" + id + "\" Body1 = \"B" + std::to_string(i - 1) + "\" Body2 = \"B" + id +
                "\" " +
                (has_hinges ? "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = " + literal(point) +
                                  " BindAxisPoint2 = " + literal(Vector3(point + across)) + " } }\n"
                            : "Type = \"Spherical\" CustomProperties { BindPoint = " + literal(point) + " } }\n");
    }
    const std::string text =
        "Geometries { Geometry { Type = \"Capsule\" Id = \"Capsule\" CustomProperties { Radius = 0.05 Height = 0.26 } "
        "}\n"
        "Geometry { Type = \"Halfspace\" Id = \"Flat\" } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Simulator { CustomProperties { TimeStep = 0.0166666666666666 Duration = 2 } }\n"
        "Environment { CollisionFilter { DefaultAllow = false Exceptions { Rule { Allow = true Body = \"Ground\" } } "
        "}\n"
        "Space { Bodies { Body { Id = \"Ground\" GeometryId = \"Flat\" }\n" +
        bodies + "} } Constraints {\n" + joints + "} }\n";
    for (const std::string solver : {"Newton", "Direct"}) {
      SceneRun run(text, {set("Solver", solver)});
      const double energy = run.energy();
      run.to_end();
      EXPECT_LE(run.report().max_joint_error(), 1e-5) << solver << ' ' << sample;
      EXPECT_LT(run.energy(), energy) << solver << ' ' << sample;
    }
  }
}

}  // namespace
}  // namespace gravitas
