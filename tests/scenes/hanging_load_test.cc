// Loads that hang on light links, ropes and planks, with the default solver and step: the tension that holds the load holds the links,
// too, by many times what their inertia does.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

const std::string kDownwards = R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
)";

// A rod of 0.5 m, or a ball.
std::string hanging_body(const std::string& id, double mass, const Vector3& moments, const Pose& pose) {
  return "Body { Id = \"" + id + "\" Mass = " + literal(mass) + " PrincipalMoments = " + literal(moments) +
         " Forces = {\"Down\"} KineticProperties { Position = " + literal(pose.position) +
         " Orientation = " + literal(pose.orientation) + " } }\n";
}

// `links` of 4 kg and 0.5 m on hinges or ball joints, let go `degrees` off the vertical with a load at their end.
std::string loaded_chain(int links, const std::string& joint, double load, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0, length = 0.5;
  const Vector3 along(std::sin(angle), -std::cos(angle), 0.0);
  std::string bodies, joints;
  for (int i = 0; i <= links; ++i) {
    const std::string id = std::to_string(i), before = i == 0 ? "" : std::to_string(i - 1);
    const Vector3 at = i * length * along;
    bodies += i < links ? hanging_body(id, 4.0, {0.085, 0.005, 0.085},
                                       {at + 0.5 * length * along, exp_rotation({0.0, 0.0, angle})})
                        : hanging_body(id, load, {0.1 * load, 0.1 * load, 0.1 * load},
                                       {at + 0.3 * along, exp_rotation({0.0, 0.0, angle})});
    joints += "Constraint { Type = \"" + joint + "\" Id = \"J" + id + "\" Body1 = \"" + before + "\" Body2 = \"" + id +
              "\" CustomProperties { " +
              (joint == "Revolute"
                   ? "BindAxisPoint1 = " + literal(at) + " BindAxisPoint2 = " + literal(Vector3(at + Vector3::UnitZ()))
                   : "BindPoint = " + literal(at)) +
              " } }\n";
  }
  return kDownwards + "Simulator { CustomProperties { Duration = 3 } }\nEnvironment { Space { Bodies {\n" + bodies +
         "} }\nConstraints {\n" + joints + "} }\n";
}

// A chain that swings stays closed, and its load goes where the end of the step taken exactly has it.
TEST(HangingLoad, SwingsOnAChainThatStaysClosed) {
  for (const std::string joint : {"Revolute", "Spherical"}) {
    for (const auto& [links, load, degrees] :
         {std::tuple{2, 400.0, 2.0}, {4, 200.0, 10.0}, {4, 1000.0, 2.0}, {6, 100.0, 5.0}, {8, 80.0, 30.0}}) {
      const std::string scene = loaded_chain(links, joint, load, degrees), id = std::to_string(links);
      SceneRun run(scene), exact(scene, {"Solver=Newton"});
      const double energy = run.energy(),
                   swing = load * kG * (0.5 * links + 0.3) * (1.0 - std::cos(degrees * std::numbers::pi / 180.0));
      while (!run.is_done()) {
        run.step(), exact.step();
        ASSERT_LT(run.energy(), energy + 0.02 * swing) << links << " links, " << joint << ", at " << run.time();
        ASSERT_LT((run.body(id).pose.position - exact.body(id).pose.position).norm(), 1e-4)
            << links << " links, " << joint << ", at " << run.time();
      }
      EXPECT_LT(run.report().max_joint_error(), 1e-4) << links << " links, " << joint << ", " << load << " kg";
    }
  }
}

// A net of slack ropes between beads, held at two corners.
TEST(HangingLoad, NetsOfRopesStayClosed) {
  constexpr int kSide = 5;
  std::string bodies, joints;
  const auto id = [](int i, int j) { return "N" + std::to_string(i) + std::to_string(j); };
  const auto rope = [&](const std::string& one, const std::string& two, const Vector3& from, const Vector3& to) {
    joints += "Constraint { Type = \"Distance\" Id = \"R" + one + two + "\" Body1 = \"" + one + "\" Body2 = \"" + two +
              "\" CustomProperties { BindPoint1 = " + literal(from) + " BindPoint2 = " + literal(to) +
              " MaximumDistance = " + literal(1.05 * (to - from).norm()) + " } }\n";
  };
  for (int i = 0; i < kSide; ++i) {
    for (int j = 0; j < kSide; ++j) {
      const Vector3 at(0.3 * i, 0.0, 0.3 * j);
      bodies += hanging_body(id(i, j), 0.1, Vector3::Constant(4e-5), {at, Quaternion::Identity()});
      if (i > 0) rope(id(i - 1, j), id(i, j), at - Vector3(0.3, 0, 0), at);
      if (j > 0) rope(id(i, j - 1), id(i, j), at - Vector3(0, 0, 0.3), at);
    }
  }
  rope("", id(0, 0), {0.0, 0.3, 0.0}, Vector3::Zero());
  rope("", id(kSide - 1, 0), {1.2, 0.3, 0.0}, {1.2, 0.0, 0.0});
  SceneRun run(kDownwards + "Simulator { CustomProperties { Duration = 3 } }\nEnvironment { Space { Bodies {\n" +
               bodies + "} }\nConstraints {\n" + joints + "} }\n");
  const double energy = run.energy();
  run.to_end();
  EXPECT_LT(run.energy(), energy);
  EXPECT_LT(run.report().max_joint_error(), 1e-3);
}

// A scissor lift: `stages` of two crossed rods of 0.5 kg and 1 m, 0.5 rad from level, 100 kg on top, and a foot that a joint
// holds in place against 1.8 times that weight for each stage.
std::string scissor_lift(int stages, const std::string& joint_of_foot) {
  constexpr double kTilt = 0.5;
  const double width = std::cos(kTilt), height = std::sin(kTilt);
  const auto turned_rod = [&](const std::string& id, int stage, double angle) {
    return hanging_body(id, 0.5, {0.001, 0.042, 0.042},
                        {{0.5 * width, (stage + 0.5) * height, 0.0}, exp_rotation({0.0, 0.0, angle})});
  };
  const auto level_body = [&](const std::string& id, double mass, double x, double y) {
    return hanging_body(id, mass, Vector3::Constant(0.1 * mass), {{x, y, 0.0}, Quaternion::Identity()});
  };
  const auto joint = [](const std::string& type, const std::string& one, const std::string& two,
                        const std::string& place) {
    return "Constraint { Type = \"" + type + "\" Id = \"" + one + "-" + two + "\" Body1 = \"" + one + "\" Body2 = \"" +
           two + "\" CustomProperties { " + place + " } }\n";
  };
  const auto hinge = [&](const std::string& one, const std::string& two, double x, double y) {
    return joint("Revolute", one, two,
                 "BindAxisPoint1 = " + literal(Vector3(x, y, 0)) + " BindAxisPoint2 = " + literal(Vector3(x, y, 1)));
  };
  std::string bodies = level_body("Foot", 0.1, width, 0.0), joints = joint_of_foot;
  for (int i = 0; i < stages; ++i) {
    const std::string a = "A" + std::to_string(i), b = "B" + std::to_string(i), below = std::to_string(i - 1);
    bodies += turned_rod(a, i, kTilt) + turned_rod(b, i, -kTilt);
    joints += hinge(a, b, 0.5 * width, (i + 0.5) * height) + hinge(i == 0 ? "" : "B" + below, a, 0.0, i * height) +
              hinge(i == 0 ? "Foot" : "A" + below, b, width, i * height);
  }
  const std::string top = std::to_string(stages - 1);
  const double roof = stages * height;
  bodies += level_body("Platform", 100.0, 0.5 * width, roof) + level_body("Shoe", 0.1, width, roof);
  joints += hinge("B" + top, "Platform", 0.0, roof) + hinge("A" + top, "Shoe", width, roof) +
            joint("Slider", "Platform", "Shoe", "BindPoint = {0, 0, 0} Axis = {1, 0, 0}");
  return kDownwards + "Simulator { CustomProperties { Duration = 0.5 } }\nEnvironment { Space { Bodies {\n" + bodies +
         "} }\nConstraints {\n" + joints + "} }\n";
}

// Sweeps that ended at 200 let lifts down: by 0.65 m of six stages on a drive, by 0.5 m on a foot that is bolted.
TEST(StandingLoad, IsHeldByAScissorLift) {
  const std::string bolted = "Constraint { Type = \"Rigid\" Id = \"Bolt\" Body2 = \"Foot\" }\n";
  const std::string driven =
      "Constraint { Type = \"Slider\" Id = \"Drive\" Body2 = \"Foot\" CustomProperties { BindPoint = {0, 0, 0} Axis = "
      "{1, "
      "0, 0} Speed = 0 } }\n";
  for (const auto& [stages, foot, sag] :
       {std::tuple{6, bolted, 1e-6}, {2, driven, 1e-3}, {4, driven, 1e-3}, {6, driven, 3e-3}}) {
    SceneRun run(scissor_lift(stages, foot));
    run.to_end();
    EXPECT_NEAR(run.body("Platform").pose.position.y(), stages * std::sin(0.5), sag) << stages << foot;
    EXPECT_LT(run.report().max_joint_error(), 1e-4) << stages << foot;
  }
}

}  // namespace
}  // namespace gravitas
