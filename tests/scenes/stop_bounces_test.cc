// Joints whose stops give back a share of the speed at which they are met, as runs have them: by every simulator and solver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

struct StopCase {
  const char *solver, *simulator, *integrator;
  double accuracy;
};

constexpr StopCase kStopCases[] = {
    {"Sequential", "Basic", "SemiImplicitEuler", 0.0}, {"Newton", "Basic", "Verlet", 0.0},
    {"Direct", "Basic", "SemiImplicitEuler", 0.0},     {"Sequential", "Substepping", "SemiImplicitEuler", 0.0},
    {"Newton", "Continuous", "Verlet", 0.0},           {"Newton", "Continuous", "Verlet", 1e-7},
    {"Sequential", "Bisection", "Verlet", 0.0},        {"Newton", "Smooth", "RK4", 0.0},
    {"Direct", "Smooth", "DormandPrince54", 0.0}};

class StopBounces : public ::testing::TestWithParam<StopCase> {
 protected:
  static SceneRun scene(const std::string& bodies, const std::string& joints, double time_step, double duration,
                        const std::string& forces = "") {
    const StopCase& with = GetParam();
    std::vector<std::string> overrides = {set("Solver", std::string(with.solver)),
                                          set("Integrator", std::string(with.integrator))};
    if (with.accuracy > 0.0) overrides.push_back(set("Simulator.Accuracy", with.accuracy));
    return SceneRun("Forces { " + forces + " }\nSimulator { Type = \"" + std::string(with.simulator) +
                        "\" CustomProperties { TimeStep = " + literal(time_step) + " Duration = " + literal(duration) +
                        " } }\nEnvironment { Space { Bodies { " + bodies + " } }\nConstraints { " + joints + " } }\n",
                    overrides);
  }
  static std::string body(const std::string& id, double mass, const Vector3& at, const Vector3& velocity,
                          const Vector3& spin = Vector3::Zero(), const std::string& more = "") {
    return "Body { Id = \"" + id + "\" Mass = " + literal(mass) +
           " PrincipalMoments = {0.1, 0.1, 0.1} KineticProperties { Position = " + literal(at) +
           " LinearVelocity = " + literal(velocity) + " AngularVelocity = " + literal(spin) + " } " + more + " }\n";
  }
  // Guides of body A along x, with stops at -0.1 and 0.05.
  static std::vector<std::string> guides(double restitution) {
    const std::string e = " Restitution = " + literal(restitution);
    return {joint("Slider", "BindPoint = {0, 0, 0} Axis = {1, 0, 0} LowerLimit = -0.1 UpperLimit = 0.05" + e,
                  "Body2 = \"A\""),
            joint("Axle",
                  "BindPoint = {0, 0, 0} SteeringAxis = {1, 0, 0} RollingAxis = {0, 1, 0} SuspensionLowerLimit = -0.1 "
                  "SuspensionUpperLimit = 0.05" +
                      e,
                  "Body2 = \"A\"")};
  }
  static std::string joint(const std::string& type, const std::string& properties, const std::string& bodies) {
    return "Constraint { Id = \"" + type + "\" Type = \"" + type + "\" " + bodies + " CustomProperties { " +
           properties + " } }\n";
  }
};

INSTANTIATE_TEST_SUITE_P(Each, StopBounces, ::testing::ValuesIn(kStopCases), [](const auto& which) {
  return std::string(which.param.solver) + which.param.simulator + which.param.integrator +
         (which.param.accuracy > 0.0 ? "Accurate" : "");
});

// Each bounce is told once, with the speed and the impulse of it; what rests on its stop is not told again.
TEST_P(StopBounces, AreTold) {
  constexpr double kMass = 2.0, kSpeed = 0.9;
  for (const double e : {1.0, 0.7, 0.25, 0.0})
    for (const std::string& guide : guides(e)) {
      SceneRun run = scene(body("A", kMass, {0, 0, 0}, {kSpeed, 0, 0}), guide, 0.005, 1.0);
      double direction = 1.0, speed = kSpeed;
      std::size_t bounces = 0;
      while (!run.is_done()) {
        run.step();
        const double now = run.body("A").twist.linear.x();
        if (now * direction > 0.0 && e > 0.0) continue;
        if (e == 0.0 && (now != 0.0 || bounces == 1)) continue;
        direction = -direction;
        ASSERT_EQ(run.count_events(EventKind::kLimitStart), ++bounces) << e << " at " << run.time();
        const Event& told = run.events().back();
        EXPECT_EQ(told.constraint, 0U);
        EXPECT_EQ(told.step, run.step_count());
        EXPECT_NEAR(told.relative_speed, speed, 1e-9);
        EXPECT_NEAR(told.impulse, kMass * speed * (1.0 + e), 1e-9);
        speed *= e;
      }
      EXPECT_GE(bounces, 1U);
      EXPECT_EQ(run.count_events(EventKind::kLimitStart), bounces) << e << guide;
    }
}

// A bar that falls on the stop of its hinge, and one that comes to it without a load: each meets it once and rests there.
TEST_P(StopBounces, WhatRestsIsNotToldAgain) {
  for (const bool falls : {true, false}) {
    SceneRun run = scene(
        body("A", 2.0, {1, 0, 0}, falls ? Vector3(0, 0, 0) : Vector3(0, -3, 0),
             falls ? Vector3(0, 0, 0) : Vector3(0, 0, -3), falls ? "Forces = { \"Down\" }" : ""),
        joint("Revolute", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} LowerLimit = -0.5", "Body2 = \"A\""),
        1.0 / 60.0, 2.0,
        "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }");
    run.to_end();
    EXPECT_EQ(run.count_events(EventKind::kLimitStart), 1U) << falls;
  }
}

// On a taut rope what swings gets it taut no more.
TEST_P(StopBounces, WhatSwingsOnATautRopeIsNotTold) {
  SceneRun run = scene(
      body("A", 2.0, {1, 0, 0}, {0, 0, 0}, Vector3::Zero(), "Forces = { \"Down\" }"),
      joint("Distance", "BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} MaximumDistance = 1", "Body2 = \"A\""),
      1.0 / 240.0, 2.0, "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }");
  run.to_end();
  EXPECT_EQ(run.count_events(EventKind::kLimitStart), 0U);
}

// A ball on a rope of 1 m that falls from 0.4 m below its end: taut once, by sqrt(2 g 0.6), and then it hangs.
TEST_P(StopBounces, ARopeThatGetsTautIsToldOnce) {
  SceneRun run =
      scene(body("A", 2.0, {0, -0.4, 0}, {0, 0, 0}, Vector3::Zero(), "Forces = { \"Down\" }"),
            joint("Distance", "BindPoint1 = {0, 0, 0} BindPoint2 = {0, -0.4, 0} MaximumDistance = 1", "Body2 = \"A\""),
            0.005, 1.0, "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -10, 0} } }");
  run.to_end();
  ASSERT_EQ(run.count_events(EventKind::kLimitStart), 1U);
  const auto told = std::ranges::find(run.events(), EventKind::kLimitStart, &Event::kind);
  // in two steps, by which a method of the first order may be late
  EXPECT_NEAR(told->relative_speed, std::sqrt(2.0 * 10.0 * 0.6), 2.0 * 0.005 * 10.0);
  EXPECT_NEAR(told->time, std::sqrt(2.0 * 0.6 / 10.0), 2.0 * 0.005);
}

// Between two stops without loads a speed is e^n of the first after n of them, exactly, and of e = 1 what it was.
TEST_P(StopBounces, OfGuidesAreAPowerOfTheFirst) {
  for (const double e : {1.0, 0.7, 0.25})
    for (const std::string& guide : guides(e)) {
      SceneRun run = scene(body("A", 2.0, {0, 0, 0}, {0.9, 0, 0}), guide, 1.0 / 60.0, 2.0);
      double expected = 0.9;
      int met = 0;
      while (!run.is_done()) {
        run.step();
        const double speed = run.body("A").twist.linear.x();
        if (speed * expected < 0.0) ++met, expected *= -e;
        EXPECT_NEAR(speed, expected, 1e-13) << e << ' ' << met << guide;
        EXPECT_LE(run.body("A").pose.position.x(), 0.05 + 1e-12);
        EXPECT_GE(run.body("A").pose.position.x(), -0.1 - 1e-12);
      }
      EXPECT_GE(met, e == 1.0 ? 11 : e == 0.7 ? 3 : 1) << guide;
    }
}

// So is the spin of what turns between stops, whatever joint has them.
TEST_P(StopBounces, OfTurnsAreAPowerOfTheFirst) {
  const std::string e = " Restitution = 0.6";
  struct Turning {
    std::string type, properties;
    double lower;
  };
  for (const Turning& turning :
       {Turning{"Revolute", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} LowerLimit = -0.7 UpperLimit = 0.5",
                -0.7},
        Turning{"Spherical", "BindPoint = {0, 0, 0} Axis = {0, 0, 1} TwistLower = -0.7 TwistUpper = 0.5", -0.7},
        Turning{"Spherical", "BindPoint = {0, 0, 0} Axis = {1, 0, 0} ReachConeAngle = 0.5", -0.5},
        Turning{"Universal",
                "BindPoint = {0, 0, 0} Axis1 = {0, 0, 1} Axis2 = {1, 0, 0} LowerLimit1 = -0.7 UpperLimit1 = 0.5", -0.7},
        Turning{"Universal",
                "BindPoint = {0, 0, 0} Axis1 = {1, 0, 0} Axis2 = {0, 0, 1} LowerLimit2 = -0.7 UpperLimit2 = 0.5", -0.7},
        Turning{"Axle",
                "BindPoint = {0, 0, 0} SteeringAxis = {0, 0, 1} RollingAxis = {1, 0, 0} SteeringLowerLimit = -0.7 "
                "SteeringUpperLimit = 0.5",
                -0.7},
        Turning{"ConstantVelocity", "BindPoint = {0, 0, 0} Axis1 = {1, 0, 0} Axis2 = {1, 0, 0} MaximumAngle = 0.5",
                -0.5}}) {
    SceneRun run = scene(body("A", 2.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 3.0}),
                         joint(turning.type, turning.properties + e, "Body2 = \"A\""), 1.0 / 60.0, 2.0);
    double expected = 3.0;
    int met = 0;
    while (!run.is_done()) {
      run.step();
      const SceneRun::Motion now = run.body("A");
      if (now.twist.angular.z() * expected < 0.0) ++met, expected *= -0.6;
      EXPECT_NEAR((now.twist.angular - Vector3(0, 0, expected)).norm(), 0.0, 1e-10) << turning.properties << met;
      const double angle = 2.0 * std::atan2(now.pose.orientation.z(), now.pose.orientation.w());
      EXPECT_LE(angle, 0.5 + 1e-9) << turning.properties;
      EXPECT_GE(angle, turning.lower - 1e-9) << turning.properties;
    }
    EXPECT_EQ(met, 3) << turning.properties;
  }
}

// A rope snaps taut: what goes along it comes back, what goes across it goes on. (1, 0, 0) x 2 m/s meet its end at 1.3 m.
TEST_P(StopBounces, OfARopeAreAlongIt) {
  for (const double e : {0.0, 0.5, 1.0}) {
    const double step = 1e-3;
    SceneRun run =
        scene(body("A", 2.0, {1.0, 0, 0}, {2.0, 0.4, 0}),
              joint("Distance",
                    "BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} MaximumDistance = 1.3 Restitution = " + literal(e),
                    "Body2 = \"A\""),
              step, 0.17);
    run.to_end();
    // (1 + 2 t)^2 + (0.4 t)^2 = 1.69
    const double time = (-4.0 + std::sqrt(16.0 + 4.0 * 4.16 * 0.69)) / (2.0 * 4.16);
    const Vector3 along = Vector3(1.0 + 2.0 * time, 0.4 * time, 0).normalized(), velocity(2.0, 0.4, 0);
    const Vector3 bounced = velocity - (1.0 + e) * along.dot(velocity) * along;
    // it is told at the end of its step; without a bounce the rope turns on
    const double late = GetParam().accuracy > 0.0 ? 1e-5 : 2.0 * step;
    const double turned = e == 0.0 ? 0.02 : 0.0;
    EXPECT_NEAR((run.body("A").twist.linear - bounced).norm(), 0.0, late + turned) << e;
  }
}

// What swings on a taut rope bears on it and never strikes: its bits are those without restitution.
TEST_P(StopBounces, OfATautRopeThatSwingsAreNone) {
  const auto ends = [](double e) {
    SceneRun run = scene(
        body("A", 2.0, {1.0, 0, 0}, {0, -1.0, 2.0}, {0, 0, 0}, "Forces = {\"Down\"}"),
        joint("Distance",
              "BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} MaximumDistance = 1 Restitution = " + literal(e),
              "Body2 = \"A\""),
        0.01, 2.0, "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }");
    run.to_end();
    return run.environment().chain_hash().text();
  };
  EXPECT_EQ(ends(1.0), ends(0.0));
}

// A weight falls on a winch's rope, 0.2 m slack, and is thrown up with e of its speed.
TEST_P(StopBounces, OfAWinchGiveBack) {
  const double step = 1e-3, fall = std::sqrt(2.0 * kG * 0.2), time = std::sqrt(0.4 / kG);
  SceneRun run =
      scene(body("W", 2.0, {0.5, -2, 0}, {0, 0, 0}, {0, 0, 0}, "Forces = {\"Down\"}"),
            joint("Winch",
                  "Axis = {0, 0, 1} Radius = 0.5 BindPoint = {0.5, -2, 0} BindAxisPoint = {0, 0, 0} Slack = "
                  "0.2 Restitution = 0.5",
                  "Body2 = \"W\""),
            step, 0.3, "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }");
  run.to_end();
  const double after = run.time() - time;
  EXPECT_NEAR(run.body("W").twist.linear.y(), 0.5 * fall - kG * after, 2.0 * kG * step);
  EXPECT_NEAR(run.body("W").pose.position.y(), -2.2 + 0.5 * fall * after - 0.5 * kG * after * after, 2.0 * fall * step);
}

// What falls on an elastic stop rises as high as it fell from, with methods of second order at any step: on a guide along the
// fall exactly, about a hinge to what an accuracy leaves.
TEST_P(StopBounces, OfElasticStopsKeepTheEnergyOfAFall) {
  const std::string down =
      "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }";
  const std::string weight = body("A", 2.0, {0.5, 0, 0}, {0, 0, 0}, {0, 0, 0}, "Forces = {\"Down\"}");
  const std::string integrator = GetParam().integrator;
  if (integrator == "SemiImplicitEuler") return;  // of order one
  SceneRun guide = scene(
      weight,
      joint("Slider", "BindPoint = {0, 0, 0} Axis = {0, 1, 0} LowerLimit = -0.25 Restitution = 1", "Body2 = \"A\""),
      1.0 / 60.0, 5.0, down);
  guide.to_end();
  // the first kinetic energy of an impact is 4.905 J
  EXPECT_NEAR(guide.energy(), 0.0, GetParam().accuracy > 0.0 ? 1e-5 : 1e-11);
  if (GetParam().accuracy == 0.0) return;
  SceneRun gate =
      scene(weight,
            joint("Revolute", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} LowerLimit = -0.5 Restitution = 1",
                  "Body2 = \"A\""),
            1.0 / 60.0, 5.0, down);
  gate.to_end();
  EXPECT_NEAR(gate.energy(), 0.0, 1e-5);
}

// A weight on a guide that falls on its stop again and again comes to rest on it, and never rises higher than before.
TEST_P(StopBounces, ComeToRest) {
  SceneRun run = scene(
      body("A", 2.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, "Forces = {\"Down\"}"),
      joint("Slider", "BindPoint = {0, 0, 0} Axis = {0, 1, 0} LowerLimit = -0.3 Restitution = 0.6", "Body2 = \"A\""),
      1.0 / 120.0, 2.5, "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }");
  // sqrt(2 s/g) (1 + e)/(1 - e) = 0.99 s
  while (run.time() < 1.2) run.step();
  for (; !run.is_done(); run.step()) {
    EXPECT_NEAR(run.body("A").pose.position.y(), -0.3, 1e-9);
    EXPECT_NEAR(run.body("A").twist.linear.y(), 0.0, 1e-9);
  }
}

// Of a chain of hinges and ball joints with stops, flung about without loads, energy never rises.
TEST_P(StopBounces, NeverAddEnergyToChains) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    conformance::Draw draw(seed);
    std::string bodies, joints;
    const std::uint32_t count = 2 + draw.below(3);
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::string id = "B" + std::to_string(i), one = i == 0 ? "" : "Body1 = \"B" + std::to_string(i - 1) + "\" ";
      bodies += body(id, draw.uniform(0.5, 2.0), {i + 0.5, 0, 0}, {0, 0, 0}, draw.vector(5.0));
      const std::string e = " Restitution = " + literal(seed % 2 == 0 ? 1.0 : draw.uniform(0.3, 1.0));
      const std::string at = literal(Vector3(i, 0, 0)), next = literal(Vector3(i, 0, 1.0));
      joints += "Constraint { Id = \"J" + std::to_string(i) + "\" " + one + "Body2 = \"" + id + "\" ";
      joints += draw.below(2) == 0
                    ? "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = " + at + " BindAxisPoint2 = " + next +
                          " LowerLimit = -0.4 UpperLimit = 0.5" + e
                    : "Type = \"Spherical\" CustomProperties { BindPoint = " + at +
                          " Axis = {1, 0, 0} ReachConeAngle = 0.5 TwistLower = -0.3 TwistUpper = 0.2" + e;
      joints += " } }\n";
    }
    SceneRun run = scene(bodies, joints, 1.0 / 480.0, 1.0);
    run.step();
    double energy = run.kinetic_energy();
    const double first = energy;
    while (!run.is_done()) {
      run.step();
      const double now = run.kinetic_energy();
      // what an accuracy leaves
      EXPECT_LE(now - energy, 1e-9 * first) << seed << " at " << run.time();
      energy = now;
    }
    EXPECT_LE(energy, first * (1.0 + 1e-7)) << seed;
  }
}

// What an edit, a checkpoint or a swap goes on from is the state alone: another solver goes on with the same bounces.
TEST(StopBouncesOfSwaps, GoOn) {
  const std::string text =
      "Simulator { CustomProperties { TimeStep = 0.01 Duration = 2 } }\nEnvironment { Space { Bodies { Body { Id = "
      "\"A\" Mass = 2 PrincipalMoments = {1, 1, 1} KineticProperties { LinearVelocity = {0.9, 0, 0} } } } "
      "}\nConstraints "
      "{ Constraint { Id = \"J\" Body2 = \"A\" Type = \"Slider\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, "
      "0, "
      "0} LowerLimit = -0.1 UpperLimit = 0.05 Restitution = 0.9 } } } }\n";
  SceneRun alone(text, {"Solver=Newton"}), swapped(text, {"Solver=Sequential"});
  for (const char* order : {"solver=Newton@step=40", "solver=Direct@step=80", "solver=Sequential@step=120"})
    swapped.order_swap(order);
  while (!alone.is_done()) {
    alone.step(), swapped.step();
    EXPECT_NEAR(swapped.body("A").twist.linear.x(), alone.body("A").twist.linear.x(), 1e-13);
    EXPECT_NEAR(swapped.body("A").pose.position.x(), alone.body("A").pose.position.x(), 1e-12);
  }
  EXPECT_EQ(swapped.environment().swaps().size(), 3);
}

// Restitution without a stop, or of one that gives way, and what is none, are told with the joint and the property.
TEST(StopBouncesOfScenes, AreRefusedWhereThereAreNone) {
  const auto refusal = [](const std::string& joint) {
    try {
      SceneRun(
          "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { "
          "Position = {1, 0, 0} } } } }\nConstraints { Constraint { Id = \"Joint7\" Body2 = \"A\" " +
          joint + " } } }\n");
    } catch (const std::exception& wrong) {
      return std::string(wrong.what());
    }
    return std::string();
  };
  const std::string slider = "Type = \"Slider\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} ";
  const std::string rope = "Type = \"Distance\" CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} ";
  EXPECT_EQ(refusal(slider + "LowerLimit = 0 Restitution = 1 }"), "");
  EXPECT_EQ(refusal(slider + "Restitution = 0 }"), "");
  EXPECT_EQ(refusal(rope + "MaximumDistance = 2 Restitution = 0.5 }"), "");
  for (const std::string& joint :
       {slider + "LowerLimit = 0 Restitution = -0.1 }", slider + "LowerLimit = 0 Restitution = 1.5 }",
        slider + "Restitution = 0.5 }", rope + "Restitution = 0.5 }",
        rope + "MaximumDistance = 2 Stiffness = 100 Restitution = 0.5 }"})
    EXPECT_NE(refusal(joint).find("Restitution"), std::string::npos) << joint << refusal(joint);
}

}  // namespace
}  // namespace gravitas
