// Constraints `Gear` and `Rack`: what is in mesh and by how much it is off it, wherever the line of centres turns.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

constexpr double kMeshRounding = 1e-12;  // of some tens of teeth at some metres

struct TeethOf {
  double one, two;
  bool is_internal;
};
constexpr TeethOf kMeshes[] = {{17, 23, false}, {20, 40, false}, {12, 48, true}, {48, 12, true}, {1, 1, false}};

class Meshing : public testing::Test {
 protected:
  // Turns a body about an axis through a point.
  static void turn(const Vector3& point, const Vector3& rotation, Pose* pose) {
    const Quaternion q = exp_rotation(rotation);
    *pose = {point + q * (pose->position - point), normalized(q * pose->orientation)};
  }
  static std::vector<double> flat(const std::vector<Vector3>& vectors) {
    std::vector<double> all;
    for (const Vector3& v : vectors) all.insert(all.end(), {v.x(), v.y(), v.z()});
    return all;
  }
  static void append(const std::vector<double>& more, std::vector<double>* all) {
    all->insert(all->end(), more.begin(), more.end());
  }
  // The place of the mesh, which is between the points.
  static Vector3 place(const Discrepancy& d, double one, double two) {
    return d.point2 - 0.5 * one * one / (one * one + two * two) * (d.point2 - d.point1);
  }
  static double error_along(const Discrepancy& d) { return to_rotation_matrix(d.axes).col(0).dot(d.point2 - d.point1); }

  conformance::Draw random_{5};
};

// Both wheels turn about their axes while the line between these turns about the first: N1 (a1 - l) = -N2 (a2 - l), and what body
// 2 turns beyond that is an arc at the pitch point.
TEST_F(Meshing, KnowsTheArcThatIsOffWhereverTheLineTurns) {
  PluginUnderTest plugin("constraint_gear");
  for (const TeethOf& teeth : kMeshes) {
    for (int i = 0; i < 20; ++i) {
      JointProblem joint(&plugin, "Gear");
      for (JointedBody& body : joint.bodies) body.pose = random_.pose(2.0);
      const Vector3 axis = random_.direction(), point1 = random_.vector(1.0), point2 = random_.vector(1.0);
      std::vector<double> properties = flat({2.0 * axis});
      append({teeth.one, teeth.two, teeth.is_internal ? 1.0 : 0.0}, &properties);
      append(flat({point1, point2}), &properties);
      append(std::vector<double>(3, std::nan("")), &properties);
      joint.bind(properties);
      const double line = random_.uniform(-9.0, 9.0), one = random_.uniform(-9.0, 9.0),
                   off = random_.uniform(-0.05, 0.05);
      const double second = teeth.is_internal ? -teeth.two : teeth.two;
      const double two = line - teeth.one / second * (one - line) + off;
      Vector3 moved = point2;
      turn(point1, one * axis, &joint.bodies[0].pose);
      Pose centre{point2, Quaternion::Identity()};
      turn(point1, line * axis, &centre);
      moved = centre.position;
      joint.bodies[1].pose.position += moved - point2;
      turn(moved, two * axis, &joint.bodies[1].pose);

      const std::vector<Discrepancy> all = joint.describe();
      ASSERT_EQ(all.size(), 1U);
      EXPECT_EQ(all[0].modes, pack_modes(AxisMode::kLocked, AxisMode::kFree, AxisMode::kFree));
      const double distance = axis.cross(point2 - point1).norm();
      const double arc = -distance * second / (teeth.one + second) * off;
      EXPECT_NEAR(error_along(all[0]), arc, kMeshRounding) << teeth.one << ":" << teeth.two;
      // the pitch point divides the line of centres as the teeth do, and its force acts across it
      const Vector3 tangent = to_rotation_matrix(all[0].axes).col(0);
      EXPECT_LT(
          (place(all[0], teeth.one, teeth.two) - (point1 + teeth.one / (teeth.one + second) * (moved - point1))).norm(),
          kMeshRounding);
      EXPECT_NEAR(tangent.dot(axis), 0.0, kMeshRounding);
      EXPECT_NEAR(tangent.dot(moved - point1), 0.0, kMeshRounding);
    }
  }
}

// What the loads of a step turned a wheel by may be several teeth: its velocity tells how many.
TEST_F(Meshing, TellsByTheVelocityWhichTeethMeet) {
  PluginUnderTest plugin("constraint_gear");
  for (const double of_step : {1.0, 0.5}) {
    JointProblem joint(&plugin, "Gear");
    joint.bodies[1].pose.position = Vector3(0.4, 0, 0);
    std::vector<double> properties = flat({Vector3::UnitZ()});
    append({40, 41, 0}, &properties);
    append(std::vector<double>(9, std::nan("")), &properties);
    joint.bind(properties);
    // 0.4 rad are 2.5 teeth; describe() tells of steps of 0.01 s
    turn(Vector3::Zero(), 0.4 * Vector3::UnitZ(), &joint.bodies[0].pose);
    joint.bodies[0].twist.angular = 0.4 / of_step / 0.01 * Vector3::UnitZ();
    EXPECT_NEAR(error_along(joint.describe()[0]), -0.4 * 0.4 * 40.0 / 81.0, kMeshRounding) << of_step;
  }
}

// Bevel wheels turn about axes that meet, and both about anything.
TEST_F(Meshing, KnowsTheArcOfBevelWheels) {
  PluginUnderTest plugin("constraint_gear");
  for (const TeethOf& teeth : {TeethOf{20, 20, false}, TeethOf{15, 40, false}, TeethOf{40, 15, false},
                               TeethOf{12, 48, true}, TeethOf{48, 12, true}}) {
    // the wheels are on this side of a mesh whose ring is body 2
    const double second = teeth.is_internal ? -teeth.two : teeth.two, side = teeth.one + second < 0.0 ? -1.0 : 1.0;
    int made = 0;
    for (int i = 0; i < 40; ++i) {
      JointProblem joint(&plugin, "Gear");
      for (JointedBody& body : joint.bodies) body.pose = random_.pose(2.0);
      const Vector3 apex = random_.vector(1.0), axis1 = random_.direction(), axis2 = random_.direction();
      // wheels of a cone length of 0.7 m, whose axes may be given either way
      const Vector3 line = second * axis1 + teeth.one * axis2, pitch = side * 0.7 * line.normalized();
      if (pitch.dot(axis1) < 0.05 || pitch.dot(axis2) < 0.05 || axis1.cross(axis2).norm() < 0.2) continue;
      std::vector<double> properties = flat({i % 2 == 0 ? axis1 : Vector3(-axis1)});
      append({teeth.one, teeth.two, teeth.is_internal ? 1.0 : 0.0}, &properties);
      append(flat({apex + pitch.dot(axis1) * axis1, apex + pitch.dot(axis2) * axis2, 3.0 * axis2}), &properties);
      joint.bind(properties);
      const double one = random_.uniform(-9.0, 9.0), off = random_.uniform(-0.02, 0.02);
      turn(apex, one * axis1, &joint.bodies[0].pose);
      turn(apex, (off - teeth.one / second * one) * axis2, &joint.bodies[1].pose);
      const Vector3 carry = random_.vector(2.0), about = random_.vector(1.0);
      for (JointedBody& body : joint.bodies) turn(about, carry, &body.pose);
      const Discrepancy d = joint.describe().at(0);
      // the pitch circle of body 2 turned by that
      const double radius = pitch.cross(axis2).norm();
      EXPECT_NEAR(std::fabs(error_along(d)), std::fabs(radius * off), kMeshRounding);
      EXPECT_LT((place(d, teeth.one, teeth.two) - (about + exp_rotation(carry) * (apex + pitch - about))).norm(),
                kMeshRounding);
      ++made;
    }
    EXPECT_GT(made, 4) << teeth.one << ":" << teeth.two;
  }
}

// Rows are the rates of errors wherever the axes are those of the mesh: whatever either body does next.
TEST_F(Meshing, RowsAreTheRatesOfTheErrors) {
  constexpr double kTime = 3e-6;
  const std::vector<double> absent(3, std::nan(""));
  std::vector<double> external = flat({Vector3::UnitZ()}), internal = external, bevel = external, rack = external;
  append({17, 23, 0}, &external), append({12, 48, 1}, &internal), append({12, 30, 0}, &bevel);
  append(flat({Vector3::Zero(), Vector3(0.4, 0.1, 0.3)}), &external), append(absent, &external);
  append(flat({Vector3::Zero(), Vector3(0.2, -0.1, 0.1)}), &internal), append(absent, &internal);
  append(flat({Vector3(0, 0, 0.4), Vector3(0.2, 0.1, 0), Vector3(2, 1, 0)}), &bevel);
  append(flat({Vector3::UnitX()}), &rack), append({20, 0.03}, &rack);
  append(flat({Vector3(0.1, 0.2, 0.3), Vector3(0, 1, 0)}), &rack);
  PluginUnderTest gear("constraint_gear"), straight("constraint_rack");
  for (const auto* properties : {&external, &internal, &bevel, &rack}) {
    for (int i = 0; i < 10; ++i) {
      JointProblem joint(properties == &rack ? &straight : &gear, properties == &rack ? "Rack" : "Gear");
      for (JointedBody& body : joint.bodies) body.pose = random_.pose(2.0);
      joint.bind(*properties);
      for (JointedBody& body : joint.bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
      const std::vector<JointedBody> now = joint.bodies;
      const Discrepancy d = joint.describe().at(0);
      const double rate = joint.row_velocity(d, to_rotation_matrix(d.axes).col(0));
      const auto error = [&](double time) {
        for (std::size_t b = 0; b < 2; ++b)
          joint.bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
        return error_along(joint.describe().at(0));
      };
      EXPECT_NEAR((error(kTime) - error(-kTime)) / (2.0 * kTime), rate, 1e-8);
    }
  }
}

TEST_F(Meshing, KnowsTheWayOfARack) {
  PluginUnderTest plugin("constraint_rack");
  for (const double side : {1.0, -1.0}) {
    for (int i = 0; i < 20; ++i) {
      JointProblem joint(&plugin, "Rack");
      for (JointedBody& body : joint.bodies) body.pose = random_.pose(2.0);
      const Vector3 axis = random_.direction(), along = axis.cross(random_.direction()).normalized();
      const Vector3 normal = side * axis.cross(along), point = random_.vector(1.0);
      std::vector<double> properties = flat({axis, 3.0 * along});
      append({20, 0.03}, &properties);
      append(flat({point, point + 0.2 * normal + 0.7 * along}), &properties);
      joint.bind(properties);
      const double radius = 0.3 / std::numbers::pi, angle = random_.uniform(-9.0, 9.0),
                   off = random_.uniform(-0.01, 0.01);
      turn(point, angle * axis, &joint.bodies[0].pose);
      // where the rim is, it goes by the turn times axis x normal
      joint.bodies[1].pose.position += (radius * angle + off) * axis.cross(normal);
      // and all of it is carried about
      const Vector3 carry = random_.vector(2.0), about = random_.vector(1.0);
      for (JointedBody& body : joint.bodies) turn(about, carry, &body.pose);
      const Discrepancy d = joint.describe()[0];
      const Vector3 way = exp_rotation(carry) * axis.cross(normal);
      EXPECT_LT((d.point2 - d.point1 - off * way).norm(), kMeshRounding);
      const Vector3 pitch = about + exp_rotation(carry) * (point + radius * normal - about);
      EXPECT_LT((d.point2 - pitch).norm(), kMeshRounding);
    }
  }
}

}  // namespace
}  // namespace gravitas::test
