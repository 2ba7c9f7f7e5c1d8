// `Smooth` ends its inner steps where stops are met: what bounces there keeps its energy, and motion the integrator's order.
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

std::string scene(const std::string& forces, const std::string& bodies, const std::string& joints, double time_step,
                  double duration, const std::string& integrator = "RK4") {
  return "Forces { " + forces +
         " }\nSimulator { Type = \"Smooth\" CustomProperties { TimeStep = " + literal(time_step) +
         " Duration = " + literal(duration) + " } }\nEnvironment { Space { Bodies { " + bodies + " } } Constraints { " +
         joints + " } KineticIntegrator = \"" + integrator + "\" ConstraintSolver = \"Direct\" }\n";
}

std::string slider(double lower, double upper, double restitution) {
  return "Constraint { Type = \"Slider\" Id = \"Rail\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} Axis = "
         "{1, 0, 0} LowerLimit = " +
         literal(lower) + " UpperLimit = " + literal(upper) + " Restitution = " + literal(restitution) + " } }";
}

std::string ball(const Vector3& at, const Vector3& velocity, const std::string& force) {
  return "Body { Id = \"A\" Mass = 2 PrincipalMoments = {1, 1, 1} Forces = {" + force +
         "} KineticProperties { Position = " + literal(at) + " LinearVelocity = " + literal(velocity) + " } }";
}

std::vector<double> times_of_stops(const SceneRun& run) {
  std::vector<double> times;
  for (const Event& event : run.events())
    if (event.kind == EventKind::kLimitStart) times.push_back(event.time);
  return times;
}

const std::string kDown =
    "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {-9.81, 0, 0} } }";

// From a height of h with e = 1: it is at the stop at sqrt(2 h/g) (1, 3, 5 ...), and its energy is what it was.
TEST(StopsOfSmooth, AreMetWhenTheyAre) {
  for (const double h : {1.0 / 60.0, 1.0 / 240.0, 1e-3}) {
    SceneRun run(scene(kDown, ball({0, 0, 0}, {0, 0, 0}, "\"Down\""), slider(-1.0, 1.0, 1.0), h, 10.0));
    const double energy = run.energy();
    run.to_end();
    const double fall = std::sqrt(2.0 / kG);
    const std::vector<double> times = times_of_stops(run);
    ASSERT_EQ(times.size(), static_cast<std::size_t>(0.5 * (10.0 / fall + 1.0))) << h;
    for (std::size_t k = 0; k < times.size(); ++k)
      EXPECT_NEAR(times[k], (2.0 * static_cast<double>(k) + 1.0) * fall, 1e-7) << h << ' ' << k;
    EXPECT_NEAR(run.energy(), energy, 1e-9) << h;
    const double since = std::fmod(10.0 + fall, 2.0 * fall) - fall;
    EXPECT_NEAR(run.body("A").pose.position.x(), -0.5 * kG * since * since, 1e-7) << h;
  }
}

// On a spring between two stops, of a guide's own as of a suspension: between them it is a part of the sine, which the stops turn over.
TEST(StopsOfSmooth, LeaveMotionItsOrder) {
  constexpr double kSpring = 50.0, kMass = 2.0, kStop = 0.06, kSpeed = 0.5;
  const double rate = std::sqrt(kSpring / kMass), amplitude = kSpeed / rate;
  const double half = 2.0 * std::asin(kStop / amplitude) / rate;  // from stop to stop
  const std::string coil = "Force { Type = \"Spring\" Id = \"Coil\" CustomProperties { Stiffness = 50 } }";
  const std::string suspension =
      "Constraint { Type = \"Axle\" Id = \"Rail\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} SteeringAxis "
      "= "
      "{1, 0, 0} RollingAxis = {0, 1, 0} SuspensionStiffness = 50 Restitution = 1 SuspensionLowerLimit = " +
      literal(-kStop) + " SuspensionUpperLimit = " + literal(kStop) + " } }";
  for (const bool is_sprung : {false, true}) {
    const auto error = [&](double h) {
      SceneRun run(scene(is_sprung ? "" : coil, ball({0, 0, 0}, {kSpeed, 0, 0}, is_sprung ? "" : "\"Coil\""),
                         is_sprung ? suspension : slider(-kStop, kStop, 1.0), h, 4.0));
      run.to_end();
      EXPECT_GT(run.count_events(EventKind::kLimitStart), 10U);
      const double phase = std::fmod(4.0 + 0.5 * half, 2.0 * half) - 0.5 * half;
      const double right = amplitude * std::sin(rate * (phase <= 0.5 * half ? phase : half - phase));
      return std::fabs(run.body("A").pose.position.x() - right);
    };
    const double coarse = error(0.02), fine = error(0.01), finest = error(0.005);
    EXPECT_LT(coarse, 2e-5);
    EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.4) << is_sprung;
    EXPECT_NEAR(std::log2(fine / finest), 4.0, 0.4) << is_sprung;
  }
}

// A preloaded spring presses the wheel on one stop, from which it is thrown again and again: x + d = A cos(rate t) in between.
TEST(StopsOfSmooth, LeaveAPreloadedSuspensionItsOrder) {
  constexpr double kSpring = 50.0, kMass = 2.0, kPreload = 4.0, kStop = 0.06, kSpeed = 0.5;
  const double rate = std::sqrt(kSpring / kMass), rest = kPreload / kSpring;
  const double amplitude = std::hypot(rest, kSpeed / rate), top = std::acos(rest / amplitude) / rate;
  const double period = 2.0 * std::acos((rest - kStop) / amplitude) / rate;  // from stop to stop
  const auto error = [&](double h) {
    SceneRun run(
        scene("", ball({0, 0, 0}, {kSpeed, 0, 0}, ""),
              "Constraint { Type = \"Axle\" Id = \"Rail\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} "
              "SteeringAxis = {1, 0, 0} RollingAxis = {0, 1, 0} SuspensionStiffness = 50 SuspensionPreload = 4 "
              "SuspensionLowerLimit = -0.06 Restitution = 1 } }",
              h, 4.0));
    run.to_end();
    EXPECT_EQ(run.count_events(EventKind::kLimitStart), static_cast<std::uint32_t>((4.0 - top) / period + 0.5));
    const double since = std::fmod(4.0 - top + 0.5 * period, period) - 0.5 * period;
    return std::fabs(run.body("A").pose.position.x() - (amplitude * std::cos(rate * since) - rest));
  };
  const double coarse = error(0.02), fine = error(0.01), finest = error(0.005);
  EXPECT_LT(coarse, 2e-5);
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.4);
  EXPECT_NEAR(std::log2(fine / finest), 4.0, 0.4);
}

// Pressed on its stop by a force that falls evenly and turns at 1/3 s, a sprung slider leaves it; braked with as much as a force
// that grows as evenly has then, it begins to slip: x = a (t - sin(rate t)/rate).
TEST(StopsOfSmooth, LeaveMotionItsOrderWhereTheyOpenOrSlip) {
  const double rate = std::sqrt(5.0 / 2.0), since = 0.96 - 1.0 / 3.0;
  struct Held {
    const char *push, *by;
  };
  for (const Held& held : {Held{"{{0, {-3, 0, 0}}, {1, {6, 0, 0}}}", "LowerLimit = 0"},
                           Held{"{{0, {0, 0, 0}}, {1, {9, 0, 0}}}", "Speed = 0 MaximumForce = 3"}}) {
    const auto error = [&](double h, const char* integrator) {
      SceneRun run(scene(
          "Force { Type = \"Basic\" Id = \"Push\" CustomProperties { Table = " + std::string(held.push) + " } }",
          ball({0, 0, 0}, {0, 0, 0}, "\"Push\""),
          "Constraint { Type = \"Slider\" Id = \"Rail\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} Axis = "
          "{1, 0, 0} Stiffness = 5 RestPosition = 0 " +
              std::string(held.by) + " } }",
          h, 0.96, integrator));
      run.to_end();
      return std::max(std::fabs(run.body("A").pose.position.x() - 1.8 * (since - std::sin(rate * since) / rate)),
                      std::fabs(run.body("A").twist.linear.x() - 1.8 * (1.0 - std::cos(rate * since))));
    };
    const double coarse = error(0.04, "RK4"), fine = error(0.02, "RK4"), finest = error(0.01, "RK4");
    EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.4) << held.by;
    EXPECT_NEAR(std::log2(fine / finest), 4.0, 0.4) << held.by;
    EXPECT_LT(error(0.04, "DormandPrince54"), 2e-9) << held.by;
    EXPECT_LT(error(0.04, "DormandPrince853"), 2e-9) << held.by;
  }
}

// Swung up on a rope of 1 m at v^2 = 7/2 g, a body leaves the circle 30 degrees above its centre, where v^2 = g/2: it flies on level.
TEST(StopsOfSmooth, LeaveMotionItsOrderWhereARopeGoesSlack) {
  const auto error = [&](double h, const char* integrator) {
    SceneRun run(
        scene(kDown, ball({-1, 0, 0}, {0, std::sqrt(3.5 * kG), 0}, "\"Down\""),
              "Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"A\" CustomProperties { BindPoint1 = {0, 0, 0} "
              "BindPoint2 = {-1, 0, 0} MaximumDistance = 1 } }",
              h, 0.72, integrator));
    run.to_end();
    EXPECT_LT(run.body("A").pose.position.norm(), 0.99);
    return std::fabs(run.body("A").twist.linear.y() + 0.5 * std::sqrt(0.5 * kG));
  };
  EXPECT_LT(error(0.01, "RK4"), 2e-7);
  EXPECT_LT(error(0.005, "RK4"), 2e-8);
  EXPECT_LT(error(0.0025, "RK4"), 2e-9);
  EXPECT_LT(error(0.02, "DormandPrince54"), 5e-9);
  EXPECT_LT(error(0.02, "DormandPrince853"), 1e-9);
}

// What such a rope bears falls faster and faster: the secant of a trial that ends early in the step leads beyond its end. Wherever
// in a step it goes slack, along the chord it flies as fast as the circle let it go.
TEST(StopsOfSmooth, LeaveMotionItsOrderWhereverInAStepARopeGoesSlack) {
  for (int k = 0; k < 60; ++k) {
    const double h = 0.02 * (1.0 + k / 120.0);
    SceneRun run(
        scene(kDown, ball({-1, 0, 0}, {0, std::sqrt(3.5 * kG), 0}, "\"Down\""),
              "Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"A\" CustomProperties { BindPoint1 = {0, 0, "
              "0} BindPoint2 = {-1, 0, 0} MaximumDistance = 1 } }",
              h, 0.72, "DormandPrince853"));
    run.to_end();
    EXPECT_LT(run.body("A").pose.position.norm(), 0.99);
    EXPECT_NEAR(run.body("A").twist.linear.y(), -0.5 * std::sqrt(0.5 * kG), 1e-11) << h;
  }
}

// e = 1/2 on a load: it comes to rest after sqrt(2 h/g) (1 + e)/(1 - e), and rests.
TEST(StopsOfSmooth, BringToRestWhatBouncesLessAndLess) {
  for (const double h : {1.0 / 60.0, 1e-3}) {
    SceneRun run(scene(kDown, ball({0, 0, 0}, {0, 0, 0}, "\"Down\""), slider(-1.0, 1.0, 0.5), h, 2.0));
    const double rests = 3.0 * std::sqrt(2.0 / kG);
    while (run.time() < rests + h) run.step();
    const std::vector<double> times = times_of_stops(run);
    // hops of less than the slop of 1e-8 m are none: the last of these takes 9e-5 s, and all that follow as long again
    EXPECT_NEAR(times.back(), rests, 1e-4) << h;
    EXPECT_LT(times.size(), 30U);
    while (!run.is_done()) {
      run.step();
      EXPECT_NEAR(run.body("A").pose.position.x(), -1.0, 1e-12);
      EXPECT_EQ(run.body("A").twist.linear.x(), 0.0);
    }
    EXPECT_EQ(times_of_stops(run).size(), times.size()) << h;
  }
}

// A spring that would turn the body back within the step, just beyond its dead stop: from there on it starts from rest.
TEST(StopsOfSmooth, AreMetByWhatTurnsBackWithinTheStep) {
  constexpr double kSpring = 2000.0, kMass = 2.0, kSpeed = 0.16;
  const double rate = std::sqrt(kSpring / kMass), amplitude = kSpeed / rate;
  for (const double share : {0.5, 0.9, 0.99}) {
    const double stop = share * amplitude, met = std::asin(share) / rate;
    for (const double h : {0.01, 0.02, 0.04}) {
      SceneRun run(scene("Force { Type = \"Spring\" Id = \"Coil\" CustomProperties { Stiffness = 2000 } }",
                         ball({0, 0, 0}, {kSpeed, 0, 0}, "\"Coil\""), slider(-1.0, stop, 0.0), h, 0.12,
                         "DormandPrince853"));
      run.to_end();
      ASSERT_GE(run.count_events(EventKind::kLimitStart), 1U) << share << ' ' << h;
      EXPECT_NEAR(times_of_stops(run).front(), met, 1e-6);
      // it comes back to where it started, no faster: a graze
      EXPECT_NEAR(run.energy(), 0.5 * kSpring * stop * stop, 1e-8) << share << ' ' << h;
      EXPECT_NEAR(run.body("A").pose.position.x(), stop * std::cos(rate * (0.12 - met)), 1e-7) << share << ' ' << h;
    }
  }
}

// Two bodies on a rope, thrown apart: where it is taut they go on together along it (e = 0), or apart no more (e).
TEST(StopsOfSmooth, OfRopesBetweenFreeBodiesKeepMomentum) {
  for (const double e : {0.0, 0.4, 1.0}) {
    SceneRun run(scene("",
                       "Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {0, 0, "
                       "0} LinearVelocity = {-1, 0.3, 0} } }"
                       "Body { Id = \"B\" Mass = 3 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, "
                       "0} LinearVelocity = {2, 0, 0.2} } }",
                       "Constraint { Type = \"Distance\" Id = \"Rope\" Body1 = \"A\" Body2 = \"B\" CustomProperties { "
                       "BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} MaximumDistance = 1.3 Restitution = " +
                           literal(e) + " } }",
                       1.0 / 60.0, 0.2, "DormandPrince853"));
    const Vector3 momentum = run.momentum(), turning = run.angular_momentum();
    const double energy = run.energy();
    // taut where |r + v t| = 1.3; along it the relative speed is turned over, e times
    const Vector3 way(1, 0, 0), speed(3, -0.3, 0.2);
    const double b = way.dot(speed), a = speed.squaredNorm();
    const double taut = (-b + std::sqrt(b * b + a * (1.3 * 1.3 - 1.0))) / a;
    const Vector3 along = (way + taut * speed).normalized();
    const double loss = 0.5 * (3.0 / 4.0) * std::pow(along.dot(speed), 2) * (1.0 - e * e);
    run.to_end();
    ASSERT_EQ(run.count_events(EventKind::kLimitStart), 1U) << e;
    EXPECT_NEAR(times_of_stops(run).front(), taut, 1e-7) << e;
    EXPECT_LE((run.momentum() - momentum).norm(), 1e-12) << e;
    EXPECT_LE((run.angular_momentum() - turning).norm(), 1e-8) << e;
    EXPECT_NEAR(run.energy(), energy - loss, 1e-7) << e;
  }
}

// A hinged rod on a load between two elastic stops, and a body that spins in an elastic cone, for long.
TEST(StopsOfSmooth, KeepTheEnergyOfWhatTurns) {
  const std::string down =
      "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, 0, -9.81} } }";
  const auto expect_kept = [](const std::string& forces, const std::string& body, const std::string& joint) {
    SceneRun run(scene(forces, "Body { Id = \"A\" Mass = 1 " + body + " }",
                       "Constraint { Id = \"Joint\" Body2 = \"A\" Type = " + joint + " }", 1.0 / 240.0, 20.0));
    const double energy = run.energy();
    run.to_end();
    EXPECT_GT(run.count_events(EventKind::kLimitStart), 30U) << joint;
    EXPECT_NEAR(run.energy(), energy, 1e-6) << joint;
  };
  expect_kept(down,
              "PrincipalMoments = {0.1, 0.1, 0.1} Forces = {\"Down\"} KineticProperties { Position = {0, 0, -1} "
              "LinearVelocity = {-2, 0, 0} AngularVelocity = {0, 2, 0} }",
              "\"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 1, 0} "
              "LowerLimit = -0.3 UpperLimit = 0.4 Restitution = 1 }");
  expect_kept("",
              "PrincipalMoments = {0.2, 0.2, 0.1} KineticProperties { Position = {0, 0, -1} "
              "LinearVelocity = {-0.4, 1.3, 0} AngularVelocity = {1.3, 0.4, 6} }",
              "\"Spherical\" CustomProperties { BindPoint = {0, 0, 0} Axis = {0, 0, -1} "
              "ReachConeAngle = 0.4 Restitution = 1 }");
}

// An arm that a drive turns, whatever pulls at it, drags a ball on a rope that bounces until it stays taut. What the drive did in
// an impact pressed the arm on in the inner step after it, up to where the rope was taut again: by 5e-3 rad.
TEST(StopsOfSmooth, LeaveAnArmToItsDrive) {
  constexpr double kSpeed = 4.6, kDuration = 1.0;
  const std::string joints =
      "Constraint { Type = \"AngularMotor\" Id = \"Drive\" Body2 = \"Arm\" CustomProperties { BindAxisPoint1 = {0, 0, "
      "0} "
      "BindAxisPoint2 = {0, 0, 1} AngularSpeed = " +
      literal(kSpeed) +
      " } }\nConstraint { Type = \"Distance\" Id = \"Rope\" Body1 = \"Arm\" Body2 = \"Ball\" CustomProperties { "
      "BindPoint1 = "
      "{-0.4, -0.9, 0} BindPoint2 = {0.14, -0.11, 0} MaximumDistance = 1 Restitution = ";
  const std::string down =
      "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }";
  const std::string bodies =
      "Body { Id = \"Arm\" Mass = 2 PrincipalMoments = {0.1, 0.1, 0.1} Forces = {\"Down\"} KineticProperties { "
      "AngularVelocity = {0, 0, " +
      literal(kSpeed) +
      "} } } Body { Id = \"Ball\" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} Forces = {\"Down\"} KineticProperties { "
      "Position = {0.14, -0.11, 0} } }";
  for (const double e : {0.0, 0.2, 0.3, 0.4, 0.6}) {
    SceneRun run(scene(down, bodies, joints + literal(e) + " } }", 1.0 / 60.0, kDuration, "DormandPrince54"));
    run.to_end();
    const Quaternion& attitude = run.body("Arm").pose.orientation;
    const double ahead = 2.0 * std::atan2(attitude.z(), attitude.w()) - kSpeed * kDuration;
    EXPECT_NEAR(std::remainder(ahead, 4.0 * std::acos(0.0)), 0.0, 1e-5) << e;
  }
}

// A rope that stops 1 kg at 1 m/s in a step of 1/60 s bears 60 N in the mean, and is compared with that.
TEST(StopsOfSmooth, BreakWhatBearsLessThanTheMeanOverTheStep) {
  for (const double bears : {50.0, 70.0}) {
    SceneRun run(
        scene("",
              "Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} "
              "LinearVelocity = {1, 0, 0} } }",
              "Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"A\" BreakingForce = " + literal(bears) +
                  " CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} MaximumDistance = 1.05 } }",
              1.0 / 60.0, 0.2));
    run.to_end();
    EXPECT_EQ(run.holds("Rope"), bears > 60.0) << bears;
    EXPECT_NEAR(run.body("A").twist.linear.x(), bears > 60.0 ? 0.0 : 1.0, 1e-12) << bears;
  }
}

}  // namespace
}  // namespace gravitas
