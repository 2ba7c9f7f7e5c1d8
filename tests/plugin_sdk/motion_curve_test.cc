// Curves through tables of poses: exact where the motion is simple, C1 everywhere, velocities those of the poses.
#include "plugin_sdk/motion_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

using CurveRow = std::array<double, MotionTable::kColumns>;

MotionTable table(const std::vector<CurveRow>& rows) {
  MotionTable made;
  for (const CurveRow& row : rows) made.rows.insert(made.rows.end(), row.begin(), row.end());
  return made;
}

CurveRow row(double time, const Vector3& x, const Quaternion& q) {
  return {time, x.x(), x.y(), x.z(), q.w(), q.x(), q.y(), q.z()};
}

// Uneven times, turns of up to 2.5 rad about changing axes.
MotionTable winding_table() {
  std::vector<CurveRow> rows;
  const double times[] = {0.0, 0.3, 0.5, 1.2, 1.3, 2.0};
  Quaternion q = Quaternion::Identity();
  for (int i = 0; i < 6; ++i) {
    rows.push_back(row(times[i], {std::sin(3.0 * i), 0.2 * i * i, std::cos(1.7 * i)}, q));
    q = rotate_by(q, Vector3(std::cos(2.0 * i), 1.0, std::sin(1.3 * i)).normalized() * (0.5 + 0.4 * i));
  }
  return table(rows);
}

double angle_between(const Quaternion& a, const Quaternion& b) {
  return log_rotation(shorter_arc(a * b.conjugate())).norm();
}

const Pose kOffset{Vector3(0.3, -0.2, 0.1), Quaternion(0.5, 0.5, -0.5, 0.5)};

TEST(MotionCurve, GoesThroughEveryRow) {
  const std::vector<double> rows = winding_table().rows;
  const MotionCurve curve({rows}, {});
  for (std::size_t i = 0; i < rows.size(); i += 8) {
    const MotionCurve::State state = curve.at(rows[i]);
    // some roundings of numbers of size 5
    EXPECT_LT((state.pose.position - Vector3(rows[i + 1], rows[i + 2], rows[i + 3])).norm(), 1e-14);
    EXPECT_LT(angle_between(state.pose.orientation, {rows[i + 4], rows[i + 5], rows[i + 6], rows[i + 7]}), 1e-14);
  }
}

TEST(MotionCurve, AtConstantVelocitiesIsExactAlsoBeyondItsEnds) {
  const Vector3 v(1.0, -2.0, 0.5), w(0.4, 2.0, -1.0);
  const Quaternion start(0.8, 0.0, 0.6, 0.0);
  std::vector<CurveRow> rows;
  for (const double t : {0.0, 0.1, 0.7, 1.0, 1.9})
    rows.push_back(row(t, Vector3(3, 4, 5) + t * v, rotate_by(start, t * w)));
  const MotionCurve curve(table(rows), {});
  for (double t = -0.5; t < 2.5; t += 0.01) {
    const MotionCurve::State state = curve.at(t);
    EXPECT_LT((state.pose.position - Vector3(3, 4, 5) - t * v).norm(), 1e-14) << t;
    EXPECT_LT(angle_between(state.pose.orientation, rotate_by(start, t * w)), 1e-14) << t;
    // quotients of differences over 0.1 s
    EXPECT_LT((state.twist.linear - v).norm(), 1e-13) << t;
    EXPECT_LT((state.twist.angular - w).norm(), 1e-13) << t;
    EXPECT_LT(state.change.angular.norm(), 1e-12) << t;
  }
}

TEST(MotionCurve, AtConstantAccelerationItsPositionsAreExact) {
  const Vector3 a(2.0, -1.0, 4.0);
  std::vector<CurveRow> rows;
  for (const double t : {0.0, 0.2, 0.3, 1.0}) rows.push_back(row(t, 0.5 * t * t * a, Quaternion::Identity()));
  const MotionCurve curve(table(rows), {});
  for (double t = 0.0; t < 1.0; t += 0.01) {
    EXPECT_LT((curve.at(t).pose.position - 0.5 * t * t * a).norm(), 1e-14) << t;
    EXPECT_LT((curve.at(t).twist.linear - t * a).norm(), 1e-13) << t;
    EXPECT_LT((curve.at(t).change.linear - a).norm(), 1e-12) << t;
  }
}

// Of a smooth way, the error of the pose falls with the cube of the rows' distance (slopes are of second order),
// inside.
TEST(MotionCurve, FollowsASmoothWayToThirdOrder) {
  const auto error = [](double h) {
    const auto x = [](double t) { return Vector3(std::sin(t), std::cos(2.0 * t), t * t * t); };
    const auto q = [](double t) {
      return exp_rotation(Vector3(0.0, 0.0, t)) * exp_rotation(Vector3(std::sin(t), 0.0, 0.0));
    };
    std::vector<CurveRow> rows;
    for (int i = -2; i * h < 1.0 + 3.0 * h; ++i) rows.push_back(row(i * h, x(i * h), q(i * h)));
    const MotionCurve curve(table(rows), {});
    double most = 0.0;
    for (double t = 0.0; t <= 1.0; t += 0.001) {
      const Pose pose = curve.at(t).pose;
      most = std::max({most, (pose.position - x(t)).norm(), angle_between(pose.orientation, q(t))});
    }
    return most;
  };
  EXPECT_NEAR(std::log2(error(0.05) / error(0.025)), 3.0, 0.2);
}

// Central differences: truncation of (1e-5)^2 times derivatives of some 1e4, and rounding of 1e-16/1e-5.
TEST(MotionCurve, ItsVelocitiesAndAccelerationsAreTheDerivatives) {
  const MotionCurve curve(winding_table(), kOffset);
  const double d = 1e-5;
  for (double t = 0.013; t < 2.0; t += 0.0531) {
    const MotionCurve::State before = curve.at(t - d), now = curve.at(t), after = curve.at(t + d);
    EXPECT_LT(((after.pose.position - before.pose.position) / (2.0 * d) - now.twist.linear).norm(), 1e-6) << t;
    const Vector3 turned =
        log_rotation(shorter_arc(after.pose.orientation * before.pose.orientation.conjugate())) / (2.0 * d);
    EXPECT_LT((turned - now.twist.angular).norm(), 1e-6) << t;
    EXPECT_LT(((after.twist.linear - before.twist.linear) / (2.0 * d) - now.change.linear).norm(), 1e-4) << t;
    EXPECT_LT(((after.twist.angular - before.twist.angular) / (2.0 * d) - now.change.angular).norm(), 1e-4) << t;
  }
}

TEST(MotionCurve, IsContinuousWithItsVelocitiesAtRows) {
  const std::vector<double> rows = winding_table().rows;
  const MotionCurve curve({rows}, kOffset);
  for (std::size_t i = 0; i < rows.size(); i += 8) {
    const MotionCurve::State before = curve.at(std::nextafter(rows[i], -1.0)), at = curve.at(rows[i]);
    // roundings, times velocities of 50 m/s and rad/s
    EXPECT_LT((before.pose.position - at.pose.position).norm(), 1e-13);
    EXPECT_LT(angle_between(before.pose.orientation, at.pose.orientation), 1e-13);
    EXPECT_LT((before.twist.linear - at.twist.linear).norm(), 1e-11);
    EXPECT_LT((before.twist.angular - at.twist.angular).norm(), 1e-11);
  }
}

TEST(MotionCurve, ARowThatStandsTwiceIsARest) {
  const Quaternion quarter(std::sqrt(0.5), 0.0, std::sqrt(0.5), 0.0);
  const MotionCurve curve(
      table({row(0, {0, 0, 0}, Quaternion::Identity()), row(1, {1, 0, 0}, quarter), row(2, {1, 0, 0}, quarter)}), {});
  for (const double t : {1.0, 1.3, 2.0, 50.0}) {
    EXPECT_EQ(curve.at(t).pose.position, Vector3(1, 0, 0)) << t;
    EXPECT_LT(angle_between(curve.at(t).pose.orientation, quarter), 1e-15) << t;
    EXPECT_EQ(curve.at(t).twist.linear, Vector3::Zero()) << t;
    EXPECT_EQ(curve.at(t).twist.angular, Vector3::Zero()) << t;
  }
}

// A door that turns about its hinge: the hinge stays, the centre of mass goes round it.
TEST(MotionCurve, TheFrameFollowsTheTableAndTheCentreOfMassWithIt) {
  const Vector3 w(0, 0, 1.5);
  std::vector<CurveRow> rows;
  for (const double t : {0.0, 0.5, 1.0}) rows.push_back(row(t, {1, 2, 3}, exp_rotation(t * w)));
  const MotionCurve curve(table(rows), kOffset);
  for (double t = 0.0; t < 1.0; t += 0.05) {
    const MotionCurve::State state = curve.at(t);
    EXPECT_LT((transform_point(state.pose, kOffset.position) - Vector3(1, 2, 3)).norm(), 1e-15 * 20.0) << t;
    const Vector3 arm = state.pose.position - Vector3(1, 2, 3);
    EXPECT_LT((state.twist.linear - w.cross(arm)).norm(), 1e-13) << t;
    EXPECT_LT((state.change.linear - w.cross(w.cross(arm))).norm(), 1e-12) << t;
  }
}

TEST(MotionCurve, TakesTheShorterWayWhateverTheSignOfAQuaternion) {
  const Quaternion small = exp_rotation(Vector3(0.2, 0, 0));
  const Quaternion minus(-small.w(), -small.x(), -small.y(), -small.z());
  const MotionCurve curve(table({row(0, {0, 0, 0}, Quaternion::Identity()), row(1, {0, 0, 0}, minus)}), {});
  EXPECT_LT((curve.at(0.5).twist.angular - Vector3(0.2, 0, 0)).norm(), 1e-15);
}

TEST(MotionCurve, OneRowStaysThere) {
  const MotionCurve curve(table({row(3, {1, 2, 3}, Quaternion::Identity())}), {});
  for (const double t : {0.0, 3.0, 10.0}) {
    EXPECT_EQ(curve.at(t).pose.position, Vector3(1, 2, 3));
    EXPECT_EQ(curve.at(t).twist.linear, Vector3::Zero());
  }
}

// Velocities are those of the poses and of what runs along, turned with the frame; the poses know nothing of it.
TEST(MotionCurve, ASurfaceRunsInItsFrame) {
  const MotionTable still = winding_table();
  const MotionTable belt{still.rows, Vector3(0.5, -1.0, 2.0)};
  const MotionCurve frame(still, {}), body(still, kOffset), carried(belt, kOffset);
  for (double t = 0.05; t < 2.0; t += 0.1) {
    const Quaternion turned = frame.at(t).pose.orientation;
    EXPECT_EQ(carried.at(t).pose.position, body.at(t).pose.position);
    EXPECT_EQ(carried.at(t).twist.angular, body.at(t).twist.angular);
    EXPECT_LT((carried.at(t).twist.linear - body.at(t).twist.linear - turned * belt.surface).norm(), 1e-14 * 100.0)
        << t;
    const double d = 1e-5;
    const Vector3 slope = (carried.at(t + d).twist.linear - carried.at(t - d).twist.linear) / (2.0 * d);
    EXPECT_LT((slope - carried.at(t).change.linear).norm(), 1e-4) << t;
  }
}

TEST(MotionCurve, NamesWhatIsWrongWithATable) {
  const Quaternion unit = Quaternion::Identity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(MotionCurve::find_problem(winding_table()), "");
  EXPECT_EQ(MotionCurve::find_problem({}), "it has no rows of time, position and orientation");
  EXPECT_EQ(MotionCurve::find_problem({std::vector<double>(9, 0.0)}),
            "it has no rows of time, position and orientation");
  EXPECT_EQ(MotionCurve::find_problem(table({row(0, {0, 0, 0}, unit), row(0, {1, 0, 0}, unit)})),
            "the time of row 1 does not ascend");
  EXPECT_EQ(MotionCurve::find_problem(table({row(0, {0, nan, 0}, unit)})), "row 0 has a number that is not finite");
  EXPECT_EQ(MotionCurve::find_problem(table({row(0, {0, 0, 0}, Quaternion(1, 1, 0, 0))})),
            "the orientation of row 0 is not unit");
}

}  // namespace
}  // namespace gravitas
