// Suspensions of axles as vehicles have them: bump stops that are met as fast as energy tells, bear what the spring does not, and
// hold wheels off their chassis; by every solver, and by simulators of either kind.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"
#include "tests/scenes/watched_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using harness::WatchedRun;

constexpr double kCarMass = 100.0, kCarSpring = 2e4;    // kg, N/m
constexpr double kCarSag = kCarMass * kG / kCarSpring;  // m

struct SuspensionCase {
  const char *solver, *simulator, *integrator;
  double time_step;
};

constexpr SuspensionCase kSuspensionCases[] = {{"Sequential", "Basic", "SemiImplicitEuler", 2.5e-4},
                                               {"Newton", "Basic", "SemiImplicitEuler", 2.5e-4},
                                               {"Direct", "Basic", "Verlet", 2.5e-4},
                                               {"Newton", "Substepping", "SemiImplicitEuler", 2.5e-4},
                                               {"Direct", "Continuous", "Verlet", 2.5e-4},
                                               {"Newton", "Smooth", "RK4", 1.0 / 240.0},
                                               {"Direct", "Smooth", "DormandPrince54", 1.0 / 60.0}};

// A quarter of a car on a wheel that stands (the world), which it may sink to along y.
class QuarterCar : public ::testing::TestWithParam<SuspensionCase> {
 protected:
  static bool is_smooth() { return std::string(GetParam().simulator) == "Smooth"; }
  static std::string scene(const std::string& suspension, double duration, double speed = 0.0) {
    const SuspensionCase& with = GetParam();
    return "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
           "Simulator { Type = \"" +
           std::string(with.simulator) + "\" CustomProperties { TimeStep = " + literal(with.time_step) +
           " Duration = " + literal(duration) +
           " } }\nEnvironment { Space { Bodies { Body { Id = \"Car\" Mass = 100 PrincipalMoments = {9, 9, 9} Forces = "
           "{\"G\"} KineticProperties { LinearVelocity = {0, " +
           literal(speed) +
           ", 0} } } } }\nConstraints { Constraint { Type = \"Axle\" Id = \"Axle\" Body1 = \"Car\" CustomProperties { "
           "BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1} " +
           suspension + " } } } }\n";
  }
  static std::vector<std::string> overrides() {
    return {set("Solver", std::string(GetParam().solver)), set("Integrator", std::string(GetParam().integrator))};
  }
  static SceneRun run(const std::string& suspension, double duration, double speed = 0.0) {
    return SceneRun(scene(suspension, duration, speed), overrides());
  }
  static Event first_stop(const SceneRun& run) {
    for (const Event& event : run.events())
      if (event.kind == EventKind::kLimitStart) return event;
    return {};
  }
};

INSTANTIATE_TEST_SUITE_P(Each, QuarterCar, ::testing::ValuesIn(kSuspensionCases), [](const auto& which) {
  return std::string(which.param.solver) + which.param.simulator + which.param.integrator;
});

// Let go at the spring's rest it would sink by twice the sag; m v^2/2 = m g x - k x^2/2 at the stop x, which gives back e v.
TEST_P(QuarterCar, MeetsItsBumpStopAtTheSpeedThatEnergyGives) {
  constexpr double kStop = 0.07;
  const double rate = std::sqrt(kCarSpring / kCarMass);
  const double time = std::acos(1.0 - kStop / kCarSag) / rate;
  const double speed = std::sqrt(2.0 * kG * kStop - kCarSpring / kCarMass * kStop * kStop);
  for (const double e : {0.0, 0.5, 1.0}) {
    SceneRun falling = run("SuspensionStiffness = 2e4 SuspensionUpperLimit = " + literal(kStop) +
                               " SuspensionLowerLimit = -0.2 Restitution = " + literal(e),
                           0.15);
    const double energy = falling.energy();
    falling.to_end();
    ASSERT_EQ(falling.count_events(EventKind::kLimitStart), 1U) << e;
    const Event met = first_stop(falling);
    // springs have order one but with Smooth
    EXPECT_NEAR(met.time, time, is_smooth() ? 1e-6 : 3.0 * GetParam().time_step) << e;
    EXPECT_NEAR(met.relative_speed, speed, is_smooth() ? 1e-6 : 0.01 * speed) << e;
    // beside it the spring and the weight push for a step
    const double load = kCarSpring * kStop - kCarMass * kG;
    EXPECT_NEAR(met.impulse, kCarMass * (1.0 + e) * met.relative_speed,
                is_smooth() ? 1e-6 * kCarMass : 2.0 * load * GetParam().time_step)
        << e;
    if (!is_smooth()) continue;
    // of the spring and the fall, 1/2 k y^2 and m g y from where it started
    const double y = falling.body("Car").pose.position.y();
    EXPECT_NEAR(falling.energy() + 0.5 * kCarSpring * y * y, energy - 0.5 * kCarMass * speed * speed * (1.0 - e * e),
                1e-5)
        << e;
  }
}

// Nearer than the sag the stop holds the car.
TEST_P(QuarterCar, StandsOnItsStop) {
  for (const std::string& spring : {"SuspensionStiffness = 2e4 SuspensionDamping = 2e3 ", ""}) {
    SceneRun standing = run(spring + "SuspensionUpperLimit = 0.02", 0.5);
    standing.to_end();
    EXPECT_NEAR(standing.body("Car").pose.position.y(), -0.02, 1e-9) << spring;
    EXPECT_NEAR(standing.body("Car").twist.linear.y(), 0.0, 1e-9) << spring;
    EXPECT_EQ(standing.count_events(EventKind::kLimitStart), 1U) << spring;
  }
}

// What each row of the joint pushed with in the last step, N.
class RowForces : public kernel::CommitListener {
 public:
  explicit RowForces(SceneRun* run) { run->environment().set_commit_listener(this); }
  double of(AxisMode mode) const { return mode == AxisMode::kLimited ? limited_ : locked_; }

 private:
  void on_inner_step(const kernel::Environment&, const kernel::InnerStep& inner) override {
    limited_ = locked_ = 0.0;
    const DiscrepancyColumns rows = inner.data.discrepancies.columns();
    for (std::size_t row = 0; row < rows.size(); ++row) {
      if (rows.at(row).is_angular()) continue;
      double force = inner.data.discrepancy_impulse[3 * row] / inner.data.time_step[0];
      // beside it, what acted in the derivatives of Smooth
      if (3 * row < inner.data.held_force.size()) force += inner.data.held_force[3 * row];
      (axis_mode(rows.at(row).modes, 0) == AxisMode::kLimited ? limited_ : locked_) += force;
    }
  }
  void on_commit(const kernel::Environment&) override {}

  double limited_ = 0.0, locked_ = 0.0;
};

// There the spring bears k x + P, and the stop the rest of the weight.
TEST_P(QuarterCar, ItsStopBearsWhatTheSpringDoesNot) {
  for (const double preload : {0.0, 300.0}) {
    SceneRun standing =
        run("SuspensionStiffness = 2e4 SuspensionDamping = 2e3 SuspensionUpperLimit = 0.02 "
            "SuspensionPreload = " +
                literal(preload),
            0.5);
    const RowForces forces(&standing);
    standing.to_end();
    // pushed down on the wheel, which is body 2
    EXPECT_NEAR(forces.of(AxisMode::kLocked), -(kCarSpring * 0.02 + preload), 1e-5) << preload;
    EXPECT_NEAR(forces.of(AxisMode::kLimited), -(kCarMass * kG - kCarSpring * 0.02 - preload), 1e-5) << preload;
  }
}

// On rubber the stop gives way by what it bears over its stiffness.
TEST_P(QuarterCar, PressesItsRubberStopIn) {
  SceneRun standing =
      run("SuspensionStiffness = 2e4 SuspensionDamping = 2e3 SuspensionUpperLimit = 0.02 "
          "SuspensionLimitStiffness = 1e5 SuspensionLimitDamping = 1e3",
          2.0);
  standing.to_end();
  // k x + k' (x - 0.02) = m g
  EXPECT_NEAR(standing.body("Car").pose.position.y(), -(kCarMass * kG + 1e5 * 0.02) / (kCarSpring + 1e5), 1e-9);
}

// Preloaded with its weight it stands where it starts, and its axle tells that weight from the first step on.
TEST_P(QuarterCar, StandsWhereItStartsOnItsPreload) {
  for (const std::string& stops : {"", "SuspensionLowerLimit = -0.05 SuspensionUpperLimit = 0.05 Restitution = 0.5 "}) {
    WatchedRun standing(
        scene("SuspensionStiffness = 2e4 SuspensionDamping = 500 SuspensionPreload = 981 " + stops, 0.2), overrides());
    while (!standing.run.is_done()) {
      standing.run.step();
      EXPECT_NEAR(standing.run.body("Car").pose.position.y(), 0.0, 1e-12) << stops;
      const auto reactions = standing.reactions();
      ASSERT_EQ(reactions.size(), 1U);
      const auto& force = reactions[0].force();
      EXPECT_NEAR(std::fabs(force.at(1)), kCarMass * kG, 1e-7) << stops << standing.run.time();
    }
  }
}

// With less it sinks until k x = m g - P; it swings at sqrt(k/m) about there.
TEST_P(QuarterCar, SinksByWhatItsPreloadLeaves) {
  SceneRun settling = run("SuspensionStiffness = 2e4 SuspensionDamping = 2.8e3 SuspensionPreload = 600", 2.0);
  settling.to_end();
  EXPECT_NEAR(settling.body("Car").pose.position.y(), -(kCarMass * kG - 600.0) / kCarSpring, 1e-9);
  if (!is_smooth()) return;
  constexpr double kSpeed = 0.2;
  SceneRun swinging = run("SuspensionStiffness = 2e4 SuspensionPreload = 981", 2.0, kSpeed);
  const double rate = std::sqrt(kCarSpring / kCarMass);
  swinging.to_end();
  EXPECT_NEAR(swinging.body("Car").pose.position.y(), kSpeed / rate * std::sin(2.0 * rate), 1e-6);
}

// Without a spring it falls freely from stop to stop: up against the lower one, back at its speed, and down on the upper one.
TEST_P(QuarterCar, IsFreeBetweenStopsAlone) {
  const double up = 1.5, way = 0.05, at_stop = std::sqrt(up * up - 2.0 * kG * way);
  SceneRun thrown = run("SuspensionLowerLimit = -0.05 SuspensionUpperLimit = 0.05 Restitution = 1", 0.09, up);
  thrown.to_end();
  ASSERT_EQ(thrown.count_events(EventKind::kLimitStart), 1U);
  const Event met = first_stop(thrown);
  EXPECT_NEAR(met.time, (up - at_stop) / kG, is_smooth() ? 1e-7 : 3.0 * GetParam().time_step);
  EXPECT_NEAR(met.relative_speed, at_stop, is_smooth() ? 1e-7 : 2.0 * kG * GetParam().time_step);
  // mirrored in time at the stop
  const double since = 0.09 - 2.0 * (up - at_stop) / kG;
  EXPECT_NEAR(thrown.body("Car").pose.position.y(), -up * since - 0.5 * kG * since * since,
              is_smooth() ? 1e-7 : 2.0 * up * GetParam().time_step);
}

// With a damper it sinks at m g/c in the end.
TEST_P(QuarterCar, SinksInADamperAlone) {
  SceneRun sinking = run("SuspensionUpperLimit = 0.5 SuspensionDamping = 2e3", 0.8);
  sinking.to_end();
  const double steady = kCarMass * kG / 2e3;
  EXPECT_NEAR(sinking.body("Car").twist.linear.y(), -steady, steady * 2.0 * std::exp(-0.8 * 2e3 / kCarMass));
}

// A car of 400 kg on four wheels, which lands on them from 0.5 m, and on the two of one side first.
class LandingCar : public ::testing::Test {
 protected:
  static constexpr double kTravel = 0.08;

  struct Setting {
    std::string solver = "Newton";
    double time_step = 1.0 / 240.0;
    bool has_stops = true;
    double mirror = 1.0;       // -1: right and left exchanged
    bool is_reversed = false;  // the order of wheels, and the direction of their steering axes
  };
  static SceneRun car(const Setting& with) {
    std::string bodies = "Body { Id = \"Floor\" GeometryId = \"Ground\" Material = \"M\" }\n", joints;
    bodies +=
        "Body { Id = \"Car\" Mass = 400 PrincipalMoments = {150, 300, 200} Forces = {\"G\"} KineticProperties { "
        "Position = {0, 1, 0} AngularVelocity = {" +
        literal(0.4 * with.mirror) + ", 0, 0.2} } }\n";
    const std::string sign = with.is_reversed ? "-" : "";
    for (int i = 0; i < 4; ++i) {
      const int wheel = with.is_reversed ? 3 - i : i;
      const double x = wheel / 2 == 0 ? 1.3 : -1.3, z = with.mirror * (wheel % 2 == 0 ? 0.8 : -0.8);
      const std::string id = "Wheel" + std::to_string(wheel), at = literal(Vector3(x, 0.8, z));
      // moved with the car
      const Vector3 velocity = Vector3(0.4 * with.mirror, 0, 0.2).cross(Vector3(x, -0.2, z));
      bodies +=
          "Body { Id = \"" + id +
          "\" GeometryId = \"Tyre\" Material = \"M\" Mass = 20 Forces = {\"G\"} KineticProperties { Position = " + at +
          " LinearVelocity = " + literal(velocity) + " AngularVelocity = {" + literal(0.4 * with.mirror) +
          ", 0, 0.2} } }\n";
      joints += "Constraint { Type = \"Axle\" Id = \"Axle" + std::to_string(wheel) + "\" Body1 = \"Car\" Body2 = \"" +
                id + "\" CustomProperties { BindPoint = " + at + " SteeringAxis = {0, " + sign +
                "1, 0} RollingAxis = {0, 0, 1} SuspensionStiffness = 1.5e4 SuspensionDamping = 500 ";
      const double lower = with.is_reversed ? -kTravel : -0.05, upper = with.is_reversed ? 0.05 : kTravel;
      if (with.has_stops)
        joints += "SuspensionLowerLimit = " + literal(lower) + " SuspensionUpperLimit = " + literal(upper) + " ";
      joints += "SteeringLowerLimit = 0 SteeringUpperLimit = 0 } }\n";
    }
    return SceneRun(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"Ground\" CustomProperties { } }\n"
        "Geometry { Type = \"Sphere\" Id = \"Tyre\" CustomProperties { Radius = 0.3 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Simulator { CustomProperties { Duration = 1 } }\nEnvironment { Space { Bodies {\n" +
            bodies + "} }\nConstraints {\n" + joints + "} }\n",
        {set("Solver", with.solver), set("Simulator.TimeStep", with.time_step)});
  }
  // How far it is above its start, as the car sees it, m.
  static double way(const SceneRun& run, int wheel) {
    const Pose car = run.body("Car").pose;
    return (car.orientation.conjugate() * (run.body("Wheel" + std::to_string(wheel)).pose.position - car.position))
               .y() +
           0.2;
  }
};

// Springs alone let the wheels come up by more than 0.2 m, into the chassis.
TEST_F(LandingCar, KeepsItsWheelsBetweenTheirStops) {
  for (const std::string solver : {"Sequential", "Newton", "Direct"})
    for (const bool has_stops : {false, true}) {
      SceneRun landing = car({.solver = solver, .has_stops = has_stops});
      double highest = -1.0, lowest = 1.0;
      while (!landing.is_done()) {
        landing.step();
        for (int wheel = 0; wheel < 4; ++wheel) {
          highest = std::max(highest, way(landing, wheel));
          lowest = std::min(lowest, way(landing, wheel));
        }
      }
      if (!has_stops) {
        EXPECT_GT(highest, 0.2) << solver;
        continue;
      }
      // Sequential's sweeps leave some of it
      EXPECT_NEAR(highest, kTravel, solver == "Sequential" ? 1e-4 : 1e-8) << solver;
      EXPECT_GE(lowest, -0.05 - (solver == "Sequential" ? 1e-4 : 1e-8)) << solver;
      EXPECT_GE(landing.count_events(EventKind::kLimitStart), 4U) << solver;
    }
}

TEST_F(LandingCar, GoesTheSameWayWithAnySolver) {
  std::vector<SceneRun::Motion> ends;
  for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
    SceneRun landing = car({.solver = solver});
    landing.to_end();
    ends.push_back(landing.body("Car"));
    EXPECT_LE((ends.back().pose.position - ends.front().pose.position).norm(), solver == "Direct" ? 1e-8 : 1e-4)
        << solver;
    EXPECT_LE(harness::angle_between(ends.back().pose.orientation, ends.front().pose.orientation),
              solver == "Direct" ? 1e-8 : 1e-4)
        << solver;
  }
}

// Right and left exchanged, wheels in another order and their axes pointing down: the mirror image of the motion.
TEST_F(LandingCar, IsTheImageOfItsTwins) {
  for (const std::string solver : {"Newton", "Direct"}) {
    SceneRun plain = car({.solver = solver}), mirrored = car({.solver = solver, .mirror = -1.0}),
             reversed = car({.solver = solver, .is_reversed = true});
    plain.to_end(), mirrored.to_end(), reversed.to_end();
    const SceneRun::Motion car = plain.body("Car"), image = mirrored.body("Car"), other = reversed.body("Car");
    const Vector3 across(1, 1, -1), turns(-1, -1, 1);
    EXPECT_LE((image.pose.position - across.cwiseProduct(car.pose.position)).norm(), 1e-9) << solver;
    EXPECT_LE((image.twist.angular - turns.cwiseProduct(car.twist.angular)).norm(), 1e-8) << solver;
    EXPECT_LE((other.pose.position - car.pose.position).norm(), 1e-9) << solver;
    EXPECT_LE((other.twist.angular - car.twist.angular).norm(), 1e-8) << solver;
  }
}

}  // namespace
}  // namespace gravitas
