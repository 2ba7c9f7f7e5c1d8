// Cylinders and capsules in water and wind against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/force/force_problem.h"
#include "workers/force/buoyancy/submerged.h"

namespace gravitas::test {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi, kHalf = std::numbers::pi;
constexpr double kRadius = 0.4, kHeight = 1.5;
const Vector3 kAbove(0, 1, 0);

Submerged capsule_at(const Pose& pose, double level = 0.0) {
  return submerged_capsule(kRadius, kHeight, pose, kAbove, level);
}
Submerged cylinder_at(const Pose& pose, double level = 0.0) {
  return submerged_cylinder(kRadius, kHeight, pose, kAbove, level);
}

// Volume of a ball up to a height over its centre, and its moment there.
double ball_below(double top) {
  return kHalf * (kRadius * kRadius * top - top * top * top / 3.0 + 2.0 / 3.0 * std::pow(kRadius, 3));
}
double ball_moment(double top) {
  return 0.5 * kHalf * kRadius * kRadius * (top * top - kRadius * kRadius) -
         0.25 * kHalf * (std::pow(top, 4) - std::pow(kRadius, 4));
}

TEST(RoundSubmerged, StandingCapsuleIsCapsAndACylinder) {
  const double whole = kHalf * kRadius * kRadius * (kHeight + 4.0 / 3.0 * kRadius);
  for (const bool is_turned : {false, true})
    for (const double depth : {-0.1, 0.01, 0.2, 0.4, 0.41, 1.0, 1.9, 2.0, 2.29, 2.3, 3.0}) {
      const double lowest = -depth, low = lowest + kRadius, high = low + kHeight;  // of the balls' centres
      const double low_top = std::clamp(-low, -kRadius, 0.0), high_top = std::clamp(-high, 0.0, kRadius);
      const double side = std::clamp(-low, 0.0, kHeight), area = kHalf * kRadius * kRadius;
      double volume = ball_below(low_top) + area * side,
             moment = ball_moment(low_top) + low * volume + 0.5 * area * side * side;
      // the upper half of its ball
      const double top_volume = ball_below(high_top) - ball_below(0.0),
                   top_moment = ball_moment(high_top) - ball_moment(0.0);
      volume += top_volume, moment += top_moment + high * top_volume;
      const Pose pose{Vector3(3, 0.5 * (low + high), -2),
                      is_turned ? exp_rotation(Vector3(0, 0, kHalf)) : exp_rotation(Vector3(0, 0.7, 0))};
      const Submerged part = capsule_at(pose);
      EXPECT_NEAR(part.volume, std::max(volume, 0.0), 1e-15) << depth;
      EXPECT_NEAR(part.whole_volume, whole, 1e-15);
      if (depth > 0.0) {
        EXPECT_NEAR(part.volume * part.centre.y(), moment, 2e-15) << depth;
        EXPECT_LT(Vector3(part.centre.x() - 3, 0, part.centre.z() + 2).norm(), 1e-14) << depth;
      }
    }
}

// The half balls of one that lies make a ball, whose cap is under water beside the cylinder's segment.
TEST(RoundSubmerged, LyingCapsuleIsABallsCapAndASegment) {
  for (const double z : {-0.5, -0.39, -0.1, 0.0, 0.25, 0.3999, 0.5}) {
    const double top = std::clamp(-z, -kRadius, kRadius), chord = std::sqrt(kRadius * kRadius - top * top);
    const double segment = kRadius * kRadius * (0.5 * kHalf + std::atan2(top, chord)) + top * chord;
    const double volume = kHeight * segment + ball_below(top);
    const double moment = ball_moment(top) - kHeight * 2.0 / 3.0 * std::pow(chord, 3);
    for (const double tilt : {0.5 * kHalf, -0.5 * kHalf}) {
      const Submerged part = capsule_at({Vector3(0, z, 0), exp_rotation(Vector3(0, 0, tilt))});
      EXPECT_NEAR(part.volume, volume, 1e-14) << z;
      EXPECT_NEAR(part.volume * (part.centre.y() - z), moment, 1e-14) << z;
    }
  }
  const Submerged half = capsule_at({Vector3(1, 0, 2), exp_rotation(Vector3(0.5 * kHalf, 0, 0))});
  EXPECT_NEAR(half.volume, 0.5 * half.whole_volume, 1e-15);
  EXPECT_LT(Vector3(half.centre - Vector3(1, half.centre.y(), 2)).norm(), 1e-15);
}

// A plane through a diameter of a cylinder's base cuts off a hoof of 2/3 r^2 h, with h its height at the rim.
TEST(RoundSubmerged, CylinderOnItsRimIsAHoof) {
  for (const double tilt : {0.1, 0.5, 1.0}) {
    const double rim = kRadius * std::tan(tilt);
    const Quaternion turn = exp_rotation(Vector3(0, 0, tilt));
    // the base's middle in the plane; its part below the plane rises from the base by `rim`
    const Submerged part = cylinder_at({turn * Vector3(0, 0.5 * kHeight, 0), turn});
    EXPECT_NEAR(part.volume, 2.0 / 3.0 * kRadius * kRadius * rim, 1e-15) << tilt;
    // its centroid: 3 pi r/16 from the diameter, 3 pi h/32 over the base
    const Vector3 centre = turn.conjugate() * part.centre;
    EXPECT_NEAR(std::fabs(centre.x()), 3.0 * kHalf * kRadius / 16.0, 1e-13) << tilt;
    EXPECT_NEAR(centre.y(), 3.0 * kHalf * rim / 32.0, 1e-13) << tilt;
  }
}

// A plane through both sides cuts as one across the axis at its height there: volume and, across, r^2 tan/4 of a shift.
TEST(RoundSubmerged, CutAcrossTheSideIsThatOfTheMiddle) {
  for (const double tilt : {0.0, 1e-9, 1e-4, 0.3, 0.8})
    for (const double along : {-0.2, 0.0, 0.1}) {
      const Quaternion turn = exp_rotation(Vector3(0, 0, tilt));
      const Vector3 axis = turn * Vector3::UnitY();
      const Pose pose{-along * axis, turn};
      const double length = 0.5 * kHeight + along;
      const Submerged part = cylinder_at(pose), capsule = capsule_at(pose);
      const double area = kHalf * kRadius * kRadius, below = 2.0 / 3.0 * area * kRadius;
      EXPECT_NEAR(part.volume, area * length, 1e-15) << tilt;
      EXPECT_NEAR(capsule.volume, area * length + below, 1e-15) << tilt;
      const Vector3 local = turn.conjugate() * (part.centre - pose.position);
      EXPECT_NEAR(std::fabs(local.x()), 0.25 * kRadius * kRadius * std::tan(tilt) / length, 1e-14) << tilt;
      EXPECT_NEAR(local.y(), 0.5 * (along - 0.5 * kHeight) + 0.125 * std::pow(kRadius * std::tan(tilt), 2) / length,
                  1e-14);
    }
}

TEST(RoundSubmerged, PartsMakeTheWhole) {
  conformance::Draw random(1);
  for (int i = 0; i < 2000; ++i) {
    const Pose pose = random.pose(0.7);
    Vector3 up = random.direction();
    const Vector3 axis = pose.orientation * Vector3::UnitY();
    // nearly along the axis, nearly across
    if (i % 4 == 1) up = (axis + 1e-6 * up).normalized();
    if (i % 4 == 2) up = (up - up.dot(axis) * axis + 1e-9 * axis).normalized();
    for (const auto& solid : {submerged_capsule, submerged_cylinder}) {
      const Submerged below = solid(kRadius, kHeight, pose, up, 0.1), above = solid(kRadius, kHeight, pose, -up, -0.1);
      EXPECT_NEAR(below.volume + above.volume, below.whole_volume, 2e-15) << i;
      const Vector3 moment =
          below.volume * (below.centre - pose.position) + above.volume * (above.centre - pose.position);
      EXPECT_LT(moment.norm(), 2e-15) << i;
    }
  }
}

// Without height it is a ball.
TEST(RoundSubmerged, CapsuleWithoutHeightIsABall) {
  conformance::Draw random(2);
  constexpr double kNoHeight = 1e-12;
  for (int i = 0; i < 500; ++i) {
    const Pose pose = random.pose(0.5);
    const Vector3 up = random.direction();
    const Submerged capsule = submerged_capsule(kRadius, kNoHeight, pose, up, 0.1);
    const Submerged ball = submerged_ball(pose.position, kRadius, up, 0.1);
    EXPECT_NEAR(capsule.volume, ball.volume, 2.0 * kNoHeight) << i;
    EXPECT_LT(
        Vector3(capsule.volume * (capsule.centre - pose.position) - ball.volume * (ball.centre - pose.position)).norm(),
        2.0 * kNoHeight)
        << i;
  }
}

// The volume changes with the level by the area of the water plane, and the moment by that of the same: two levels near each other.
TEST(RoundSubmerged, RisesByItsWaterPlane) {
  conformance::Draw random(3);
  for (int i = 0; i < 500; ++i) {
    const Pose pose = random.pose(0.4);
    const Vector3 up = random.direction();
    constexpr double kStep = 1e-5;
    for (const auto& solid : {submerged_capsule, submerged_cylinder}) {
      const auto at = [&](double level) { return solid(kRadius, kHeight, pose, up, level); };
      const Submerged low = at(-kStep), high = at(kStep);
      const double area = (high.volume - low.volume) / (2.0 * kStep);
      const double moment = up.dot(high.volume * high.centre - low.volume * low.centre) / (2.0 * kStep);
      // the plane is at 0; the third derivative of the volume is some 1/m where no end is touched
      EXPECT_NEAR(moment, 0.0, 1e-8 + kStep * kStep * area) << i;
      EXPECT_GE(area, 0.0);
    }
  }
}

// ---- forces

ForceAnswer answer_of(PluginUnderTest* plugin, const char* type, const std::vector<double>& properties,
                      const ForceShape& shape, ForcedBody body) {
  ForceProblem problem{0.0, {type_id(type)}, {properties}, {body}, {0, 0}};
  problem.shapes = {shape};
  problem.bodies[0].shape = 0;
  return ask_wrenches(plugin, problem).at(0);
}

// Standing with `dip` of its lower half ball in water it weighs pi h^2 (3r - h)/3.
TEST(RoundBuoyancy, CapsuleIsAtRestAtItsDepth) {
  PluginUnderTest force("force_buoyancy");
  for (const double dip : {0.01, 0.1, 0.4}) {
    ForcedBody body;
    body.pose.position.y() = 0.5 * kHeight + kRadius - dip;
    const ForceAnswer answer = answer_of(&force, "Buoyancy", {1000, 0, 0, -10, 0, 0, 0, 0, 0, 0, 0},
                                         {type_id("Capsule"), {kRadius, kHeight}}, body);
    EXPECT_NEAR(answer.wrench.force.y(), 1e4 * kHalf * dip * dip * (3.0 * kRadius - dip) / 3.0, 1e-11) << dip;
    EXPECT_LT(answer.wrench.torque.norm(), 1e-11);
  }
}

Wrench in_wind(PluginUnderTest* plugin, const char* shape, const ForcedBody& body) {
  return answer_of(plugin, "Aerodynamic", {2, 0, 0, 0, 1}, {type_id(shape), {kRadius, kHeight}}, body).wrench;
}

TEST(RoundAerodynamic, IsThatOfItsSections) {
  PluginUnderTest force("force_aerodynamic");
  const double ball = 0.5 * kHalf * kRadius * kRadius, side = 4.0 / 3.0 * kRadius * kHeight;
  ForcedBody body;
  body.twist.linear = Vector3(0, 3, 0);
  EXPECT_LT((in_wind(&force, "Capsule", body).force + 9.0 * ball * kAbove).norm(), 1e-14);
  EXPECT_LT((in_wind(&force, "Cylinder", body).force + 9.0 * 2.0 * ball * kAbove).norm(), 1e-14);
  body.twist.linear = Vector3(0, 0, -3);
  EXPECT_LT((in_wind(&force, "Capsule", body).force - 9.0 * (ball + side) * Vector3::UnitZ()).norm(), 1e-14);
  EXPECT_LT((in_wind(&force, "Cylinder", body).force - 9.0 * side * Vector3::UnitZ()).norm(), 1e-14);
  // spins on its axis
  body.twist = {Vector3::Zero(), Vector3(0, 7, 0)};
  for (const char* shape : {"Capsule", "Cylinder"}) {
    EXPECT_LT(in_wind(&force, shape, body).force.norm(), 1e-14);
    EXPECT_LT(in_wind(&force, shape, body).torque.norm(), 1e-14);
  }
}

// About its middle, end over end: 4/3 r w^2 integral of |t|^3, the half balls pi r^2/4 (w a)^2 at the arm a, the discs w^2 4/15 r^5.
TEST(RoundAerodynamic, ResistsTurning) {
  PluginUnderTest force("force_aerodynamic");
  constexpr double kRate = 3.0, kArm = 0.5 * kHeight;
  ForcedBody body;
  body.twist.angular = Vector3(kRate, 0, 0);
  const double side = 4.0 / 3.0 * kRadius * 0.5 * std::pow(kArm, 4);
  const double balls = 2.0 * kArm * 0.25 * kHalf * kRadius * kRadius * kArm * kArm;
  const double discs = 2.0 * 4.0 / 15.0 * std::pow(kRadius, 5);
  EXPECT_NEAR(in_wind(&force, "Capsule", body).torque.x(), -kRate * kRate * (side + balls), 1e-13);
  EXPECT_NEAR(in_wind(&force, "Cylinder", body).torque.x(), -kRate * kRate * (side + discs), 1e-13);
  EXPECT_LT(in_wind(&force, "Cylinder", body).force.norm(), 1e-14);
}

// Midpoints on a fine grid of the faces; what is summed is (n.u)^2 where that looks into the motion, which has no kink in its slope.
TEST(RoundAerodynamic, IsTheSumOverItsFaces) {
  PluginUnderTest force("force_aerodynamic");
  conformance::Draw random(4);
  constexpr int kGrid = 100;
  for (int i = 0; i < 24; ++i) {
    ForcedBody body;
    body.pose.orientation = random.rotation();
    body.geometry = random.pose(0.3);
    // fast turns about points near the axis, where the velocity across it vanishes, and slow ones
    body.twist = {random.vector(2.0), random.vector(i % 3 == 0 ? 0.1 : 5.0)};
    const Pose geometry = compose({Vector3::Zero(), body.pose.orientation}, body.geometry);
    for (const bool is_capsule : {true, false}) {
      Wrench sum;
      const auto add = [&](const Vector3& local, const Vector3& normal, double area) {
        const Vector3 point = transform_point(geometry, local), n = geometry.orientation * normal;
        const double speed = std::max(0.0, n.dot(body.twist.linear + body.twist.angular.cross(point)));
        const Vector3 push = -speed * speed * area * n;
        sum.force += push;
        sum.torque += point.cross(push);
      };
      for (int j = 0; j < kGrid; ++j)
        for (int k = 0; k < kGrid; ++k) {
          const double angle = kTurn * (j + 0.5) / kGrid, share = (k + 0.5) / kGrid;
          const Vector3 out(std::cos(angle), 0, std::sin(angle));
          add(kRadius * out + (share - 0.5) * kHeight * kAbove, out, kTurn * kRadius * kHeight / (kGrid * kGrid));
          for (const double end : {-1.0, 1.0}) {
            const Vector3 middle = end * 0.5 * kHeight * kAbove;
            const double sine = std::sqrt(1.0 - share * share);
            const Vector3 normal = sine * out + end * share * kAbove;
            if (is_capsule)
              add(middle + kRadius * normal, normal, kTurn * kRadius * kRadius / (kGrid * kGrid));
            else
              add(middle + share * kRadius * out, end * kAbove, share * kTurn * kRadius * kRadius / (kGrid * kGrid));
          }
        }
      const Wrench w = in_wind(&force, is_capsule ? "Capsule" : "Cylinder", body);
      EXPECT_LT((w.force - sum.force).norm(), 1e-4 * sum.force.norm()) << i << is_capsule;
      EXPECT_LT((w.torque - sum.torque).norm(), 1e-4 * (sum.torque.norm() + sum.force.norm())) << i << is_capsule;
    }
  }
}

}  // namespace
}  // namespace gravitas::test
