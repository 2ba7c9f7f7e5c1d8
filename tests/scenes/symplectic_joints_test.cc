// Symmetric methods with joints (simulator Smooth): energy that does not drift, ways back, joints that a clock moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::literal;
using harness::SceneRun;
using harness::set;

struct SymmetricMethod {
  std::string integrator;
  int order;
  std::vector<std::string> settings(double time_step) const {
    std::vector<std::string> all = {"Integrator=" + integrator, set("Simulator.TimeStep", time_step)};
    if (integrator == "SymplecticSplitting") all.push_back("Integrator.Order=" + std::to_string(order));
    return all;
  }
  friend std::ostream& operator<<(std::ostream& out, const SymmetricMethod& method) {
    return out << method.integrator << ' ' << method.order;
  }
};
const std::vector<SymmetricMethod> kSymmetric = {
    {"SymplecticSplitting", 2}, {"SymplecticSplitting", 4}, {"SymplecticSplitting", 6}, {"ImplicitMidpoint", 2}};

std::string body(const std::string& id, const std::string& moments, const SceneRun::Motion& start) {
  return "Body { Id = \"" + id + "\" Mass = 1 PrincipalMoments = " + moments + " Forces = {\"Down\"} " +
         "KineticProperties { Position = " + literal(start.pose.position) +
         " Orientation = " + literal(start.pose.orientation) + " LinearVelocity = " + literal(start.twist.linear) +
         " AngularVelocity = " + literal(start.twist.angular) + " } }\n";
}

std::string scene(const std::string& bodies, const std::string& joints) {
  return R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, 0, -9.81} } } }
Simulator { Type = "Smooth" CustomProperties { Duration = 1000 } }
Environment { Space { Bodies { )" +
         bodies + "} } Constraints { " + joints + " } ConstraintSolver = \"Direct\" }\n";
}

// A tilted top, its tip at the origin.
std::string top() {
  const Vector3 arm(0, 0.05, 0.0866), spin(0, 15, 25.98);
  return scene(
      body("Top", "{0.011, 0.012, 0.001}", {{arm, Quaternion::Identity()}, {spin.cross(arm), spin}}),
      R"(Constraint { Type = "Spherical" Id = "Tip" Body2 = "Top" CustomProperties { BindPoint = {0, 0, 0} } })");
}

// Two rods in space, on a ball joint and a Hooke's joint.
std::string rods(const SceneRun::Motion& upper, const SceneRun::Motion& lower) {
  const Vector3 cross = upper.pose.position + upper.pose.orientation * Vector3(0.5, 0, 0);
  return scene(
      body("Upper", "{0.03, 0.08, 0.055}", upper) + body("Lower", "{0.03, 0.08, 0.055}", lower),
      R"(Constraint { Type = "Spherical" Id = "Hook" Body2 = "Upper" CustomProperties { BindPoint = {0, 0, 0} } }
Constraint { Type = "Universal" Id = "Cross" Body1 = "Upper" Body2 = "Lower" CustomProperties { BindPoint = )" +
          literal(cross) + " Axis1 = " + literal(upper.pose.orientation * Vector3::UnitY()) +
          " Axis2 = " + literal(lower.pose.orientation * Vector3::UnitZ()) + " } }");
}
std::string rods() {
  return rods({{Vector3(0.5, 0, 0), Quaternion::Identity()}, {Vector3(0, 0.5, 0), Vector3(0, 0, 1)}},
              {{Vector3(1.5, 0, 0), Quaternion::Identity()}, {Vector3(0, 1.0, 0), Vector3::Zero()}});
}

// The energy of a symplectic method wanders about that of the start and does not leave it: what it is off by in the last
// quarter is what it was off by in the first. Steps of a 25th of a turn of the spin.
TEST(SymplecticJoints, EnergyOfATopDoesNotDrift) {
  for (const SymmetricMethod& method : kSymmetric) {
    const int order = method.order;
    SceneRun run(top(), method.settings(1.0 / 120.0));
    const double energy = run.energy();
    const auto largest_in = [&](int steps) {
      double largest = 0.0;
      for (int i = 0; i < steps; ++i) run.step(), largest = std::max(largest, std::abs(run.energy() - energy));
      return largest;
    };
    const double first = largest_in(500);
    run.steps(2000);
    EXPECT_LT(largest_in(500), 1.1 * first) << method;
    // and as small as its order has it; the Cayley map turns less exactly than the free rotor
    const double share = method.integrator == "ImplicitMidpoint" ? 2e-2 : order == 2 ? 5e-3 : order == 4 ? 1e-5 : 2e-7;
    EXPECT_LT(first, share * energy) << method;
    EXPECT_LT(run.report().max_joint_error(), 1e-15) << method;
  }
}

// From its end with all velocities turned round a symmetric method runs back to its start, whatever its steps.
TEST(SymplecticJoints, RunsBackToItsStart) {
  for (const SymmetricMethod& method : kSymmetric) {
    SceneRun there(rods(), method.settings(0.01));
    const auto start = std::pair(there.body("Upper"), there.body("Lower"));
    there.steps(300);
    const auto turned_round = [&](const std::string& id) {
      const SceneRun::Motion now = there.body(id);
      return SceneRun::Motion{now.pose, {-now.twist.linear, -now.twist.angular}};
    };
    EXPECT_GT((there.body("Lower").pose.position - start.second.pose.position).norm(), 0.1);
    SceneRun back(rods(turned_round("Upper"), turned_round("Lower")), method.settings(0.01));
    back.steps(300);
    for (const auto& [id, motion] : {std::pair("Upper", start.first), std::pair("Lower", start.second)}) {
      const SceneRun::Motion now = back.body(id);
      // roundings of 1e-14, grown by a motion whose neighbours part by e^t or so
      EXPECT_LT((now.pose.position - motion.pose.position).norm(), 1e-10) << id << ' ' << method;
      EXPECT_LT(angle_between(now.pose.orientation, motion.pose.orientation), 1e-10) << id << ' ' << method;
      EXPECT_LT((now.twist.linear + motion.twist.linear).norm(), 1e-9) << id << ' ' << method;
    }
  }
}

// Where the spin goes by a radian in a step, what joints have to do is found in some drifts and not in others: kicks take over.
TEST(SymplecticJoints, KeepTheirOrderWhereASpinIsFast) {
  for (const int order : {4, 6}) {
    const auto end_of = [&](int steps) {
      SceneRun run(top(), SymmetricMethod{"SymplecticSplitting", order}.settings(0.8 / steps));
      run.steps(static_cast<std::uint32_t>(steps));
      EXPECT_LT(run.report().max_joint_error(), 1e-12) << order;
      return run.body("Top").pose.position;
    };
    const Vector3 exact = end_of(400);
    EXPECT_LT((end_of(24) - exact).norm(), 1e-3) << order;
    EXPECT_LT((end_of(48) - exact).norm(), 1e-4) << order;
  }
}

// A joint holds up to its BreakingForce: what it bears counts as where steps end. It breaks in the step in which it does with RK4.
TEST(SymplecticJoints, BearWhatTheyBear) {
  const auto step_of_break = [&](std::vector<std::string> settings, double force) {
    SceneRun run(scene(body("Bob", "{1e-6, 1e-6, 1e-6}", {{Vector3(1, 0, 0), Quaternion::Identity()}, {}}),
                       "Constraint { Type = \"Spherical\" Id = \"Hook\" Body2 = \"Bob\" BreakingForce = " +
                           literal(force) + " CustomProperties { BindPoint = {0, 0, 0} } }"),
                 std::move(settings));
    while (run.holds("Hook") && run.step_count() < 200) run.step();
    return run.step_count();
  };
  for (int i = 1; i < 20; ++i) {
    const double force = 0.05 * i * 3.0 * 9.81;  // of what it bears at the bottom
    const std::uint32_t expected = step_of_break({"Integrator=RK4", set("Simulator.TimeStep", 0.005)}, force);
    EXPECT_LT(expected, 120U);
    for (const SymmetricMethod& method : kSymmetric)
      EXPECT_EQ(step_of_break(method.settings(0.005), force), expected) << method << ' ' << i;
  }
}

// What no force acts on keeps its momenta: two bodies that turn about a ball joint between them.
TEST(SymplecticJoints, KeepTheMomentaOfAPair) {
  std::string text =
      scene(body("One", "{1, 2, 2.5}",
                 {{Vector3(-1, 0, 0), Quaternion::Identity()}, {Vector3(0, -2, 0.5), Vector3(1, 0.5, 2)}}) +
                body("Two", "{0.5, 0.6, 0.7}",
                     {{Vector3(1, 0, 0), Quaternion::Identity()}, {Vector3(0, 3, -1), Vector3(-1, 1, 3)}}),
            R"(Constraint { Type = "Spherical" Id = "Joint" Body1 = "One" Body2 = "Two"
                              CustomProperties { BindPoint = {0, 0, 0} } })");
  for (std::size_t at = 0; (at = text.find("Forces = {\"Down\"}")) != std::string::npos;) text.erase(at, 17);
  for (const SymmetricMethod& method : {kSymmetric[1], kSymmetric[3]}) {
    SceneRun run(text, method.settings(0.01));
    run.step();  // joints jump to velocities that they allow
    const Vector3 momentum = run.momentum(), angular = run.angular_momentum();
    const double energy = run.energy();
    run.steps(3000);
    EXPECT_LT((run.momentum() - momentum).norm(), 1e-11) << method;
    EXPECT_LT((run.angular_momentum() - angular).norm(), 1e-10) << method;
    EXPECT_NEAR(run.energy(), energy, (method.order == 2 ? 1e-2 : 1e-4) * energy) << method;
  }
}

// A rod hangs on a hook that goes to and fro: errors of half the step are 2^order times smaller.
TEST(SymplecticJoints, FollowAHookAtTheirOrder) {
  const std::string hook =
      R"(Body { Id = "Hook" Kinematic = true Motion = {{0, {0, 0, 0}, {1, 0, 0, 0}}, {1, {0.4, 0.1, 0}, {1, 0, 0, 0}}, {2, {0, 0.3, 0.2}, {1, 0, 0, 0}}} }
)";
  const std::string text = scene(
      hook + body("Rod", "{0.3, 0.3, 0.01}", {{Vector3(0, 0, -1), Quaternion::Identity()}, {}}),
      R"(Constraint { Type = "Spherical" Id = "Joint" Body1 = "Hook" Body2 = "Rod" CustomProperties { BindPoint = {0, 0, 0} } })");
  const auto end_of = [&](const SymmetricMethod& method, int steps) {
    // within one piece of the motion, whose ends are jumps of acceleration
    SceneRun run(text, method.settings(0.9 / steps));
    run.steps(static_cast<std::uint32_t>(steps));
    return run.body("Rod").pose.position;
  };
  const Vector3 exact = end_of(kSymmetric[2], 160);
  for (const SymmetricMethod& method : kSymmetric) {
    const int steps = method.order == 2 ? 80 : method.order == 4 ? 20 : 10;
    const double coarse = (end_of(method, steps) - exact).norm(), fine = (end_of(method, 2 * steps) - exact).norm();
    EXPECT_NEAR(std::log2(coarse / fine), method.order, 0.2) << method << ": " << coarse << ", " << fine;
  }
}

// Dampers are no locks: kicks take over, at the method's order, and the energy that a damper takes is its own.
TEST(SymplecticJoints, OfOtherKindsKeepTheirOrder) {
  const auto end_of = [&](const SymmetricMethod& method, int steps) {
    SceneRun run(
        scene(
            body("Bob", "{0.1, 0.1, 0.1}", {{Vector3(1, 0, 0), Quaternion::Identity()}, {}}),
            R"(Constraint { Type = "Revolute" Id = "Hinge" Body2 = "Bob" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 1, 0} Damping = 0.7 } })"),
        method.settings(1.5 / steps));
    run.steps(static_cast<std::uint32_t>(steps));
    return run.body("Bob").pose.position;
  };
  const Vector3 exact = end_of(kSymmetric[2], 480);
  for (const SymmetricMethod& method : kSymmetric) {
    const int steps = method.order == 2 ? 150 : method.order == 4 ? 60 : 24;
    const double coarse = (end_of(method, steps) - exact).norm(), fine = (end_of(method, 2 * steps) - exact).norm();
    EXPECT_NEAR(std::log2(coarse / fine), method.order, 0.2) << method << ": " << coarse << ", " << fine;
  }
}

}  // namespace
}  // namespace gravitas
