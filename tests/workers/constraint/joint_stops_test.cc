// Suspensions of axles, and limits that give way: the rows of their stops and preloads, and what they refuse.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_pair.h"

namespace gravitas::test {
namespace {

// With limits alone it is a guide along the steering axis, whose way they see and no turn of the wheel.
TEST_F(JointPair, ASuspensionWithLimitsIsAGuideBetweenThem) {
  PluginUnderTest plugin("constraint_axle");
  const double no = kNoValue;
  for (const double stiffness : {no, 2000.0}) {
    JointProblem wheel =
        joint(&plugin, "Axle",
              numbers({kPoint, kAxis, kAcross}, {stiffness, no, no, no, no, no, 0.0, no, no, -0.04, 0.09, 0.0, 0.5}));
    wheel.bodies[1].pose.position += 0.07 * kAxis;
    turn(&wheel, 0.4 * kAxis);
    const std::vector<Discrepancy> all = wheel.describe();
    ASSERT_EQ(all.size(), std::isnan(stiffness) ? 3U : 4U);
    EXPECT_EQ(rank(wheel.jacobian({all[0], all[1]})), 3);
    for (const Discrepancy& d : all) EXPECT_NEAR(joint_error(d, d.point2 - d.point1), 0.0, kFreedomRounding);
    const Discrepancy& limit = all.back();
    EXPECT_EQ(limit.modes, pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree));
    EXPECT_EQ(Vector3(limit.lower.x(), limit.upper.x(), limit.restitution), Vector3(-0.04, 0.09, 0.5));
    const Vector3 axis = to_rotation_matrix(limit.axes).col(0);
    EXPECT_NEAR(axis.dot(limit.point2 - limit.point1), 0.07, kFreedomRounding);
    EXPECT_EQ(rank(wheel.jacobian({all[0], all[1], limit})), 4);
    EXPECT_NEAR((axis - kAxis).norm(), 0.0, kFreedomRounding);
  }
}

// At the start it bears its preload, along the steering axis on body 1.
TEST_F(JointPair, ASuspensionBearsItsPreloadAtTheStart) {
  PluginUnderTest plugin("constraint_axle");
  const double no = kNoValue;
  JointProblem wheel =
      joint(&plugin, "Axle",
            numbers({kPoint, kAxis, kAcross}, {2000.0, 50.0, no, no, no, no, 0.0, no, no, no, no, 600.0, 0.0}));
  for (const double way : {0.0, 0.1, -0.3}) {
    wheel.bodies[1].pose.position = bodies_[1].pose.position + way * kAxis;
    const Discrepancy spring = wheel.describe().at(2);
    const Vector3 axis = to_rotation_matrix(spring.axes).col(0);
    EXPECT_NEAR(axis.dot(spring.point2 - spring.point1) / spring.compliance.x(), 600.0 + 2000.0 * way, 1e-9) << way;
  }
}

// Limits that give way are no error and take no freedom.
TEST_F(JointPair, LimitsThatGiveWayAreSpringsBeyondThem) {
  struct Soft {
    const char *plugin, *type;
    std::vector<double> properties;
    double turn, way;
    std::size_t row;
  };
  const double no = kNoValue;
  for (const Soft& soft :
       {Soft{"constraint_slider", "Slider",
             numbers({kPoint, kAxis}, {-0.1, 0.2, no, no, no, no, 0.0, 0.0, 0.0, 500.0, 7.0}), 0.0, 0.5, 4},
        Soft{"constraint_revolute", "Revolute",
             numbers({kPoint, kPoint + kAxis}, {-0.1, 0.2, no, no, 0.0, no, no, 0.0, 0.0, 500.0, 7.0}), 0.5, 0.0, 3},
        Soft{"constraint_axle", "Axle",
             numbers({kPoint, kAxis, kAcross}, {no, no, no, no, no, no, 0.0, no, no, -0.1, 0.2, 0.0, 0.0, 500.0, 7.0}),
             0.0, 0.5, 2}}) {
    PluginUnderTest plugin(soft.plugin);
    JointProblem pair = joint(&plugin, soft.type, soft.properties);
    turn(&pair, soft.turn * kAxis);
    pair.bodies[1].pose.position += soft.way * kAxis;
    const Discrepancy limit = pair.describe().at(soft.row);
    EXPECT_EQ(axis_mode(limit.modes, 0), AxisMode::kLimited) << soft.type;
    EXPECT_EQ(limit.compliance.x(), 1.0 / 500.0) << soft.type;
    EXPECT_EQ(limit.damping.x(), 7.0) << soft.type;
    EXPECT_NEAR(to_rotation_matrix(limit.axes).col(0).dot(limit.point2 - limit.point1), 0.5, kFreedomRounding);
    EXPECT_EQ(joint_error(limit, limit.point2 - limit.point1), 0.0) << soft.type;
  }
}

TEST_F(JointPair, StopsThatCannotBeAreRefusedWithTheField) {
  struct Trial {
    const char *plugin, *type;
    std::vector<double> properties;
    const char* field;
  };
  const double no = kNoValue;
  const auto wheel = [](const std::vector<double>& rest) { return numbers({kPoint, kAxis, kAcross}, rest); };
  const std::vector<Trial> trials = {
      {"constraint_axle", "Axle", wheel({no, no, no, no, no, no, 0.0, no, no, 0.02, 0.1}), "SuspensionLowerLimit"},
      {"constraint_axle", "Axle", wheel({no, no, no, no, no, no, 0.0, no, no, no, -0.1}), "SuspensionUpperLimit"},
      {"constraint_axle", "Axle", wheel({no, no, no, no, no, no, 0.0, no, no, -0.1, 0.1, 50}), "SuspensionPreload"},
      {"constraint_axle", "Axle", wheel({2e3, no, no, no, no, no, 0.0, no, no, no, no, -50}), "SuspensionPreload"},
      {"constraint_axle", "Axle", wheel({no, no, -1, 1, no, no, 0.0, no, no, no, no, 0, 0.5, 500, no}),
       "SuspensionLimitStiffness"},
      {"constraint_axle", "Axle", wheel({no, no, no, no, no, no, 0.0, no, no, -0.1, no, 0, 0.5, 500, no}),
       "Restitution"},
      {"constraint_slider", "Slider", numbers({kPoint, kAxis}, {no, no, no, no, no, no, 0, 0, 0, 500, no}),
       "LimitStiffness"},
      {"constraint_slider", "Slider", numbers({kPoint, kAxis}, {-1, no, no, no, no, no, 0, 0, 0, no, 3}),
       "LimitDamping"},
      {"constraint_slider", "Slider", numbers({kPoint, kAxis}, {-1, no, no, no, no, no, 0, 0.5, 0, 500, 3}),
       "Restitution"},
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint + kAxis}, {-1, no, no, no, 0, no, no, 0, 0, 500, no}),
       "LimitStiffness"},
  };
  for (const Trial& trial : trials) {
    PluginUnderTest plugin(trial.plugin);
    const std::string why = refused(&plugin, trial.type, trial.properties);
    EXPECT_NE(why.find(std::string(trial.type) + ": " + trial.field), std::string::npos)
        << trial.type << ", " << trial.field << ": \"" << why << '"';
  }
}

}  // namespace
}  // namespace gravitas::test
