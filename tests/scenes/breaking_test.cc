// Joints of every type break under every solver when, and only when, they bear more than their BreakingForce or -Torque.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;

const char* const kBreakers[] = {"Sequential", "Newton", "Direct"};

std::string scene_of(const std::string& forces, const std::string& bodies, const std::string& joints,
                     const std::string& solver) {
  return "Simulator { Type = \"Basic\" Id = \"Main\" CustomProperties { TimeStep = 0.01 Duration = 3 } }\n"
         "Forces { " +
         forces +
         " }\n"
         "Environment { Id = \"World\" Space { Type = \"Basic\" Id = \"All\" Bodies { " +
         bodies +
         " } }\n"
         "Constraints { " +
         joints +
         " }\n"
         "KineticIntegrator = \"SemiImplicitEuler\" ConstraintSolver = \"" +
         solver + "\" }";
}

std::string body(const std::string& id, double mass, const Vector3& at, const std::string& forces) {
  return "Body { Id = \"" + id + "\" Mass = " + literal(mass) + " PrincipalMoments = {0.1, 0.1, 0.1} Forces = { " +
         forces + " } KineticProperties { Position = " + literal(at) + " CanSleep = false } }\n";
}

const std::string kGravityDown =
    "Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } }";

struct JointType {
  const char* type;
  const char* properties;  // at the origin, against a pull along x
};

constexpr JointType kBreakable[] = {
    {"Spherical", "BindPoint = {0, 0, 0}"},
    {"Revolute", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1}"},
    {"Rigid", "BindPoint = {0, 0, 0}"},
    {"AngularMotor", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {1, 0, 0} AngularSpeed = 3"},
    {"Slider", "BindPoint = {0, 0, 0} Axis = {0, 1, 0}"},
    {"Distance", "BindPoint1 = {-1, 0, 0} BindPoint2 = {0, 0, 0}"},
    {"Universal", "BindPoint = {0, 0, 0} Axis1 = {0, 1, 0} Axis2 = {0, 0, 1}"},
    {"ConstantVelocity", "BindPoint = {0, 0, 0} Axis1 = {1, 0, 0} Axis2 = {1, 0, 0}"},
    {"Axle", "BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1}"},
};

class Breaking : public ::testing::TestWithParam<std::tuple<JointType, const char*>> {};
INSTANTIATE_TEST_SUITE_P(Each, Breaking,
                         ::testing::Combine(::testing::ValuesIn(kBreakable), ::testing::ValuesIn(kBreakers)),
                         [](const auto& one) {
                           return std::string(std::get<0>(one.param).type) + std::get<1>(one.param);
                         });

// With joints in the derivative, too: judged by what they bear where the step ends.
TEST_P(Breaking, ComesWithSmoothAsWell) {
  const auto& [joint, solver] = GetParam();
  if (std::string(solver) == "Sequential") GTEST_SKIP() << "it tells no reactions";
  const std::string pull =
      "Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Table = {{0, {0,0,0}}, {10, {100,0,0}}} } }";
  const std::string held = std::string("Constraint { Type = \"") + joint.type +
                           "\" Id = \"Joint\" Body2 = \"Ball\" BreakingForce = 7.65 CustomProperties { " +
                           joint.properties + " } }";
  SceneRun run(scene_of(pull, body("Ball", 2.0, Vector3::Zero(), "\"Pull\""), held, solver),
               {"Simulator=Smooth", "Integrator=RK4"});
  while (run.step_count() < 90) {
    run.step();
    if (10.0 * run.time() < 7.64) {
      EXPECT_TRUE(run.holds("Joint")) << run.time();
    } else if (10.0 * run.time() > 7.76) {
      EXPECT_FALSE(run.holds("Joint")) << run.time();
    }
  }
}

// A spring that is damped critically bears the pull all but its start.
TEST(BreakingOfASpring, ComesWithSmoothAsWell) {
  const std::string pull =
      "Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Table = {{0, {0,0,0}}, {10, {100,0,0}}} } }";
  const std::string held =
      "Constraint { Type = \"Axle\" Id = \"Joint\" Body2 = \"Ball\" BreakingForce = 7.65 CustomProperties { BindPoint "
      "= "
      "{0, 0, 0} SteeringAxis = {1, 0, 0} RollingAxis = {0, 0, 1} SuspensionStiffness = 2e4 SuspensionDamping = 400 } "
      "}";
  SceneRun run(scene_of(pull, body("Ball", 2.0, Vector3::Zero(), "\"Pull\""), held, "Newton"),
               {"Simulator=Smooth", "Integrator=RK4"});
  while (run.step_count() < 90) {
    run.step();
    if (10.0 * run.time() < 7.64) {
      EXPECT_TRUE(run.holds("Joint")) << run.time();
    } else if (10.0 * run.time() > 7.76) {
      EXPECT_FALSE(run.holds("Joint")) << run.time();
    }
  }
}

// A pull that grows by 10 N/s, in steps of 0.1 N: the step from t_n bears 10 t_n, and the 78th is the first with more than
// 7.65 N. What is free from then on is pulled on.
TEST_P(Breaking, ComesWithTheFirstStepThatBearsMore) {
  const auto& [joint, solver] = GetParam();
  const std::string pull =
      "Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Force = {0, 0, 0} Table = {{0, {0,0,0}}, {10, "
      "{100,0,0}}} } }";
  const std::string held = std::string("Constraint { Type = \"") + joint.type +
                           "\" Id = \"Joint\" Body2 = \"Ball\" BreakingForce = 7.65 CustomProperties { " +
                           joint.properties + " } }";
  SceneRun run(scene_of(pull, body("Ball", 2.0, Vector3::Zero(), "\"Pull\""), held, solver));
  const double h = run.time_step();
  double speed = 0.0;
  while (run.step_count() < 200) {
    const double force = 10.0 * run.time();
    run.step();
    ASSERT_EQ(run.holds("Joint"), run.step_count() < 78) << run.step_count();
    if (!run.holds("Joint")) speed += h * force / 2.0;
    ASSERT_NEAR(run.body("Ball").twist.linear.x(), speed, 1e-9) << run.step_count();
  }
  ASSERT_EQ(run.count_events(EventKind::kBreak), 1U);
  EXPECT_EQ(run.events()[0].step, 78U);
  EXPECT_EQ(run.events()[0].constraint, 0U);
  EXPECT_LE(run.report().max_joint_error(), 1e-9);
}

constexpr JointType kBent[] = {
    {"Rigid", "BindPoint = {0, 0, 0}"},
    {"Revolute", "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 1, 0}"},
    {"Slider", "BindPoint = {0, 0, 0} Axis = {1, 0, 0}"},
    {"Universal", "BindPoint = {0, 0, 0} Axis1 = {1, 0, 0} Axis2 = {0, 1, 0}"},
    {"ConstantVelocity", "BindPoint = {0, 0, 0} Axis1 = {0, 0, 1} Axis2 = {0, 0, 1}"},
    {"Axle", "BindPoint = {0, 0, 0} SteeringAxis = {1, 0, 0} RollingAxis = {0, 1, 0}"},
};

class BreakingByTorque : public ::testing::TestWithParam<std::tuple<JointType, const char*>> {};
INSTANTIATE_TEST_SUITE_P(Each, BreakingByTorque,
                         ::testing::Combine(::testing::ValuesIn(kBent), ::testing::ValuesIn(kBreakers)),
                         [](const auto& one) {
                           return std::string(std::get<0>(one.param).type) + std::get<1>(one.param);
                         });

// A pull across the end of an arm of 2 m that grows by 10 N/s: the 78th step is the first with more than 15.3 N m about the
// joint, which has no more than 7.8 N to bear.
TEST_P(BreakingByTorque, ComesWithTheFirstStepThatBearsMore) {
  const auto& [joint, solver] = GetParam();
  const std::string pull =
      "Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Table = {{0, {0,0,0}}, {10, {0,100,0}}} } }";
  const auto held = [](const JointType& type, const char* strength) {
    return std::string("Constraint { Type = \"") + type.type + "\" Id = \"Joint\" Body2 = \"Ball\" " + strength +
           " CustomProperties { " + type.properties + " } }";
  };
  const std::string ball = body("Ball", 2.0, Vector3(2, 0, 0), "\"Pull\"");
  SceneRun run(scene_of(pull, ball, held(joint, "BreakingTorque = 15.3"), solver));
  while (run.step_count() < 100) {
    run.step();
    ASSERT_EQ(run.holds("Joint"), run.step_count() < 78) << run.step_count();
  }
  SceneRun strong(scene_of(pull, ball, held(joint, "BreakingForce = 15.3 BreakingTorque = 30"), solver));
  strong.steps(150);
  EXPECT_TRUE(strong.holds("Joint"));
  strong.steps(10);
  EXPECT_FALSE(strong.holds("Joint"));
}

class BreakingOf : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Each, BreakingOf, ::testing::ValuesIn(kBreakers),
                         [](const auto& one) { return std::string(one.param); });

// What only turns, and a drive: a brake that holds bears what would turn it; a ball joint bears no torque at all.
TEST_P(BreakingOf, ABrakeByTheTorqueOfItsDrive) {
  const std::string turn =
      "Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Table = {{0, {0,0,0}}, {10, {0,100,0}}} } }";
  for (const char* simulator : {"Basic", "Smooth"}) {
    if (std::string(simulator) == "Smooth" && std::string(GetParam()) == "Sequential") continue;
    const std::string brake =
        "Constraint { Type = \"AngularMotor\" Id = \"Brake\" Body2 = \"Arm\" BreakingTorque = 15.3 CustomProperties { "
        "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} AngularSpeed = 0 } }\n"
        "Constraint { Type = \"Spherical\" Id = \"Pin\" Body2 = \"Arm\" BreakingTorque = 1e-9 CustomProperties { "
        "BindPoint = {0, 0, 0} } }";
    SceneRun run(scene_of(turn, body("Arm", 2.0, Vector3(2, 0, 0), "\"Pull\""), brake, GetParam()),
                 {std::string("Simulator=") + simulator});
    while (run.step_count() < 90) {
      run.step();
      // the mean over the step, or, with Smooth, what is borne where it ends
      if (run.step_count() != 77) {
        ASSERT_EQ(run.holds("Brake"), run.step_count() < 78) << simulator << ' ' << run.step_count();
      }
    }
    EXPECT_TRUE(run.holds("Pin")) << simulator;
  }
}

// Three weights on each other: the joint between the first two bears 30 N of weight, and is the only one too weak for its
// own. What stays above hangs on; what falls keeps its joint.
TEST_P(BreakingOf, TheWeakestLinkOfAChain) {
  std::string bodies, joints;
  const double forces[] = {100.0, 3.0 * kG - 0.001, 2.0 * kG};
  for (int i = 0; i < 3; ++i) {
    const std::string id = "Link" + std::to_string(i);
    bodies += body(id, i == 0 ? 1.0 : 1.5, Vector3(0, -0.5 - i, 0), "\"Down\"");
    joints += "Constraint { Type = \"Spherical\" Id = \"Joint" + std::to_string(i) + "\" Body1 = \"" +
              (i == 0 ? "" : "Link" + std::to_string(i - 1)) + "\" Body2 = \"" + id +
              "\" BreakingForce = " + literal(forces[i]) +
              " CustomProperties { BindPoint = " + literal(Vector3(0, -i, 0)) + " } }\n";
  }
  SceneRun run(scene_of(kGravityDown, bodies, joints, GetParam()));
  run.steps(50);
  EXPECT_TRUE(run.holds("Joint0"));
  EXPECT_FALSE(run.holds("Joint1"));
  EXPECT_TRUE(run.holds("Joint2"));
  ASSERT_EQ(run.count_events(EventKind::kBreak), 1U);
  EXPECT_EQ(run.events()[0].step, 1U);
  EXPECT_NEAR(run.body("Link0").pose.position.y(), -0.5, 1e-9);
  const double h = run.time_step();
  // 50 free steps: h^2 g (1 + 2 + ... + 50)
  EXPECT_NEAR(run.body("Link1").pose.position.y(), -1.5 - kG * h * h * 50 * 51 / 2, 1e-9);
  EXPECT_NEAR(run.body("Link2").pose.position.y(), -2.5 - kG * h * h * 50 * 51 / 2, 1e-9);
}

// A weight falls into a rope of 1 m: the step that tightens it takes all its speed, m g h n / h of force, or, where that is
// more than the rope bears, nothing of it.
TEST_P(BreakingOf, TheJerkOfARope) {
  const double h = 0.01;
  int n = 0;
  while (kG * h * h * n * (n + 1) / 2 <= 1.0) ++n;
  const double jerk = kG * n;
  for (const double strength : {jerk * (1.0 + 1e-6), jerk * (1.0 - 1e-6)}) {
    const std::string rope =
        "Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"Ball\" BreakingForce = " + literal(strength) +
        " CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {0, 0, 0} MinimumDistance = 0 MaximumDistance = 1 } }";
    SceneRun run(scene_of(kGravityDown, body("Ball", 1.0, Vector3::Zero(), "\"Down\""), rope, GetParam()));
    run.steps(static_cast<std::uint32_t>(n - 1));
    EXPECT_TRUE(run.holds("Rope"));
    run.step();
    EXPECT_EQ(run.holds("Rope"), strength > jerk);
    EXPECT_NEAR(run.body("Ball").pose.position.y(), strength > jerk ? -1.0 : -kG * h * h * n * (n + 1) / 2, 1e-9);
    EXPECT_NEAR(run.body("Ball").twist.linear.y(), strength > jerk ? 0.0 : -kG * h * n, 1e-9);
    run.steps(100);
    EXPECT_EQ(run.holds("Rope"), strength > jerk);
    EXPECT_EQ(run.body("Ball").pose.position.y() < -1.1, strength < jerk);
  }
}

// A motor that starts its rotor within a step, and a stiff damper that is struck, hold nothing together.
TEST_P(BreakingOf, NothingByADriveAlone) {
  const std::string motor =
      "Constraint { Type = \"AngularMotor\" Id = \"Motor\" Body2 = \"Ball\" BreakingThreshold = 0.005 CustomProperties "
      "{ "
      "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {1, 0, 0} AngularSpeed = 100 } }\n";
  SceneRun run(scene_of("", body("Ball", 1.0, Vector3::Zero(), ""), motor, GetParam()));
  run.steps(20);
  EXPECT_TRUE(run.holds("Motor"));
  EXPECT_NEAR(run.body("Ball").twist.angular.x(), 100.0, 1e-9);
}

// It is taut from the start, and the ball flies outwards: the jerk is before the first step with Smooth, and part of it all the same.
TEST_P(BreakingOf, TheJerkOfARopeAtTheStart) {
  if (std::string(GetParam()) == "Sequential") GTEST_SKIP() << "it tells no reactions";
  const std::string ball =
      "Body { Id = \"Ball\" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} KineticProperties { Position = {0, -1, 0} "
      "LinearVelocity = {0, -10, 0} CanSleep = false } }";
  for (const char* simulator : {"Basic", "Smooth"})
    for (const double strength : {990.0, 1010.0}) {  // 10 N s in 0.01 s
      const std::string rope =
          "Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"Ball\" BreakingForce = " + literal(strength) +
          " CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {0, -1, 0} MinimumDistance = 0 MaximumDistance = 1 "
          "} }";
      SceneRun run(scene_of("", ball, rope, GetParam()), {std::string("Simulator=") + simulator, "Integrator=RK4"});
      run.steps(3);
      EXPECT_EQ(run.holds("Rope"), strength > 1000.0) << simulator;
      EXPECT_NEAR(run.body("Ball").twist.linear.y(), strength > 1000.0 ? 0.0 : -10.0, 1e-9) << simulator;
    }
}

// A truck of 1 t at 2 m/s on a slack rope whose plate of 5 kg is bolted to the world: the bolt that breaks took all its momentum,
// 2000 N s for a bolt of 100 N. What comes after the jerk is one rope with two masses.
TEST_P(BreakingOf, ABoltThatHoldsATruckForAStep) {
  const std::string bodies = body("Plate", 5, Vector3::Zero(), "") +
                             "Body { Id = \"Truck\" Mass = 1000 PrincipalMoments = {100, 100, 100} KineticProperties { "
                             "Position = {1, 0, 0} LinearVelocity = {2, 0, 0} } }\n";
  const std::string rope =
      "Constraint { Type = \"Distance\" Id = \"Rope\" Body1 = \"Plate\" Body2 = \"Truck\" CustomProperties { "
      "BindPoint1 = {0, 0, 0} BindPoint2 = {1, 0, 0} MinimumDistance = 0 MaximumDistance = 1.5 } }\n";
  for (const char* strength : {"BreakingForce = 100", "BreakingThreshold = 1e-3"})
    for (const char* simulator : {"Basic", "Substepping"}) {
      const std::string bolt = std::string("Constraint { Type = \"Rigid\" Id = \"Bolt\" Body2 = \"Plate\" ") +
                               strength + " CustomProperties { BindPoint = {0, 0, 0} } }\n";
      SceneRun run(scene_of("", bodies, bolt + rope, GetParam()), {std::string("Simulator=") + simulator});
      run.steps(60);
      EXPECT_FALSE(run.holds("Bolt")) << strength << ' ' << simulator;
      EXPECT_TRUE(run.holds("Rope")) << strength << ' ' << simulator;
      for (const char* id : {"Truck", "Plate"})
        EXPECT_NEAR(run.body(id).twist.linear.x(), 2000.0 / 1005.0, 1e-6) << id << ' ' << strength << ' ' << simulator;
    }
}

// Of two equal bolts in a row, which a blow overloads alike, one breaks and saves the other.
TEST_P(BreakingOf, OneOfTwoInARow) {
  const std::string bodies =
      body("A", 1, {0, 0, 0}, "") + body("B", 1, {1, 0, 0}, "") + body("C", 1, {2, 0, 0}, "\"Pull\"");
  const std::string pull =
      "Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Table = {{0, {0,0,0}}, {10, {100,0,0}}} } }";
  std::string joints =
      "Constraint { Type = \"Rigid\" Id = \"Wall\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} } }\n";
  for (const char* pair : {"AB", "BC"})
    joints += std::string("Constraint { Type = \"Rigid\" Id = \"") + pair + "\" Body1 = \"" + pair[0] +
              "\" Body2 = \"" + pair[1] + "\" BreakingForce = 7.65 CustomProperties { BindPoint = {0, 0, 0} } }\n";
  SceneRun run(scene_of(pull, bodies, joints, GetParam()));
  run.steps(150);
  EXPECT_EQ(run.count_events(EventKind::kBreak), 1U);
  EXPECT_NE(run.holds("AB"), run.holds("BC"));
}

// A hundred bolts that all bear too much, and one that does not: they break in one step, which is not solved a hundred times.
TEST_P(BreakingOf, ManyInOneStep) {
  std::string bodies, joints;
  for (int i = 0; i <= 100; ++i) {
    const std::string id = std::to_string(i);
    bodies += body("B" + id, 1, Vector3(2.0 * i, 0, 0), "\"Down\"");
    joints += "Constraint { Type = \"Rigid\" Id = \"J" + id + "\" Body2 = \"B" + id +
              "\" BreakingForce = " + literal(i < 100 ? 9.0 - 0.01 * i : 10.0) + " }\n";
  }
  SceneRun run(scene_of(kGravityDown, bodies, joints, GetParam()));
  run.step();
  EXPECT_EQ(run.count_events(EventKind::kBreak), 100U);
  EXPECT_TRUE(run.holds("J100"));
  EXPECT_LT(run.environment().stage_time(kernel::Stage::kSolve).count(), 30U);
  for (int i = 0; i <= 100; ++i)
    EXPECT_NEAR(run.body("B" + std::to_string(i)).twist.linear.y(), i < 100 ? -kG * run.time_step() : 0.0, 1e-12) << i;
}

// A specimen between the world and a kinematic body that goes away from it: no force holds it, and none was told, so that it was
// drawn out by 5 cm. The weakest joint breaks; of others that nobody tears none does.
TEST_P(BreakingOf, ASpecimenInATensileTest) {
  for (const char* type : {"Spherical", "Rigid"})
    for (const char* simulator : {"Basic", "Continuous"})
      for (const int weakest : {0, 1, 2}) {
        std::string bodies =
            "Body { Id = \"Puller\" Kinematic = true KineticProperties { Position = {2, 0, 0} "
            "LinearVelocity = {0.1, 0, 0} } }\n" +
            body("0", 0.1, {0, 0, 0}, "") + body("1", 0.1, {1, 0, 0}, "") + body("Aside", 1, {0, 5, 0}, "\"Down\"");
        std::string joints =
            "Constraint { Type = \"Spherical\" Id = \"Hook\" Body2 = \"Aside\" BreakingForce = 50 "
            "CustomProperties { BindPoint = {0.3, 5, 0} } }\n";
        const char* const ends[] = {"", "0", "1", "Puller"};
        for (int i = 0; i < 3; ++i)
          joints += std::string("Constraint { Type = \"") + type + "\" Id = \"J" + std::to_string(i) + "\" Body1 = \"" +
                    ends[i] + "\" Body2 = \"" + ends[i + 1] + "\" BreakingForce = " + (i == weakest ? "90" : "100") +
                    " CustomProperties { BindPoint = " + literal(Vector3(i - 0.5, 0, 0)) + " } }\n";
        SceneRun run(scene_of(kGravityDown, bodies, joints, GetParam()), {std::string("Simulator=") + simulator});
        run.steps(50);
        for (int i = 0; i < 3; ++i)
          EXPECT_EQ(run.holds("J" + std::to_string(i)), i != weakest) << type << ' ' << simulator << ' ' << weakest;
        EXPECT_TRUE(run.holds("Hook"));
        EXPECT_LT(run.report().max_joint_error(), 1e-3) << type << ' ' << simulator << ' ' << weakest;
      }
}

// Joints that hold the same freedoms again bear alike: of a plate of 98.1 N on four of them none breaks at 30 N (once two bore
// half the weight each, or one all of it, as the first did with Smooth, and the plate fell).
TEST(RedundantJoints, BearAlike) {
  for (const std::string type : {"Distance", "Spherical", "Rigid"}) {
    std::string joints;
    for (int i = 0; i < 4; ++i) {
      const Vector3 at(i % 2 == 0 ? 1.0 : -1.0, 0.5, i < 2 ? 1.0 : -1.0);
      const std::string place = type == "Distance" ? "BindPoint1 = " + literal(Vector3(at + Vector3::UnitY())) +
                                                         " BindPoint2 = " + literal(at)
                                                   : "BindPoint = " + literal(at);
      joints += "Constraint { Type = \"" + type + "\" Id = \"J" + std::to_string(i) +
                "\" Body2 = \"Plate\" BreakingForce = 30 CustomProperties { " + place + " } }\n";
    }
    for (const char* solver : kBreakers)
      for (const char* simulator : {"Basic", "Smooth"}) {
        const std::string setting = type + " " + solver + " " + simulator;
        if (setting.ends_with("Sequential Smooth")) continue;
        SceneRun run(scene_of(kGravityDown, body("Plate", 10, {0, 0, 0}, "\"Down\""), joints, solver),
                     {std::string("Simulator=") + simulator});
        run.steps(100);
        for (int i = 0; i < 4; ++i) EXPECT_TRUE(run.holds("J" + std::to_string(i))) << setting;
        EXPECT_LE(run.body("Plate").pose.position.norm(), 1e-9) << setting;
      }
  }
}

}  // namespace
}  // namespace gravitas
