// The restitution of joints' stops: which rows have it, and what is refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

const double kNothing = std::nan("");

// A joint with stops, but for its last property, and what of it makes it one without: the index of a number of a stop, or one of
// a spring that holds it.
struct JointOfStops {
  const char *library, *type;
  std::vector<double> properties;
  std::vector<std::size_t> stops;
  std::size_t limited_rows;
  std::size_t spring = 0;
};

const JointOfStops kJointsOfStops[] = {
    {"constraint_revolute",
     "Revolute",
     {0, 0, 0, 0, 0, 1, -1, 1, kNothing, kNothing, 0, kNothing, kNothing},
     {6, 7},
     1},
    {"constraint_slider", "Slider", {0, 0, 0, 1, 0, 0, -1, 1, kNothing, kNothing, kNothing, kNothing, 0}, {6, 7}, 1},
    {"constraint_distance", "Distance", {0, 0, 0, 1, 0, 0, 0.5, 2, kNothing, kNothing}, {6, 7}, 1, 8},
    {"constraint_spherical",
     "Spherical",
     {0, 0, 0, 0.5, 0, 1, 0, 0, -0.5, 0.5, kNothing, kNothing, kNothing, kNothing, kNothing, kNothing},
     {3, 8, 9},
     2},
    {"constraint_universal",
     "Universal",
     {0,        0,        0,        1,        0,        0,        0,  1, 0,  kNothing, kNothing,
      kNothing, kNothing, kNothing, kNothing, kNothing, kNothing, -1, 1, -1, 1},
     {17, 18, 19, 20},
     2},
    {"constraint_constant_velocity", "ConstantVelocity", {0, 0, 0, 1, 0, 0, 1, 0, 0, kNothing, kNothing, 0.5}, {11}, 1},
    {"constraint_axle",
     "Axle",
     {0, 0, 0, 0, 1, 0, 1, 0, 0, 2000, 50, -0.5, 0.5, kNothing, kNothing, 0, kNothing, kNothing, -0.1, 0.2, 0},
     {11, 12, 18, 19},
     2},
    {"constraint_winch", "Winch", {0, 0, 1, 0.5, 0.5, -1, 0, 0, 0, 0, 0.1, kNothing, kNothing, 0}, {}, 1, 11}};

class RestitutionOfStops : public testing::TestWithParam<JointOfStops> {
 protected:
  static std::vector<double> with(double restitution, std::vector<double> properties = GetParam().properties) {
    properties.push_back(restitution);
    return properties;
  }
  static std::string refused(const std::vector<double>& properties) {
    PluginUnderTest plugin(GetParam().library);
    JointProblem joint(&plugin, GetParam().type);
    return plugin.refusal(stage::Method::kConstraintBind, joint.bind_request(properties));
  }
  static std::vector<double> restitutions(const std::vector<double>& properties) {
    PluginUnderTest plugin(GetParam().library);
    JointProblem joint(&plugin, GetParam().type);
    joint.bind(properties);
    std::vector<double> found;
    for (const Discrepancy& d : joint.describe()) {
      EXPECT_TRUE(d.restitution == 0.0 || axis_mode(d.modes, 0) == AxisMode::kLimited) << GetParam().type;
      if (axis_mode(d.modes, 0) == AxisMode::kLimited) found.push_back(d.restitution);
    }
    return found;
  }
};

INSTANTIATE_TEST_SUITE_P(Each, RestitutionOfStops, testing::ValuesIn(kJointsOfStops),
                         [](const auto& which) { return std::string(which.param.type); });

TEST_P(RestitutionOfStops, IsThatOfItsLimitedRowsAlone) {
  for (const double e : {0.0, 0.3, 1.0})
    EXPECT_EQ(restitutions(with(e)), std::vector<double>(GetParam().limited_rows, e)) << e;
  // of a request that was recorded before there was one
  EXPECT_EQ(restitutions(GetParam().properties), std::vector<double>(GetParam().limited_rows, 0.0));
}

TEST_P(RestitutionOfStops, IsRefusedOutsideOfZeroToOne) {
  for (const double wrong : {-0.1, 1.5, kNothing, HUGE_VAL}) {
    const std::string text = refused(with(wrong));
    EXPECT_NE(text.find(std::string(GetParam().type) + ": Restitution"), std::string::npos) << wrong << text;
  }
}

TEST_P(RestitutionOfStops, IsRefusedWithoutStopsAndOfThoseThatGiveWay) {
  const auto expect_refused = [](const std::vector<double>& without) {
    EXPECT_NE(refused(with(0.5, without)).find(std::string(GetParam().type) + ": Restitution is given without"),
              std::string::npos);
    EXPECT_EQ(refused(with(0.0, without)), "");
  };
  std::vector<double> without = GetParam().properties;
  for (const std::size_t stop : GetParam().stops) without[stop] = kNothing;
  if (!GetParam().stops.empty()) expect_refused(without);
  if (GetParam().spring == 0) return;
  std::vector<double> sprung = GetParam().properties;
  sprung[GetParam().spring] = 100.0;
  expect_refused(sprung);
}

}  // namespace
}  // namespace gravitas::test
