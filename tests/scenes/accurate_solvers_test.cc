// What Newton and Direct are for: large mass ratios, loaded chains, stacks, friction at its limit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"
#include "tests/turn_between.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::literal;
using harness::SceneRun;
using harness::set;
using harness::turned;

std::string scene(const std::string& declarations, const std::string& bodies, const std::string& joints,
                  double time_step, double duration, const Vector3& gravity = {0, -kG, 0}) {
  return declarations +
         "\nForces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = " + literal(gravity) +
         " } } PUSHES }\nSimulator { CustomProperties { TimeStep = " + literal(time_step) +
         " Duration = " + literal(duration) + " } }\nEnvironment { Space { Bodies {\n" + bodies +
         "} } Constraints {\n" + joints + "} }\n";
}

// With further forces.
std::string with_pushes(std::string text, const std::string& pushes) {
  const std::size_t at = text.find("PUSHES");
  return text.replace(at, 6, pushes);
}

std::vector<std::string> solver(const std::string& name) { return {set("Solver", name)}; }

const std::string kCubes =
    "Geometries { Geometry { Type = \"Box\" Id = \"Cube\" CustomProperties { HalfExtents = {0.5, 0.5, 0.5} } } "
    "Geometry { Type = \"Halfspace\" Id = \"Floor\" } }\n"
    "Materials { Material { Id = \"Wood\" StaticFrictionCoefficient = 0.5 } }";
const std::string kFloor = "Body { Id = \"Ground\" GeometryId = \"Floor\" Material = \"Wood\" Immovable = true }\n";

std::string cube(int i, double mass) {
  return "Body { Id = \"C" + std::to_string(i) +
         "\" GeometryId = \"Cube\" Material = \"Wood\" Mass = " + literal(mass) +
         " KineticProperties { Position = " + literal(Vector3(0, 0.5 + i, 0)) + " } Forces = { \"Down\" } }\n";
}

// ---- chains

// Links 0.5 m along a direction from the origin, and a load half a metre beyond.
std::string chain(int links, double load, const Vector3& along, double time_step, double duration) {
  const Quaternion turn = test::turn_between(Vector3::UnitY(), along);
  const Vector3 moments = Vector3(0.26, 0.02, 0.26) / 12.0;
  std::string bodies, joints;
  for (int i = 0; i < links; ++i)
    bodies += "Body { Id = \"L" + std::to_string(i) + "\" Mass = 1 PrincipalMoments = " + literal(moments) +
              " KineticProperties { Position = " + literal(Vector3((0.25 + 0.5 * i) * along)) +
              " Orientation = " + literal(turn) + " } Forces = { \"Down\" } }\n";
  bodies += "Body { Id = \"Load\" Mass = " + literal(load) +
            " PrincipalMoments = " + literal(Vector3(Vector3::Constant(0.1 * load))) +
            " KineticProperties { Position = " + literal(Vector3(0.5 * (links + 1) * along)) +
            " } Forces = { \"Down\" } }\n";
  for (int i = 0; i <= links; ++i)
    joints += "Constraint { Type = \"Spherical\" Id = \"J" + std::to_string(i) + "\" " +
              (i == 0 ? "" : "Body1 = \"L" + std::to_string(i - 1) + "\" ") + "Body2 = \"" +
              (i == links ? "Load" : "L" + std::to_string(i)) +
              "\" CustomProperties { BindPoint = " + literal(Vector3(0.5 * i * along)) + " } }\n";
  return with_pushes(scene("", bodies, joints, time_step, duration), "");
}

class Accurate : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Each, Accurate, ::testing::Values("Newton", "Direct"),
                         [](const auto& which) { return std::string(which.param); });

// 20 links of 1 kg under 1000 kg from 45 degrees: closed at 1/60 s, and the tip converges to where it is at 5 s.
TEST_P(Accurate, ALoadedChainStaysClosedAndConverges) {
  const Vector3 along = Vector3(1, -1, 0).normalized();
  const auto tip = [&](double h) {
    SceneRun run(chain(20, 1000.0, along, h, 5), solver(GetParam()));
    run.to_end();
    EXPECT_LE(run.report().max_joint_error(), 1e-12) << "time step " << h;
    return run.body("Load").pose.position;
  };
  const Vector3 exact(-0.49554864, -10.4881963, 0.0);
  const double coarse = (tip(1.0 / 60) - exact).norm(), fine = (tip(1.0 / 240) - exact).norm();
  // of first order, which Basic is
  EXPECT_LE(coarse, 0.1);
  EXPECT_NEAR(std::log2(coarse / fine), 2.0, 0.4);
}

// The same with joints inside the derivative: of fourth order, once steps are shorter than the chain's stiffest swing asks
// of an explicit method (at 1/60 s they are not).
TEST_P(Accurate, ALoadedChainKeepsTheOrderOfItsIntegratorInSmooth) {
  std::vector<std::string> overrides = solver(GetParam());
  overrides.insert(overrides.end(), {"Simulator=Smooth", "Integrator=RKMK4"});
  SceneRun run(chain(20, 1000.0, Vector3(1, -1, 0).normalized(), 1.0 / 240, 5), overrides);
  run.to_end();
  EXPECT_LE(run.report().max_joint_error(), 1e-12);
  EXPECT_LE((run.body("Load").pose.position - Vector3(-0.49554864, -10.4881963, 0.0)).norm(), 1e-6);
}

// Hanging at rest, nothing moves whatever the load: the tension is exact.
TEST_P(Accurate, AHangingChainCarriesAnyLoad) {
  for (const double load : {1.0, 1e2, 1e4}) {
    SceneRun run(chain(20, load, {0, -1, 0}, 1.0 / 60, 1), solver(GetParam()));
    run.to_end();
    EXPECT_LE(run.report().max_joint_error(), 1e-12) << load;
    EXPECT_LE((run.body("Load").pose.position - Vector3(0, -10.5, 0)).norm(), 1e-12) << load;
    EXPECT_LE(run.body("L9").twist.linear.norm(), 1e-10) << load;
  }
}

// Links joined by short rods or ropes, each end to end, off the plumb by a milliradian: what pulls a rod holds it from
// turning (T h^2/(m l) is 0.3 to 500), and the chain swings as its energy allows.
TEST_P(Accurate, AChainOfRodsOrRopesStaysClosed) {
  struct Case {
    int links;
    double rod, load, time_step;
  };
  for (const char* bound : {"", "MaximumDistance = "}) {
    for (const Case& c : {Case{2, 0.02, 1, 1.0 / 60}, Case{8, 0.1, 1, 1.0 / 60}, Case{8, 0.1, 5000, 1.0 / 60},
                          Case{8, 0.1, 5000, 1e-3}}) {
      for (const double tilt : {0.0, 1e-3}) {
        const double link = 0.4, pitch = link + c.rod;
        const Vector3 along(std::sin(tilt), -std::cos(tilt), 0.0);
        std::string bodies, joints;
        double falls = 0.0;
        for (int i = 0; i < c.links; ++i) {
          const double weight = i + 1 == c.links ? c.load : 1.0, top = c.rod + pitch * i;
          bodies += "Body { Id = \"L" + std::to_string(i) + "\" Mass = " + literal(weight) +
                    " PrincipalMoments = " + literal(Vector3(weight * Vector3(0.0136, 0.0005, 0.0136))) +
                    " KineticProperties { Position = " + literal(Vector3((top + 0.5 * link) * along)) +
                    " Orientation = " + literal(test::turn_between(-Vector3::UnitY(), along)) +
                    " } Forces = { \"Down\" } }\n";
          joints += "Constraint { Type = \"Distance\" Id = \"R" + std::to_string(i) + "\" " +
                    (i == 0 ? "" : "Body1 = \"L" + std::to_string(i - 1) + "\" ") + "Body2 = \"L" + std::to_string(i) +
                    "\" CustomProperties { BindPoint1 = " + literal(Vector3((top - c.rod) * along)) +
                    " BindPoint2 = " + literal(Vector3(top * along)) + (*bound == 0 ? "" : bound + literal(c.rod)) +
                    " } }\n";
          falls += weight * kG * (top + 0.5 * link) * (1.0 - std::cos(tilt));
        }
        SceneRun run(with_pushes(scene("", bodies, joints, c.time_step, 0.5), ""), solver(GetParam()));
        run.to_end();
        const std::string what = std::string(bound) + " " + std::to_string(c.links) + " links under " +
                                 std::to_string(c.load) + " kg, tilt " + std::to_string(tilt);
        EXPECT_LE(run.report().max_joint_error(), 1e-11) << what;
        EXPECT_LE(run.kinetic_energy(), falls + 1e-9) << what;
      }
    }
  }
}

// ---- stacks

void expect_stands(const std::vector<double>& masses, double duration, const std::vector<std::string>& overrides,
                   const std::string& joints = "") {
  std::string bodies = kFloor;
  for (std::size_t i = 0; i < masses.size(); ++i) bodies += cube(static_cast<int>(i), masses[i]);
  SceneRun run(with_pushes(scene(kCubes, bodies, joints, 1.0 / 60, duration), ""), overrides);
  run.to_end();
  EXPECT_LE(run.report().max_penetration(), 1e-10);
  EXPECT_LE(run.report().max_joint_error(), 1e-12);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const SceneRun::Motion body = run.body("C" + std::to_string(i));
    EXPECT_LE((body.pose.position - Vector3(0, 0.5 + static_cast<double>(i), 0)).norm(), 1e-9) << i;
    EXPECT_LE(angle_between(body.pose.orientation, Quaternion::Identity()), 1e-9) << i;
    EXPECT_LE(body.twist.linear.norm(), 1e-6) << i;
  }
}

TEST_P(Accurate, TwoUnderAThousandTimesTheirMassStand) { expect_stands({1, 1000}, 5, solver(GetParam())); }
TEST_P(Accurate, TenUnderAThousandTimesTheirMassStand) {
  expect_stands({1, 1, 1, 1, 1, 1, 1, 1, 1, 1000}, 1, solver(GetParam()));
}

// Flat boxes, a little beside each other: sweeps do not end there, and velocities grew by gravity while positions stood.
TEST_P(Accurate, FlatBoxesUnderAHundredThousandTimesTheirMassStand) {
  for (const auto& masses : {std::vector<double>{1, 1e5}, std::vector<double>{1, 1e3, 1e5}}) {
    std::string bodies = kFloor;
    const auto place = [](std::size_t i) {
      return Vector3(0.01 * static_cast<double>(i), 0.1 + 0.2 * static_cast<double>(i), 0);
    };
    for (std::size_t i = 0; i < masses.size(); ++i)
      bodies += "Body { Id = \"B" + std::to_string(i) +
                "\" GeometryId = \"Plate\" Material = \"Wood\" Mass = " + literal(masses[i]) +
                " KineticProperties { Position = " + literal(place(i)) + " } Forces = { \"Down\" } }\n";
    const std::string shapes = R"(
Geometries { Geometry { Type = "Box" Id = "Plate" CustomProperties { HalfExtents = {0.2, 0.1, 0.2} } } Geometry { Type = "Halfspace" Id = "Floor" } }
Materials { Material { Id = "Wood" StaticFrictionCoefficient = 0.5 } })";
    SceneRun run(with_pushes(scene(shapes, bodies, "", 1.0 / 60, 3), ""), solver(GetParam()));
    run.to_end();
    for (std::size_t i = 0; i < masses.size(); ++i) {
      const SceneRun::Motion body = run.body("B" + std::to_string(i));
      EXPECT_LE((body.pose.position - place(i)).norm(), 1e-9) << i << " of " << masses.size();
      EXPECT_LE(body.twist.linear.norm(), 1e-6) << i << " of " << masses.size();
    }
  }
}

TEST_P(Accurate, TwentyStand) { expect_stands(std::vector<double>(20, 1.0), 3, solver(GetParam())); }
TEST_P(Accurate, TenUnderTenThousandTimesTheirMassStand) {
  expect_stands({1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1e4}, 0.5, solver(GetParam()));
}

// A joint between the upper two, whose pull and what the contacts push against it no motion tells; from rest, and with a last
// step so short that the impulses before it are no guess.
TEST_P(Accurate, StacksWithAJointInThemStand) {
  for (const auto& masses : {std::vector<double>(12, 1.0), std::vector<double>{1, 1, 1, 1000}}) {
    const std::size_t top = masses.size() - 1;
    expect_stands(masses, 2.0 + 1e-8, solver(GetParam()),
                  "Constraint { Type = \"Spherical\" Id = \"J\" Body1 = \"C" + std::to_string(top - 1) +
                      "\" Body2 = \"C" + std::to_string(top) + "\" CustomProperties { BindPoint = " +
                      literal(Vector3(0, static_cast<double>(top), 0)) + " } }\n");
  }
}

// Sequential, too, by layers; by plain sweeps it does not.
TEST(SequentialStack, TenUnderAThousandTimesTheirMassStand) {
  const std::vector<double> masses = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1000};
  expect_stands(masses, 5, solver("Sequential"));
  std::string bodies = kFloor;
  for (std::size_t i = 0; i < masses.size(); ++i) bodies += cube(static_cast<int>(i), masses[i]);
  SceneRun plain(with_pushes(scene(kCubes, bodies, "", 1.0 / 60, 1), ""),
                 {"Solver=Sequential", "Solver.ShockPropagation=Never", "Solver.NesterovAcceleration=false"});
  plain.to_end();
  EXPECT_GT(plain.report().max_penetration(), 1e-3);
}

// Each turned against the one below, and put or dropped upon it one after another.
void expect_turned_and_dropped_rest(const std::string& name) {
  for (const auto& [count, turn, gap] :
       {std::tuple{10, 0.4, 0.0}, std::tuple{11, 0.05, 0.0}, std::tuple{10, 0.1, 0.1}, std::tuple{20, 0.1, 0.1}}) {
    std::string bodies = kFloor;
    for (int i = 0; i < count; ++i)
      bodies += "Body { Id = \"C" + std::to_string(i) +
                "\" GeometryId = \"Cube\" Material = \"Wood\" KineticProperties { Position = " +
                literal(Vector3(0, 0.5 + (1.0 + gap) * i, 0)) +
                " Orientation = " + literal(turned({0, 1, 0}, turn * i)) + " } Forces = { \"Down\" } }\n";
    SceneRun run(with_pushes(scene(kCubes, bodies, "", 1.0 / 60, 5), ""), solver(name));
    run.to_end();
    for (int i = 0; i < count; ++i) {
      const auto body = run.body("C" + std::to_string(i));
      EXPECT_LE((body.pose.position - Vector3(0, 0.5 + i, 0)).norm(), 1e-9)
          << count << " turned by " << turn << ": " << i;
      EXPECT_LE(body.twist.linear.norm(), 1e-9);
    }
  }
}

TEST(SequentialStack, TurnedAndDroppedCubesComeToRestWhereTheyAre) { expect_turned_and_dropped_rest("Sequential"); }
TEST_P(Accurate, TurnedAndDroppedCubesComeToRestWhereTheyAre) { expect_turned_and_dropped_rest(GetParam()); }

// ---- friction

// Box on a slope of tan 0.5: at 1e-6 above the angle of friction it sticks for 25 s, below it slides as it must.
TEST(AccurateFriction, ABoxSticksToTheLimit) {
  const double slope = std::atan(0.5);
  const auto text = [&](double mu) {
    return with_pushes(
        scene(
            "Geometries { Geometry { Type = \"Box\" Id = \"Cube\" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} } } "
            "Geometry { Type = \"Halfspace\" Id = \"Floor\" } }\nMaterials { Material { Id = \"Wood\" "
            "StaticFrictionCoefficient = " +
                literal(mu) + " } }",
            kFloor + "Body { Id = \"Box\" GeometryId = \"Cube\" Material = \"Wood\" Mass = 1 KineticProperties { "
                     "Position = {0, 0.1, 0} } Forces = { \"Down\" } }\n",
            "", 1.0 / 60, 25, kG * Vector3(std::sin(slope), -std::cos(slope), 0)),
        "");
  };
  SceneRun sticks(text(0.5 + 1e-6), solver("Newton"));
  sticks.to_end();
  EXPECT_LE((sticks.body("Box").pose.position - Vector3(0, 0.1, 0)).norm(), 1e-9);
  SceneRun slides(text(0.49), solver("Newton"));
  slides.to_end();
  EXPECT_NEAR(slides.body("Box").twist.linear.x(), 25.0 * kG * (std::sin(slope) - 0.49 * std::cos(slope)), 1e-10);
}

// A plate with 25 balls on it is pushed: the balls roll, and everything moves in the direction of the push.
TEST(AccurateFriction, RollingIsTheSameInEveryDirection) {
  for (const double degrees : {0.0, 60.0, 90.0}) {
    const Vector3 push(std::cos(degrees * kPi / 180), 0, std::sin(degrees * kPi / 180));
    std::string bodies =
        "Body { Id = \"Ground\" GeometryId = \"Floor\" Material = \"Hard\" Immovable = true }\nBody { Id = \"Plate\" "
        "GeometryId = \"Plate\" Material = \"Hard\" Mass = 10 KineticProperties { Position = {0, 0.5, 0} } Forces = { "
        "\"Down\", \"Push\" } }\n";
    for (int i = 0; i < 25; ++i)
      bodies += "Body { Id = \"S" + std::to_string(i) +
                "\" GeometryId = \"Ball\" Material = \"Rubber\" Mass = 1 KineticProperties { Position = " +
                literal(Vector3(-4 + 2 * (i % 5), 1.5, -4 + 2 * (i / 5))) + " } Forces = { \"Down\" } }\n";
    SceneRun run(
        with_pushes(
            scene("Geometries { Geometry { Type = \"Box\" Id = \"Plate\" CustomProperties { HalfExtents = {10, 0.5, "
                  "10} } "
                  "} Geometry { Type = \"Sphere\" Id = \"Ball\" CustomProperties { Radius = 0.5 } } Geometry { Type = "
                  "\"Halfspace\" Id = \"Floor\" } }\nMaterials { Material { Id = \"Hard\" StaticFrictionCoefficient = "
                  "0.4 "
                  "} Material { Id = \"Rubber\" StaticFrictionCoefficient = 1.6 } }",
                  bodies, "", 0.001, 0.4),
            "Force { Type = \"Basic\" Id = \"Push\" CustomProperties { Force = " + literal(Vector3(150 * push)) +
                " } }"),
        solver("Newton"));
    const double a = (150.0 - 0.4 * 35.0 * kG) / (10.0 + 2.0 / 7.0 * 25.0);
    double sum = 0.0;
    int count = 0;
    while (!run.is_done()) {
      run.step();
      for (const std::string& id : run.movable_bodies()) {
        const double expected = (id == "Plate" ? 1.0 : 2.0 / 7.0) * a * run.time();
        sum += (run.body(id).twist.linear - expected * push).squaredNorm();
        ++count;
      }
    }
    EXPECT_LE(sum / count, 1e-20) << degrees;
  }
}

// A frictionless block slides down a wedge that a guide lets go: both laws at once, joints and contacts.
TEST(AccurateFriction, AMovableWedgeGivesWayAsItMust) {
  const double angle = kPi / 6.0;
  const Quaternion tilt = turned(Vector3::UnitZ(), -angle);
  const Vector3 out = tilt * Vector3::UnitY();
  const std::string declarations =
      "Geometries { Geometry { Type = \"Box\" Id = \"Wedge\" CustomProperties { HalfExtents = {3, 0.5, 1} } } Geometry "
      "{ "
      "Type = \"Box\" Id = \"Block\" CustomProperties { HalfExtents = {0.2, 0.2, 0.2} } } }\nMaterials { Material { Id "
      "= "
      "\"Ice\" StaticFrictionCoefficient = 0 } }";
  const std::string bodies =
      "Body { Id = \"Wedge\" GeometryId = \"Wedge\" Material = \"Ice\" Mass = 2 KineticProperties { Orientation = " +
      literal(tilt) +
      " } Forces = { \"Down\" } }\nBody { Id = \"Block\" GeometryId = \"Block\" Material = \"Ice\" Mass = " +
      "1 KineticProperties { Position = " + literal(Vector3(0.7 * out)) + " Orientation = " + literal(tilt) +
      " } Forces = { \"Down\" } }\n";
  SceneRun run(with_pushes(scene(declarations, bodies,
                                 "Constraint { Type = \"Slider\" Id = \"Guide\" Body2 = \"Wedge\" CustomProperties { "
                                 "BindPoint = {0, 0, 0} Axis = {1, 0, 0} } }\n",
                                 1.0 / 240, 0.5),
                           ""),
               solver("Newton"));
  while (!run.is_done()) {
    run.step();
    ASSERT_NEAR(run.body("Wedge").twist.linear.x(), -1.88793538025007615 * run.time(), 1e-10) << run.time();
  }
}

// A capsule of 45 g that two pads hold with 20 or 95 times the force it takes does not creep in a minute. (At 1/60 s the
// pads of a free step pass through what they hold.)
TEST(AccurateFriction, ACapsuleThatIsHeldDoesNotCreep) {
  for (const double share : {20.0, 95.0}) {
    const double force = share * 0.045 * kG / (2.0 * 0.7);
    const auto pad = [&](const char* id, double x, const char* push) {
      return std::string("Body { Id = \"") + id +
             "\" GeometryId = \"Pad\" Material = \"Rubber\" Mass = 0.1 KineticProperties { Position = " +
             literal(Vector3(x, 0, 0)) + " } Forces = { \"" + push + "\" } }\n";
    };
    const auto guide = [](const char* id, const char* pad_id) {
      return std::string("Constraint { Type = \"Slider\" Id = \"") + id + "\" Body2 = \"" + pad_id +
             "\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} } }\n";
    };
    SceneRun run(
        with_pushes(
            scene("Geometries { Geometry { Type = \"Box\" Id = \"Pad\" CustomProperties { HalfExtents = {0.01, 0.02, "
                  "0.02} } } Geometry { Type = \"Capsule\" Id = \"Held\" CustomProperties { Radius = 0.004 Height = "
                  "0.02 } } }\nMaterials { Material { Id = \"Rubber\" StaticFrictionCoefficient = 0.7 } }",
                  pad("Left", -0.014, "Right") + pad("Right", 0.014, "Left") +
                      "Body { Id = \"Held\" GeometryId = \"Held\" Material = \"Rubber\" Mass = 0.045 "
                      "KineticProperties { Position = {0, 0, 0} } Forces = { \"Down\" } }\n",
                  guide("G1", "Left") + guide("G2", "Right"), 0.002, 60),
            "Force { Type = \"Basic\" Id = \"Right\" CustomProperties { Force = " + literal(Vector3(force, 0, 0)) +
                " } } Force { Type = \"Basic\" Id = \"Left\" CustomProperties { Force = " +
                literal(Vector3(-force, 0, 0)) + " } }"),
        solver("Newton"));
    run.to_end();
    // 1e-9 m/s is wanted
    EXPECT_LE(run.body("Held").pose.position.norm(), 1e-11 * run.time()) << share;
    EXPECT_LE(run.body("Held").twist.linear.norm(), 1e-11) << share;
  }
}

// A catenary of 25 stones, a quarter of its half-span thick, between two footings: every joint's thrust lies within the
// cone of mu = 0.5 and within the stones, so that it stands for a minute where it was built.
TEST(AccurateFriction, ACatenaryArchStands) {
  constexpr int kStones = 25;
  constexpr double kHalfSpan = 1.3, kThickness = 0.25, kDepth = 0.3;
  // y = cosh(half span) - cosh x, by arc length s = sinh x
  const auto cut = [&](int i) {
    const double s = std::sinh(kHalfSpan) * (2.0 * i / kStones - 1.0);
    const double x = std::asinh(s);
    return std::pair(Vector3(x, std::cosh(kHalfSpan) - std::cosh(x), 0), std::atan(-s));
  };
  std::string shapes = "Geometry { Type = \"Box\" Id = \"Foot\" CustomProperties { HalfExtents = {0.2, 0.4, 0.4} } }\n";
  std::string bodies;
  for (int i = 0; i < kStones; ++i) {
    std::vector<Vector3> corners;
    Vector3 middle = Vector3::Zero();
    for (const int end : {i, i + 1}) {
      const auto [point, slope] = cut(end);
      for (const double side : {-0.5, 0.5})
        corners.emplace_back(point + side * kThickness * Vector3(-std::sin(slope), std::cos(slope), 0));
    }
    for (const Vector3& corner : corners) middle += 0.25 * corner;
    std::string vertices;
    for (const Vector3& corner : corners)
      for (const double z : {-0.5 * kDepth, 0.5 * kDepth})
        vertices += (vertices.empty() ? "" : ", ") + literal(Vector3(corner - middle + Vector3(0, 0, z)));
    const std::string id = std::to_string(i);
    shapes += "Geometry { Type = \"ConvexPolyhedron\" Id = \"G" + id + "\" CustomProperties { Vertices = { " +
              vertices + " } } }\n";
    bodies += "Body { Id = \"S" + id + "\" GeometryId = \"G" + id +
              "\" Material = \"Stone\" MassDensity = 2000 KineticProperties { Position = " + literal(middle) +
              " } Forces = { \"Down\" } }\n";
  }
  for (const int end : {0, kStones}) {
    const auto [point, slope] = cut(end);
    const double away = end == 0 ? -0.2 : 0.2;
    bodies += "Body { Id = \"F" + std::to_string(end) +
              "\" GeometryId = \"Foot\" Material = \"Stone\" Immovable = true KineticProperties { Position = " +
              literal(Vector3(point + away * Vector3(std::cos(slope), std::sin(slope), 0))) +
              " Orientation = " + literal(turned(Vector3::UnitZ(), slope)) + " } }\n";
  }
  SceneRun run(with_pushes(scene("Geometries { " + shapes +
                                     "}\nMaterials { Material { Id = \"Stone\" StaticFrictionCoefficient = 0.5 } }",
                                 bodies, "", 1.0 / 60, 60),
                           ""),
               solver("Newton"));
  std::vector<Vector3> built;
  for (const std::string& id : run.movable_bodies()) built.push_back(run.body(id).pose.position);
  run.to_end();
  std::size_t next = 0;
  for (const std::string& id : run.movable_bodies())
    EXPECT_LE((run.body(id).pose.position - built[next++]).norm(), 1e-6 * kHalfSpan) << id;
}

}  // namespace
}  // namespace gravitas
