// Springs and dampers on the axes of joints: where they come to rest, how they swing, and that a wheel is steered by them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

class JointSprings : public ::testing::Test {
 protected:
  static constexpr double kStiffness = 50.0;  // N m/rad or N/m
  static constexpr double kArm = 0.5;         // m
  static constexpr const char* kStiffBend =
      "Type = \"ConstantVelocity\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {0, 0.6, 0.8} Axis2 = {0, 0.6, "
      "0.8} "
      "BendStiffness = 1e8 }";

  // A body "Arm" of 1 kg at `position`, which the joint holds to the world; CanSleep = false, so that it rests by itself.
  static std::string scene(const std::string& joint, const Vector3& position, const std::string& more = "") {
    return "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } }\n"
           "Force { Type = \"Basic\" Id = \"T\" CustomProperties { Torque = {0, 10, 0} } } }\n"
           "Simulator { CustomProperties { Duration = 10 } }\n"
           "Environment { Space { Bodies { Body { Id = \"Arm\" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} " +
           (more.empty() ? std::string("Forces = {\"G\"}") : more) +
           " KineticProperties { CanSleep = false Position = " + harness::literal(position) +
           " } } } }\nConstraints { Constraint { Id = \"J\" Body2 = \"Arm\" " + joint + " } } }\n";
  }
  // Two free bodies on a joint; a push turns one.
  static std::string kicked(double push, const std::string& joint) {
    return "Forces { Force { Type = \"Basic\" Id = \"Kick\" CustomProperties { Force = " +
           harness::literal(Vector3(0, 0, push)) +
           " ApplicationPoint = {0, 0.2, 0} Instantaneous = true } } }\n"
           "Environment { Space { Bodies {\n"
           "Body { Id = \"A\" Mass = 3 PrincipalMoments = {0.06, 0.006, 0.06} KineticProperties { "
           "Position = {0, -0.25, 0} } }\n"
           "Body { Id = \"B\" Mass = 2 PrincipalMoments = {0.004, 0.04, 0.04} Forces = {\"Kick\"} KineticProperties { "
           "Position = {0.25, 0, 0} } } } }\n"
           "Constraints { Constraint { Id = \"J\" Body1 = \"A\" Body2 = \"B\" " +
           joint + " } } }\n";
  }
  // Root of a function that falls through zero between -1 and 1.
  static double root(const std::function<double(double)>& f) {
    double low = -1.0, high = 1.0;
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (f(middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
  // Angle of an arm above the horizontal, where k (angle - rest) and its weight balance.
  static double sunk(double rest) {
    return root([&](double angle) { return -kStiffness * (angle - rest) - kG * kArm * std::cos(angle); });
  }
};

// Two bodies on a joint whose spring is unloaded fall some 1 m on a corner: what the spring takes up is energy that they do not
// have.
TEST_F(JointSprings, StiffOnesGainNothingInImpacts) {
  struct Pair {
    std::string geometry, first, second;  // poses
  };
  const Pair boxes = {
      "\"Box\" CustomProperties { HalfExtents = {0.08, 0.25, 0.1} }",
      "Position = {-0.109, 1.482, 0.279} Orientation = {0.68608774588, 0.67739036520, 0, 0.26537878229}",
      "Position = {0.167, 1.251, -0.001} Orientation = {0.29066074940, -0.00755288058, 0, -0.95679635641}"};
  const std::string capsule = "\"Capsule\" CustomProperties { Radius = 0.06 Height = 0.4 }";
  const Pair steep = {
      capsule,
      "Position = {0.057372, 1.463831, 0.292233} Orientation = {0.66311298487, 0.73449824581, 0, -0.14419950134}",
      "Position = {0.063572, 1.305223, 0.219136} Orientation = {0.41877335151, 0.87213262215, 0, -0.25300903039}"};
  const Pair flat = {
      capsule,
      "Position = {0.150963, 1.715347, 0.144346} Orientation = {0.92677468949, 0.25958554012, 0, -0.27148484725}",
      "Position = {-0.264024, 1.610057, 0.090437} Orientation = {0.82669709234, 0.18232586916, 0, 0.53228676007}"};
  const std::string shaft =
      "Type = \"ConstantVelocity\" CustomProperties { BindPoint = {0, 1.5, 0} Axis1 = {-0.6, 0.7, 0.4} "
      "Axis2 = {-0.6, 0.7, 0.4} BendStiffness = 1e6 }";
  const std::string ball = "Type = \"Spherical\" CustomProperties { BindPoint = {0, 1.5, 0} Stiffness = ";
  const std::vector<std::pair<Pair, std::string>> cases = {
      {boxes, ball + "1e4 }"},
      {boxes, ball + "1e6 }"},
      {boxes, shaft},
      {steep, ball + "1e6 }"},
      {steep,
       "Type = \"ConstantVelocity\" CustomProperties { BindPoint = {0, 1.5, 0} Axis1 = {0.7415, 0.5385, -0.4002} "
       "Axis2 = {0.7415, 0.5385, -0.4002} BendStiffness = 1e6 }"},
      {flat,
       "Type = \"Universal\" CustomProperties { BindPoint = {0, 1.5, 0} Axis1 = {-0.616361617, 0.667057894, "
       "0.418487900} "
       "Axis2 = {0.570958222, 0.744560770, -0.345884327} Stiffness1 = 1e4 Stiffness2 = 1e4 }"}};
  for (const auto& [pair, joint] : cases) {
    const std::string bodies =
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"F\" } Geometry { Id = \"S\" Type = " + pair.geometry +
        " } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { CollisionFilter { DefaultAllow = true Rules { Rule { Allow = false Bodies = {\"P\", \"Q\"} } } "
        "}\n"
        "Space { Bodies { Body { Id = \"Floor\" GeometryId = \"F\" }\n"
        "Body { Id = \"P\" GeometryId = \"S\" Mass = 3 Forces = {\"G\"} KineticProperties { " +
        pair.first + " } }\nBody { Id = \"Q\" GeometryId = \"S\" Mass = 2 Forces = {\"G\"} KineticProperties { " +
        pair.second + " } } } }\nConstraints { Constraint { Id = \"J\" Body1 = \"P\" Body2 = \"Q\" " + joint +
        " } } }\n";
    for (const std::string solver : {"Newton", "Direct"}) {
      SceneRun run(bodies, {set("Simulator.TimeStep", 1.0 / 60.0), set("Simulator.Duration", 1.0), "Solver=" + solver});
      const double start = run.energy();
      double highest = start;
      while (run.time() < 1.0 - 1e-9) {
        run.step();
        highest = std::max(highest, run.energy());
      }
      // the method's own error in free fall is m g v h / 2
      EXPECT_LT(highest, 1.05 * start) << joint << ' ' << solver;
    }
  }
}

// A push turns one of two free bodies on a joint that straightens itself with 1e8 N m/rad.
TEST_F(JointSprings, StiffBendsStayClosed) {
  for (const std::string solver : {"Newton", "Direct"}) {
    SceneRun run(kicked(0.5, kStiffBend),
                 {set("Simulator.TimeStep", 1.0 / 60.0), set("Simulator.Duration", 1.0), "Solver=" + solver});
    run.to_end();
    const auto end = [&](const std::string& body, const Vector3& point) {
      const Pose pose = run.body(body).pose;
      return Vector3(pose.position + pose.orientation * point);
    };
    EXPECT_LT((end("A", {0, 0.25, 0}) - end("B", {-0.25, 0, 0})).norm(), 1e-12) << solver;
    EXPECT_LT(run.energy(), 0.5 * 0.5 * 0.5 / 2.0 + 0.5 * 0.1 * 0.1 / 0.004) << solver;  // of B alone
  }
}

// The same, pushed harder, against a joint that gives nothing: four turns in a second, in steps of 4 ms.
TEST_F(JointSprings, StiffOnesMoveAsRigidJoints) {
  const std::vector<std::string> joints = {
      kStiffBend, "Type = \"Spherical\" CustomProperties { BindPoint = {0, 0, 0} Stiffness = 1e8 }",
      "Type = \"Bushing\" CustomProperties { BindPoint = {0, 0, 0} Stiffness = {1e9, 1e9, 1e9} "
      "AngularStiffness = {1e8, 1e8, 1e8} }"};
  for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
    const auto end = [&](const std::string& joint) {
      SceneRun run(kicked(2.0, joint),
                   {set("Simulator.TimeStep", 0.004), set("Simulator.Duration", 1.0), "Solver=" + solver});
      run.to_end();
      return run.body("A").pose.position;
    };
    const Vector3 rigid = end("Type = \"Rigid\"");
    for (const std::string& joint : joints) EXPECT_LT((end(joint) - rigid).norm(), 3e-4) << solver << ' ' << joint;
  }
}

// Five straight links on hinges whose stiff springs are at rest 0.3 rad away: all motion comes out of them.
TEST_F(JointSprings, GiveNoMoreThanTheyHold) {
  constexpr int kLinks = 5;
  constexpr double kLength = 0.4, kRest = 0.3;
  for (const double stiffness : {1e5, 4e5}) {
    std::string bodies, hinges;
    for (int i = 0; i < kLinks; ++i) {
      const std::string id = std::to_string(i);
      bodies += "Body { Id = \"L" + id +
                "\" Mass = 1 PrincipalMoments = {0.001, 0.0133, 0.0133} KineticProperties { Position = " +
                harness::literal(Vector3((i + 0.5) * kLength, 0, 0)) + " } }\n";
      hinges += "Constraint { Id = \"J" + id + "\" Type = \"Revolute\" Body2 = \"L" + id + "\" " +
                (i > 0 ? "Body1 = \"L" + std::to_string(i - 1) + "\" " : std::string()) +
                "CustomProperties { BindAxisPoint1 = " + harness::literal(Vector3(i * kLength, 0, 0)) +
                " BindAxisPoint2 = " + harness::literal(Vector3(i * kLength, 0, 1)) +
                " Stiffness = " + harness::literal(stiffness) + " RestAngle = " + harness::literal(kRest) + " } }\n";
    }
    const double held = 0.5 * kLinks * stiffness * kRest * kRest;
    for (const std::string solver : {"Newton", "Direct", "Sequential"})
      for (const double step : {1.0 / 60.0, 1.0 / 240.0}) {
        SceneRun run("Environment { Space { Bodies {\n" + bodies + "} }\nConstraints {\n" + hinges + "} }\n",
                     {set("Simulator.TimeStep", step), set("Simulator.Duration", 0.5), "Solver=" + solver});
        while (!run.is_done()) {
          run.step();
          ASSERT_LE(run.kinetic_energy(), held) << solver << ' ' << step << ' ' << stiffness;
        }
        EXPECT_LT(run.report().max_joint_error(), solver == "Sequential" ? 1e-3 : 1e-12) << solver << ' ' << step;
      }
  }
}

// A drive without bound goes at its speed whatever springs do beside it, or behind a joint that holds.
TEST_F(JointSprings, GiveWayToDrivesWithoutBound) {
  const auto slider = [](const std::string& id, const std::string& bodies, double x, const std::string& more) {
    return "Constraint { Id = \"" + id + "\" Type = \"Slider\" " + bodies +
           " CustomProperties { BindPoint = " + harness::literal(Vector3(x, 0, 0)) + " Axis = {1, 0, 0} " + more +
           " } }\n";
  };
  const std::string spring = "Stiffness = 1e3", drive = "Speed = 0.5";
  const std::string joints[] = {
      slider("J", "Body2 = \"A\"", 0, spring + " " + drive) + slider("K", "Body1 = \"A\" Body2 = \"B\"", 1, spring),
      slider("J", "Body2 = \"A\"", 0, drive) +
          "Constraint { Id = \"K\" Type = \"Rigid\" Body1 = \"A\" Body2 = \"B\" }\n" +
          slider("L", "Body2 = \"B\"", 1, spring)};
  for (const std::string& held : joints) {
    const std::string scene =
        "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} }\n"
        "Body { Id = \"B\" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} KineticProperties { Position = {1, 0, 0} } } } "
        "}\n"
        "Constraints { " +
        held + "} }\n";
    for (const std::string solver : {"Newton", "Direct", "Sequential"})
      for (const double step : {1.0 / 60.0, 1e-3}) {
        SceneRun run(scene, {set("Simulator.TimeStep", step), set("Simulator.Duration", 1.0), "Solver=" + solver});
        run.to_end();
        EXPECT_NEAR(run.body("A").pose.position.x(), 0.5 * run.time(), 1e-9) << solver << ' ' << step;
        EXPECT_NEAR(run.body("A").twist.linear.x(), 0.5, 1e-9) << solver << ' ' << step;
      }
  }
}

TEST_F(JointSprings, RestWhereTheyBalanceTheLoad) {
  const Vector3 out(kArm, 0, 0), aslant(0.4, 0, 0.3);
  struct Trial {
    std::string joint;
    Vector3 start, rest;
  };
  const auto below = [](const Vector3& direction, double angle) {
    return Vector3(std::cos(angle) * direction + kArm * std::sin(angle) * Vector3::UnitY());
  };
  const std::vector<Trial> trials = {
      {"Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} Stiffness = 50 "
       "Damping = 5 RestAngle = 0.2 }",
       out, below(out, sunk(0.2))},
      {"Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} LowerLimit = -1 "
       "UpperLimit = 0.5 Stiffness = 50 Damping = 5 }",
       out, below(out, sunk(0.0))},
      {"Type = \"Slider\" CustomProperties { BindPoint = {0, 0, 0} Axis = {0, 1, 0} Stiffness = 50 Damping = 5 "
       "RestPosition = 0.3 }",
       out, out + (0.3 - kG / kStiffness) * Vector3::UnitY()},
      {"Type = \"Spherical\" CustomProperties { BindPoint = {0, 0, 0} Stiffness = 50 Damping = 5 }", aslant,
       below(aslant, sunk(0.0))},
      {"Type = \"ConstantVelocity\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {4, 0, 3} Axis2 = {4, 0, 3} "
       "BendStiffness = 50 BendDamping = 5 }",
       aslant, below(aslant, sunk(0.0))},
      {"Type = \"Universal\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {0, 0, 1} Axis2 = {0, 1, 0} Stiffness1 = "
       "50 Damping1 = 5 Stiffness2 = 10 Damping2 = 3 }",
       out, below(out, sunk(0.0))},
      {"Type = \"Universal\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {0, 1, 0} Axis2 = {0, 0, 1} Stiffness1 = "
       "10 Damping1 = 3 Stiffness2 = 50 Damping2 = 5 }",
       out, below(out, sunk(0.0))},
      {"Type = \"Distance\" CustomProperties { BindPoint1 = {0.5, 1, 0} BindPoint2 = {0.5, 0, 0} MaximumDistance = 1.2 "
       "Stiffness = 50 Damping = 5 }",
       out, out - (0.2 + kG / kStiffness) * Vector3::UnitY()},
      {"Type = \"Bushing\" CustomProperties { BindPoint = {0.5, 0, 0} Stiffness = {20, 50, 30} Damping = {5, 5, 5} "
       "AngularStiffness = {1, 2, 3} AngularDamping = {1, 1, 1} }",
       out, out - kG / kStiffness * Vector3::UnitY()},
  };
  for (const Trial& trial : trials)
    for (const std::string solver : {"Newton", "Direct", "Sequential"})
      for (const double time_step : {1.0 / 60.0, 2e-3}) {
        SceneRun run(scene(trial.joint, trial.start), {set("Solver", solver), set("Simulator.TimeStep", time_step)});
        run.to_end();
        // `Sequential` sweeps joint by joint in directions of the free motion
        const double bound = solver == "Sequential" ? 40.0 * time_step * time_step : 1e-8;
        EXPECT_LE((run.body("Arm").pose.position - trial.rest).norm(), bound)
            << trial.joint << ' ' << solver << ' ' << time_step;
      }
}

// A hinge's I x'' + c x' + k x = 0, struck at rest.
TEST_F(JointSprings, SwingAtTheirFrequency) {
  constexpr double kMoment = 0.1, kSoft = 40.0, kDamper = 0.3, kSpeed = 5.0, kEnd = 0.5;
  const double decay = 0.5 * kDamper / kMoment, rate = std::sqrt(kSoft / kMoment - decay * decay);
  const double exact = std::exp(-decay * kEnd) * kSpeed / rate * std::sin(rate * kEnd);
  const std::string joint =
      "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} Stiffness = 40 "
      "Damping = 0.3 }";
  struct Trial {
    const char *simulator, *integrator;
    double order;
  };
  for (const Trial& trial :
       {Trial{"Basic", "SemiImplicitEuler", 1}, {"Smooth", "RK4", 4}, {"Smooth", "ImplicitMidpoint", 2}})
    for (const std::string solver : {"Newton", "Direct"}) {
      std::vector<double> errors;
      for (const double time_step : {kEnd / 400.0, kEnd / 800.0}) {
        SceneRun run(scene(joint, Vector3::Zero(), "Forces = {}"),
                     {set("Solver", solver), set("Simulator", trial.simulator), set("Integrator", trial.integrator),
                      set("Simulator.TimeStep", time_step), set("Simulator.Duration", kEnd),
                      set("Body.Arm.AngularVelocity", Vector3(0, 0, kSpeed))});
        run.to_end();
        const Quaternion q = run.body("Arm").pose.orientation;
        errors.push_back(std::fabs(2.0 * std::atan2(q.z(), q.w()) - exact));
      }
      EXPECT_NEAR(std::log2(errors[0] / errors[1]), trial.order, 0.1) << trial.simulator << ' ' << trial.integrator;
    }
}

// The joint's torque is the gradient of k angle^2/2, for turns of any size: what swings in three dimensions keeps its energy.
TEST_F(JointSprings, KeepEnergyInTheLarge) {
  SceneRun run(
      scene("Type = \"Spherical\" CustomProperties { BindPoint = {0, 0, 0} Stiffness = 20 }", Vector3(kArm, 0, 0)),
      {set("Solver", "Newton"), set("Simulator", "Smooth"), set("Integrator", "DormandPrince853"),
       set("Simulator.TimeStep", 0.01), set("Simulator.Duration", 1.0),
       set("Body.Arm.LinearVelocity", Vector3(0, 0, 4)), set("Body.Arm.AngularVelocity", Vector3(6, -8, 0))});
  const double before = run.energy();
  double largest = 0.0;
  while (!run.is_done()) {
    run.step();
    const double angle = harness::angle_between(run.body("Arm").pose.orientation, Quaternion::Identity());
    largest = std::max(largest, angle);
    EXPECT_NEAR(run.energy() + 0.5 * 20.0 * angle * angle, before, 1e-9);
  }
  EXPECT_GE(largest, 1.2);
}

// A spring so stiff that no explicit step could follow it yields by load over stiffness.
TEST_F(JointSprings, AreStableForEveryStiffness) {
  for (const std::string solver : {"Newton", "Direct", "Sequential"})
    for (const double stiffness : {1e-3, 1e3, 1e8, 1e13}) {
      SceneRun run(scene("Type = \"Bushing\" CustomProperties { BindPoint = {0, 0, 0} Stiffness = {1e5, 1e5, 1e5} "
                         "AngularStiffness = {1e5, " +
                             harness::literal(stiffness) + ", 1e5} AngularDamping = {0, " +
                             harness::literal(1e-3 + 0.6 * std::sqrt(stiffness)) + ", 0} }",
                         Vector3::Zero(), "Forces = {\"T\"}"),
                   {set("Solver", solver), set("Simulator.TimeStep", 1.0 / 60.0)});
      run.to_end();
      const double turn = harness::angle_between(run.body("Arm").pose.orientation, Quaternion::Identity());
      if (stiffness >= 1e3) EXPECT_NEAR(turn, 10.0 / stiffness, 1e-9) << solver << ' ' << stiffness;
      EXPECT_TRUE(std::isfinite(turn));
    }
}

// Springs of unequal stiffness about the axes of a body that turns far about all of them.
class UnevenBushing : public ::testing::Test {
 protected:
  static constexpr double kMoment = 0.1, kAlong = 1000.0;  // kg m^2, N/m

  static std::string bushing(const Vector3& stiffness, const std::string& more = "") {
    return "Constraints { Constraint { Id = \"J\" Type = \"Bushing\" Body2 = \"B\" " + more +
           "CustomProperties { BindPoint = {0.2, 0, 0} Stiffness = {1000, 1000, 1000} AngularStiffness = " +
           harness::literal(stiffness) + " } } }\n";
  }
  static std::string body(const std::string& id, const std::string& moments, const std::string& motion) {
    return "Body { Id = \"" + id + "\" Mass = 1 PrincipalMoments = " + moments + " KineticProperties { " + motion +
           " } }\n";
  }
  static std::string simulator(double duration) {
    return "Simulator { CustomProperties { TimeStep = 0.002 SleepEnergy = 0 Duration = " + harness::literal(duration) +
           " } }\n";
  }
  // One in the world, at the spring's point.
  static std::string turning(const Vector3& stiffness, const Vector3& spin) {
    return simulator(5.0) + "Environment { Space { Bodies { " +
           body("B", "{0.1, 0.1, 0.1}", "Position = {0.2, 0, 0} AngularVelocity = " + harness::literal(spin)) +
           "} }\n" + bushing(stiffness) + "}\n";
  }
  // What the springs hold, J, the second point at `arm` in the second body.
  static double held(const Pose& one, const Pose& two, const Vector3& arm1, const Vector3& arm2,
                     const Vector3& stiffness) {
    const Quaternion turn = one.orientation.conjugate() * two.orientation;
    const Eigen::AngleAxisd angle(turn.w() < 0.0 ? Quaternion(-turn.coeffs()) : turn);
    const Vector3 components = angle.angle() * angle.axis();
    const Vector3 way = two.position + two.orientation * arm2 - one.position - one.orientation * arm1;
    return 0.5 * kAlong * way.squaredNorm() + 0.5 * components.dot(stiffness.cwiseProduct(components));
  }
};

TEST_F(UnevenBushing, KeepsItsEnergy) {
  const Vector3 spin(6, 4, 5);
  for (const Vector3& stiffness : {Vector3(1, 5, 50), Vector3(10, 20, 40), Vector3(1, 1, 50), Vector3(5, 5, 5)}) {
    const double energy = 0.5 * kMoment * spin.squaredNorm();
    for (const std::string integrator : {"DormandPrince853", "RK4"}) {
      SceneRun run(turning(stiffness, spin), {"Simulator=Smooth", "Integrator=" + integrator, "Solver=Newton"});
      double worst = 0.0;
      while (!run.is_done()) {
        run.step();
        const double now = held({{0.2, 0, 0}, Quaternion::Identity()}, run.body("B").pose, Vector3::Zero(),
                                Vector3::Zero(), stiffness) +
                           run.kinetic_energy();
        worst = std::max(worst, std::fabs(now / energy - 1.0));
      }
      // RK4: (w h)^5 a step, w = 22 rad/s
      EXPECT_LT(worst, integrator == "RK4" ? 1e-5 : 1e-11) << stiffness.transpose() << integrator;
    }
    // springs that are implicit take energy away
    for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
      SceneRun run(turning(stiffness, spin), {"Solver=" + solver});
      double most = 0.0;
      while (!run.is_done()) {
        run.step();
        most = std::max(most, run.kinetic_energy());
      }
      EXPECT_LT(most, 1.001 * energy) << stiffness.transpose() << solver;
    }
  }
}

// Two free bodies.
TEST_F(UnevenBushing, KeepsEnergyAndMomentaBetweenBodies) {
  const Vector3 stiffness(1, 5, 50);
  const std::string scene =
      simulator(5.0) + "Environment { Space { Bodies {\n" +
      body("A", "{0.1, 0.15, 0.2}", "Position = {0, 0, 0} AngularVelocity = {-2, 1, 3}") +
      body("B", "{0.1, 0.08, 0.05}", "Position = {0.5, 0, 0} LinearVelocity = {0, 1, 0} AngularVelocity = {4, 3, -2}") +
      "} }\n" + bushing(stiffness, "Body1 = \"A\" ") + "}\n";
  SceneRun run(scene, {"Simulator=Smooth", "Integrator=DormandPrince853", "Solver=Newton"});
  const Vector3 momentum = run.momentum(), angular = run.angular_momentum();
  const Pose one = run.body("A").pose, two = run.body("B").pose;
  const Vector3 point(0.2, 0, 0), arm1 = one.orientation.conjugate() * (point - one.position),
                                  arm2 = two.orientation.conjugate() * (point - two.position);
  const Quaternion axes1 = one.orientation, axes2 = two.orientation;
  const auto energy = [&] {
    const Pose a = run.body("A").pose, b = run.body("B").pose;
    // the spring's axes are the world's at the start
    return run.kinetic_energy() + held({a.position, a.orientation * axes1.conjugate()},
                                       {b.position, b.orientation * axes2.conjugate()}, axes1 * arm1, axes2 * arm2,
                                       stiffness);
  };
  const double start = energy();
  while (!run.is_done()) {
    run.step();
    ASSERT_NEAR(energy(), start, 1e-10 * start) << run.time();
  }
  EXPECT_LT((run.momentum() - momentum).norm(), 1e-12);
  EXPECT_LT((run.angular_momentum() - angular).norm(), 1e-11);
}

TEST_F(UnevenBushing, DampersTakeEnergyAway) {
  for (const std::string simulator : {"Smooth", "Basic"}) {
    SceneRun run(
        turning({1, 5, 50}, {6, 4, 5}),
        {"Simulator=" + simulator, "Integrator=" + std::string(simulator == "Smooth" ? "RK4" : "SemiImplicitEuler"),
         "Solver=Newton", set("Constraint.J.AngularDamping", Vector3(0.01, 0.02, 0.0))});
    double energy = 0.5 * kMoment * Vector3(6, 4, 5).squaredNorm();
    while (!run.is_done()) {
      run.step();
      const double now = held({{0.2, 0, 0}, Quaternion::Identity()}, run.body("B").pose, Vector3::Zero(),
                              Vector3::Zero(), {1, 5, 50}) +
                         run.kinetic_energy();
      ASSERT_LT(now, energy * (simulator == "Smooth" ? 1.0 + 1e-9 : 1.002)) << simulator << run.time();
      energy = now;
    }
    EXPECT_LT(energy, 0.7 * 3.85) << simulator;
  }
}

// A wheel that rolls at 20 rad/s about z and may steer about y.
class Steering : public JointSprings {
 protected:
  static SceneRun wheel(const std::string& properties, const std::string& force, const std::string& solver,
                        double time_step, double spin) {
    return SceneRun(
        scene("Type = \"Axle\" CustomProperties { BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = "
              "{0, 0, 1} " +
                  properties + " }",
              Vector3::Zero(), "Forces = {" + force + "}"),
        {set("Solver", solver), set("Simulator.TimeStep", time_step), set("Simulator.Duration", 5.0),
         set("Body.Arm.AngularVelocity", Vector3(0, 0, spin))});
  }
  static double angle(const SceneRun& run) {
    const Vector3 axis = run.body("Arm").pose.orientation * Vector3::UnitZ();
    return std::atan2(axis.x(), axis.z());
  }
};

TEST_F(Steering, GoesWhereItsSpringIsAtRest) {
  for (const std::string solver : {"Newton", "Direct", "Sequential"})
    for (const double spin : {0.0, 20.0}) {
      SceneRun turning =
          wheel("SteeringStiffness = 100 SteeringDamping = 10 SteeringAngle = 0.3", "\"T\"", solver, 1e-3, spin);
      turning.to_end();
      // of first order in the step while it rolls
      EXPECT_NEAR(angle(turning), 0.3 + 10.0 / 100.0, spin == 0.0 ? 1e-8 : 5e-5) << solver << ' ' << spin;
      EXPECT_NEAR(turning.body("Arm").twist.angular.norm(), spin, 1e-3 * spin + 1e-7) << solver << ' ' << spin;
    }
}

TEST_F(Steering, StopsAtItsLimits) {
  for (const std::string solver : {"Newton", "Direct", "Sequential"})
    for (const double time_step : {1.0 / 60.0, 1e-3})
      for (const double spin : {0.0, 20.0}) {
        SceneRun turning =
            wheel("SteeringLowerLimit = -0.1 SteeringUpperLimit = 0.2", "\"T\"", solver, time_step, spin);
        turning.to_end();
        EXPECT_NEAR(angle(turning), 0.2, solver == "Sequential" ? 1e-5 : 1e-12) << solver << ' ' << spin;
      }
}

}  // namespace
}  // namespace gravitas
