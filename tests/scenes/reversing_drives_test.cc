// Drives with a largest force beside the spring of their joint: where the speed passes theirs, the force turns back at once and
// the mass swings on. Against the motion itself, whose turns are located to rounding.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "plugin_sdk/math/pose.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

// m x'' = -k (x - rest) - c x' + M while x' < w, - M while x' > w; x(0) = 0.
struct DrivenOscillator {
  double mass, stiffness, damping, rest, speed, force, start_velocity;

  struct State {
    double way, velocity;
  };

  double acceleration(const State& s, double push) const {
    return (push - stiffness * (s.way - rest) - damping * s.velocity) / mass;
  }

  // RK4, of fourth order in h.
  State after(const State& s, double push, double h) const {
    const auto at = [&](const State& rate, double share) {
      return State{s.way + share * h * rate.way, s.velocity + share * h * rate.velocity};
    };
    const auto rate = [&](const State& x) { return State{x.velocity, acceleration(x, push)}; };
    const State a = rate(s), b = rate(at(a, 0.5)), c = rate(at(b, 0.5)), d = rate(at(c, 1.0));
    return {s.way + h / 6.0 * (a.way + 2.0 * b.way + 2.0 * c.way + d.way),
            s.velocity + h / 6.0 * (a.velocity + 2.0 * b.velocity + 2.0 * c.velocity + d.velocity)};
  }

  // The ways at the ends of steps.
  std::vector<double> ways(double time_step, int steps) const {
    constexpr int kFine = 400;
    State now{0.0, start_velocity};
    double push = now.velocity < speed ? force : -force;
    std::vector<double> ways;
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; j < kFine; ++j) {
        double left = time_step / kFine;
        const auto has_passed = [&](const State& s) { return (s.velocity - speed) * push > 0.0; };
        if (has_passed(after(now, push, left))) {
          double low = 0.0, high = left;
          for (int halving = 0; halving < 60; ++halving) {
            const double middle = 0.5 * (low + high);
            (has_passed(after(now, push, middle)) ? high : low) = middle;
          }
          now = after(now, push, high);
          // the spring is the stronger: nothing stays at the drive's speed
          EXPECT_GT(std::fabs(mass * acceleration(now, 0.0)), force);
          left -= high, push = -push;
        }
        now = after(now, push, left);
      }
      ways.push_back(now.way);
    }
    return ways;
  }
};

constexpr DrivenOscillator kOscillators[] = {{1.2, 11.0, 0.0, 0.0, 0.3, 3.0, 2.7},
                                             {0.7, 32.0, 0.0, 0.33, 1.0, 2.4, -3.5},
                                             {0.7, 32.0, 0.3, 0.33, 1.0, 2.4, -3.5}};

std::string scene(const std::string& type, const DrivenOscillator& o) {
  const bool turns = type == "Revolute";
  const std::string velocity = literal(Vector3(o.start_velocity, 0, 0));
  return "Environment { Space { Bodies { Body { Id = \"Mass\" Mass = " + literal(o.mass) +
         " PrincipalMoments = " + literal(Vector3::Constant(o.mass).eval()) + " KineticProperties { " +
         (turns ? "AngularVelocity = " : "LinearVelocity = ") + velocity +
         " } } } }\nConstraints { Constraint { Type = \"" + type +
         "\" Id = \"Joint\" Body2 = \"Mass\" CustomProperties { " +
         (turns ? "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {1, 0, 0} RestAngle = "
                : "BindPoint = {0, 0, 0} Axis = {1, 0, 0} RestPosition = ") +
         literal(o.rest) + (turns ? " AngularSpeed = " : " Speed = ") + literal(o.speed) +
         (turns ? " MaximumTorque = " : " MaximumForce = ") + literal(o.force) +
         " Stiffness = " + literal(o.stiffness) + " Damping = " + literal(o.damping) + " } } } }\n";
}

double way_of(const std::string& type, const SceneRun& run) {
  const Pose pose = run.body("Mass").pose;
  return type == "Revolute" ? 2.0 * std::atan2(pose.orientation.x(), pose.orientation.w()) : pose.position.x();
}

// Per step of two thirds of a second, in which the speed passes that of the drive once or twice.
TEST(ReversingDrives, MeetTheAccuracy) {
  for (const double time_step : {1.0 / 60.0, 1.0 / 240.0})
    for (const DrivenOscillator& oscillator : kOscillators) {
      const int steps = static_cast<int>(std::lround(40.0 / 60.0 / time_step));
      const std::vector<double> ways = oscillator.ways(time_step, steps);
      for (const std::string type : {"Slider", "Revolute"})
        for (const std::string solver : {"Newton", "Direct", "Sequential"})
          for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
            SceneRun run(
                scene(type, oscillator),
                {"Simulator=Continuous", set("Simulator.Accuracy", accuracy), set("Simulator.TimeStep", time_step),
                 set("Simulator.Duration", steps * time_step), "Integrator=Verlet", "Solver=" + solver});
            double worst = 0.0;
            for (const double way : ways) {
              run.step();
              worst = std::max(worst, std::fabs(way_of(type, run) - way));
            }
            EXPECT_LT(worst, 10.0 * accuracy) << type << ' ' << solver << ' ' << accuracy << ' ' << time_step << ' '
                                              << oscillator.stiffness << ' ' << oscillator.damping;
            EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(),
                      100U * static_cast<std::uint64_t>(steps))
                << type << ' ' << solver << ' ' << accuracy;
          }
    }
}

// A spring asks for its error over the step, which is without end the shorter that is: what solvers took for nothing grew with it.
TEST(ReversingDrives, PushWithAllTheirForceInShortSteps) {
  for (const std::string type : {"Slider", "Revolute"})
    for (const std::string solver : {"Newton", "Direct", "Sequential"})
      for (const double time_step : {1e-2, 1e-4, 1e-6, 1e-7, 1e-8})
        for (const double missing : {-1e-4, 1e-4}) {
          DrivenOscillator oscillator = kOscillators[0];
          oscillator.rest = -0.7, oscillator.start_velocity = oscillator.speed - missing;
          const double share = std::min(1.0, std::fabs(missing) / (40.0 * time_step));
          oscillator.force *= share, oscillator.rest *= share;  // so that the step does not reach the drive's speed
          SceneRun run(scene(type, oscillator),
                       {"Simulator=Basic", set("Simulator.TimeStep", time_step),
                        set("Simulator.Duration", 2.0 * time_step), "Integrator=Verlet", "Solver=" + solver});
          run.step();
          const Twist twist = run.body("Mass").twist;
          const double velocity = type == "Revolute" ? twist.angular.x() : twist.linear.x();
          const double push = missing > 0.0 ? oscillator.force : -oscillator.force;
          const double expected = oscillator.acceleration({0.0, oscillator.start_velocity}, push) * time_step;
          const double gained = velocity - oscillator.start_velocity;
          // what the spring changes by in the step
          const double bound = oscillator.stiffness / oscillator.mass * time_step * time_step;
          EXPECT_NEAR(gained, expected, bound + 1e-14) << type << ' ' << solver << ' ' << time_step << ' ' << missing;
        }
}

// Two free bodies on a sprung, damped and driven hinge: the drive turned back in the last inner step of all attempts that were
// used, and they agreed on 2.5e-4 rad too much, whatever the accuracy.
TEST(ReversingDrives, InTheLastInnerStepsAreSeen) {
  const std::string text = R"(
Environment { Space { Bodies {
  Body { Id = "A" Mass = 1.3 PrincipalMoments = {1.4399240468548342, 1.279932486093186, 1.5999156076164824}
    KineticProperties { Orientation = {0.49729982681676771, -0.41529021149766776, 0.54381737552589837, 0.53337565051130631}
      AngularVelocity = {0.024041729149599358, 0.24397270446226682, 0.015621823932634889} } }
  Body { Id = "B" Mass = 0.7 PrincipalMoments = {0.83379281573173603, 1.0720193345122322, 1.1911325939024802}
    KineticProperties { Position = {0.039147679968345499, 0.39726615734957316, 0.025437361848277142}
      Orientation = {0.49729982681676771, -0.41529021149766776, 0.54381737552589837, 0.53337565051130631}
      AngularVelocity = {-0.32173425444365411, -3.264922239425422, -0.20905633886571243} } }
} }
Constraints { Constraint { Type = "Revolute" Id = "Hinge" Body1 = "A" Body2 = "B" CustomProperties {
  BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0.097869199920863736, 0.99316539337393284, 0.06359340462069285}
  Stiffness = 32.452013633372843 RestAngle = 0.32750906223002452 Damping = 0.12466465309547353
  AngularSpeed = 1 MaximumTorque = 2.3777283839322814 LowerLimit = -0.39667237626939994
  UpperLimit = 0.38146489891197999 Restitution = 1 } } } }
)";
  const auto end = [&](const std::string& solver, double accuracy, double time_step) {
    SceneRun run(text,
                 {"Simulator=Continuous", set("Simulator.Accuracy", accuracy), set("Simulator.TimeStep", time_step),
                  "Simulator.Duration=0.5", "Integrator=Verlet", "Solver=" + solver});
    run.to_end();
    return run.body("B");
  };
  const SceneRun::Motion expected = end("Newton", 1e-10, 1.0 / 960.0);
  for (const std::string solver : {"Newton", "Direct", "Sequential"})
    for (const double accuracy : {1e-4, 1e-6, 1e-8}) {
      const SceneRun::Motion motion = end(solver, accuracy, 1.0 / 60.0);
      EXPECT_LT(2.0 * (motion.pose.orientation.coeffs() - expected.pose.orientation.coeffs()).norm(), 3.0 * accuracy)
          << solver << ' ' << accuracy;
      EXPECT_LT((motion.twist.angular - expected.twist.angular).norm(), 30.0 * accuracy) << solver << ' ' << accuracy;
    }
}

}  // namespace
}  // namespace gravitas
