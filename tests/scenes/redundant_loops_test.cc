// Loops whose joints say more than they need to, with `Smooth`: in space their rows depend on each other on the joints alone, so
// that each state that an integrator tries has them contradict each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

// Bennett's linkage: four hinges in space, one freedom. It falls.
const std::string kBennett = R"(
Forces { Force { Type = "Gravity" Id = "g" CustomProperties { Acceleration = {1, -4, -3} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 0.5 } }
Environment { Space { Bodies {
  Body { Id = "A" Mass = 0.5 PrincipalMoments = {0.02, 0.03, 0.04} Forces = {"g"} KineticProperties { Position = {0.13507557646703494, 0.21036774620197413, 0} LinearVelocity = {-0.6311032385989642, 0.4052267293903894, 0} AngularVelocity = {0, 0, 3} } }
  Body { Id = "B" Mass = 0.8 PrincipalMoments = {0.05, 0.03, 0.04} Forces = {"g"} KineticProperties { Position = {-0.025188825763021727, 0.17084529876141352, 0.07765211028694366} LinearVelocity = {-0.7393689906858802, 0.273156709999697, 0.2594858460785334} AngularVelocity = {-0.5903768067859982, 0.379076588217991, 1.9744727966567477} } }
  Body { Id = "C" Mass = 0.6 PrincipalMoments = {0.02, 0.01, 0.02} Forces = {"g"} KineticProperties { Position = {-0.5548536343785249, -0.039522447440560576, 0.0776521102869436} LinearVelocity = {-0.1082657520852547, -0.13207001940502985, 0.2594858460972378} AngularVelocity = {0, -1.1073766537870982, -0.5636193972143742} } }
} } Constraints {
  Constraint { Type = "Revolute" Id = "j0" Body2 = "A" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }
  Constraint { Type = "Revolute" Id = "j1" Body1 = "A" Body2 = "B" CustomProperties { BindAxisPoint1 = {0.2701511529340699, 0.42073549240394825, 0} BindAxisPoint2 = {0.7452814110861568, 0.11565786203752088, 0.8253356149096783} } }
  Constraint { Type = "Revolute" Id = "j2" Body1 = "B" Body2 = "C" CustomProperties { BindAxisPoint1 = {-0.32052880446011334, -0.07904489488112121, 0.15530422057388732} BindAxisPoint2 = {-0.5173210733827645, 0.41643951914046307, 1.0013349519034072} } }
  Constraint { Type = "Revolute" Id = "j3" Body1 = "C" CustomProperties { BindAxisPoint1 = {-0.7891784642969364, 0, 0} BindAxisPoint2 = {-0.7891784642969364, 0.8912073600614354, 0.45359612142557726} } }
} } )";

TEST(RedundantLoops, InSpaceKeepTheOrder) {
  const auto run = [](const std::string& integrator, double time_step) {
    SceneRun linkage(kBennett, {set("Integrator", integrator), set("Simulator.TimeStep", time_step)});
    linkage.to_end();
    return linkage.body("B");
  };
  const SceneRun::Motion right = run("DormandPrince853", 0.01);
  const auto error = [&](double time_step) {
    const SceneRun::Motion is = run("RK4", time_step);
    return std::max((is.pose.position - right.pose.position).norm(),
                    harness::angle_between(is.pose.orientation, right.pose.orientation));
  };
  const double coarse = error(0.01), fine = error(0.005), finest = error(0.0025);
  EXPECT_LT(coarse, 1e-6);
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.5);
  EXPECT_NEAR(std::log2(fine / finest), 4.0, 0.5);
}

// A parallelogram that turns evenly lies flat at the end of steps, where it might go on as an antiparallelogram: on that branch next to
// none of its velocities are allowed, and it was told so. It lost four fifths of its energy.
TEST(RedundantLoops, GoOnThroughTheFlatPose) {
  const double turn = 2.0 * kPi;
  const auto body = [](const std::string& id, double inertia, double x, double speed, double spin) {
    return "Body { Id = \"" + id + "\" Mass = 1 PrincipalMoments = {0.001, " + harness::literal(inertia) + ", " +
           harness::literal(inertia) + "} KineticProperties { Position = {" + harness::literal(x) +
           ", 0, 0} LinearVelocity = {0, " + harness::literal(speed) + ", 0} AngularVelocity = {0, 0, " +
           harness::literal(spin) + "} } }\n";
  };
  const auto hinge = [](const std::string& bodies, const std::string& x) {
    return "Constraint { Type = \"Revolute\" Id = \"at" + x + "\" " + bodies +
           " CustomProperties { BindAxisPoint1 = {" + x + ", 0, 0} BindAxisPoint2 = {" + x + ", 0, 1} } }\n";
  };
  const auto scene = [&](const std::string& bodies, const std::string& joints) {
    return "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.01 Duration = 3 } }\nEnvironment { Space { "
           "Bodies { " +
           body("L", 0.01, 0.15, 0.15 * turn, turn) + body("R", 0.01, 0.95, 0.15 * turn, turn) +
           body("C", 0.05, 0.7, 0.3 * turn, 0.0) + bodies + "} } Constraints { " + hinge("Body2 = \"L\"", "0") +
           hinge("Body1 = \"L\" Body2 = \"C\"", "0.3") + hinge("Body1 = \"C\" Body2 = \"R\"", "1.1") +
           hinge("Body2 = \"R\"", "0.8") + joints + "} }\n";
  };
  for (const std::string solver : {"Direct", "Newton"})
    for (const std::string integrator : {"RK4", "RKMK4", "SymplecticSplitting", "ImplicitMidpoint", "DormandPrince54"})
      for (const double time_step : {0.005, 0.01, 1.0 / 60.0, 0.02}) {
        if (integrator == "SymplecticSplitting" && time_step > 0.01) continue;  // known weakness
        SceneRun run(scene("", ""),
                     {set("Solver", solver), set("Integrator", integrator), set("Simulator.TimeStep", time_step)});
        const double energy = run.energy();
        run.to_end();
        EXPECT_NEAR(run.energy(), energy, 1e-3 * energy) << solver << ' ' << integrator << ' ' << time_step;
        EXPECT_NEAR(run.body("L").twist.angular.z(), turn, 1e-3 * turn)
            << solver << ' ' << integrator << ' ' << time_step;
        EXPECT_LE(run.report().max_joint_error(), 1e-12) << solver << ' ' << integrator << ' ' << time_step;
      }
  // whatever else turns there
  SceneRun beside(scene(body("Wheel", 1e4, 20.0, 0.0, 5.0), hinge("Body2 = \"Wheel\"", "20")),
                  {set("Integrator", std::string("RK4"))});
  beside.to_end();
  EXPECT_NEAR(beside.body("L").twist.angular.z(), turn, 1e-3 * turn);
}

}  // namespace
}  // namespace gravitas
