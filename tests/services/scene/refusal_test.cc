// Refusals of plugins as the author of a scene reads them: who is meant, by Id, and where it stands.
#include "services/scene/refusal.h"

#include <gtest/gtest.h>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

const std::string kForces =
    "Forces { Force { Type = \"Drag\" Id = \"Air\" CustomProperties { LinearCoefficient = 1 } }\n"
    "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }\n"
    "Force { Type = \"Drag\" Id = \"Water\" CustomProperties { LinearCoefficient = 1 } } }\n";
const std::string kWorld =
    "Environment { Space { Bodies {\n"
    "Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = { \"Down\", \"Air\" } }\n"
    "  Body { Id = \"B\" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = { \"Air\", \"Down\", \"Water\" } } } }\n"
    "Constraints { Constraint { Type = \"Spherical\" Id = \"J1\" Body1 = \"A\" CustomProperties { BindPoint = {0, 0, "
    "0} } "
    "}\n"
    "Constraint { Type = \"AngularMotor\" Id = \"J2\" Body1 = \"A\" Body2 = \"B\" CustomProperties {\n"
    "BindAxisPoint1 = {0, 0, 0}\n"
    "BindAxisPoint2 = {0, 0, 0} AngularSpeed = 1 } } }\n";
const std::string kMethods =
    "KineticIntegrator = \"RK4\"\n"
    "ConstraintSolver { Type = \"Sequential\" CustomProperties { Iterations = 5\n"
    "CorrectionFactor = 1 } } }\n";

kernel::StageFault fault(kernel::FaultKind kind, Slot slot, const std::string& plugin, const std::string& text) {
  kernel::StageFault made(kind, "test", text);
  made.slot = slot;
  made.plugin = plugin;
  return made;
}

kernel::StageFault refusal(Slot slot, const std::string& plugin, const std::string& reason) {
  return fault(kernel::FaultKind::kRefusal, slot, plugin, "it refused: " + reason);
}

// A scene of two joints of one plugin, and forces of two.
struct World {
  BuiltScene built;

  explicit World(const std::vector<std::string>& overrides = {})
      : built(build(kForces + kWorld + kMethods, overrides)) {}
  // `place: who: reason`, or nothing.
  std::string place(const kernel::StageFault& fault) {
    const auto found = find_refused(built.read.scene(), *built.description, fault);
    return found ? to_string(*found) : "";
  }
  std::string text(const kernel::StageFault& fault) { return refusal_text(*built.description, fault); }
};

TEST(Refusal, OfAJointIsAtTheJoint) {
  World world;
  const auto fault = refusal(Slot::kConstraint, "Joints", "joint 1: Motor: it does not turn");
  EXPECT_EQ(world.place(fault), "scene:8:1: error: Constraint \"J2\": Motor: it does not turn");
  EXPECT_EQ(world.text(fault), "it refused: Constraint \"J2\": Motor: it does not turn");
}

TEST(Refusal, ThatNamesPropertiesIsAtTheOneWrittenLast) {
  const auto points = refusal(Slot::kConstraint, "Joints", "joint 1: BindAxisPoint1 and BindAxisPoint2 are the same");
  EXPECT_EQ(World().place(points),
            "scene:10:1: error: Constraint \"J2\": BindAxisPoint1 and BindAxisPoint2 are the same");
  const auto point = refusal(Slot::kConstraint, "Joints", "joint 1: BindAxisPoint1 is far");
  EXPECT_EQ(World().place(point), "scene:9:1: error: Constraint \"J2\": BindAxisPoint1 is far");
  const auto other = refusal(Slot::kConstraint, "Joints", "joint 1: BindAxisPoint is none");
  EXPECT_EQ(World().place(other), "scene:8:1: error: Constraint \"J2\": BindAxisPoint is none");
  EXPECT_EQ(World({"Constraint.J2.BindAxisPoint1={0,0,0}"}).place(points),
            "--set Constraint.J2.BindAxisPoint1={0,0,0}: Constraint \"J2\": BindAxisPoint1 and BindAxisPoint2 are the "
            "same");
}

// Rows are the applications of one plugin, body by body.
TEST(Refusal, OfAForceNamesItsBody) {
  World world;
  const auto fault = refusal(Slot::kForce, "Drag", "application 2: too thick");
  EXPECT_EQ(world.place(fault), "scene:3:1: error: Force \"Water\" on Body \"B\" (scene:6:3): too thick");
  EXPECT_EQ(world.text(fault), "it refused: Force \"Water\" on Body \"B\": too thick");
  EXPECT_EQ(world.text(refusal(Slot::kForce, "Drag", "application 1: thin")),
            "it refused: Force \"Air\" on Body \"B\": thin");
  EXPECT_EQ(world.place(refusal(Slot::kForce, "Gravity", "application 1: Acceleration is none")),
            "scene:2:57: error: Force \"Down\" on Body \"B\" (scene:6:3): Acceleration is none");
}

TEST(Refusal, OfABodyOnItsWayNamesIt) {
  World world;
  const auto text = [&](Slot slot, const std::string& reason) { return world.text(refusal(slot, "Standard", reason)); };
  EXPECT_EQ(text(Slot::kCollision, "body 1 turns too far"), "it refused: Body \"B\" turns too far");
  EXPECT_EQ(text(Slot::kCollision, "body 2 turns too far"), "it refused: body 2 turns too far");
  EXPECT_EQ(text(Slot::kCollision, "body one"), "it refused: body one");
  EXPECT_EQ(text(Slot::kIntegrator, "body 1 turns too far"), "it refused: body 1 turns too far");
}

TEST(Refusal, OfSettingsIsWhereTheyStand) {
  const auto settings = [](const std::string& text) {
    return fault(kernel::FaultKind::kHandshake, Slot::kSolver, "Sequential", text);
  };
  EXPECT_EQ(World().place(settings("Sequential: CorrectionFactor: too much")),
            "scene:13:1: error: Sequential: CorrectionFactor: too much");
  EXPECT_EQ(World().place(settings("Sequential: no")), "scene:12:1: error: Sequential: no");
  EXPECT_EQ(World({"Solver.Iterations=7"}).place(settings("Sequential: Iterations: odd")),
            "--set Solver.Iterations=7: Sequential: Iterations: odd");
}

TEST(Refusal, OfTheSimulatorIsAtItsType) {
  BuiltScene built = build("Simulator {\n Type = \"Smooth\" }\n" + kForces + kWorld + kMethods);
  const auto found = find_refused(built.read.scene(), std::string("the simulator Smooth needs more"));
  ASSERT_TRUE(found);
  EXPECT_EQ(to_string(*found), "scene:2:9: error: the simulator Smooth needs more");
  EXPECT_FALSE(find_refused(built.read.scene(), std::string("fallback LCP has no types")));
}

// What is about no row, or about none that there is, or no refusal at all, stays as it is.
TEST(Refusal, OfNobodyIsTextAlone) {
  World world;
  for (const auto& one : {refusal(Slot::kConstraint, "Joints", "joint 2: Axis is missing"),
                          refusal(Slot::kConstraint, "Joints", "joint x: Axis is missing"),
                          refusal(Slot::kConstraint, "Joints", "joint 1 is none"),
                          refusal(Slot::kConstraint, "Elsewhere", "joint 0: Axis is missing"),
                          refusal(Slot::kForce, "Drag", "application 3: too thick"),
                          refusal(Slot::kForce, "Drag", "joint 0: Axis is missing"),
                          refusal(Slot::kSolver, "Sequential", "joint 0: Axis is missing"),
                          fault(kernel::FaultKind::kFailure, Slot::kForce, "Drag", "it failed: application 0: oh"),
                          fault(kernel::FaultKind::kHandshake, Slot::kSolver, "Sequential", "it did not start")}) {
    EXPECT_EQ(world.place(one), "") << one.text();
    EXPECT_EQ(world.text(one), one.text());
  }
}

}  // namespace
}  // namespace gravitas::scene
