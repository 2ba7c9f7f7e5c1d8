// Forces and torques of joints and contacts against closed forms, with every solver.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "tests/scenes/watched_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using Watched = harness::WatchedRun;

Vector3 vector_of(const google::protobuf::RepeatedField<double>& numbers) {
  return {numbers.at(0), numbers.at(1), numbers.at(2)};
}

std::string scene(const std::string& shapes, const std::string& bodies, const std::string& joints) {
  return shapes + R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } }
         Force { Type = "Basic" Id = "Twist" CustomProperties { Force = {0, 0, 0} Torque = {0, -2, 0} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment { Space { Bodies { )" +
         bodies + "} } Constraints {" + joints + "} }\n";
}

class Reactions : public ::testing::TestWithParam<const char*> {
 protected:
  std::vector<std::string> solver(std::vector<std::string> more = {}) const {
    more.push_back(set("Solver", std::string(GetParam())));
    more.emplace_back("Simulator.SleepEnergy=0");
    return more;
  }
};
INSTANTIATE_TEST_SUITE_P(Each, Reactions, ::testing::Values("Sequential", "Newton", "Direct"),
                         [](const auto& which) { return std::string(which.param); });

std::string pendulum(const Vector3& at) {
  return scene(
      "",
      "Body { Id = \"Bob\" Mass = 3 PrincipalMoments = {1e-6, 1e-6, 1e-6} KineticProperties { Position = " +
          literal(at) + " } Forces = { \"Down\" } }\n",
      "Constraint { Type = \"Spherical\" Id = \"Pivot\" Body2 = \"Bob\" CustomProperties { BindPoint = {0, 0, 0} "
      "} }\n");
}

TEST_P(Reactions, OfAPivotIsTheWeightThatHangsOnIt) {
  for (const std::vector<std::string>& way :
       {std::vector<std::string>{}, {"Simulator.Substeps=4"}, {"Integrator=Verlet"}}) {
    Watched watched(pendulum({0, -1, 0}), solver(way));
    EXPECT_TRUE(watched.reactions().empty());
    watched.run.steps(50);
    const auto reactions = watched.reactions();
    ASSERT_EQ(reactions.size(), 1U);
    EXPECT_EQ(reactions[0].constraint(), "Pivot");
    EXPECT_EQ(reactions[0].bodies(0), "");
    EXPECT_EQ(reactions[0].bodies(1), "Bob");
    EXPECT_EQ(reactions[0].step(), 50U);
    EXPECT_LE((vector_of(reactions[0].force()) - Vector3(0, 3 * kG, 0)).norm(), 1e-10);
    EXPECT_LE(vector_of(reactions[0].torque()).norm(), 1e-12);
    EXPECT_LE(vector_of(reactions[0].point()).norm(), 1e-12);
  }
}

// From the horizontal: 3 m g sin(angle below it), along the rod. Mean over a step, so of first order.
TEST_P(Reactions, OfASwingingPivotConverges) {
  const auto error = [&](double h) {
    Watched watched(pendulum({1, 0, 0}), solver({set("Simulator.TimeStep", h)}));
    double largest = 0.0;
    while (watched.run.time() < 0.5) {
      const Vector3 before = watched.run.body("Bob").twist.linear;
      watched.run.step();
      const SceneRun::Motion bob = watched.run.body("Bob");
      const Vector3 force = vector_of(watched.reactions().at(0).force());
      // Newton's law over the step, to rounding
      const Vector3 gained = 3.0 * ((bob.twist.linear - before) / h + Vector3(0, kG, 0));
      EXPECT_LE((force - gained).norm(), 1e-9 / h);
      const Vector3 along = bob.pose.position.normalized();
      largest = std::max(largest, (force - 9.0 * kG * along.y() * along).norm());
    }
    return largest;
  };
  const double coarse = error(2e-3), fine = error(1e-3);
  EXPECT_LE(fine, 0.5);
  EXPECT_NEAR(std::log2(coarse / fine), 1.0, 0.2);
}

// A table on three round feet: each bears what the law of the lever says, wherever the centre of mass is.
TEST_P(Reactions, OfATablesFeetFollowTheLever) {
  const std::vector<Vector3> feet = {{1, 0, 0}, {-0.5, 0, 0.8}, {-0.5, 0, -0.8}};
  for (const Vector3& share : {Vector3(1.0 / 3, 1.0 / 3, 1.0 / 3), Vector3(0.6, 0.3, 0.1)}) {
    std::string children;
    Vector3 centre(0, 0.3, 0);
    for (std::size_t i = 0; i < 3; ++i) {
      children += (i > 0 ? ", " : "") + ("{\"Foot\", " + literal(feet[i]) + ", {1, 0, 0, 0}}");
      centre += share(static_cast<Eigen::Index>(i)) * feet[i];
    }
    Watched watched(
        scene("Geometries { Geometry { Type = \"Sphere\" Id = \"Foot\" CustomProperties { Radius = 0.1 } } Geometry { "
              "Type "
              "= \"Compound\" Id = \"Table\" CustomProperties { Children = { " +
                  children +
                  " } } } Geometry { Type = \"Halfspace\" Id = \"Floor\" } }\nMaterials { Material { Id = \"Wood\" "
                  "StaticFrictionCoefficient = 0.5 } }",
              "Body { Id = \"Ground\" GeometryId = \"Floor\" Material = \"Wood\" Immovable = true }\nBody { Id = "
              "\"Table\" "
              "GeometryId = \"Table\" Material = \"Wood\" Mass = 10 PrincipalMoments = {2, 3, 2} CentreOfMass = " +
                  literal(centre) + " KineticProperties { Position = {0, 0.1, 0} } Forces = { \"Down\" } }\n",
              ""),
        solver());
    watched.run.steps(50);
    const auto reactions = watched.reactions();
    ASSERT_EQ(reactions.size(), 3U);
    for (const report::v1::Reaction& reaction : reactions) {
      EXPECT_TRUE(reaction.constraint().empty());
      EXPECT_EQ(reaction.bodies(0), "Ground");
      EXPECT_EQ(reaction.bodies(1), "Table");
      EXPECT_EQ(vector_of(reaction.torque()), Vector3::Zero());
      std::size_t foot = 0;
      while (foot < 2 && (vector_of(reaction.point()) - feet[foot]).norm() > 0.1) ++foot;
      const Vector3 force = vector_of(reaction.force());
      EXPECT_NEAR(force.y(), 10 * kG * share(static_cast<Eigen::Index>(foot)), 1e-8) << foot;
      EXPECT_LE(std::hypot(force.x(), force.z()), 0.5 * force.y());
    }
  }
}

// How four corners share a weight is nobody's business; its sum and its centre are.
TEST_P(Reactions, OfFourCornersSumUpToTheWeight) {
  Watched watched(
      scene(
          "Geometries { Geometry { Type = \"Box\" Id = \"Crate\" CustomProperties { HalfExtents = {0.4, 0.2, 0.3} } } "
          "Geometry { Type = \"Halfspace\" Id = \"Floor\" } }",
          "Body { Id = \"Ground\" GeometryId = \"Floor\" Immovable = true }\nBody { Id = \"Crate\" GeometryId = "
          "\"Crate\" "
          "Mass = 7 KineticProperties { Position = {2, 0.2, 1} } Forces = { \"Down\" } }\n",
          ""),
      solver());
  watched.run.steps(50);
  Vector3 sum = Vector3::Zero(), turn = Vector3::Zero();
  const auto reactions = watched.reactions();
  EXPECT_GE(reactions.size(), 3U);
  for (const report::v1::Reaction& reaction : reactions) {
    sum += vector_of(reaction.force());
    turn += (vector_of(reaction.point()) - Vector3(2, 0.2, 1)).cross(vector_of(reaction.force()));
  }
  EXPECT_LE((sum - Vector3(0, 7 * kG, 0)).norm(), 1e-9);
  EXPECT_LE(turn.norm(), 1e-9);
}

// A motor that turns against 2 N m at constant speed gives 2 N m, and its hinge bears the weight; so do a hinge and an axle with a
// drive of their own.
TEST_P(Reactions, OfAMotorIsItsTorque) {
  const std::string hinge = "BindAxisPoint1 = {0, -0.5, 0} BindAxisPoint2 = {0, 0.5, 0}";
  for (const std::string& joint :
       {"AngularMotor\" CustomProperties { " + hinge, "Revolute\" CustomProperties { " + hinge,
        "Revolute\" CustomProperties { MaximumTorque = 5 " + hinge,
        std::string(
            "Axle\" CustomProperties { BindPoint = {0, 0, 0} SteeringAxis = {0, 0, 1} RollingAxis = {0, 1, 0}")}) {
    Watched watched(scene("",
                          "Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.1, 0.2, 0.1} Forces = { \"Down\", "
                          "\"Twist\" } }\n",
                          "Constraint { Id = \"Motor\" Body2 = \"Disc\" Type = \"" + joint + " AngularSpeed = 3 } }\n"),
                    solver());
    watched.run.steps(50);
    const auto reactions = watched.reactions();
    ASSERT_EQ(reactions.size(), 1U);
    EXPECT_NEAR(watched.run.body("Disc").twist.angular.y(), 3.0, 1e-9) << joint;
    EXPECT_LE((vector_of(reactions[0].torque()) - Vector3(0, 2, 0)).norm(), 1e-8) << joint;
    EXPECT_LE((vector_of(reactions[0].drive_torque()) - Vector3(0, 2, 0)).norm(), 1e-8) << joint;
    EXPECT_EQ(reactions[0].drive_force_size(), 0) << joint;
    EXPECT_LE((vector_of(reactions[0].force()) - Vector3(0, 2 * kG, 0)).norm(), 1e-8) << joint;
  }
}

// What a drive presses its stop with was lost in their sum, which is nothing.
TEST_P(Reactions, OfADriveAndItsStopAreToldApart) {
  const std::string disc = "Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.1, 0.2, 0.1} }\n";
  const auto joint = [](const std::string& type, const std::string& properties) {
    return "Constraint { Id = \"J\" Body2 = \"Disc\" Type = \"" + type + "\" CustomProperties { " + properties +
           " } }\n";
  };
  Watched turns(scene("", disc,
                      joint("Revolute",
                            "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 1, 0} UpperLimit = 0.1 "
                            "AngularSpeed = 3 MaximumTorque = 5")),
                solver());
  Watched slides(scene("", disc,
                       joint("Slider",
                             "BindPoint = {0, 0, 0} Axis = {1, 0, 0} LowerLimit = -0.1 Speed = -4 "
                             "MaximumForce = 6")),
                 solver());
  turns.run.steps(50), slides.run.steps(50);
  const report::v1::Reaction turn = turns.reactions().at(0), slide = slides.reactions().at(0);
  EXPECT_LE(vector_of(turn.torque()).norm(), 1e-8);
  EXPECT_LE((vector_of(turn.drive_torque()) - Vector3(0, 5, 0)).norm(), 1e-8);
  EXPECT_LE(vector_of(slide.force()).norm(), 1e-8);
  EXPECT_LE((vector_of(slide.drive_force()) - Vector3(-6, 0, 0)).norm(), 1e-8);
  EXPECT_EQ(slide.drive_torque_size(), 0);
  // a damper is no drive
  Watched damped(scene("", disc, joint("Slider", "BindPoint = {0, 0, 0} Axis = {1, 0, 0} Damping = 3")), solver());
  damped.run.steps(3);
  EXPECT_EQ(damped.reactions().at(0).drive_force_size(), 0);
}

// Joints inside the derivative: the force is that of the last one.
TEST_P(Reactions, OfSmoothMotionAreThoseOfTheDerivative) {
  if (std::string(GetParam()) == "Sequential") GTEST_SKIP() << "has no answer to Solver.Reactions";
  Watched watched(pendulum({1, 0, 0}), solver({"Simulator=Smooth", "Integrator=RK4", "Simulator.TimeStep=0.001"}));
  watched.run.steps(400);
  const Vector3 along = watched.run.body("Bob").pose.position.normalized();
  const Vector3 force = vector_of(watched.reactions().at(0).force());
  // the last stage of RK4 is not quite where the step ends
  EXPECT_LE((force - 9.0 * kG * along.y() * along).norm(), 1e-4);
}

// A spring inside the derivative as much as at the end of the step: what hangs in it weighs on the joint.
TEST_P(Reactions, OfASpringAreTheWeightThatHangsInIt) {
  const std::string text =
      scene("", "Body { Id = \"Bob\" Mass = 3 PrincipalMoments = {0.1, 0.1, 0.1} Forces = { \"Down\" } }\n",
            "Constraint { Type = \"Axle\" Id = \"Spring\" Body2 = \"Bob\" CustomProperties { BindPoint = {0, 0, 0} "
            "SteeringAxis "
            "= {0, 1, 0} RollingAxis = {1, 0, 0} SuspensionStiffness = 1200 SuspensionDamping = 120 } }\n");
  for (const char* simulator : {"Basic", "Smooth"}) {
    if (GetParam() == std::string("Sequential") && simulator == std::string("Smooth")) continue;
    Watched watched(text, solver({set("Simulator", std::string(simulator)), "Integrator=RK4"}));
    watched.run.steps(200);
    const auto reactions = watched.reactions();
    ASSERT_EQ(reactions.size(), 1U);
    // e^(-20 * 2) of the swing is left
    EXPECT_LE((vector_of(reactions[0].force()) - Vector3(0, 3 * kG, 0)).norm(), 1e-10) << simulator;
  }
}

TEST_P(Reactions, OfABrokenJointAreNone) {
  for (const double weights : {0.99, 1.01}) {
    Watched watched(pendulum({0, -1, 0}), solver({set("Constraint.Pivot.BreakingForce", weights * 3 * kG)}));
    for (int i = 0; i < 2; ++i) {
      watched.run.step();
      EXPECT_EQ(watched.reactions().size(), weights > 1.0 ? 1U : 0U) << weights;
    }
  }
}

// Joints that hold the same freedoms share as equal bolts would: F/3 + F a x/sum of x^2, both from the bolts' middle, whatever
// the beam's inertia (once the middle one of three told 30 N of 60 with 6 kg m^2, 52 N with 0.5, and 4 N with Sequential).
TEST_P(Reactions, OfABeamOnThreeBolts) {
  constexpr double kWeight = 6 * kG;
  const double places[] = {-1.0, 0.5, 2.0};
  for (const char* type : {"Spherical", "Rigid"})
    for (const char* simulator : {"Basic", "Smooth"})
      for (const double inertia : {0.05, 0.5, 6.0, 600.0}) {
        if (GetParam() == std::string("Sequential") && simulator == std::string("Smooth")) continue;
        // moments of bolts are none where the load is in their middle
        const double at = type == std::string("Rigid") ? 0.5 : 0.0;
        std::string joints;
        for (const double x : places)
          joints += std::string("Constraint { Type = \"") + type + "\" Id = \"At " + literal(x) +
                    "\" Body2 = \"Beam\" CustomProperties { BindPoint = " + literal(Vector3(x - at, 0, 0)) + " } }\n";
        Watched watched(scene("",
                              "Body { Id = \"Beam\" Mass = 6 PrincipalMoments = " +
                                  literal(Vector3(inertia, inertia, inertia)) + " Forces = { \"Down\" } }\n",
                              joints),
                        solver({set("Simulator", std::string(simulator))}));
        watched.run.steps(3);
        const auto reactions = watched.reactions();
        ASSERT_EQ(reactions.size(), 3U);
        for (int i = 0; i < 3; ++i)
          EXPECT_NEAR(vector_of(reactions[static_cast<std::size_t>(i)].force()).y(),
                      kWeight / 3.0 + kWeight * (at - 0.5) * (places[i] - 0.5) / 4.5, 1e-7)
              << type << ' ' << simulator << ' ' << inertia << ' ' << i;
      }
}

// Bricks joined to a wall, n wide and n high, on the world: each column bears itself. The null space of so many rows that depend
// on each other took n^6 operations, half a second a step at n = 12.
TEST_P(Reactions, OfAWallOfBricks) {
  const int count = GetParam() == std::string("Sequential") ? 4 : 12;
  std::string bodies, joints;
  const auto brick = [](int i, int j) { return "B" + std::to_string(i) + "_" + std::to_string(j); };
  const auto join = [&](const std::string& one, const std::string& two) {
    joints += "Constraint { Type = \"Rigid\" Id = \"" + one + "-" + two + "\" Body1 = \"" + one + "\" Body2 = \"" +
              two + "\" }\n";
  };
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      bodies +=
          "Body { Id = \"" + brick(i, j) +
          "\" Mass = 1 PrincipalMoments = {0.2, 0.2, 0.2} KineticProperties { Position = " + literal(Vector3(i, j, 0)) +
          " } Forces = { \"Down\" } }\n";
      join(j > 0 ? brick(i, j - 1) : "", brick(i, j));
      if (i > 0) join(brick(i - 1, j), brick(i, j));
    }
  Watched watched(scene("", bodies, joints), solver());
  watched.run.steps(3);
  EXPECT_LE(watched.run.report().max_joint_error(), GetParam() == std::string("Sequential") ? 1e-7 : 1e-12);
  const auto reactions = watched.reactions();
  ASSERT_EQ(reactions.size(), static_cast<std::size_t>(count * (2 * count - 1)));
  for (const report::v1::Reaction& reaction : reactions) {
    const Vector3 force = vector_of(reaction.force());
    const bool is_foot = reaction.bodies(0).empty();
    EXPECT_NEAR(force.x(), 0.0, 1e-6) << reaction.constraint();
    if (is_foot) EXPECT_NEAR(force.y(), kG * count, 1e-6) << reaction.constraint();
  }
}

}  // namespace
}  // namespace gravitas
