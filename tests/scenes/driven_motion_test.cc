// Drives of hinges and guides along a course over time (Motion): where they are, what they bear, what bounds them, in closed form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "tests/scenes/scene_run.h"
#include "tests/scenes/watched_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using harness::WatchedRun;

constexpr double kDiscMoment = 0.2;  // kg m^2, of the disc about its axis

std::string course_of(double from, double to, int intervals, const std::function<double(double)>& value) {
  std::string rows;
  for (int i = 0; i <= intervals; ++i) {
    const double t = from + (to - from) * i / intervals;
    rows += (i > 0 ? ", {" : "{") + literal(t) + ", " + literal(value(t)) + "}";
  }
  return " Motion = {" + rows + "} ";
}

// A disc about z, on the world or on a free frame of three times its moment.
std::string course_scene(const std::string& joint, const std::string& body1 = "", const std::string& more = "") {
  return "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } "
         "Force { Type = \"Basic\" Id = \"Twist\" CustomProperties { Force = {0, 0, 0} Torque = {0, 0, 1} } } }\n"
         "Simulator { CustomProperties { TimeStep = 0.01 Duration = 2 } }\n"
         "Environment { Space { Bodies {\n"
         "Body { Id = \"Frame\" Mass = 5 PrincipalMoments = {1, 1, 0.6} }\n"
         "Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.1, 0.1, 0.2} " +
         more + " } } }\nConstraints { Constraint { Id = \"J\" Body1 = \"" + body1 + "\" Body2 = \"Disc\" " + joint +
         " } } }\n";
}

std::string course_hinge(const std::string& more, const Vector3& point = Vector3::Zero()) {
  return "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = " + literal(point) +
         " BindAxisPoint2 = " + literal(Vector3(point + Vector3::UnitZ())) + more + " }";
}
std::string course_guide(const std::string& more) {
  return "Type = \"Slider\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0}" + more + " }";
}

// Of body 2 against body 1, -pi ... pi.
double disc_angle(const SceneRun& run, const std::string& body1 = "") {
  const Quaternion one = body1.empty() ? Quaternion::Identity() : run.body(body1).pose.orientation;
  const Quaternion q = one.conjugate() * run.body("Disc").pose.orientation;
  return 2.0 * std::atan2(q.z(), q.w());
}
double turns_apart(double a, double b) { return std::fabs(std::remainder(a - b, 2.0 * kPi)); }

struct CourseWay {
  const char *solver, *simulator, *integrator;
};
void PrintTo(const CourseWay& way, std::ostream* out) { *out << way.solver << way.simulator << way.integrator; }

class DrivenMotion : public ::testing::TestWithParam<CourseWay> {
 protected:
  std::vector<std::string> with(std::vector<std::string> more = {}) const {
    more.push_back(std::string("Solver=") + GetParam().solver);
    more.push_back(std::string("Simulator=") + GetParam().simulator);
    more.push_back(std::string("Integrator=") + GetParam().integrator);
    return more;
  }
  bool is_smooth() const { return std::string(GetParam().simulator) == "Smooth"; }
};

INSTANTIATE_TEST_SUITE_P(
    Each, DrivenMotion,
    ::testing::Values(CourseWay{"Sequential", "Basic", "SemiImplicitEuler"},
                      CourseWay{"Newton", "Basic", "SemiImplicitEuler"}, CourseWay{"Newton", "Basic", "Euler"},
                      CourseWay{"Direct", "Basic", "Verlet"}, CourseWay{"Direct", "Basic", "BasicVerlet"},
                      CourseWay{"Newton", "Basic", "RK4"}, CourseWay{"Newton", "Continuous", "Verlet"},
                      CourseWay{"Direct", "Bisection", "SemiImplicitEuler"},
                      CourseWay{"Newton", "Substepping", "SemiImplicitEuler"},
                      CourseWay{"Sequential", "Substepping", "Verlet"}, CourseWay{"Newton", "Smooth", "RK4"},
                      CourseWay{"Direct", "Smooth", "DormandPrince54"}, CourseWay{"Newton", "Smooth", "Radau"}),
    [](const auto& which) { return std::string(which.param.solver) + which.param.simulator + which.param.integrator; });

// At constant accelerations a course through its rows is exact. The disc's weight is no matter to its axis.
TEST_P(DrivenMotion, IsWhereItsCourseIsAtEachStep) {
  const auto way = [](double t) { return 0.4 * t + 1.5 * t * t; };
  for (const std::string& body1 : {"", "Frame"}) {
    SceneRun run(course_scene(course_hinge(course_of(0, 2, 4, way)), body1), with());
    while (!run.is_done()) {
      run.step();
      ASSERT_LT(turns_apart(disc_angle(run, body1), way(run.time())), 1e-12) << run.time();
      const double rate =
          run.body("Disc").twist.angular.z() - (body1.empty() ? 0.0 : run.body("Frame").twist.angular.z());
      ASSERT_NEAR(rate, 0.4 + 3.0 * run.time(), 1e-11) << run.time();
    }
    EXPECT_GT(way(run.time()), 2.0 * kPi);
    EXPECT_LT(run.report().max_joint_error(), 1e-12);
  }
  SceneRun run(course_scene(course_guide(course_of(0, 2, 4, way)), "", "Forces = {\"Down\"}"), with());
  while (!run.is_done()) {
    run.step();
    ASSERT_NEAR(run.body("Disc").pose.position.x(), way(run.time()), 1e-12) << run.time();
    ASSERT_NEAR(run.body("Disc").twist.linear.x(), 0.4 + 3.0 * run.time(), 1e-11) << run.time();
    ASSERT_NEAR(run.body("Disc").pose.position.y(), 0.0, 1e-12);
  }
}

// Through turns, though it has a single limit, which tells an angle within one.
TEST_P(DrivenMotion, TurnsOnAwayFromASingleLimit) {
  const auto way = [](double t) { return -0.4 * t - 1.5 * t * t - 0.5 * t * t * t * t; };
  for (const char* bound : {"", " MaximumTorque = 20"}) {
    SceneRun run(course_scene(course_hinge(std::string(" UpperLimit = 0.75") + bound + course_of(0, 2, 40, way))),
                 with());
    while (!run.is_done()) {
      run.step();
      ASSERT_LT(turns_apart(disc_angle(run), way(run.time())), *bound == '\0' ? 1e-3 : 0.02) << bound << run.time();
    }
    EXPECT_LT(way(run.time()), -4.0 * kPi);
  }
}

// Two free bodies share the turn by their moments, and keep their momentum.
TEST_P(DrivenMotion, FreeBodiesShareItByTheirMoments) {
  const auto way = [](double t) { return 1.5 * t * t; };
  SceneRun run(course_scene(course_hinge(course_of(0, 2, 4, way)), "Frame"), with());
  while (!run.is_done()) {
    run.step();
    ASSERT_NEAR(run.body("Disc").twist.angular.z(), 3.0 * run.time() * 0.6 / 0.8, 1e-10);
    ASSERT_LT(run.angular_momentum().norm(), 1e-10);
    ASSERT_LT(run.momentum().norm(), 1e-10);
  }
}

// The torque is J a, with the load's part where a load twists the disc.
TEST_P(DrivenMotion, BearsMomentTimesAcceleration) {
  const auto way = [](double t) { return 1.5 * t * t; };
  for (const bool is_twisted : {false, true}) {
    WatchedRun watched(
        course_scene(course_hinge(course_of(0, 2, 4, way)), "", is_twisted ? "Forces = {\"Twist\"}" : ""), with());
    watched.run.steps(3);
    for (int i = 0; i < 100; ++i) {
      watched.run.step();
      const auto reactions = watched.reactions();
      ASSERT_EQ(reactions.size(), 1U);
      ASSERT_NEAR(reactions[0].torque(2), kDiscMoment * 3.0 - (is_twisted ? 1.0 : 0.0), 1e-9);
    }
  }
}

// Through a rest, and on: the rows stand twice, and nothing sleeps for good.
TEST_P(DrivenMotion, RestsAndGoesOn) {
  SceneRun run(course_scene(course_hinge(" Motion = {{0, 0}, {0.3, 1}, {1.5, 1}, {2, 0}}")), with());
  run.steps(30);
  while (run.time() < 1.5 - 1e-9) {
    ASSERT_NEAR(disc_angle(run), 1.0, 1e-12);
    ASSERT_NEAR(run.body("Disc").twist.angular.z(), 0.0, 1e-12);
    run.step();
  }
  run.to_end();
  EXPECT_NEAR(disc_angle(run), 0.0, 1e-12);
}

// Before its first row and after its last it goes on at the rates there.
TEST_P(DrivenMotion, GoesOnBeyondItsEnds) {
  SceneRun run(course_scene(course_hinge(" Motion = {{0.5, 1}, {1, 2}}")), with());
  while (!run.is_done()) {
    run.step();
    ASSERT_LT(turns_apart(disc_angle(run), 2.0 * run.time()), 1e-12) << run.time();
  }
}

// A course that goes beyond a limit stops there, and comes away with it again.
TEST_P(DrivenMotion, StopsAtLimits) {
  const auto way = [](double t) { return 2.0 * t - t * t; };
  for (const char* bound : {"", " MaximumTorque = 50"}) {
    const bool is_bounded = *bound != '\0';
    SceneRun run(course_scene(course_hinge(course_of(0, 2, 2, way) + " LowerLimit = -0.5 UpperLimit = 0.75" + bound),
                              "", "KineticProperties { AngularVelocity = {0, 0, 2} }"),
                 with());
    while (!run.is_done()) {
      run.step();
      // bounded, it is off by up to a step's way where the limit stops it and lets it go, and then by h^2 of its acceleration
      const double expected = std::min(0.75, way(run.time()));
      const double since = std::min(std::fabs(run.time() - 0.5), std::fabs(run.time() - 1.5));
      const double behind = !is_bounded ? 1e-12 : since < 0.15 ? 0.01 : 3e-4;
      ASSERT_NEAR(disc_angle(run), expected, behind) << bound << run.time();
      ASSERT_LE(disc_angle(run), 0.75 + 1e-9);
    }
  }
  SceneRun run(course_scene(course_guide(course_of(0, 2, 2, way) + " UpperLimit = 0.75")), with());
  while (!run.is_done()) {
    run.step();
    ASSERT_NEAR(run.body("Disc").pose.position.x(), std::min(0.75, way(run.time())), 1e-12);
  }
}

// With a bound that suffices it is behind by some h^2 of its accelerations, and the bound is kept.
TEST_P(DrivenMotion, BoundedItFollowsWhatItCan) {
  const auto way = [](double t) { return 1.5 * t * t; };
  for (const double step : {0.01, 0.005}) {
    WatchedRun watched(
        course_scene(course_hinge(course_of(0, 2, 4, way) + " MaximumTorque = 2"), "", "Forces = {\"Twist\"}"),
        with({set("Simulator.TimeStep", step)}));
    while (!watched.run.is_done()) {
      watched.run.step();
      ASSERT_LT(turns_apart(disc_angle(watched.run), way(watched.run.time())), 10.0 * step * step)
          << watched.run.time();
      if (watched.run.step_count() > 2) {
        ASSERT_NEAR(watched.reactions()[0].torque(2), kDiscMoment * 3.0 - 1.0, 0.05) << watched.run.time();
      }
    }
  }
}

// A course that jumps away within a hundredth: T/J = 5 rad/s^2 all the way up, a quarter of that to come to rest, so the
// disc is there at v/5 + v/1.25 with v^2 (1/10 + 1/2.5) = 1, and does not go beyond.
TEST_P(DrivenMotion, BoundedItFallsBehindAndComesBack) {
  for (const double sign : {1.0, -1.0}) {
    SceneRun run(course_scene(course_hinge(" MaximumTorque = 1 Motion = {{0, 0}, {0.01, " + literal(sign) + "}, {3, " +
                                           literal(sign) + "}}")),
                 with({set("Simulator.Duration", 3.0), set("Simulator.TimeStep", 0.005)}));
    double most = 0.0, fastest = 0.0;
    while (!run.is_done()) {
      const double before = run.body("Disc").twist.angular.z();
      run.step();
      ASSERT_LE(std::fabs(run.body("Disc").twist.angular.z() - before), 5.0 * 0.005 * (is_smooth() ? 2.0 : 1.0) + 1e-9);
      fastest = std::max(fastest, sign * run.body("Disc").twist.angular.z());
      most = std::max(most, sign * disc_angle(run));
      if (run.time() < 0.25) {
        ASSERT_NEAR(sign * disc_angle(run), 2.5 * run.time() * run.time(), 5.0 * 0.005) << run.time();
      }
      if (run.time() > 1.8) {
        ASSERT_NEAR(sign * disc_angle(run), 1.0, 1e-3) << run.time();
      }
    }
    EXPECT_NEAR(fastest, std::sqrt(2.0), 0.08);
    EXPECT_LT(most, 1.0 + 1e-3);
    EXPECT_NEAR(sign * disc_angle(run), 1.0, 1e-9);
  }
}

// A bound of 0: nothing is driven.
TEST_P(DrivenMotion, WithoutAnyTorqueItTurnsFreely) {
  SceneRun run(course_scene(course_hinge(" MaximumTorque = 0 Motion = {{0, 0}, {1, 1}}"), "",
                            "KineticProperties { AngularVelocity = {0, 0, 0.5} }"),
               with());
  run.to_end();
  EXPECT_NEAR(disc_angle(run), 1.0, 1e-12);
}

// A crank of 0.3 that turns at a constant rate, a rod of 1 and a piston: x = r cos a + sqrt(l^2 - r^2 sin^2 a).
TEST_P(DrivenMotion, ACrankMovesItsPiston) {
  const std::string text =
      "Simulator { CustomProperties { TimeStep = 0.005 Duration = 2 } }\nEnvironment { Space { Bodies {\n"
      "Body { Id = \"Crank\" Mass = 1 PrincipalMoments = {0.01, 0.01, 0.01} KineticProperties { Position = {0.15, 0, "
      "0} } }\n"
      "Body { Id = \"Rod\" Mass = 0.5 PrincipalMoments = {0.001, 0.04, 0.04} KineticProperties { Position = {0.8, 0, "
      "0} } }\n"
      "Body { Id = \"Piston\" Mass = 2 PrincipalMoments = {0.01, 0.01, 0.01} KineticProperties { Position = {1.3, 0, "
      "0} } }\n"
      "} }\nConstraints {\nConstraint { Type = \"Revolute\" Id = \"Shaft\" Body2 = \"Crank\" CustomProperties { "
      "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} Motion = {{0, 0}, {1, 7}} } }\n"
      "Constraint { Type = \"Revolute\" Id = \"Pin\" Body1 = \"Crank\" Body2 = \"Rod\" CustomProperties { "
      "BindAxisPoint1 = {0.3, 0, 0} BindAxisPoint2 = {0.3, 0, 1} } }\n"
      "Constraint { Type = \"Spherical\" Id = \"Small\" Body1 = \"Rod\" Body2 = \"Piston\" CustomProperties { "
      "BindPoint = "
      "{1.3, 0, 0} } }\nConstraint { Type = \"Slider\" Id = \"Bore\" Body2 = \"Piston\" CustomProperties { BindPoint = "
      "{0, "
      "0, 0} Axis = {1, 0, 0} } } } }\n";
  const bool is_exact = std::string(GetParam().solver) != "Sequential";
  SceneRun run(text, with());
  while (!run.is_done()) {
    run.step();
    const double a = 7.0 * run.time(), across = 0.3 * std::sin(a);
    ASSERT_NEAR(run.body("Piston").pose.position.x(), 0.3 * std::cos(a) + std::sqrt(1.0 - across * across),
                is_exact ? 1e-9 : 1e-3)
        << run.time();
  }
}

// Course and state are all that a solver needs: others go on with it.
TEST(DrivenMotionOfSwaps, GoesOn) {
  const auto way = [](double t) { return std::sin(3.0 * t); };
  for (const char* bound : {"", " MaximumTorque = 0.4"}) {
    const std::string text = course_scene(course_hinge(course_of(0, 2, 40, way) + bound));
    SceneRun alone(text, {"Solver=Newton"}), swapped(text, {"Solver=Sequential"});
    for (const char* order : {"solver=Newton@step=40", "solver=Direct@step=80", "solver=Sequential@step=120"})
      swapped.order_swap(order);
    while (!alone.is_done()) {
      alone.step(), swapped.step();
      ASSERT_NEAR(disc_angle(swapped), disc_angle(alone), 1e-10) << bound << alone.time();
    }
    EXPECT_EQ(swapped.environment().swaps().size(), 3);
  }
}

// A million turns: the angle is known but for whole turns, and the course to its own rounding.
TEST(DrivenMotionOfManyTurns, KeepsItsAngle) {
  const double turns = 2e6 * kPi, rate = 60.0;
  for (const char* solver : {"Newton", "Direct", "Sequential"})
    for (const char* bound : {"", " MaximumTorque = 100"}) {
      SceneRun run(course_scene(course_hinge(" Motion = {{0, " + literal(turns) + "}, {1, " + literal(turns + rate) +
                                             "}}" + bound)),
                   {std::string("Solver=") + solver});
      while (!run.is_done()) {
        run.step();
        // from rest, 500 rad/s^2 and a quarter of that
        if (run.time() < 1.0 && *bound != '\0') continue;
        ASSERT_LT(turns_apart(disc_angle(run), rate * run.time()), 1e-8) << solver << bound << run.time();
      }
    }
}

// The order of an integrator is kept with Smooth: an arm that a course of four rows turns, and a pendulum at its end, which
// feels Coriolis and Jdot terms.
class OrderOfDrivenMotion : public ::testing::TestWithParam<std::pair<const char*, double>> {};
INSTANTIATE_TEST_SUITE_P(Each, OrderOfDrivenMotion,
                         ::testing::Values(std::pair{"RK4", 4.0}, std::pair{"DormandPrince54", 0.0}),
                         [](const auto& which) { return std::string(which.param.first); });

TEST_P(OrderOfDrivenMotion, IsThatOfTheIntegrator) {
  // an arm that is driven by rows, and a pendulum that hangs from its end
  const std::string text =
      "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.01 Duration = 1 } }\nEnvironment { Space { Bodies "
      "{\n"
      "Body { Id = \"Arm\" Mass = 1 PrincipalMoments = {0.01, 0.02, 0.03} KineticProperties { Position = {0.5, 0, 0} } "
      "Forces "
      "= {\"Down\"} }\n"
      "Body { Id = \"Bob\" Mass = 1 PrincipalMoments = {0.01, 0.02, 0.03} KineticProperties { Position = {1, -0.7, 0} "
      "} Forces "
      "= {\"Down\"} } } }\nConstraints {\nConstraint { Type = \"Revolute\" Id = \"A\" Body2 = \"Arm\" CustomProperties "
      "{ "
      "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} Motion = {{0, 0}, {0.23, 0.7}, {0.61, -0.4}, {1, 1.3}} } "
      "}\n"
      "Constraint { Type = \"Revolute\" Id = \"B\" Body1 = \"Arm\" Body2 = \"Bob\" CustomProperties { BindAxisPoint1 = "
      "{1, 0, "
      "0} BindAxisPoint2 = {1, 0, 1} } } } }\n";
  const auto end_of = [&](double step, const std::string& integrator) {
    SceneRun run(text, {set("Simulator.TimeStep", step), "Integrator=" + integrator, "Solver=Direct"});
    run.to_end();
    return run.body("Bob").pose.position;
  };
  const Vector3 reference = end_of(0.005, "DormandPrince853");
  const double coarse = (end_of(0.02, GetParam().first) - reference).norm(),
               fine = (end_of(0.01, GetParam().first) - reference).norm();
  if (GetParam().second > 0.0) {
    EXPECT_GT(std::log2(coarse / fine), GetParam().second - 0.3) << coarse << " " << fine;
  } else {
    EXPECT_LT(coarse, 1e-7);
  }
}

}  // namespace
}  // namespace gravitas
