// Whole scenes of smooth motion with references known beforehand: free bodies to the accuracy of their integrators,
// springs of any stiffness, joined bodies as far as the solver's projection reaches, floating bodies.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::SceneRun;
using harness::set;

// ---- free bodies

// A box of 0.1 x 0.4 x 0.9 m that tumbles about its unstable axis under gravity, 10 s.
std::string tumbling_box(const std::string& integrator, double time_step) {
  return R"(
Geometries { Geometry { Type = "Box" Id = "Box" CustomProperties { HalfExtents = {0.05, 0.2, 0.45} } } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, 0, -9.8} } } }
Simulator { CustomProperties { TimeStep = )" +
         harness::literal(time_step) + R"( Duration = 10 } }
Environment {
  Space { Bodies { Body { Id = "Box" GeometryId = "Box" Mass = 10 Forces = { "Down" }
    KineticProperties { LinearVelocity = {-2, 2, 8} AngularVelocity = {0.1, 5, 0.1} } } } }
  KineticIntegrator )" +
         integrator + "\n}\n";
}

const Quaternion kTumbled(0.2251645634139581639, -0.6199275624994524883, -0.2770291506871945918, 0.6987457236403101407);

struct BoxErrors {
  double angle, energy, spin, position;
};

BoxErrors errors_of(const std::string& integrator, double time_step) {
  SceneRun run(tumbling_box(integrator, time_step));
  const double energy = run.energy();
  const auto spin = [&] {
    const SceneRun::Motion m = run.body("Box");
    return Vector3(run.angular_momentum() - run.mass("Box") * m.pose.position.cross(m.twist.linear));
  };
  const Vector3 before = spin();
  run.to_end();
  const Vector3 right(-20, 20, 80 - 490);
  const SceneRun::Motion end = run.body("Box");
  return {angle_between(end.pose.orientation, kTumbled), std::fabs(run.energy() / energy - 1.0),
          (spin() - before).norm() / before.norm(), (end.pose.position - right).norm() / right.norm()};
}

// Kicks and exact free turning in turn.
TEST(TumblingBox, IsExactBySplitting) {
  for (const std::string integrator : {"SymplecticSplitting", "Verlet", "SemiImplicitEuler"}) {
    for (const double h : {1e-3, 1e-2, 0.5, 10.0}) {
      const BoxErrors e = errors_of("= \"" + integrator + "\"", h);
      EXPECT_LT(e.angle, 1e-8) << integrator << h;
      EXPECT_LT(e.spin, 1e-12) << integrator << h;
      if (integrator == "SemiImplicitEuler") continue;  // falls to first order
      // E has a part m g z with z of 400 m summed from all steps
      EXPECT_LT(e.energy, h < 0.1 ? 1e-10 : 1e-12) << integrator << h;
      EXPECT_LT(e.position, 1e-11) << integrator << h;
    }
  }
}

TEST(TumblingBox, IsAccurateByErrorControl) {
  const BoxErrors e = errors_of("{ Type = \"DormandPrince54\" CustomProperties { Accuracy = 1e-13 } }", 0.5);
  EXPECT_LT(e.angle, 1e-8);
  EXPECT_LT(e.spin, 1e-10);
}

TEST(TumblingBox, IsFollowedByTheOthersToTheirOrder) {
  // at least their order: about an unstable axis the largest part of the error goes with the energy's, one order higher
  struct Bound {
    const char* integrator;
    double order, angle;
  };
  for (const Bound& b : {Bound{"= \"RKMK4\"", 4.0, 1e-7}, Bound{"= \"RK4\"", 4.0, 1e-7},
                         Bound{"= \"ImplicitMidpoint\"", 2.0, 1e-2}, Bound{"= \"BasicVerlet\"", 2.0, 1e-2}}) {
    const double fine = errors_of(b.integrator, 1e-3).angle, coarse = errors_of(b.integrator, 2e-3).angle;
    EXPECT_LT(fine, b.angle) << b.integrator;
    EXPECT_GT(std::log2(coarse / fine), b.order - 0.2) << b.integrator;
  }
}

// ---- springs

// Two balls of 1 kg on a spring between them: they swing at sqrt(2 k), and their centre stays.
std::string two_on_a_spring(const std::string& integrator, double stiffness, double damping, double time_step) {
  return R"(
Forces { Force { Type = "Spring" Id = "Link" CustomProperties { Stiffness = )" +
         harness::literal(stiffness) + " Damping = " + harness::literal(damping) +
         R"( RestLength = 1 AnchorBody = "B" } } }
Simulator { CustomProperties { TimeStep = )" +
         harness::literal(time_step) + R"( Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = { "Link" }
      KineticProperties { Position = {1.2, 0, 0} } }
    Body { Id = "B" Mass = 1 PrincipalMoments = {1, 1, 1} } } }
  KineticIntegrator )" +
         integrator + "\n}\n";
}

TEST(Springs, BetweenBodiesSwingAtTheirFrequency) {
  SceneRun run(two_on_a_spring("= \"SymplecticSplitting\"", 50.0, 0.0, 0.005));
  const double energy = run.energy();
  EXPECT_NEAR(energy, 0.5 * 50.0 * 0.04, 1e-12);
  run.to_end();
  const double length = run.body("A").pose.position.x() - run.body("B").pose.position.x();
  EXPECT_NEAR(length, 1.0 + 0.2 * std::cos(std::sqrt(100.0)), 1e-8);
  // (h w)^4, of 6e-6, times what Suzuki's method leaves of it
  EXPECT_NEAR(run.energy(), energy, 1e-7);
  EXPECT_LT(run.momentum().norm(), 1e-14);
  EXPECT_NEAR(run.body("A").pose.position.x() + run.body("B").pose.position.x(), 1.2, 1e-13);
}

TEST(Springs, OfAnyStiffnessAreHeldAtTheFrameRate) {
  for (double k = 1e2; k < 2e14; k *= 100.0) {
    const double c = 0.2 * std::sqrt(2.0 * k);  // a fifth of critical
    SceneRun run(two_on_a_spring("= \"Rosenbrock\"", k, c, 1.0 / 60.0));
    run.to_end();
    const double length = run.body("A").pose.position.x() - run.body("B").pose.position.x();
    const double w = std::sqrt(2.0 * k - c * c), swing = 0.2 * std::exp(-c) * (std::cos(w) + c / w * std::sin(w));
    EXPECT_NEAR(length, 1.0 + swing, 1e-4) << k;
    EXPECT_LT(run.momentum().norm(), 1e-6) << k;
  }
}

// ---- floating

TEST(Floating, FindsItsDepthAndComesUpright) {
  SceneRun run(R"(
Geometries { Geometry { Type = "Box" Id = "Raft" CustomProperties { HalfExtents = {1, 0.25, 2} } } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } }
  Force { Type = "Buoyancy" Id = "Lake"
    CustomProperties { FluidDensity = 1000 FluidLevel = 3 LinearDrag = 8000 AngularDrag = 8000 } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 40 } }
Environment {
  Space { Bodies { Body { Id = "Raft" GeometryId = "Raft" MassDensity = 600 Forces = { "Down", "Lake" }
    KineticProperties { Position = {0, 4, 0} Orientation = {0.9, 0.3, 0.1, 0.3} } } } }
  KineticIntegrator = "RKMK4"
}
)");
  run.to_end();
  const SceneRun::Motion raft = run.body("Raft");
  // six tenths of its height are under water
  EXPECT_NEAR(raft.pose.position.y(), 3.0 + 0.25 - 0.3, 1e-5);
  EXPECT_NEAR((raft.pose.orientation * Vector3(0, 1, 0)).y(), 1.0, 1e-6);
}

// ---- joined bodies

// A point on a massless rod of 1 m from the horizontal: x, y at 10 s. The simulator Basic projects after a free step,
// so that the order is one: the error, and that it halves with the step.
TEST(JoinedBodies, SwingToFirstOrder) {
  const auto error_at = [](double h) {
    SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { Duration = 10 } }
Environment {
  Space { Bodies { Body { Id = "Bob" Mass = 1 PrincipalMoments = {1e-9, 1e-9, 1e-9} Forces = { "Down" }
    KineticProperties { Position = {-1, 0, 0} } } } }
  Constraints { Constraint { Type = "Spherical" Id = "Pivot" Body2 = "Bob" CustomProperties { BindPoint = {0, 0, 0} } } }
  KineticIntegrator = "SymplecticSplitting"
}
)",
                 {set("Simulator.TimeStep", h)});
    run.to_end();
    EXPECT_LT(run.report().max_joint_error(), 1e-9);
    return (run.body("Bob").pose.position - Vector3(-0.275087462576116860, -0.961419205099125064, 0)).norm();
  };
  const double coarse = error_at(5e-4), fine = error_at(2.5e-4);
  EXPECT_NEAR(coarse / fine, 2.0, 0.5);
  EXPECT_LT(fine, 0.2);
}

}  // namespace
}  // namespace gravitas
