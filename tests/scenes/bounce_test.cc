// Impacts: the ratio of the speeds, energy, apexes, coming to rest, mixed materials, two movable bodies.
#include <gmock/gmock.h>
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
using harness::set;

constexpr double kRadius = 0.5, kHeight = 1.0;

struct Case {
  const char* integrator;
  double restitution;
};

void PrintTo(const Case& which, std::ostream* out) { *out << which.integrator << ", e = " << which.restitution; }

std::vector<std::string> overrides(const Case& which, double time_step) {
  return {set("Integrator", std::string(which.integrator)), set("Simulator.TimeStep", time_step),
          set("Material.Ground.RestitutionCoefficient", which.restitution),
          set("Material.Rubber.RestitutionCoefficient", which.restitution)};
}

double height(const SceneRun& run) { return run.body("Ball").pose.position.y() - kRadius; }
double speed(const SceneRun& run) { return run.body("Ball").twist.linear.y(); }

class Bounce : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(EachIntegratorAndRestitution, Bounce,
                         ::testing::Values(Case{"Euler", 0.0}, Case{"Euler", 0.5}, Case{"Euler", 0.8},
                                           Case{"Euler", 1.0}, Case{"SemiImplicitEuler", 0.0},
                                           Case{"SemiImplicitEuler", 0.5}, Case{"SemiImplicitEuler", 0.8},
                                           Case{"SemiImplicitEuler", 1.0}));

// Every landing leaves with e times the speed of arrival: that of a fall through what was left of the gap.
TEST_P(Bounce, LeavesWithTheShareOfTheSpeedOfArrival) {
  const double e = GetParam().restitution;
  SceneRun run("bounce.gravitas", overrides(GetParam(), 0.004));
  int landings = 0;
  while (!run.is_done() && landings < 5) {
    const double gap = height(run), before = speed(run);
    run.step();
    const double after = speed(run);
    if (before >= 0.0 || after <= before) continue;
    const double arrival = std::sqrt(before * before + 2.0 * kG * gap);
    if (arrival < 2.0 * kG * run.time_step()) break;  // slower than this it rests
    ++landings;
    // a handful of operations on numbers of size arrival^2
    ASSERT_NEAR(after, e * arrival, 1e-14 * arrival) << "landing " << landings;
    ASSERT_NEAR(height(run), 0.0, 1e-15) << "landing " << landings;
  }
  EXPECT_EQ(landings, e == 0.0 ? 1 : 5);
}

// The modified energy of a first-order method differs from the true one by m g h |v|/2 and changes its sign with v at
// a bounce: each costs (or, with Euler, gives) at most m g h |v|, and the rest of the step in which it lands another.
void expect_elastic_energy(const Case& which) {
  const double arrival = std::sqrt(2.0 * kG * kHeight), energy = 2.0 * kG * (kHeight + kRadius);
  double coarser = 0.0;
  for (const double h : {1.0 / 128, 1.0 / 256, 1.0 / 512, 1.0 / 1024}) {
    SceneRun run("bounce.gravitas", overrides(which, h));
    double worst = 0.0;
    int landings = 0;
    while (!run.is_done()) {
      const double before = speed(run);
      run.step();
      landings += before < 0.0 && speed(run) > 0.0 ? 1 : 0;
      worst = std::max(worst, std::fabs(run.energy() - energy));
    }
    EXPECT_GE(landings, 6);
    EXPECT_LE(worst, 2.0 * (landings + 1) * 2.0 * kG * h * arrival) << h;
    if (coarser > 0.0) {
      EXPECT_NEAR(std::log2(coarser / worst), 1.0, 0.25) << h;
    }
    coarser = worst;
  }
}

TEST(Bounce, KeepsTheEnergyToFirstOrderIfElastic) {
  expect_elastic_energy({"Euler", 1.0});
  expect_elastic_energy({"SemiImplicitEuler", 1.0});
}

// Two balls on a rod fall on one end, then on the other while they turn: what the joint does in the step is not the
// impact's gain, and costs no restitution.
TEST(Bounce, OfJoinedBodiesIsElastic) {
  for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
    for (const std::string simulator : {"Continuous", "Basic"}) {
      SCOPED_TRACE(solver + ", " + simulator);
      SceneRun run(R"(
Geometries { Geometry { Type = "Halfspace" Id = "Flat" } Geometry { Type = "Sphere" Id = "Round" CustomProperties { Radius = 0.1 } } }
Materials { Material { Id = "Smooth" RestitutionCoefficient = 1 StaticFrictionCoefficient = 0 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.005 Duration = 0.6 } }
Environment {
  Space { Bodies {
    Body { Id = "Ground" GeometryId = "Flat" Material = "Smooth" }
    Body { Id = "A" GeometryId = "Round" Material = "Smooth" Mass = 1 KineticProperties { Position = {0, 1, 0} } Forces = {"Down"} }
    Body { Id = "B" GeometryId = "Round" Material = "Smooth" Mass = 2 KineticProperties { Position = {0.5, 1.2, 0.1} } Forces = {"Down"} }
  } }
  Constraints { Constraint { Type = "Rigid" Id = "Rod" Body1 = "A" Body2 = "B" } }
  KineticIntegrator = "Verlet"
}
)",
                   {set("Simulator", simulator), set("Solver", solver)});
      const double energy = run.energy();
      run.to_end();
      // the joint is of first order: 0.4 % of it go in each 5 ms that they turn
      EXPECT_NEAR(run.energy(), energy, 0.06 * energy);
    }
  }
}

TEST_P(Bounce, ApexesShrinkByTheSquare) {
  const double e = GetParam().restitution, h = 1e-4;
  SceneRun run("bounce.gravitas", overrides(GetParam(), h));
  double apex = kHeight;
  if (e == 0.0) {
    while (speed(run) <= 0.0 && !run.is_done()) run.step();
    EXPECT_LT(speed(run), 1e-12);
    EXPECT_NEAR(height(run), 0.0, h * std::sqrt(2.0 * kG * kHeight));
    return;
  }
  for (int bounce = 0; bounce < 3; ++bounce) {
    while (speed(run) <= 0.0) run.step();
    double top = 0.0;
    for (; speed(run) > 0.0; run.step()) top = std::max(top, height(run));
    const double arrival = std::sqrt(2.0 * kG * apex);
    // the speed of arrival and the way up are each of first order: h v/2 and h e v/2; the apex lies between two states
    EXPECT_NEAR(top, e * e * apex, h * (arrival + 2.0 * kG * h)) << "bounce " << bounce;
    apex = top;
  }
  EXPECT_NEAR(apex, kHeight * std::pow(e, 6.0), 4.0 * h * std::sqrt(2.0 * kG * kHeight));
}

// Time of the last step that moved the ball.
double last_motion_of(SceneRun* run) {
  double last = 0.0;
  while (!run->is_done()) {
    const double before = height(*run);
    run->step();
    if (std::fabs(speed(*run)) > 1e-12 || std::fabs(height(*run) - before) > 1e-12) last = run->time();
  }
  return last;
}

class RestReached : public ::testing::TestWithParam<Case> {};

// Explicit Euler gains g h in every flight (its position lags behind), so it cannot come below the rest speed with more
// than e = 1/2: see the next test.
INSTANTIATE_TEST_SUITE_P(EachIntegratorAndRestitution, RestReached,
                         ::testing::Values(Case{"Euler", 0.0}, Case{"Euler", 0.3}, Case{"SemiImplicitEuler", 0.0},
                                           Case{"SemiImplicitEuler", 0.5}, Case{"SemiImplicitEuler", 0.8}));

TEST_P(RestReached, IsReachedInTimeAndIsExact) {
  const double e = GetParam().restitution, h = 0.001;
  SceneRun run("bounce.gravitas", overrides(GetParam(), h));
  const double last_motion = last_motion_of(&run);
  EXPECT_LE(std::fabs(speed(run)), 1e-12);
  EXPECT_NEAR(height(run), 0.0, 1e-9);
  EXPECT_EQ(run.body("Ball").twist.angular, Vector3::Zero());
  // The time of the closed form, less flights below the rest speed 2 g h, which together take 4 h/(1 - e). A flight is
  // timed to two steps, and loses or gains at most g h e/(1 - e) of its speed in all, so 2 h e/(1 - e) of its time.
  const double expected = std::sqrt(2.0 * kHeight / kG) * (1.0 + e) / (1.0 - e);
  const double flights = e == 0.0 ? 1.0 : std::log(2.0 * kG * h / std::sqrt(2.0 * kG * kHeight)) / std::log(e);
  EXPECT_NEAR(last_motion, expected, (flights * (2.0 + 2.0 * e / (1.0 - e)) + 4.0 / (1.0 - e)) * h);
}

// What explicit Euler does badly: with e > 1/2 the ball ends in hops that leave with e g h/(1 - e) for ever. They
// vanish with the time step.
TEST(Bounce, ExplicitEulerKeepsHoppingLowAboveOneHalf) {
  const double e = 0.8;
  for (const double h : {0.004, 0.001}) {
    SceneRun run("bounce.gravitas", overrides({"Euler", e}, h));
    while (run.time() < 5.5) run.step();
    double fastest = 0.0;
    for (; !run.is_done(); run.step()) fastest = std::max(fastest, speed(run));
    EXPECT_GT(fastest, 2.0 * kG * h);
    // the fixed point of v = e (v + g h), within the step that the landing falls into
    EXPECT_NEAR(fastest, e / (1.0 - e) * kG * h, kG * h + 1e-12);
  }
}

TEST(Bounce, RestitutionIsTheMeanOfTheTwoMaterials) {
  for (const auto& [ground, ball] :
       {std::pair{0.2, 0.6}, std::pair{0.6, 0.2}, std::pair{0.0, 0.8}, std::pair{0.8, 0.0}}) {
    SceneRun run("bounce.gravitas", {set("Material.Ground.RestitutionCoefficient", ground),
                                     set("Material.Rubber.RestitutionCoefficient", ball)});
    double arrival = 0.0;
    while (speed(run) <= 0.0) {
      arrival = std::sqrt(speed(run) * speed(run) + 2.0 * kG * height(run));
      run.step();
    }
    EXPECT_NEAR(speed(run), 0.4 * arrival, 1e-14) << ground << " and " << ball;
  }
}

TEST(Bounce, EventsTellOfEachLanding) {
  SceneRun run("bounce.gravitas", {set("Simulator.Duration", 2)});
  std::vector<double> landings;
  while (!run.is_done()) {
    const double before = speed(run);
    run.step();
    if (before < 0.0 && speed(run) > 0.0) landings.push_back(run.time());
  }
  std::vector<double> starts;
  for (const Event& event : run.events()) {
    ASSERT_LT(event.a, event.b);
    if (event.kind == EventKind::kCollisionStart) starts.push_back(event.time);
  }
  ASSERT_GE(landings.size(), 2U);
  EXPECT_EQ(starts, landings);
  EXPECT_NEAR(run.events()[0].relative_speed, std::sqrt(2.0 * kG * kHeight), kG * run.time_step());
  // J = m (1 + e) v
  EXPECT_NEAR(run.events()[0].impulse, 2.0 * 1.8 * run.events()[0].relative_speed, 3.6 * kG * run.time_step());
  EXPECT_NEAR(run.count_events(EventKind::kCollisionEnd), starts.size(), 1);
}

struct Impact {
  const char* integrator;
  double left_mass, right_mass, restitution;
};

void PrintTo(const Impact& impact, std::ostream* out) {
  *out << impact.left_mass << " kg against " << impact.right_mass << " kg, e = " << impact.restitution;
}

class HeadOn : public ::testing::TestWithParam<Impact> {};

INSTANTIATE_TEST_SUITE_P(EachMassAndRestitution, HeadOn,
                         ::testing::Values(Impact{"Euler", 1, 1, 1}, Impact{"SemiImplicitEuler", 1, 1, 1},
                                           Impact{"SemiImplicitEuler", 1, 1, 0}, Impact{"SemiImplicitEuler", 1, 3, 0.5},
                                           Impact{"SemiImplicitEuler", 1000, 1, 0.8},
                                           Impact{"SemiImplicitEuler", 1, 1e6, 1}, Impact{"Euler", 2, 0.5, 0.3}));

TEST_P(HeadOn, ConservesMomentumAndObeysTheLawOfRestitution) {
  const auto [integrator, m1, m2, e] = GetParam();
  SceneRun run("collide.gravitas", {set("Integrator", std::string(integrator)), set("Body.Left.Mass", m1),
                                    set("Body.Right.Mass", m2), set("Material.Rubber.RestitutionCoefficient", e)});
  const double v1 = 2.0, v2 = -1.0;
  run.to_end();
  const double centre = (m1 * v1 + m2 * v2) / (m1 + m2);
  EXPECT_NEAR(run.body("Left").twist.linear.x(), centre - m2 / (m1 + m2) * e * (v1 - v2), 1e-14);
  EXPECT_NEAR(run.body("Right").twist.linear.x(), centre + m1 / (m1 + m2) * e * (v1 - v2), 1e-14);
  // along the line of the centres alone, without turning
  for (const char* ball : {"Left", "Right"}) {
    EXPECT_EQ(run.body(ball).twist.linear.y(), 0.0);
    EXPECT_EQ(run.body(ball).twist.linear.z(), 0.0);
    EXPECT_EQ(run.body(ball).twist.angular, Vector3::Zero());
  }
  EXPECT_EQ(run.count_events(EventKind::kCollisionStart), 1U);
}

// A rod of 1 kg over a floor, without gravity; `of_rod` says how it flies, `friction` what both are made of.
std::string rod_over_floor(double friction, const std::string& of_rod) {
  return R"(
Geometries {
  Geometry { Type = "Halfspace" Id = "Floor" }
  Geometry { Type = "Capsule" Id = "Rod" CustomProperties { Radius = 0.05 Height = 0.8 } }
}
Materials { Material { Id = "Steel" RestitutionCoefficient = 1 StaticFrictionCoefficient = )" +
         harness::literal(friction) + R"( } }
Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.001 Duration = 0.4 } }
Environment {
  Space { Type = "Basic" Id = "Space" Bodies {
    Body { Id = "Floor" GeometryId = "Floor" Material = "Steel" Immovable = true }
    Body { Id = "Rod" GeometryId = "Rod" Material = "Steel" Mass = 1 )" +
         of_rod + R"( } } }
  KineticIntegrator = "SemiImplicitEuler" ConstraintSolver = "Newton"
})";
}

// Nearly flat: one end of a rod bounces, and the other lands so soon after that what it gets presses the first one down
// again. Held there it would give the rod energy, so that the bounce is less; no more of it than that.
TEST(ElasticRod, WhoseSecondEndLandsAStepLaterLosesNoEnergy) {
  const std::string scene = rod_over_floor(0.0, R"(PrincipalMoments = {0.03, 0.002, 0.03}
      KineticProperties { Position = {0, 0.5, 0} Orientation = {0.706399320969851, 0, 0, 0.7078135342965218}
                          LinearVelocity = {0, -3, 0} })");
  for (const char* solver : {"Newton", "Direct", "Sequential"}) {
    for (const double moment : {0.02, 0.03, 0.05}) {
      SceneRun run(scene, {set("Solver", std::string(solver)),
                           set("Body.Rod.PrincipalMoments", Vector3(moment, 0.002, moment))});
      run.to_end();
      // the share is found to 1e-10, by a parabola through three solutions
      EXPECT_NEAR(run.kinetic_energy(), 4.5, 1e-8) << solver << ", " << moment;
    }
  }
}

// Kane's paradox: friction turns the rod so that its end would part with e times the speed of arrival and more energy than
// there was. It parts with as much of that as adds none.
TEST(ElasticRod, WhoseFrictionWouldAddEnergyLosesNone) {
  const std::string scene = rod_over_floor(0.8, R"(PrincipalMoments = {0.02, 0.002, 0.02}
      KineticProperties { Position = {0, 0.6, 0}
                          Orientation = {0.8699914681633703, 0, 0, 0.4930667757240834}
                          LinearVelocity = {-0.4865646792633509, -3.527401180512383, 0}
                          AngularVelocity = {0, 0, -2.1670156706503896} })");
  for (const char* solver : {"Newton", "Direct", "Sequential"}) {
    SceneRun run(scene, {set("Solver", std::string(solver))});
    const double before = run.kinetic_energy();
    run.to_end();
    EXPECT_NEAR(run.kinetic_energy(), before, 1e-8 * before) << solver;
    EXPECT_GT(run.body("Rod").twist.linear.y(), 0.0) << solver;
  }
}

// A ball comes down slowly in the middle of a step, while a box elsewhere slides to its stop before that: the step is cut
// there, and the ball bounces as it does alone.
TEST(BounceWhereItIsMet, DoesNotMindASlideThatEndsElsewhere) {
  const double h = 1.0 / 60.0, met = 1.8 * h, start = -0.11, arrival = start + kG * met;
  const auto velocity_after = [&](const std::string& box) {
    SceneRun run(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"Flat\" } Geometry { Type = \"Sphere\" Id = \"Round\" "
        "CustomProperties { Radius = 0.1 } } Geometry { Type = \"Box\" Id = \"Tile\" CustomProperties { HalfExtents = "
        "{0.5, 0.1, 0.5} } } }\nMaterials { Material { Id = \"Wood\" RestitutionCoefficient = 0.5 "
        "StaticFrictionCoefficient = 0.3 DynamicFrictionCoefficient = 0.3 } }\nForces { Force { Type = \"Gravity\" Id "
        "= "
        "\"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\nSimulator { Type = \"Bisection\" "
        "CustomProperties { TimeStep = " +
            literal(h) +
            " Duration = 1 } }\nEnvironment { KineticIntegrator = \"Verlet\" ConstraintSolver = \"Newton\" Space { "
            "Bodies { Body { Id = \"Floor\" GeometryId = \"Flat\" Material = \"Wood\" } Body { Id = \"Ball\" "
            "GeometryId "
            "= \"Round\" Mass = 1 Material = \"Wood\" Forces = { \"Down\" } KineticProperties { Position = " +
            literal(Vector3(0, 0.1 + start * met + 0.5 * kG * met * met, 0)) +
            " LinearVelocity = " + literal(Vector3(0, -start, 0)) + " } } " + box + " } } }\n",
        {});
    run.steps(2);
    return run.body("Ball").twist.linear.y();
  };
  const std::string box =
      "Body { Id = \"Box\" GeometryId = \"Tile\" Mass = 3 Material = \"Wood\" Forces = { \"Down\" } KineticProperties "
      "{ "
      "Position = {50, 0.1, 0} LinearVelocity = " +
      literal(Vector3(0.3 * kG * 1.2 * h, 0, 0)) + " } }";
  const double wanted = 0.5 * arrival - kG * 0.2 * h;
  EXPECT_NEAR(velocity_after(""), wanted, 1e-6);
  EXPECT_NEAR(velocity_after(box), wanted, 1e-6);
}

// A heavy ball throws a block against its stop, some nm away, and goes on: by then it has bounced once, and arrives at a block that
// stands. It stopped dead in one of twelve such places, as one that had pressed before.
TEST(BounceAtAStop, IsOneOfItsOwn) {
  constexpr double kBall = 4.0, kBlock = 0.5, e = 0.6;
  int places = 0;
  for (const double speed : {1.3, 2.0, 3.1})
    for (double gap = 1e-9; gap < 6e-9; gap *= 1.13) {
      ++places;
      const double share = (1.0 + e) * kBlock / (kBall + kBlock), on = speed * (1.0 - share);
      SceneRun run(
          "Geometries { Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = 0.1 } } Geometry { Type "
          "= \"Box\" Id = \"B\" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} } } }\n"
          "Materials { Material { Id = \"M\" RestitutionCoefficient = 0.6 StaticFrictionCoefficient = 0 } }\n"
          "Simulator { Type = \"Continuous\" CustomProperties { TimeStep = 0.0166666666666666 Duration = 0.15 "
          "Accuracy = 1e-5 } }\nEnvironment { Space { Bodies { Body { Id = \"Block\" GeometryId = \"B\" Material = "
          "\"M\" Mass = 0.5 KineticProperties { Position = {0.2, 0, 0} } }\n"
          "Body { Id = \"Ball\" GeometryId = \"S\" Material = \"M\" Mass = 4 KineticProperties { Position = {-0.1, "
          "0, 0} LinearVelocity = {" +
          literal(speed) +
          ", 0, 0} } } } } Constraints { Constraint { Type = \"Slider\" Id = \"J\" Body2 = \"Block\" "
          "CustomProperties { BindPoint = {0.2, 0, 0} Axis = {1, 0, 0} UpperLimit = " +
          literal(gap) + " } } } ConstraintSolver = \"Newton\" }");
      run.to_end();
      EXPECT_NEAR(run.body("Ball").twist.linear.x(), -e * on, 1e-6) << speed << ' ' << gap;
    }
  EXPECT_EQ(places, 45);
}

// Flights shorter than a step: what began in it, and was closed again where it ended, was at rest, with `Bisection`.
TEST(BounceWithinAStep, IsOneLikeAnyOther) {
  constexpr double kDuration = 1.2;
  for (const std::string simulator : {"Continuous", "Bisection"})
    for (const double restitution : {1.0, 0.99})
      for (const double height : {3e-4, 1e-3}) {
        SceneRun run(
            "Geometries { Geometry { Type = \"Halfspace\" Id = \"Flat\" } Geometry { Type = \"Sphere\" Id = \"Round\" "
            "CustomProperties { Radius = 0.01 } } }\nMaterials { Material { Id = \"M\" RestitutionCoefficient = " +
                literal(restitution) +
                " } }\nForces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, "
                "0} "
                "} } }\nSimulator { CustomProperties { SleepEnergy = 0 } }\nEnvironment { Space { Bodies { Body { Id = "
                "\"Floor\" GeometryId = \"Flat\" Material = \"M\" Immovable = true }\nBody { Id = \"Ball\" GeometryId "
                "= "
                "\"Round\" Mass = 1 Material = \"M\" Forces = {\"Down\"} KineticProperties { Position = " +
                literal(Vector3(0.0, 0.01 + height, 0.0)) + " } } } } }",
            {set("Simulator", simulator), set("Simulator.TimeStep", 1.0 / 60.0), set("Simulator.Duration", kDuration)});
        run.to_end();
        double speed = std::sqrt(2.0 * kG * height), met = speed / kG;
        for (double flight = 0.0; met + flight <= run.time(); flight = 2.0 * speed / kG) {
          met += flight;
          speed *= restitution;
        }
        const double then = run.time() - met;
        const auto ball = run.body("Ball");
        EXPECT_NEAR(ball.pose.position.y(), 0.01 + speed * then - 0.5 * kG * then * then, 1e-7)
            << simulator << ' ' << restitution << ' ' << height;
        EXPECT_NEAR(ball.twist.linear.y(), speed - kG * then, 1e-5) << simulator << ' ' << restitution << ' ' << height;
      }
}

// Elastic balls that hop from 0.03 mm to 1 m high, side by side, several times in each step and each in its own time: where one
// meets the ground does not change what the others do. One lay still where another one landed later in the same step, and one whose
// flight ended shortly before the step did.
TEST(BounceWithinAStep, EachOfManyBallsKeepsItsEnergy) {
  constexpr double kBallRadius = 0.01;
  constexpr int kBalls = 16;
  const auto height = [](int i) { return 3e-5 * std::pow(2.0, i); };
  for (const std::string simulator : {"Continuous", "Bisection"})
    for (const bool highest_first : {false, true}) {
      std::string balls;
      for (int k = 0; k < kBalls; ++k) {
        const int i = highest_first ? kBalls - 1 - k : k;
        balls +=
            "\nBody { Id = \"" + std::to_string(i) +
            "\" GeometryId = \"Round\" Mass = 1 Material = \"M\" Forces = {\"Down\"} KineticProperties { Position = " +
            literal(Vector3(i, kBallRadius + height(i), 0.0)) + " } }";
      }
      SceneRun run(
          "Geometries { Geometry { Type = \"Halfspace\" Id = \"Flat\" } Geometry { Type = \"Sphere\" Id = \"Round\" "
          "CustomProperties { Radius = 0.01 } } }\nMaterials { Material { Id = \"M\" RestitutionCoefficient = 1 } }\n"
          "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
          "Simulator { CustomProperties { SleepEnergy = 0 } }\nEnvironment { Space { Bodies { Body { Id = \"Floor\" "
          "GeometryId = \"Flat\" Material = \"M\" Immovable = true }" +
              balls + " } } }",
          {set("Simulator", simulator), set("Simulator.TimeStep", 1.0 / 60.0), set("Simulator.Duration", 1.0)});
      run.to_end();
      for (int i = 0; i < kBalls; ++i) {
        const auto ball = run.body(std::to_string(i));
        const double energy = 0.5 * ball.twist.linear.squaredNorm() + kG * (ball.pose.position.y() - kBallRadius);
        EXPECT_NEAR(energy / (kG * height(i)), 1.0, 1e-9) << simulator << ' ' << i << ' ' << highest_first;
      }
    }
}

}  // namespace
}  // namespace gravitas
