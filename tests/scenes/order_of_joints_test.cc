// The order in which a scene lists its joints changes rounding, and nothing else.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;

constexpr int kLinks = 80;

// A chain of rods that falls from the horizontal, with its joints as they come, or the even ones first.
std::string falling_chain(bool even_first) {
  std::string bodies;
  std::vector<std::string> joints;
  for (int i = 0; i < kLinks; ++i) {
    const std::string id = std::to_string(i), before = i == 0 ? "" : std::to_string(i - 1);
    bodies += "Body { Id = \"" + id + "\" Mass = 1 PrincipalMoments = {0.002, 0.02, 0.02} Forces = {\"Down\"}" +
              " KineticProperties { Position = " + literal(Vector3(0.5 * i + 0.25, 0.0, 0.0)) + " } }\n";
    joints.push_back("Constraint { Type = \"Spherical\" Id = \"J" + id + "\" Body1 = \"" + before + "\" Body2 = \"" +
                     id + "\" CustomProperties { BindPoint = " + literal(Vector3(0.5 * i, 0.0, 0.0)) + " } }\n");
  }
  if (even_first)
    std::stable_partition(joints.begin(), joints.end(),
                          [&, i = 0](const std::string&) mutable { return i++ % 2 == 0; });
  std::string all;
  for (const std::string& joint : joints) all += joint;
  return R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { Duration = 0.25 } }
Environment { Space { Bodies {
)" + bodies +
         "} }\nConstraints {\n" + all + "} }\n";
}

TEST(OrderOfJoints, ChangesRoundingAlone) {
  for (const std::vector<std::string>& of : {std::vector<std::string>{"Solver=Newton"},
                                             {"Solver=Direct"},
                                             {"Solver=Direct", "Simulator=Smooth", "KineticIntegrator=RK4"}}) {
    SceneRun in_order(falling_chain(false), of), even_first(falling_chain(true), of);
    in_order.to_end(), even_first.to_end();
    for (int i = 0; i < kLinks; ++i) {
      const std::string id = std::to_string(i);
      EXPECT_LT((in_order.body(id).pose.position - even_first.body(id).pose.position).norm(), 1e-9)
          << id << ", " << of.back();
    }
    EXPECT_LT(even_first.report().max_joint_error(), 1e-9) << of.back();
  }
}

}  // namespace
}  // namespace gravitas
