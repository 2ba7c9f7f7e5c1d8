// Discrepancies against what they are meant to be the derivative, the error or the sign of.
#include "plugin_sdk/discrepancy.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/constraint.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

using conformance::Draw;

// Two moving bodies and a discrepancy between them.
struct Pair {
  explicit Pair(Draw* random, double reach)
      : pose1(random->pose(3.0)),
        pose2(random->pose(3.0)),
        twist1{random->vector(2.0), random->vector(2.0)},
        twist2{random->vector(2.0), random->vector(2.0)} {
    d.point1 = random->vector(3.0);
    d.point2 = d.point1 + random->vector(reach);
    d.axes = random->rotation();
  }
  // The poses after a time t at constant velocities.
  Pose first(double t) const { return displaced(pose1, t * twist1.linear, t * twist1.angular); }
  Pose second(double t) const { return displaced(pose2, t * twist2.linear, t * twist2.angular); }
  Vector3 error(double t) const { return error_at(d, pose1, pose2, first(t), second(t)); }
  double row_velocity(const Vector3& axis) const {
    return jacobian_row(d, axis, pose1.position, pose2.position)
        .velocity(twist1.linear, twist1.angular, twist2.linear, twist2.angular);
  }

  Pose pose1, pose2;
  Twist twist1, twist2;
  Discrepancy d;
};

// Central difference of the error along `axis`: exact to h^2 times the third derivative (some
// hundreds here, from |w|^3 |r|) and to 1e-15 / h.
double error_rate(const Pair& pair, const Vector3& axis) {
  constexpr double h = 1e-5;
  return axis.dot(pair.error(h) - pair.error(-h)) / (2.0 * h);
}
constexpr double kDifferenceTolerance = 1e-7;

// ---- Jacobian -----------------------------------------------------------------------------------

TEST(DiscrepancyJacobian, IsTheRateOfAVanishingError) {
  Draw random(1);
  for (int i = 0; i < 500; ++i) {
    const Pair pair(&random, 0.0);
    const Vector3 axis = random.direction();
    EXPECT_NEAR(pair.row_velocity(axis), error_rate(pair, axis), kDifferenceTolerance);
  }
}

// With arms to the point midway the row leaves out a.((w1 + w2)/2 x e), which is first order in the
// error e, and nothing else.
TEST(DiscrepancyJacobian, DiffersFromTheRateByTheMeanTurnOfTheError) {
  Draw random(2);
  for (int i = 0; i < 500; ++i) {
    const Pair pair(&random, 0.5);
    const Vector3 axis = random.direction();
    const Vector3 error = pair.d.point2 - pair.d.point1;
    const Vector3 turn = 0.5 * (pair.twist1.angular + pair.twist2.angular);
    EXPECT_NEAR(pair.row_velocity(axis) + axis.dot(turn.cross(error)), error_rate(pair, axis), kDifferenceTolerance);
  }
}

TEST(DiscrepancyJacobian, GivesTheVelocityOfThePointOnBody2RelativeToBody1) {
  Discrepancy d;
  d.point1 = d.point2 = Vector3(1, 0, 0);
  const JacobianRow row = jacobian_row(d, Vector3::UnitY(), Vector3::Zero(), Vector3(2, 0, 0));
  const Vector3 up = Vector3::UnitY(), turn = Vector3::UnitZ(), none = Vector3::Zero();
  EXPECT_EQ(row.velocity(none, none, up, none), 1.0);
  EXPECT_EQ(row.velocity(up, none, none, none), -1.0);
  // the point lies in front of body 1 and behind body 2
  EXPECT_EQ(row.velocity(none, turn, none, none), -1.0);
  EXPECT_EQ(row.velocity(none, none, none, turn), -1.0);
}

TEST(DiscrepancyJacobian, AnImpulseAlongARowChangesNoMomentum) {
  Draw random(3);
  for (int i = 0; i < 200; ++i) {
    const Pair pair(&random, 1.0);
    const Vector3 axis = random.direction();
    const JacobianRow row = jacobian_row(pair.d, axis, pair.pose1.position, pair.pose2.position);
    EXPECT_TRUE((row.linear1 + row.linear2).isZero(0.0));
    const Vector3 about_origin =
        row.angular1 + pair.pose1.position.cross(row.linear1) + row.angular2 + pair.pose2.position.cross(row.linear2);
    // sums of products of size ten
    EXPECT_LT(about_origin.norm(), 1e-14);
  }
}

TEST(DiscrepancyJacobian, OfTheAngularTwinIsTheRateOfItsError) {
  Draw random(4);
  for (int i = 0; i < 500; ++i) {
    Pair pair(&random, 0.5);
    pair.d.modes |= kAngularDiscrepancy;
    const Vector3 axis = random.direction();
    EXPECT_NEAR(pair.row_velocity(axis), error_rate(pair, axis), kDifferenceTolerance);
    const JacobianRow row = jacobian_row(pair.d, axis, pair.pose1.position, pair.pose2.position);
    EXPECT_TRUE(row.linear1.isZero(0.0) && row.linear2.isZero(0.0));
    EXPECT_EQ(row.angular2, axis);
    EXPECT_EQ(row.angular1, Vector3(-axis));
  }
}

// ---- error at other poses -----------------------------------------------------------------------

TEST(DiscrepancyError, IsWhatWasWrittenAtTheSamePoses) {
  Draw random(5);
  for (int i = 0; i < 200; ++i) {
    const Pair pair(&random, 1.0);
    // a rotation and its inverse of vectors of size ten
    EXPECT_LT((pair.error(0.0) - (pair.d.point2 - pair.d.point1)).norm(), 1e-14);
  }
}

// And stays as it is along the axes, which turn, too.
TEST(DiscrepancyError, TurnsWithBothBodies) {
  Draw random(6);
  for (int i = 0; i < 200; ++i) {
    const Pair pair(&random, 1.0);
    const Pose moved = random.pose(5.0);
    const Pose then1 = compose(moved, pair.pose1), then2 = compose(moved, pair.pose2);
    const Vector3 now = pair.d.point2 - pair.d.point1;
    EXPECT_LT((error_at(pair.d, pair.pose1, pair.pose2, then1, then2) - moved.orientation * now).norm(), 1e-13);
    EXPECT_LT((error_in_axes_at(pair.d, pair.pose1, pair.pose2, then1, then2) - now).norm(), 1e-13);
  }
}

TEST(DiscrepancyError, OfTheAngularTwinCountsTheTurnsOfBothBodies) {
  Discrepancy d;
  d.modes |= kAngularDiscrepancy;
  d.point2 = Vector3(0, 0, 0.1);
  const Pose still;
  const auto turned = [](double angle) { return Pose{Vector3(7, 8, 9), exp_rotation(Vector3(0, 0, angle))}; };
  EXPECT_NEAR(error_at(d, still, still, still, turned(0.5)).z(), 0.6, 1e-15);
  EXPECT_NEAR(error_at(d, still, still, turned(0.5), still).z(), -0.4, 1e-15);
  EXPECT_NEAR(error_at(d, still, still, turned(-3.0), turned(-3.0)).z(), 0.1, 1e-15);
  // both names of one attitude are the same attitude
  Pose other_name = turned(0.5);
  other_name.orientation.coeffs() *= -1.0;
  EXPECT_NEAR(error_at(d, still, still, still, other_name).z(), 0.6, 1e-15);
}

// Of any turn, of either body: the angle is that of the directions themselves.
TEST(DiscrepancyError, OfASwingIsTheAngleThatItsDirectionsHave) {
  Draw random(11);
  for (int i = 0; i < 50; ++i) {
    const Vector3 first = random.direction(), second = random.direction();
    Discrepancy d;
    set_swing({first, second}, 0.7, &d);
    d.modes = pack_modes(AxisMode::kLocked, AxisMode::kFree, AxisMode::kFree) | kAngularDiscrepancy | kSwingDiscrepancy;
    EXPECT_LT((swing_directions(d).second - second).norm(), 1e-14);
    EXPECT_NEAR(held_angle(d), 0.7, 1e-15);
    const Pose now1 = random.pose(3.0), now2 = random.pose(3.0), then1 = random.pose(3.0), then2 = random.pose(3.0);
    const Vector3 turned1 = then1.orientation * (now1.orientation.conjugate() * first);
    const Vector3 turned2 = then2.orientation * (now2.orientation.conjugate() * second);
    // of directions that are nearly parallel an arc cosine knows half of the digits
    EXPECT_NEAR(joint_error(d, error_at(d, now1, now2, then1, then2)), std::fabs(std::acos(turned1.dot(turned2)) - 0.7),
                1e-12);
  }
}

// Of any turn that leaves the twist within half a turn of what it was: that of the shafts' frames, with the cosine of half the
// bend that there was.
TEST(DiscrepancyError, OfATwistIsTheAngleThatItsShaftsHave) {
  Draw random(12);
  for (int i = 0; i < 50; ++i) {
    const Quaternion frame1 = random.rotation(), bent = exp_rotation(random.vector(0.8)) * frame1;
    const Quaternion frame2 = exp_rotation(random.uniform(-2.0, 2.0) * (bent * Vector3::UnitX())) * bent;
    double scale = 0.0;
    const Discrepancy d = twist_row(frame1, frame2, AxisMode::kLocked, &scale);
    EXPECT_TRUE(is_valid_mode(d.modes));
    const double twist = twist_between(frame1, frame2);
    EXPECT_NEAR((d.axes * Vector3::UnitX()).dot(d.point2 - d.point1), scale * twist, 1e-14);
    const Twisting as_written = twisting_of(d);
    EXPECT_NEAR(as_written.angle, twist, 1e-13);
    EXPECT_LT((as_written.first - frame1 * Vector3::UnitX()).norm(), 1e-14);
    EXPECT_LT((as_written.second - frame2 * Vector3::UnitX()).norm(), 1e-14);
    const Pose now1 = random.pose(3.0), now2 = random.pose(3.0);
    const Quaternion turn1 = exp_rotation(random.vector(0.3)), turn2 = exp_rotation(random.vector(0.3));
    const Pose then1{now1.position, turn1 * now1.orientation}, then2{now2.position, turn2 * now2.orientation};
    EXPECT_NEAR(joint_error(d, error_at(d, now1, now2, then1, then2)),
                scale * std::fabs(twist_between(turn1 * frame1, turn2 * frame2)), 1e-13);
  }
}

TEST(DiscrepancyError, OfATwistGoesOnBeyondHalfATurn) {
  double scale = 0.0;
  const Discrepancy d = twist_row(Quaternion::Identity(), exp_rotation(Vector3(3.1, 0, 0)), AxisMode::kLocked, &scale);
  const Pose still, turned{Vector3::Zero(), exp_rotation(Vector3(0.1, 0, 0))};
  EXPECT_NEAR(error_at(d, still, still, still, turned).x(), 3.2, 1e-14);
  EXPECT_NEAR(error_at(d, still, still, turned, still).x(), 3.0, 1e-14);
}

// A component of a rotation vector, over the length of its gradient, which is what turning changes it by.
TEST(DiscrepancyError, OfAComponentIsThatOfTheRotationVector) {
  Draw random(13);
  for (int i = 0; i < 50; ++i) {
    const Quaternion frame1 = random.rotation(), frame2 = exp_rotation(random.vector(1.5)) * frame1;
    const auto component = [&](const Quaternion& one, const Quaternion& two) {
      return log_rotation(one.conjugate() * two).y();
    };
    const Discrepancy d = sprung_component(frame1, frame2, 1, {50.0, 2.0});
    EXPECT_TRUE(is_valid_mode(d.modes));
    const TurnComponent written = turn_component_of(d);
    const double length = written.gradient().norm();
    EXPECT_GE(length, 1.0 - 1e-15);
    EXPECT_NEAR((d.axes * Vector3::UnitX()).dot(d.point2 - d.point1) * length, component(frame1, frame2), 1e-14);
    EXPECT_NEAR(d.compliance.x() * 50.0 * length * length, 1.0, 1e-14);
    const Pose now1 = random.pose(3.0), now2 = random.pose(3.0);
    const Vector3 turn1 = random.vector(0.3), turn2 = random.vector(0.3);
    const auto turned = [&](double share) {
      const Pose then1{now1.position, exp_rotation(share * turn1) * now1.orientation};
      const Pose then2{now2.position, exp_rotation(share * turn2) * now2.orientation};
      return length * (d.axes * Vector3::UnitX()).dot(error_at(d, now1, now2, then1, then2));
    };
    EXPECT_NEAR(turned(1.0), component(exp_rotation(turn1) * frame1, exp_rotation(turn2) * frame2), 1e-13);
    const double rate = (turned(1e-5) - turned(-1e-5)) / 2e-5;
    EXPECT_NEAR(rate, written.gradient().dot(turn2 - turn1), kDifferenceTolerance);
  }
}

TEST(CarriedPoint, StaysWithItsBody) {
  Draw random(7);
  for (int i = 0; i < 200; ++i) {
    const Pose from = random.pose(3.0), to = random.pose(3.0);
    const Vector3 in_body = random.vector(2.0);
    const Vector3 there = carried(transform_point(from, in_body), from, to);
    EXPECT_LT((there - transform_point(to, in_body)).norm(), 1e-14);
    EXPECT_LT((carried(there, to, from) - transform_point(from, in_body)).norm(), 1e-14);
  }
  const Vector3 point(1, 2, 3);
  EXPECT_EQ(carried(point, Pose{}, Pose{}), point);
}

// ---- joint error --------------------------------------------------------------------------------

// Joint error of an error of (0.3, -0.4, 0.5) along the axes, the modes given one by one.
double joint_error_of(AxisMode x, AxisMode y, AxisMode z) {
  Draw random(8);
  Discrepancy d;
  d.axes = random.rotation();
  d.modes = pack_modes(x, y, z);
  d.lower = Vector3(-0.1, -0.1, -0.1);
  d.upper = Vector3(0.1, 0.1, 0.6);
  return joint_error(d, d.axes * Vector3(0.3, -0.4, 0.5));
}
constexpr double kCopyRounding = 1e-15;

TEST(JointError, IsTheNormOverLockedAxes) {
  using enum AxisMode;
  EXPECT_NEAR(joint_error_of(kLocked, kLocked, kLocked), std::sqrt(0.5), kCopyRounding);
  EXPECT_NEAR(joint_error_of(kLocked, kLocked, kFree), 0.5, kCopyRounding);
  EXPECT_NEAR(joint_error_of(kFree, kLocked, kFree), 0.4, kCopyRounding);
}

TEST(JointError, CountsLimitsWhereTheyAreExceeded) {
  using enum AxisMode;
  EXPECT_NEAR(joint_error_of(kLimited, kFree, kFree), 0.2, kCopyRounding);  // above
  EXPECT_NEAR(joint_error_of(kFree, kLimited, kFree), 0.3, kCopyRounding);  // below
  EXPECT_EQ(joint_error_of(kFree, kFree, kLimited), 0.0);                   // within
  EXPECT_NEAR(joint_error_of(kLimited, kLimited, kLimited), std::sqrt(0.13), kCopyRounding);
  Discrepancy unlimited;
  unlimited.modes = pack_modes(kLimited, kLimited, kLimited);
  unlimited.lower = Vector3::Constant(-kUnlimited);
  unlimited.upper = Vector3::Constant(kUnlimited);
  EXPECT_EQ(joint_error(unlimited, Vector3(1e9, -1e9, 0)), 0.0);
}

TEST(JointError, CountsAUnilateralAxisOnOneSide) {
  using enum AxisMode;
  EXPECT_EQ(joint_error_of(kUnilateral, kFree, kFree), 0.0);
  EXPECT_NEAR(joint_error_of(kFree, kUnilateral, kFree), 0.4, kCopyRounding);
}

// The same error between the same limits: how far it is from the nearer one.
TEST(LimitGaps, AreTheWaysToTheNearerLimits) {
  using enum AxisMode;
  Draw random(8);
  Discrepancy d;
  d.axes = random.rotation();
  d.point1 = Vector3(1, 2, 3);
  d.point2 = d.point1 + d.axes * Vector3(0.3, -0.4, 0.5);
  d.lower = Vector3(-0.1, -0.1, -0.1);
  d.upper = Vector3(0.1, kUnlimited, 0.6);
  d.modes = pack_modes(kLimited, kLimited, kLimited);
  EXPECT_LE((limit_gaps(d) - Vector3(-0.2, -0.3, 0.1)).norm(), 1e-14);
  d.modes = pack_modes(kUnilateral, kLocked, kDriven);
  EXPECT_NEAR(limit_gaps(d).x(), 0.3, 1e-14);
  EXPECT_EQ(limit_gaps(d).y(), kUnlimited);
  EXPECT_EQ(limit_gaps(d).z(), kUnlimited);
  // what gives way, and what leaves no room, is no limit
  d.modes = pack_modes(kLimited, kLimited, kLimited);
  d.compliance.x() = 1e-3;
  d.upper.z() = d.lower.z();
  EXPECT_EQ(limit_gaps(d).x(), kUnlimited);
  EXPECT_EQ(limit_gaps(d).z(), kUnlimited);
  // a rope of 1 m whose ends are sqrt(0.5) m apart
  d.compliance.setZero();
  d.modes = kRadialDiscrepancy | pack_modes(kLimited, kFree, kFree);
  d.lower.x() = -kUnlimited;
  d.upper.x() = 1.0;
  EXPECT_NEAR(limit_gaps(d).x(), 1.0 - std::sqrt(0.5), 1e-14);
}

TEST(JointError, KnowsNoErrorOfVelocityRows) {
  using enum AxisMode;
  EXPECT_EQ(joint_error_of(kFree, kFree, kFree), 0.0);
  EXPECT_EQ(joint_error_of(kDriven, kFriction, kFriction), 0.0);
}

// ---- contacts -----------------------------------------------------------------------------------

TEST(ContactDiscrepancy, PutsThePointsWhereTheSurfacesAre) {
  Draw random(9);
  for (int i = 0; i < 200; ++i) {
    const Vector3 point = random.vector(3.0), normal = random.direction();
    const double depth = random.uniform(-0.5, 0.5);
    const Discrepancy contact = contact_discrepancy(point, normal, depth);
    const Vector3 gap = contact.point2 - contact.point1;
    EXPECT_NEAR(gap.dot(normal), -depth, 1e-14);
    EXPECT_LT(gap.cross(normal).norm(), 1e-14);
    EXPECT_LT((0.5 * (contact.point1 + contact.point2) - point).norm(), 1e-15);
    // the first axis is the normal, the others are tangents
    const Matrix3 axes = contact.axes.toRotationMatrix();
    EXPECT_LT((axes.col(0) - normal).norm(), 1e-14);
    EXPECT_NEAR(axes.determinant(), 1.0, 1e-14);
    EXPECT_NEAR(joint_error(contact, gap), std::max(0.0, depth), 1e-14);
  }
}

TEST(ContactDiscrepancy, ModesAreUnilateralAlongTheNormalAndFrictionAcross) {
  const Discrepancy contact = contact_discrepancy(Vector3::Zero(), Vector3::UnitY(), 0.1);
  EXPECT_EQ(axis_mode(contact.modes, 0), AxisMode::kUnilateral);
  EXPECT_EQ(axis_mode(contact.modes, 1), AxisMode::kFriction);
  EXPECT_EQ(axis_mode(contact.modes, 2), AxisMode::kFriction);
  EXPECT_FALSE(contact.is_angular());
}

// A ball of radius 1 sunk by 0.1 into the ground y <= 0: lifting it, and a positive multiplier,
// make the gap larger.
TEST(ContactDiscrepancy, APositiveMultiplierParts) {
  const Pose ground, ball{Vector3(0, 0.9, 0), Quaternion::Identity()};
  const Discrepancy contact = contact_discrepancy(Vector3(0, -0.05, 0), Vector3::UnitY(), 0.1);
  Pose lifted = ball;
  lifted.position.y() += 0.25;
  EXPECT_NEAR(error_at(contact, ground, ball, ground, lifted).y(), -0.1 + 0.25, kCopyRounding);
  const JacobianRow row = jacobian_row(contact, Vector3::UnitY(), ground.position, ball.position);
  EXPECT_EQ(row.linear2, Vector3::UnitY());
  EXPECT_EQ(row.linear1, Vector3(-Vector3::UnitY()));
}

// ---- modes --------------------------------------------------------------------------------------

TEST(AxisModes, PackAndUnpack) {
  for (std::uint32_t x = 0; x <= 5; ++x) {
    for (std::uint32_t y = 0; y <= 5; ++y) {
      for (std::uint32_t z = 0; z <= 5; ++z) {
        for (const bool angular : {false, true}) {
          const auto mode = [](std::uint32_t code) { return static_cast<AxisMode>(code); };
          const std::uint32_t packed = pack_modes(mode(x), mode(y), mode(z), angular);
          EXPECT_EQ(axis_mode(packed, 0), mode(x));
          EXPECT_EQ(axis_mode(packed, 1), mode(y));
          EXPECT_EQ(axis_mode(packed, 2), mode(z));
          Discrepancy d;
          d.modes = packed;
          EXPECT_EQ(d.is_angular(), angular);
          EXPECT_TRUE(is_valid_mode(packed));
        }
      }
    }
  }
}

// Of all small codes exactly 6 * 6^3 are modes: plain, angular, radial, swing, twist, component.
TEST(AxisModes, OtherCodesAreInvalid) {
  int valid = 0;
  for (std::uint32_t code = 0; code < (1U << 18); ++code) valid += is_valid_mode(code) ? 1 : 0;
  EXPECT_EQ(valid, 1296);
  for (int bit = 14; bit < 32; ++bit) EXPECT_FALSE(is_valid_mode(1U << bit)) << bit;
  EXPECT_FALSE(is_valid_mode(kAngularDiscrepancy | kRadialDiscrepancy));
  EXPECT_FALSE(is_valid_mode(kRadialDiscrepancy | kSwingDiscrepancy));
  EXPECT_FALSE(is_valid_mode(0x006) || is_valid_mode(0x060) || is_valid_mode(0x600));
}

// ---- columns ------------------------------------------------------------------------------------

TEST(DiscrepancyColumns, GiveBackWhatWasPushed) {
  Draw random(10);
  std::vector<Discrepancy> given(3);
  for (Discrepancy& d : given) {
    d.point1 = random.vector(1.0), d.point2 = random.vector(1.0), d.velocity = random.vector(1.0);
    d.correction = random.uniform(0.0, 1.0);
    d.axes = random.rotation();
    d.modes = pack_modes(AxisMode::kDriven, AxisMode::kLimited, AxisMode::kFree, true);
    d.upper = random.vector(1.0), d.lower = d.upper - random.vector(1.0).cwiseAbs();
    d.compliance = random.vector(1.0).cwiseAbs(), d.damping = random.vector(1.0).cwiseAbs();
    d.maximum_force = random.vector(1.0).cwiseAbs();
    d.restitution = random.uniform(0.0, 1.0);
  }

  using Reply = stage::ConstraintDiscrepanciesReply;
  std::array<std::array<double, 12>, Reply::kColumnCount> numbers{};
  std::array<gravitas_reply_column, Reply::kColumnCount> columns{};
  for (std::size_t i = 0; i < columns.size(); ++i) columns[i] = {numbers[i].data(), 12, 0};
  for (std::size_t i = 0; i < given.size(); ++i) detail::push_discrepancy(Reply(columns.data()), i, given[i]);

  const auto real = [&](std::size_t c) {
    return std::span(static_cast<const double*>(columns[c].data), columns[c].count);
  };
  const DiscrepancyColumns read{
      real(Reply::kPoint1),
      real(Reply::kPoint2),
      real(Reply::kVelocity),
      real(Reply::kCorrection),
      real(Reply::kAxes),
      {static_cast<const std::uint32_t*>(columns[Reply::kMode].data), columns[Reply::kMode].count},
      real(Reply::kLower),
      real(Reply::kUpper),
      real(Reply::kCompliance),
      real(Reply::kDamping),
      real(Reply::kMaximumForce),
      real(Reply::kRestitution)};
  ASSERT_EQ(read.size(), given.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    const Discrepancy d = read.at(i), &g = given[i];
    EXPECT_TRUE(d.point1 == g.point1 && d.point2 == g.point2 && d.velocity == g.velocity);
    EXPECT_TRUE(d.correction == g.correction && d.axes.coeffs() == g.axes.coeffs());
    EXPECT_TRUE(d.modes == g.modes && d.lower == g.lower && d.upper == g.upper);
    EXPECT_TRUE(d.compliance == g.compliance && d.damping == g.damping);
    EXPECT_EQ(d.maximum_force, g.maximum_force);
    EXPECT_EQ(d.restitution, g.restitution);
    EXPECT_EQ(static_cast<const std::uint32_t*>(columns[Reply::kConstraint].data)[i], i);
  }
}

}  // namespace
}  // namespace gravitas
