// What `Continuous` with an Accuracy tells of joints and contacts, against closed forms of means over a step: as well as the
// accuracy says, and never beyond what bounds it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/watched_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::set;
using harness::WatchedRun;

constexpr double kStep = 1.0 / 60.0;

Vector3 vector_of(const google::protobuf::RepeatedField<double>& numbers) {
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

std::vector<std::string> settings(double accuracy, const std::string& solver = "Newton") {
  return {"Simulator=Continuous", set("Simulator.Accuracy", accuracy), set("Simulator.TimeStep", kStep),
          "Integrator=Verlet", "Solver=" + solver};
}

std::string scene(const std::string& shapes, const std::string& bodies, const std::string& joints) {
  return shapes +
         "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n" +
         "Simulator { CustomProperties { Duration = 2 SleepEnergy = 0 } }\nEnvironment { Space { Bodies {\n" + bodies +
         "} } Constraints {" + joints + "} }\n";
}

std::string bob(double mass, double moment, const Vector3& at, const Vector3& velocity, const Vector3& spin) {
  return "Body { Id = \"Bob\" Mass = " + literal(mass) +
         " PrincipalMoments = " + literal(Vector3(moment, moment, moment)) +
         " Forces = {\"G\"} KineticProperties { Position = " + literal(at) + " LinearVelocity = " + literal(velocity) +
         " AngularVelocity = " + literal(spin) + " } }\n";
}

// A rotor off its axis at constant speed: the motor bears nothing, the axle m w^2 r, whose direction turns by w h in the step.
TEST(AccurateReactions, OfARotorsMotorAreNone) {
  constexpr double kMass = 2.0, kArm = 0.3, kSpeed = 20.0, kMoment = 0.1;
  for (const char* solver : {"Newton", "Direct"})
    for (const double accuracy : {1e-3, 1e-5, 1e-7, 1e-9}) {
      WatchedRun watched(
          "Environment { Space { Bodies { Body { Id = \"Rotor\" Mass = 2 PrincipalMoments = {0.1, 0.1, 0.1} "
          "KineticProperties { Position = {0.3, 0, 0} LinearVelocity = {0, 6, 0} AngularVelocity = {0, 0, 20} "
          "} } } } Constraints { Constraint { Type = \"AngularMotor\" Id = \"Motor\" Body2 = \"Rotor\" "
          "CustomProperties { AngularSpeed = 20 BindAxisPoint1 = {0, 0, -0.5} BindAxisPoint2 = {0, 0, 0.5} "
          "} } } }\n",
          settings(accuracy, solver));
      // of the velocities' errors, at the start and the end of the step
      const double bound = 2.0 * (kMoment + kMass * kArm * kArm) * kSpeed * accuracy / kStep;
      for (int i = 0; i < 20; ++i) {
        const double middle = (i + 0.5) * kSpeed * kStep;
        watched.run.step();
        const report::v1::Reaction motor = watched.reactions().at(0);
        EXPECT_LE(std::fabs(motor.drive_torque(2)), bound) << solver << ' ' << accuracy << ' ' << i;
        EXPECT_LE(vector_of(motor.torque()).norm(), bound) << solver << ' ' << accuracy << ' ' << i;
        const double mean = kMass * kSpeed * kSpeed * kArm * std::sin(0.5 * kSpeed * kStep) / (0.5 * kSpeed * kStep);
        const Vector3 force = -mean * Vector3(std::cos(middle), std::sin(middle), 0.0);
        // the run may be ahead of its clock by the sum of the errors
        EXPECT_LE((vector_of(motor.force()) - force).norm(), 20.0 * bound + mean * i * accuracy)
            << solver << ' ' << accuracy << ' ' << i;
      }
    }
}

// Its bob goes round at w: the pivot bears the weight and m w^2 r, which turns by w h in the step.
TEST(AccurateReactions, OfAConicalPendulumAreItsTension) {
  constexpr double kMass = 3.0, kLength = 1.5, kAngle = 0.7;
  const double radius = kLength * std::sin(kAngle), height = kLength * std::cos(kAngle), speed = std::sqrt(kG / height);
  for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
    WatchedRun watched(scene("", bob(kMass, 0.05, {radius, -height, 0}, {0, 0, -speed * radius}, {0, speed, 0}),
                             "Constraint { Type = \"Spherical\" Id = \"Pivot\" Body2 = \"Bob\" CustomProperties { "
                             "BindPoint = {0, 0, 0} } }\n"),
                       settings(accuracy));
    for (int i = 0; i < 30; ++i) {
      const Vector3 before = watched.run.body("Bob").twist.linear;
      watched.run.step();
      const Vector3 force = vector_of(watched.reactions().at(0).force());
      // Newton's law over the step, to rounding, whatever the accuracy
      const Vector3 gained = kMass * ((watched.run.body("Bob").twist.linear - before) / kStep + Vector3(0, kG, 0));
      EXPECT_LE((force - gained).norm(), 1e-9) << accuracy << ' ' << i;
      const double angle = 0.5 * speed * kStep, inward = kMass * speed * speed * radius * std::sin(angle) / angle;
      const double bound = 2.0 * kMass * speed * radius * accuracy / kStep;
      EXPECT_NEAR(force.y(), kMass * kG, bound) << accuracy << ' ' << i;
      EXPECT_NEAR(std::hypot(force.x(), force.z()), inward, bound) << accuracy << ' ' << i;
    }
  }
}

// From rest at 60 degrees: m g cos + m w^2 l along the rod and m (g sin - a) across, with a = g sin m l^2 / (m l^2 + I), as a mean
// over the step of the motion itself (RK4 in steps of h/200, Simpson's rule).
TEST(AccurateReactions, OfASwingingHingeAreTheWeightAndTheSwing) {
  constexpr double kMass = 2.0, kLength = 0.8, kMoment = 0.1, kStart = kPi / 3.0;
  const double share = kMass * kLength * kLength / (kMass * kLength * kLength + kMoment);
  const auto pull = [&](double angle, double speed) {
    const Vector3 out(std::sin(angle), -std::cos(angle), 0), ahead(std::cos(angle), std::sin(angle), 0);
    return Vector3(-kMass * (kG * std::cos(angle) + speed * speed * kLength) * out +
                   kMass * kG * std::sin(angle) * (1.0 - share) * ahead);
  };
  for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
    WatchedRun watched(
        scene("",
              bob(kMass, kMoment, {kLength * std::sin(kStart), -kLength * std::cos(kStart), 0}, {0, 0, 0}, {0, 0, 0}),
              "Constraint { Type = \"Revolute\" Id = \"Hinge\" Body2 = \"Bob\" CustomProperties { BindAxisPoint1 = "
              "{0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }\n"),
        settings(accuracy));
    double angle = kStart, speed = 0.0, way = 0.0;
    for (int i = 0; i < 60; ++i) {
      constexpr int kFine = 200;
      const double dt = kStep / kFine;
      const auto turned = [&](double a) { return -share * kG / kLength * std::sin(a); };
      Vector3 mean = Vector3::Zero();
      for (int k = 0; k <= kFine; ++k) {
        const double weight = k == 0 || k == kFine ? 1.0 : (k % 2 == 1 ? 4.0 : 2.0);
        mean += weight / (3.0 * kFine) * pull(angle, speed);
        if (k == kFine) break;
        const double a1 = turned(angle), v2 = speed + 0.5 * dt * a1, a2 = turned(angle + 0.5 * dt * speed);
        const double v3 = speed + 0.5 * dt * a2, a3 = turned(angle + 0.5 * dt * v2), v4 = speed + dt * a3;
        const double a4 = turned(angle + dt * v3);
        angle += dt / 6.0 * (speed + 2.0 * v2 + 2.0 * v3 + v4);
        speed += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      }
      watched.run.step();
      way = std::max(way, std::fabs(speed) * kLength);
      const report::v1::Reaction hinge = watched.reactions().at(0);
      // errors of velocities now, and those of angles and speeds that have summed up
      const double bound = 2.0 * kMass * accuracy / kStep + (i + 1) * accuracy * 4.0 * kMass * kG;
      EXPECT_LE((vector_of(hinge.force()) - mean).norm(), bound) << accuracy << ' ' << i;
      // bears no turn about its axis
      EXPECT_LE(std::fabs(hinge.torque(2)), bound) << accuracy << ' ' << i;
    }
    EXPECT_GT(way, 2.0);
  }
}

// A crate slides to a stop: friction is mu m g on the way, each corner's within its cone, also where it stops.
TEST(AccurateReactions, OfASlidingCrateAreWithinTheirCones) {
  constexpr double kMass = 7.0, kFriction = 0.3;
  for (const char* solver : {"Newton", "Direct", "Sequential"})
    for (const double accuracy : {1e-4, 1e-6}) {
      WatchedRun watched(
          scene("Geometries { Geometry { Type = \"Box\" Id = \"Crate\" CustomProperties { HalfExtents = {0.4, 0.2, "
                "0.3} } } "
                "Geometry { Type = \"Halfspace\" Id = \"Floor\" } }\nMaterials { Material { Id = \"Wood\" "
                "StaticFrictionCoefficient = 0.3 } }\n",
                "Body { Id = \"Ground\" GeometryId = \"Floor\" Material = \"Wood\" Immovable = true }\nBody { Id = "
                "\"Crate\" GeometryId = \"Crate\" Material = \"Wood\" Mass = 7 Forces = {\"G\"} KineticProperties { "
                "Position = {0, 0.2, 0} LinearVelocity = {1, 0, 0.5} } }\n",
                ""),
          settings(accuracy, solver));
      for (int i = 0; i < 30; ++i) {
        const Vector3 before = watched.run.body("Crate").twist.linear;
        watched.run.step();
        const Vector3 after = watched.run.body("Crate").twist.linear;
        Vector3 sum = Vector3::Zero();
        for (const report::v1::Reaction& corner : watched.reactions()) {
          const Vector3 force = vector_of(corner.force());
          sum += force;
          EXPECT_GE(force.y(), 0.0);
          EXPECT_LE(std::hypot(force.x(), force.z()), kFriction * force.y() * (1.0 + 2e-9)) << solver << ' ' << i;
        }
        const Vector3 gained = kMass * ((after - before) / kStep + Vector3(0, kG, 0));
        EXPECT_LE((sum - gained).norm(), 1e-9) << solver << ' ' << accuracy << ' ' << i;
        if (after.norm() > 0.1) {
          EXPECT_NEAR(std::hypot(sum.x(), sum.z()), kFriction * kMass * kG, 1e-6) << solver << ' ' << i;
        }
      }
      EXPECT_LE(watched.run.body("Crate").twist.linear.norm(), 1e-9);
    }
}

// A motor spins a rotor off its axis up with all of its torque, then keeps its speed with none. It never tells more than its bound.
TEST(AccurateReactions, OfABoundedMotorAreWithinItsBound) {
  constexpr double kTorque = 6.0, kSpeed = 8.0, kInertia = 0.1 + 2 * 0.3 * 0.3;
  for (const double accuracy : {1e-4, 1e-6}) {
    WatchedRun watched(
        "Environment { Space { Bodies { Body { Id = \"Rotor\" Mass = 2 PrincipalMoments = {0.1, 0.1, 0.1} "
        "KineticProperties { Position = {0.3, 0, 0} } } } } Constraints { Constraint { Type = \"Revolute\" "
        "Id = \"Motor\" Body2 = \"Rotor\" CustomProperties { AngularSpeed = 8 MaximumTorque = 6 "
        "BindAxisPoint1 = {0, 0, -0.5} BindAxisPoint2 = {0, 0, 0.5} } } } }\n",
        settings(accuracy));
    for (int i = 0; i < 40; ++i) {
      watched.run.step();
      const double told = watched.reactions().at(0).drive_torque(2);
      const double mean =
          std::fmin(kTorque * (i + 1) * kStep / kInertia, kSpeed) - std::fmin(kTorque * i * kStep / kInertia, kSpeed);
      EXPECT_LE(told, kTorque * (1.0 + 1e-9)) << accuracy << ' ' << i;
      EXPECT_NEAR(told, kInertia * mean / kStep, 2.0 * kInertia * kSpeed * accuracy / kStep + 1e-9)
          << accuracy << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace gravitas
