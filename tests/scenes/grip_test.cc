// Bodies held or braked by more contacts than their balance determines: which forces share the load is the solver's choice,
// and must not turn what is symmetric, nor differ from trial to trial of a step.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

constexpr double kGrip = 0.5, kPressed = 50.0;

std::string load_and_frame(double mass) {
  return R"(
Geometries {
  Geometry { Type = "Box" Id = "Load" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} } }
  Geometry { Type = "Box" Id = "Pad" CustomProperties { HalfExtents = {0.02, 0.05, 0.05} } }
}
Materials { Material { Id = "Rubber" RestitutionCoefficient = 0 StaticFrictionCoefficient = 0.5 } }
Forces {
  Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } }
  Force { Type = "Basic" Id = "Push" CustomProperties { Force = {50, 0, 0} } }
}
Environment { Space { Bodies {
  Body { Id = "Frame" Mass = 1 PrincipalMoments = {1, 1, 1} Immovable = true KineticProperties { Position = {0, 0.5, 0} } }
  Body { Id = "Load" GeometryId = "Load" Material = "Rubber" Forces = {"Down"} Mass = )" +
         harness::literal(mass) + " }\n";
}

// Between a plate that does not move and a pad on a slider that is pushed.
std::string clamp_scene(double mass) {
  return "Simulator { CustomProperties { TimeStep = 0.016666666666666666 Duration = 0.1 SleepEnergy = 0 } }\n" +
         load_and_frame(mass) + R"(
  Body { Id = "Plate" GeometryId = "Pad" Material = "Rubber" Immovable = true KineticProperties { Position = {0.12, 0, 0} } }
  Body { Id = "Pad" GeometryId = "Pad" Material = "Rubber" Mass = 0.5 KineticProperties { Position = {-0.12, 0, 0} } Forces = {"Push"} }
} }
Constraints { Constraint { Type = "Slider" Id = "Guide" Body1 = "Frame" Body2 = "Pad" CustomProperties { BindPoint = {-0.12, 0, 0} Axis = {1, 0, 0} } } }
KineticIntegrator = "Verlet"
}
)";
}

// Just below the load at which friction gives way the load stays.
TEST(Clamp, HoldsWhatItsFrictionBears) {
  const double mass = 0.95 * 2.0 * kGrip * kPressed / kG;
  for (const std::string solver : {"Newton", "Direct"}) {
    for (const std::string accuracy : {"1e-4", "1e-6", "1e-8"}) {
      SceneRun run(clamp_scene(mass), {"Simulator=Continuous", "Simulator.Accuracy=" + accuracy, "Solver=" + solver});
      run.to_end();
      const SceneRun::Motion load = run.body("Load");
      EXPECT_LT(load.pose.position.norm(), 1e-10) << solver << ", " << accuracy;
      EXPECT_LT(load.pose.orientation.vec().norm(), 1e-10) << solver << ", " << accuracy;
    }
  }
}

// Two jaws on hinges press a nut of a tenth of their mass with 25 times the force it takes to hold it: it stays, as the told
// speed says.
TEST(Jaws, HoldALightNut) {
  const auto jaw = [](const std::string& id, double y) {
    return "  Body { Id = \"" + id + "\" GeometryId = \"Jaw\" Material = \"Steel\" Mass = 0.3 Forces = {\"Press" + id +
           "\"} KineticProperties { Position = {0.3, " + harness::literal(y) + ", 0} } }\n";
  };
  const auto press = [](const std::string& id, double force) {
    return "  Force { Type = \"Basic\" Id = \"Press" + id + "\" CustomProperties { Force = {0, " +
           harness::literal(force) + ", 0} ApplicationPoint = {0.2, 0, 0} } }\n";
  };
  const auto hinge = [](const std::string& id, const std::string& y) {
    return "  Constraint { Type = \"Revolute\" Id = \"Hinge" + id + "\" Body2 = \"" + id +
           "\" CustomProperties { BindAxisPoint1 = {0, " + y + ", 0} BindAxisPoint2 = {0, " + y + ", 1} } }\n";
  };
  const std::string scene = R"(
Geometries {
  Geometry { Type = "Box" Id = "Jaw" CustomProperties { HalfExtents = {0.3, 0.01, 0.05} } }
  Geometry { Type = "Box" Id = "Nut" CustomProperties { HalfExtents = {0.02, 0.02, 0.02} } }
}
Materials { Material { Id = "Steel" RestitutionCoefficient = 0 StaticFrictionCoefficient = 0.8 } }
Simulator { CustomProperties { TimeStep = 0.003333333333333333 Duration = 1 SleepEnergy = 0 } }
Forces {
)" + press("Upper", -10.0) + press("Lower", 10.0) +
                            R"(}
Environment { Space { Bodies {
  Body { Id = "Nut" GeometryId = "Nut" Material = "Steel" Mass = 0.02 KineticProperties { Position = {0.1, 0, 0} } }
)" + jaw("Upper", 0.03) + jaw("Lower", -0.03) +
                            "} }\nConstraints {\n" + hinge("Upper", "0.03") + hinge("Lower", "-0.03") +
                            "}\nKineticIntegrator = \"SemiImplicitEuler\"\n}\n";
  for (const std::string solver : {"Sequential", "Newton", "Direct"}) {
    for (const char* step : {"0.003333333333333333", "0.001"}) {
      SceneRun run(scene, {"Solver=" + solver, set("Simulator.TimeStep", step)});
      run.to_end();
      EXPECT_LT((run.body("Nut").pose.position - Vector3(0.1, 0.0, 0.0)).norm(), 2e-4) << solver << ", " << step;
    }
  }
}

// Between two pads on sprung sliders, just above that load: it slides straight down.
TEST(Gripper, LetsASymmetricLoadSlideStraight) {
  const double share = 1.02, mass = share * 2.0 * kGrip * kPressed / kG, h = 1.0 / 240.0;
  const std::string scene =
      "Simulator { CustomProperties { TimeStep = 0.004166666666666667 Duration = 1 SleepEnergy = 0 } }\n" +
      load_and_frame(mass) + R"(
  Body { Id = "Left" GeometryId = "Pad" Material = "Rubber" Mass = 0.5 KineticProperties { Position = {-0.12, 0, 0} } Forces = {"Down"} }
  Body { Id = "Right" GeometryId = "Pad" Material = "Rubber" Mass = 0.5 KineticProperties { Position = {0.12, 0, 0} } Forces = {"Down"} }
} }
Constraints {
  Constraint { Type = "Slider" Id = "LeftGuide" Body1 = "Frame" Body2 = "Left" CustomProperties { BindPoint = {-0.12, 0, 0} Axis = {1, 0, 0} Stiffness = 1000 RestPosition = 0.05 Damping = 20 } }
  Constraint { Type = "Slider" Id = "RightGuide" Body1 = "Frame" Body2 = "Right" CustomProperties { BindPoint = {0.12, 0, 0} Axis = {-1, 0, 0} Stiffness = 1000 RestPosition = 0.05 Damping = 20 } }
}
KineticIntegrator = "SemiImplicitEuler"
}
)";
  // velocities are those of steps' ends
  const double fallen = 0.5 * kG * (1.0 - 1.0 / share) * (1.0 + h);
  for (const std::string solver : {"Newton", "Direct"}) {
    SceneRun run(scene, {"Solver=" + solver});
    run.to_end();
    const SceneRun::Motion load = run.body("Load");
    EXPECT_NEAR(load.pose.position.y(), -fallen, 1e-4) << solver;
    EXPECT_LT(std::hypot(load.pose.position.x(), load.pose.position.z()), 1e-9) << solver;
    EXPECT_LT(load.pose.orientation.vec().norm(), 1e-8) << solver;
  }
}

// A box that slides and spins flat on the ground: the more Accuracy, the nearer to one motion, whoever solves it.
TEST(SpinningBox, SlidesAsAccuratelyAsIsAsked) {
  const std::string scene = R"(
Geometries {
  Geometry { Type = "Halfspace" Id = "Flat" }
  Geometry { Type = "Box" Id = "Box" CustomProperties { HalfExtents = {0.3, 0.15, 0.2} } }
}
Materials { Material { Id = "Wood" RestitutionCoefficient = 0 StaticFrictionCoefficient = 0.3 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Continuous" CustomProperties { TimeStep = 0.016666666666666666 Duration = 0.4 Accuracy = 1e-6 SleepEnergy = 0 } }
Environment { Space { Bodies {
  Body { Id = "Floor" GeometryId = "Flat" Material = "Wood" }
  Body { Id = "Box" GeometryId = "Box" Material = "Wood" MassDensity = 1000 KineticProperties { Position = {0, 0.15, 0} LinearVelocity = {1.5, 0, 0.7} AngularVelocity = {0, 3, 0} } Forces = {"Down"} }
} } KineticIntegrator = "Verlet" }
)";
  const auto end = [&](const std::string& solver, double accuracy) {
    SceneRun run(scene, {"Solver=" + solver, set("Simulator.Accuracy", accuracy)});
    run.to_end();
    return run.body("Box").pose;
  };
  const Pose right = end("Newton", 1e-10);
  for (const std::string solver : {"Newton", "Direct"}) {
    for (const double accuracy : {1e-5, 1e-6, 1e-8}) {
      const Pose pose = end(solver, accuracy);
      const double allowed = std::max(5.0 * accuracy, 1e-7);
      EXPECT_LT((pose.position - right.position).norm(), allowed) << solver << ", " << accuracy;
      EXPECT_LT(harness::angle_between(pose.orientation, right.orientation), allowed) << solver << ", " << accuracy;
    }
  }
}

}  // namespace
}  // namespace gravitas
