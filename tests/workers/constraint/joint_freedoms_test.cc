// Every joint: which freedoms its rows take and which they leave, at the start and after any motion that they leave, and
// what it refuses. The properties are those of the scene language in the order of their declaration.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_pair.h"

namespace gravitas::test {
namespace {

// A motion of body 2 against body 1 about or along world axes of the start, applied in order: what is later is fixed in
// body 1 if `in_body1`, else moves with body 2.
struct JointMotion {
  Vector3 axis;
  bool turns = true;
  bool in_body1 = true;
  double way = 0.0;  // along the axis with a radian
};

struct JointCase {
  const char* type;
  const char* plugin;
  std::vector<double> properties;
  long rows;
  long rank;
  // Freedoms left: rank + freedoms = 6.
  std::vector<JointMotion> freedoms;
};

void PrintTo(const JointCase& joint, std::ostream* out) { *out << joint.type; }

const std::vector<JointCase>& cases() {
  static const std::vector<JointCase> all = {
      {"Spherical",
       "constraint_spherical",
       numbers({kPoint}, {kNoValue, 0, kNoValue, kNoValue, kNoValue, kNoValue, kNoValue}),
       3,
       3,
       {{Vector3::UnitX()}, {Vector3::UnitY()}, {Vector3::UnitZ()}}},
      {"Revolute",
       "constraint_revolute",
       numbers({kPoint, kPoint + 0.4 * kAxis}, {kNoValue, kNoValue}),
       5,
       5,
       {{kAxis}}},
      {"Rigid", "constraint_rigid", numbers({kPoint}), 6, 6, {}},
      {"Slider",
       "constraint_slider",
       numbers({kPoint, 3.0 * kAxis}, {kNoValue, kNoValue, kNoValue, kNoValue}),
       5,
       5,
       {{kAxis, false}}},
      {"Universal",
       "constraint_universal",
       numbers({kPoint, kAxis, kAcross}),
       4,
       4,
       {{kAcross, true, false}, {kAxis, true, true}}},
      {"Screw",
       "constraint_screw",
       numbers({kPoint, kPoint + 0.4 * kAxis}, {-2.0}),
       5,
       5,
       {{kAxis, true, true, -1.0 / 3.14159265358979323846}}},
      {"Axle",
       "constraint_axle",
       numbers({kPoint, kAxis, kAcross}, {kNoValue, kNoValue}),
       4,
       4,
       {{kAcross, true, false}, {kAxis, true, true}}},
  };
  return all;
}

class JointFreedoms : public testing::TestWithParam<JointCase> {
 protected:
  JointFreedoms() : plugin_(GetParam().plugin), joint_(&plugin_, GetParam().type) {
    for (JointedBody& body : joint_.bodies) body.pose = random_.pose(3.0);
    joint_.bind(GetParam().properties);
    start_ = joint_.bodies;
  }

  // Moves body 2 by the freedoms from the start, and then both bodies as one.
  void move(double size) {
    joint_.bodies = start_;
    Pose& pose = joint_.bodies[1].pose;
    Pose moved = {};  // of body 2 since the start, world
    for (const JointMotion& m : GetParam().freedoms) {
      const double by = random_.uniform(-size, size);
      Pose next;
      if (m.turns) {
        const Quaternion turn = exp_rotation(by * m.axis);
        next = {kPoint - turn * kPoint + by * m.way * m.axis, turn};
      } else {
        next = {by * m.axis, Quaternion::Identity()};
      }
      moved = m.in_body1 ? compose(next, moved) : compose(moved, next);
    }
    pose = compose(moved, pose);
    pose.orientation = normalized(pose.orientation);
    const Pose both = random_.pose(2.0);
    for (JointedBody& body : joint_.bodies) {
      body.pose = compose(both, body.pose);
      body.pose.orientation = normalized(body.pose.orientation);
    }
  }

  PluginUnderTest plugin_;
  JointProblem joint_;
  std::vector<JointedBody> start_;
  conformance::Draw random_{7};
};

INSTANTIATE_TEST_SUITE_P(Each, JointFreedoms, testing::ValuesIn(cases()),
                         [](const auto& which) { return std::string(which.param.type); });

TEST_P(JointFreedoms, RowsHaveTheRankOfTheProof) {
  ASSERT_EQ(GetParam().rank + static_cast<long>(GetParam().freedoms.size()), 6);
  for (int i = 0; i < 20; ++i) {
    const Eigen::MatrixXd rows = joint_.jacobian(joint_.describe());
    EXPECT_EQ(rows.rows(), GetParam().rows);
    EXPECT_EQ(rank(rows), GetParam().rank);
    move(0.6);
  }
}

TEST_P(JointFreedoms, WhatIsLeftFreeIsNoError) {
  for (int i = 0; i < 20; ++i) {
    move(1.0);
    for (const Discrepancy& d : joint_.describe())
      EXPECT_NEAR(joint_error(d, d.point2 - d.point1), 0.0, kFreedomRounding);
  }
}

// The rows are the derivative of the errors in every state that the joint allows, by central differences.
TEST_P(JointFreedoms, RowsAreTheRatesOfTheErrors) {
  constexpr double kTime = 1e-5;
  for (int i = 0; i < 10; ++i) {
    move(0.6);
    for (JointedBody& body : joint_.bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
    const std::vector<JointedBody> now = joint_.bodies;
    const std::vector<Discrepancy> all = joint_.describe();
    std::vector<double> rates;
    for (const Discrepancy& d : all) {
      const Matrix3 axes = to_rotation_matrix(d.axes);
      for (int k = 0; k < 3; ++k)
        if (axis_mode(d.modes, k) == AxisMode::kLocked) rates.push_back(joint_.row_velocity(d, axes.col(k)));
    }
    const auto errors = [&](double time) {
      for (std::size_t b = 0; b < 2; ++b)
        joint_.bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
      std::vector<double> along;
      for (const Discrepancy& d : joint_.describe()) {
        const Matrix3 axes = to_rotation_matrix(d.axes);
        for (int k = 0; k < 3; ++k)
          if (axis_mode(d.modes, k) == AxisMode::kLocked) along.push_back(axes.col(k).dot(d.point2 - d.point1));
      }
      return along;
    };
    const std::vector<double> before = errors(-kTime), after = errors(kTime);
    joint_.bodies = now;
    ASSERT_EQ(after.size(), rates.size());
    // rounding over the time, and the next order but one
    for (std::size_t k = 0; k < rates.size(); ++k)
      EXPECT_NEAR((after[k] - before[k]) / (2.0 * kTime), rates[k], 1e-8) << "row " << k;
  }
}

// ---- each by itself

TEST_F(JointPair, ARevolutesAngleIsThatOfBody2AboutItsAxis) {
  PluginUnderTest plugin("constraint_revolute");
  for (const double angle : {-2.5, -0.4, 0.0, 1.3, 3.0, 4.0}) {
    JointProblem hinge = joint(&plugin, "Revolute", numbers({kPoint, kPoint + 0.4 * kAxis}, {-1.0, 5.0}));
    turn(&hinge, angle * kAxis);
    const std::vector<Discrepancy> all = hinge.describe();
    ASSERT_EQ(all.size(), 4U);
    const Discrepancy& limit = all[3];
    EXPECT_TRUE(limit.is_angular());
    const Vector3 axis = to_rotation_matrix(limit.axes).col(0);
    EXPECT_LT((axis - kAxis).norm(), kFreedomRounding);
    // limits of -1 and 5 span 6 of 6.28 rad: the turn nearest to 2
    const double seen = angle < 2.0 - 3.14159 ? angle + 6.283185307179586 : angle;
    EXPECT_NEAR(axis.dot(limit.point2 - limit.point1), seen, kFreedomRounding);
    EXPECT_DOUBLE_EQ(limit.lower.x(), -1.0);
    EXPECT_DOUBLE_EQ(limit.upper.x(), 5.0);
  }
}

TEST_F(JointPair, ASlidersWayLimitsAndDriveAreAlongItsAxis) {
  PluginUnderTest plugin("constraint_slider");
  JointProblem slider = joint(&plugin, "Slider", numbers({kPoint, 2.0 * kAxis}, {-0.5, 2.0, 0.7, 30.0}));
  slider.bodies[1].pose.position += 1.25 * kAxis;
  const std::vector<Discrepancy> all = slider.describe();
  ASSERT_EQ(all.size(), 6U);
  const Discrepancy &limit = all[4], &drive = all[5];
  EXPECT_NEAR(to_rotation_matrix(limit.axes).col(0).dot(limit.point2 - limit.point1), 1.25, kFreedomRounding);
  EXPECT_EQ(limit.lower.x(), -0.5);
  EXPECT_EQ(limit.upper.x(), 2.0);
  EXPECT_LT((drive.velocity - 0.7 * kAxis).norm(), kFreedomRounding);
  EXPECT_EQ(drive.maximum_force.x(), 30.0);
  EXPECT_EQ(rank(slider.jacobian(all)), 6);
}

TEST_F(JointPair, ARevolutesDriveIsAboutItsAxis) {
  PluginUnderTest plugin("constraint_revolute");
  const double no = kNoValue;
  for (const double torque : {30.0, no}) {
    JointProblem hinge =
        joint(&plugin, "Revolute", numbers({kPoint, kPoint + 0.4 * kAxis}, {-0.5, 2.0, 50, 2, 0.0, -0.7, torque}));
    turn(&hinge, 1.25 * kAxis);
    const std::vector<Discrepancy> all = hinge.describe();
    ASSERT_EQ(all.size(), 6U);
    const Discrepancy& drive = all[5];
    EXPECT_EQ(drive.modes, pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree, true));
    EXPECT_LT((to_rotation_matrix(drive.axes).col(0) - kAxis).norm(), kFreedomRounding);
    EXPECT_LT((drive.velocity + 0.7 * kAxis).norm(), kFreedomRounding);
    EXPECT_EQ(drive.maximum_force.x(), torque == torque ? torque : kUnlimited);
    EXPECT_EQ(rank(hinge.jacobian(all)), 6);
  }
}

// The drive's row sees what the wheel rolls at and not what it steers at, whatever the angle between its axes, and its power is
// the torque times that.
TEST_F(JointPair, AnAxlesDriveIsAboutWhatItRollsAt) {
  PluginUnderTest plugin("constraint_axle");
  const double no = kNoValue;
  for (const Vector3& rolling : {kAcross, kBent})
    for (int i = 0; i < 20; ++i) {
      JointProblem wheel =
          joint(&plugin, "Axle", numbers({kPoint, kAxis, rolling}, {2000, 50, -1, 1, no, no, 0.0, 0.7, 30.0}));
      turn(&wheel, random_.uniform(-1.0, 1.0) * kAxis);
      const Vector3 now = wheel.bodies[1].pose.orientation * (bodies_[1].pose.orientation.conjugate() * rolling);
      const std::vector<Discrepancy> all = wheel.describe();
      ASSERT_EQ(all.size(), 5U);
      const Discrepancy& drive = all[4];
      EXPECT_EQ(drive.modes, pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree, true) | kSwingDiscrepancy);
      EXPECT_EQ(rank(wheel.jacobian(all)), 6);
      const double rolls = random_.uniform(-3.0, 3.0), steers = random_.uniform(-3.0, 3.0);
      wheel.bodies[1].twist.angular = rolls * now + steers * kAxis;
      const Vector3 axis = to_rotation_matrix(drive.axes).col(0);
      const double rate = wheel.row_velocity(drive, axis);
      EXPECT_NEAR(rate / rolls * 0.7, drive.velocity.dot(axis), kFreedomRounding);
      EXPECT_NEAR(drive.maximum_force.x() * rate, 30.0 * rolls, 100 * kFreedomRounding);
      EXPECT_NEAR(axis.dot(kAxis), 0.0, kFreedomRounding);
    }
  EXPECT_EQ(joint(&plugin, "Axle", numbers({kPoint, kAxis, kAcross}, {no, no, no, no, no, no, 0.0, 0.7, no}))
                .describe()
                .at(2)
                .maximum_force.x(),
            kUnlimited);
}

TEST_F(JointPair, ADistancesRowIsTheRateOfTheDistance) {
  PluginUnderTest plugin("constraint_distance");
  const Vector3 other = kPoint + 1.7 * kBent;
  JointProblem rod = joint(&plugin, "Distance", numbers({kPoint, other}, {kNoValue, kNoValue}));
  ASSERT_EQ(rod.describe().size(), 1U);
  EXPECT_NEAR(rod.describe()[0].lower.x(), 1.7, kFreedomRounding);
  EXPECT_EQ(rod.describe()[0].lower.x(), rod.describe()[0].upper.x());
  EXPECT_EQ(rank(rod.jacobian(rod.describe())), 1);
  for (int i = 0; i < 20; ++i) {
    for (JointedBody& body : rod.bodies)
      body = {displaced(body.pose, random_.vector(0.1), random_.vector(0.3)),
              {random_.vector(1.0), random_.vector(1.0)}};
    const Discrepancy d = rod.describe()[0];
    const Vector3 axis = to_rotation_matrix(d.axes).col(0);
    EXPECT_NEAR(axis.dot(d.point2 - d.point1), (d.point2 - d.point1).norm(), kFreedomRounding);
    EXPECT_NEAR(joint_error(d, d.point2 - d.point1), std::fabs((d.point2 - d.point1).norm() - 1.7), kFreedomRounding);
    const auto distance_after = [&](double time) {
      Vector3 point[2];
      for (std::size_t b = 0; b < 2; ++b) {
        const JointedBody& body = rod.bodies[b];
        point[b] = carried(b == 0 ? d.point1 : d.point2, body.pose,
                           displaced(body.pose, time * body.twist.linear, time * body.twist.angular));
      }
      return (point[1] - point[0]).norm();
    };
    EXPECT_NEAR((distance_after(1e-5) - distance_after(-1e-5)) / 2e-5, rod.row_velocity(d, axis), 1e-8);
  }
}

TEST_F(JointPair, ARopeIsSlackWithinItsLength) {
  PluginUnderTest plugin("constraint_distance");
  const Discrepancy d = joint(&plugin, "Distance", numbers({kPoint, kPoint + kAxis}, {kNoValue, 2.5})).describe().at(0);
  EXPECT_EQ(d.lower.x(), -kUnlimited);  // where its points meet it holds nothing, either
  EXPECT_EQ(d.upper.x(), 2.5);
  EXPECT_EQ(joint_error(d, d.point2 - d.point1), 0.0);
  EXPECT_NEAR(joint_error(d, Vector3(0, 3.0, 0)), 0.5, kFreedomRounding);
}

// It was refused by where its points were at the start, whatever had become of them.
TEST_F(JointPair, ARopeThatAnEditKeepsMayHaveAnyLength) {
  PluginUnderTest plugin("constraint_distance");
  const std::vector<double> shorter = numbers({kPoint, kPoint + kAxis}, {kNoValue, 0.5});
  EXPECT_NE(refused(&plugin, "Distance", shorter).find("MaximumDistance"), std::string::npos);
  JointProblem rope(&plugin, "Distance");
  rope.bodies = bodies_;
  rope.is_kept = true;
  rope.bind(shorter);
  const Discrepancy d = rope.describe().at(0);
  EXPECT_EQ(d.upper.x(), 0.5);
  EXPECT_NEAR(joint_error(d, d.point2 - d.point1), 0.5, kFreedomRounding);
  EXPECT_NE(
      plugin.refusal(stage::Method::kConstraintBind, rope.bind_request(numbers({kPoint, kPoint + kAxis}, {0.6, 0.5})))
          .find("MinimumDistance"),
      std::string::npos);
}

TEST_F(JointPair, ConstantVelocityLeavesEveryBendFreeAndNoTwist) {
  PluginUnderTest plugin("constraint_constant_velocity");
  for (int i = 0; i < 30; ++i) {
    JointProblem shafts = joint(&plugin, "ConstantVelocity", numbers({kPoint, kAxis, kAxis}));
    // from straight, a bend to any direction
    Vector3 across = random_.vector(1.0);
    across -= across.dot(kAxis) * kAxis;
    turn(&shafts, 1.2 * across);
    const std::vector<Discrepancy> all = shafts.describe();
    ASSERT_EQ(all.size(), 2U);
    EXPECT_EQ(rank(shafts.jacobian(all)), 4);
    for (const Discrepancy& d : all) EXPECT_NEAR(joint_error(d, d.point2 - d.point1), 0.0, kFreedomRounding);
    // equal speeds about the shafts are what the row wants
    const Vector3 shaft2 = exp_rotation(1.2 * across) * kAxis;
    shafts.bodies[0].twist.angular = 3.0 * kAxis;
    shafts.bodies[1].twist.angular = 3.0 * shaft2;
    EXPECT_NEAR(shafts.row_velocity(all[1], to_rotation_matrix(all[1].axes).col(0)), 0.0, kFreedomRounding);
    // a twist about the second shaft is seen as cos(bend/2) of it
    turn(&shafts, 0.01 * shaft2);
    const Discrepancy twisted = shafts.describe()[1];
    EXPECT_NEAR(joint_error(twisted, twisted.point2 - twisted.point1), 0.01 * std::sqrt(0.5 * (1 + kAxis.dot(shaft2))),
                kFreedomRounding);
  }
}

TEST_F(JointPair, ASuspensionIsASpringAlongTheSteeringAxisAndNoError) {
  PluginUnderTest plugin("constraint_axle");
  JointProblem wheel = joint(&plugin, "Axle", numbers({kPoint, kAxis, kAcross}, {2000.0, 50.0}));
  wheel.bodies[1].pose.position += 0.07 * kAxis;
  const std::vector<Discrepancy> all = wheel.describe();
  ASSERT_EQ(all.size(), 3U);
  EXPECT_EQ(rank(wheel.jacobian({all[0], all[1]})), 3);
  for (const Discrepancy& d : all) EXPECT_NEAR(joint_error(d, d.point2 - d.point1), 0.0, kFreedomRounding);
  EXPECT_NEAR(to_rotation_matrix(all[2].axes).col(0).dot(all[2].point2 - all[2].point1), 0.07, kFreedomRounding);
  EXPECT_EQ(all[2].compliance.x(), 1.0 / 2000.0);
  EXPECT_EQ(all[2].damping.x(), 50.0);
}

// A spring's force and torque have a potential: the power of its rows is the rate of e^2/(2 c), in every state that the joint
// allows, turned far; and it holds nothing. Of axes that are not square that is k angle^2/2 with sin(e) = sine sin(angle).
TEST_F(JointPair, SpringsHaveAPotentialAndTakeNoFreedom) {
  struct Sprung {
    const char* plugin;
    const char* type;
    std::vector<double> properties;
    // of the turn of body 2, rad, at most, and of its way
    Vector3 turn, way;
    std::size_t springs;
    double sine = 1.0;
  };
  const double skew = kAxis.cross(kBent).norm();
  const Vector3 none = Vector3::Zero();
  const double no = kNoValue;
  const std::vector<Sprung> all_joints = {
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint + kAxis}, {no, no, 50, 2, 0.4}), 2.5 * kAxis, none,
       1},
      {"constraint_slider", "Slider", numbers({kPoint, kAxis}, {no, no, no, no, 50, 2, 0.4}), none, 3.0 * kAxis, 1},
      {"constraint_spherical",
       "Spherical",
       numbers({kPoint}, {no, 0, no, no, no, no, no, 50, 2}),
       {1, -1.5, 1},
       none,
       3},
      {"constraint_universal", "Universal", numbers({kPoint, kAxis, kAcross}, {50, 2, 0, 0}), 1.3 * kAxis, none, 1},
      {"constraint_universal", "Universal", numbers({kPoint, kAxis, kBent}, {0, 0, 50, 2}), 1.3 * kBent, none, 1, skew},
      {"constraint_constant_velocity", "ConstantVelocity", numbers({kPoint, kAxis, kAxis}, {50, 2}), 2.0 * kAcross,
       none, 2},
      {"constraint_axle", "Axle", numbers({kPoint, kAxis, kBent}, {no, no, no, no, 50, 2, 0.2}), 1.1 * kAxis, none, 1,
       skew},
      {"constraint_distance", "Distance", numbers({kPoint, kPoint + kAxis}, {2.5, 2.5, 50, 2}), none, {0.4, 2, -1}, 1},
      {"constraint_bushing",
       "Bushing",
       numbers({kPoint}, {1, 0, 0, 0, 10, 20, 30, 1, 2, 3, 50, 50, 50, 1, 1, 1}),
       {1, -1.5, 1},
       {0.4, 2, -1},
       6},
      {"constraint_bushing",
       "Bushing",
       numbers({kPoint}, {0.6, 0, 0.8, 0, 0, 20, 0, 1, 2, 3, 0, 0, 0, 0, 0, 0}),
       {1, -1.5, 1},
       {0.4, 2, -1},
       1},
  };
  for (const Sprung& sprung : all_joints) {
    PluginUnderTest plugin(sprung.plugin);
    for (int i = 0; i < 20; ++i) {
      JointProblem pair = joint(&plugin, sprung.type, sprung.properties);
      turn(&pair, random_.uniform(-1.0, 1.0) * sprung.turn);
      pair.bodies[1].pose.position += random_.uniform(-1.0, 1.0) * sprung.way;
      for (JointedBody& body : pair.bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
      const std::vector<JointedBody> now = pair.bodies;
      const auto each = [&](auto&& look) {
        for (const Discrepancy& d : pair.describe())
          for (int k = 0; k < 3; ++k)
            if (d.compliance[k] > 0.0) look(d, k, to_rotation_matrix(d.axes).col(k));
      };
      double power = 0.0;
      std::size_t springs = 0;
      each([&](const Discrepancy& d, int k, const Vector3& axis) {
        const double rest = axis_mode(d.modes, k) == AxisMode::kLimited ? d.lower[k] : 0.0;
        power += (axis.dot(d.point2 - d.point1) - rest) / d.compliance[k] * pair.row_velocity(d, axis);
        ++springs;
      });
      EXPECT_EQ(springs, sprung.springs) << sprung.type;
      const auto energy = [&](double time) {
        for (std::size_t b = 0; b < 2; ++b)
          pair.bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
        double sum = 0.0;
        each([&](const Discrepancy& d, int k, const Vector3& axis) {
          const double rest = axis_mode(d.modes, k) == AxisMode::kLimited ? d.lower[k] : 0.0;
          const double error = axis.dot(d.point2 - d.point1) - rest;
          const double angle = std::asin(std::sin(error) / sprung.sine);
          sum += sprung.sine < 1.0 ? 0.5 * 50.0 * angle * angle : 0.5 * error * error / d.compliance[k];
        });
        return sum;
      };
      EXPECT_NEAR((energy(1e-5) - energy(-1e-5)) / 2e-5, power, 1e-6) << sprung.type << ' ' << i;
    }
  }
}

// Reach cones and twist: the row's error is the way to the limit, and its rate is the row's, near the limit.
TEST_F(JointPair, AReachConesRowPointsToTheCone) {
  PluginUnderTest plugin("constraint_spherical");
  const std::vector<double> round = numbers({kPoint}, {0.5, 0, kAxis.x(), kAxis.y(), kAxis.z(), kNoValue, kNoValue});
  std::vector<double> irregular = numbers({kPoint}, {kNoValue, 4});
  for (const double number : {0.3, 0.4, 1.8, 0.7, 3.5, 0.35, 5.0, 0.6}) irregular.push_back(number);
  for (const double number : {kAxis.x(), kAxis.y(), kAxis.z(), kNoValue, kNoValue}) irregular.push_back(number);
  for (const bool is_round : {true, false}) {
    int inside = 0, outside = 0;
    for (int i = 0; i < 200; ++i) {
      JointProblem socket = joint(&plugin, "Spherical", is_round ? round : irregular);
      turn(&socket, random_.vector(0.5));
      for (JointedBody& body : socket.bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
      const auto error = [&] {
        const Discrepancy d = socket.describe().at(1);
        return to_rotation_matrix(d.axes).col(0).dot(d.point2 - d.point1);
      };
      const Discrepancy d = socket.describe().at(1);
      (error() < 0.0 ? inside : outside) += 1;
      const double start = error();
      // the length of the gradient is that at the cone
      if (!is_round && std::fabs(start) > 2e-3) continue;
      const double rate = socket.row_velocity(d, to_rotation_matrix(d.axes).col(0));
      const std::vector<JointedBody> now = socket.bodies;
      double at[2];
      for (int side = 0; side < 2; ++side) {
        const double time = side == 0 ? -1e-6 : 1e-6;
        for (std::size_t b = 0; b < 2; ++b)
          socket.bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
        at[side] = error();
      }
      EXPECT_NEAR((at[1] - at[0]) / 2e-6, rate, is_round ? 1e-8 : 2e-2);
    }
    EXPECT_GT(inside, 20);
    EXPECT_GT(outside, 20);
  }
}

TEST_F(JointPair, ATwistIsLimitedAtAnySwing) {
  PluginUnderTest plugin("constraint_spherical");
  const std::vector<double> properties = numbers({kPoint}, {kNoValue, 0, kAxis.x(), kAxis.y(), kAxis.z(), -0.3, 0.8});
  for (int i = 0; i < 20; ++i) {
    JointProblem socket = joint(&plugin, "Spherical", properties);
    const double twist = random_.uniform(-1.0, 1.0);
    turn(&socket, twist * kAxis);
    Vector3 across = random_.vector(1.0);
    across -= across.dot(kAxis) * kAxis;
    turn(&socket, across);
    const std::vector<Discrepancy> all = socket.describe();
    ASSERT_EQ(all.size(), 2U);
    const Discrepancy& d = all[1];
    const double scale = d.upper.x() / 0.8;
    EXPECT_NEAR(scale, std::cos(0.5 * across.norm()), kFreedomRounding);
    EXPECT_NEAR(d.lower.x(), -0.3 * scale, kFreedomRounding);
    EXPECT_NEAR(to_rotation_matrix(d.axes).col(0).dot(d.point2 - d.point1), scale * twist, kFreedomRounding);
  }
}

TEST_F(JointPair, ContradictionsAreRefusedWithTheField) {
  struct Trial {
    const char* plugin;
    const char* type;
    std::vector<double> properties;
    const char* field;
  };
  const std::vector<Trial> trials = {
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint}, {kNoValue, kNoValue}), "BindAxisPoint1"},
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint + kAxis}, {0.5, -0.5}), "LowerLimit"},
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint + kAxis}, {0.1, 0.5}), "LowerLimit"},
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint + kAxis}, {-0.5, -0.1}), "UpperLimit"},
      {"constraint_revolute", "Revolute", numbers({kPoint, kPoint + kAxis}, {-4.0, 4.0}), "UpperLimit"},
      {"constraint_revolute", "Revolute",
       numbers({kPoint, kPoint + kAxis}, {kNoValue, kNoValue, kNoValue, kNoValue, 0.0, kNoValue, 5.0}),
       "MaximumTorque"},
      {"constraint_axle", "Axle",
       numbers({kPoint, kAxis, kAcross},
               {kNoValue, kNoValue, kNoValue, kNoValue, kNoValue, kNoValue, 0.0, kNoValue, 5.0}),
       "MaximumTorque"},
      {"constraint_slider", "Slider", numbers({kPoint, Vector3::Zero()}, {kNoValue, kNoValue, kNoValue, kNoValue}),
       "Axis"},
      {"constraint_slider", "Slider", numbers({kPoint, kAxis}, {1.0, -1.0, kNoValue, kNoValue}), "LowerLimit"},
      {"constraint_slider", "Slider", numbers({kPoint, kAxis}, {kNoValue, kNoValue, kNoValue, 5.0}), "MaximumForce"},
      {"constraint_distance", "Distance", numbers({kPoint, kPoint + kAxis}, {2.0, 1.0}), "MinimumDistance"},
      {"constraint_distance", "Distance", numbers({kPoint, kPoint + kAxis}, {2.0, 3.0}), "MinimumDistance"},
      {"constraint_distance", "Distance", numbers({kPoint, kPoint + kAxis}, {kNoValue, 0.5}), "MaximumDistance"},
      {"constraint_distance", "Distance", numbers({kPoint, kPoint}, {kNoValue, kNoValue}), "MaximumDistance"},
      {"constraint_universal", "Universal", numbers({kPoint, kAxis, -2.0 * kAxis}), "Axis2"},
      {"constraint_universal", "Universal", numbers({kPoint, Vector3::Zero(), kAxis}), "Axis1"},
      {"constraint_constant_velocity", "ConstantVelocity", numbers({kPoint, kAxis, -kAxis}), "Axis2"},
      {"constraint_axle", "Axle", numbers({kPoint, kAxis, kAxis}, {kNoValue, kNoValue}), "RollingAxis"},
      {"constraint_axle", "Axle", numbers({kPoint, kAxis, kAcross}, {kNoValue, 3.0}), "SuspensionDamping"},
      {"constraint_axle", "Axle", numbers({kPoint, kAxis, kAcross}, {kNoValue, kNoValue, 0.2, 0.1}),
       "SteeringLowerLimit"},
      {"constraint_distance", "Distance", numbers({kPoint, kPoint + kAxis}, {1.0, 2.0, kNoValue, 3.0}), "Damping"},
      // at the centre of mass no way leads from the point to it
      {"constraint_spherical", "Spherical",
       numbers({bodies_[1].pose.position}, {0.5, 0, kNoValue, kNoValue, kNoValue, kNoValue, kNoValue}), "Axis"},
      {"constraint_spherical", "Spherical", numbers({kPoint}, {kNoValue, 0, 0, 0, 0, -0.1, 0.1}), "Axis"},
      {"constraint_spherical", "Spherical",
       numbers({kPoint}, {0.5, 3, 0.0, 0.5, 1.0, 0.5, 2.0, 0.5, 1, 0, 0, kNoValue, kNoValue}), "ReachConeAngle"},
      {"constraint_spherical", "Spherical",
       numbers({kPoint}, {kNoValue, 2, 0.0, 0.5, 1.0, 0.5, 1, 0, 0, kNoValue, kNoValue}), "ReachCone"},
      {"constraint_spherical", "Spherical",
       numbers({kPoint}, {kNoValue, 3, 0.0, 0.5, 2.0, 0.5, 1.0, 0.5, 1, 0, 0, kNoValue, kNoValue}), "ReachCone"},
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
