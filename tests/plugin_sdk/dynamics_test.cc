// Newton-Euler against conservation laws and closed forms.
#include "plugin_sdk/dynamics.h"

#include <gtest/gtest.h>

#include <cstring>
#include <numbers>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

using conformance::Draw;

struct Rotor {
  explicit Rotor(Draw* random) : inertia(), q(random->rotation()), w(random->vector(3.0)) {
    for (int k = 0; k < 3; ++k) inertia[k] = random->uniform(0.2, 3.0);
  }
  Vector3 acceleration(const Vector3& torque) const {
    return angular_acceleration(q, w, inertia, inertia.cwiseInverse(), torque);
  }
  Vector3 inertia;
  Quaternion q;
  Vector3 w;
};

bool same_bits(const Pose& a, const Pose& b) {
  return std::memcmp(a.position.data(), b.position.data(), 3 * sizeof(double)) == 0 &&
         std::memcmp(a.orientation.coeffs().data(), b.orientation.coeffs().data(), 4 * sizeof(double)) == 0;
}

// ---- angular acceleration -----------------------------------------------------------------------

// d/dt (I_w w) = tau, by central differences of the momentum along the motion: exact to h^2 times
// its third derivative (below 1e4 here) and to 1e-15 / h.
TEST(AngularAcceleration, MakesTheTorqueTheRateOfAngularMomentum) {
  Draw random(1);
  constexpr double h = 1e-5;
  for (int i = 0; i < 500; ++i) {
    const Rotor rotor(&random);
    const Vector3 torque = random.vector(5.0);
    const Vector3 alpha = rotor.acceleration(torque);
    const auto momentum = [&](double t) -> Vector3 {
      const Vector3 w = rotor.w + t * alpha;
      // the attitude to second order: turned by the mean velocity
      const Quaternion q = rotate_by(rotor.q, t * (rotor.w + 0.5 * t * alpha));
      return angular_momentum(0.0, rotor.inertia, {Vector3::Zero(), q}, {Vector3::Zero(), w});
    };
    const Vector3 rate = (momentum(h) - momentum(-h)) / (2.0 * h);
    EXPECT_LT((rate - torque).norm(), 1e-6);
  }
}

// The gyroscopic term does no work: dE/dt = tau.w.
TEST(AngularAcceleration, MakesTheTorquesPowerTheRateOfEnergy) {
  Draw random(2);
  for (int i = 0; i < 500; ++i) {
    const Rotor rotor(&random);
    const Vector3 torque = random.vector(5.0);
    const double power = (world_inertia(rotor.q, rotor.inertia) * rotor.acceleration(torque)).dot(rotor.w);
    // w.(w x L) is zero but for rounding in terms of size 100
    EXPECT_NEAR(power, torque.dot(rotor.w), 1e-12);
  }
}

TEST(AngularAcceleration, IsTorqueOverMomentWhereNothingIsGyroscopic) {
  const Vector3 ball = Vector3::Constant(0.5), w(1, 2, 3);
  const Quaternion turned = exp_rotation(Vector3(0.3, -0.2, 0.9));
  EXPECT_EQ(angular_acceleration(turned, w, ball, ball.cwiseInverse(), Vector3(1, 0, -1)), Vector3(2, 0, -2));
  // about a principal axis
  const Vector3 moments(1, 2, 4);
  EXPECT_EQ(
      angular_acceleration(Quaternion::Identity(), Vector3(0, 0, 5), moments, moments.cwiseInverse(), Vector3(0, 0, 8)),
      Vector3(0, 0, 2));
}

TEST(AngularAcceleration, DoesNotTurnWhatCannotBeTurned) {
  EXPECT_EQ(angular_acceleration(Quaternion::Identity(), Vector3(1, 2, 3), Vector3::Zero(), Vector3::Zero(),
                                 Vector3(4, 5, 6)),
            Vector3::Zero());
}

// Its z axis, which points along -y of the world, is locked.
TEST(AngularAcceleration, KeepsALockedAxisOfABall) {
  const Quaternion turned = exp_rotation(Vector3(std::numbers::pi / 2, 0, 0));
  const Vector3 acceleration =
      angular_acceleration(turned, Vector3(4, 5, 6), Vector3::Ones(), Vector3(1, 1, 0), Vector3(1, 2, 3));
  EXPECT_LT((acceleration - Vector3(1, 0, 3)).norm(), 1e-15);
}

// ---- displacement -------------------------------------------------------------------------------

TEST(Displaced, ByNothingIsTheSamePoseBitForBit) {
  Draw random(3);
  for (int i = 0; i < 200; ++i) {
    Pose pose = random.pose(5.0);
    pose.orientation.coeffs() *= 1.0 + random.uniform(-1e-6, 1e-6);  // not even renormalised
    if (i % 2 == 0) pose.position.y() = -0.0;
    const Vector3 nothing = i % 3 == 0 ? Vector3(-0.0, 0.0, -0.0) : Vector3::Zero();
    EXPECT_TRUE(same_bits(displaced(pose, nothing, nothing), pose));
  }
}

TEST(Displaced, MovesAndTurnsInWorldAxes) {
  const Pose pose{Vector3(1, 2, 3), exp_rotation(Vector3(0, 0, 0.5))};
  const Pose moved = displaced(pose, Vector3(0.5, 0, -1), Vector3(0, 0, 0.25));
  EXPECT_EQ(moved.position, Vector3(1.5, 2, 2));
  EXPECT_LT((log_rotation(moved.orientation) - Vector3(0, 0, 0.75)).norm(), 1e-15);
  // the turn is about a world axis, not one of the body
  const Pose tipped =
      displaced({Vector3::Zero(), exp_rotation(Vector3(1.2, 0, 0))}, Vector3::Zero(), Vector3(0, 0.7, 0));
  const Vector3 expected =
      exp_rotation(Vector3(0, 0.7, 0)) * (exp_rotation(Vector3(1.2, 0, 0)) * Vector3(0.1, 0.2, 0.3));
  EXPECT_LT((tipped.orientation * Vector3(0.1, 0.2, 0.3) - expected).norm(), 1e-15);
}

TEST(Displaced, KeepsAttitudesUnit) {
  Draw random(4);
  Pose pose = random.pose(1.0);
  for (int i = 0; i < 10000; ++i) pose = displaced(pose, random.vector(1.0), random.vector(2.0));
  EXPECT_NEAR(pose.orientation.norm(), 1.0, 1e-15);
}

TEST(Displaced, ATranslationAloneLeavesTheAttitudeAlone) {
  Draw random(5);
  const Pose pose = random.pose(5.0);
  Pose expected = pose;
  expected.position += Vector3(1, 0, 0);
  EXPECT_TRUE(same_bits(displaced(pose, Vector3(1, 0, 0), Vector3::Zero()), expected));
}

// ---- impulses, energy, momentum -----------------------------------------------------------------

TEST(AfterImpulse, ChangesMomentumByTheImpulse) {
  Draw random(6);
  for (int i = 0; i < 500; ++i) {
    const Rotor rotor(&random);
    const double mass = random.uniform(0.5, 4.0);
    const Pose pose{random.vector(3.0), rotor.q};
    const Twist before{random.vector(2.0), rotor.w};
    const Vector3 impulse = random.vector(3.0), arm = random.vector(1.0);
    const Twist after =
        after_impulse(before, rotor.q, 1.0 / mass, rotor.inertia.cwiseInverse(), impulse, arm.cross(impulse));
    EXPECT_LT((mass * (after.linear - before.linear) - impulse).norm(), 1e-14);
    const Vector3 gained =
        angular_momentum(mass, rotor.inertia, pose, after) - angular_momentum(mass, rotor.inertia, pose, before);
    EXPECT_LT((gained - (pose.position + arm).cross(impulse)).norm(), 1e-13);
    // work of an impulse: impulse times the mean velocity of its point
    const Vector3 mean = 0.5 * (before.linear + after.linear) + 0.5 * (before.angular + after.angular).cross(arm);
    EXPECT_NEAR(
        kinetic_energy(mass, rotor.inertia, rotor.q, after) - kinetic_energy(mass, rotor.inertia, rotor.q, before),
        impulse.dot(mean), 1e-12);
  }
}

TEST(AfterImpulse, DoesNotMoveTheImmovable) {
  const Twist before{Vector3(1, 2, 3), Vector3(4, 5, 6)};
  const Twist after =
      after_impulse(before, Quaternion::Identity(), 0.0, Vector3::Zero(), Vector3(7, 8, 9), Vector3(1, 1, 1));
  EXPECT_EQ(after.linear, before.linear);
  EXPECT_EQ(after.angular, before.angular);
}

TEST(KineticEnergy, IsThatOfMotionAndOfSpin) {
  const Vector3 moments(1, 2, 4);
  EXPECT_EQ(kinetic_energy(3.0, moments, Quaternion::Identity(), {Vector3(1, 2, 2), {0, 0, 0}}), 13.5);
  EXPECT_EQ(kinetic_energy(3.0, moments, Quaternion::Identity(), {Vector3::Zero(), {1, 1, 1}}), 3.5);
  // turned by a quarter about z, the body's x axis points along the world's y
  const Quaternion quarter = exp_rotation(Vector3(0, 0, 1.5707963267948966));
  EXPECT_NEAR(kinetic_energy(3.0, moments, quarter, {Vector3::Zero(), {0, 1, 0}}), 0.5, 1e-15);
}

TEST(AngularMomentum, CountsTheOrbitAndTheSpin) {
  const Pose pose{Vector3(2, 0, 0), Quaternion::Identity()};
  EXPECT_EQ(angular_momentum(3.0, Vector3(1, 2, 4), pose, {Vector3(0, 5, 0), Vector3(1, 1, 1)}), Vector3(1, 2, 34));
}

// ---- bounds -------------------------------------------------------------------------------------

// Rounding of sums of numbers below ten.
constexpr double kBoundsRounding = 1e-14;

TEST(BoxBounds, ContainEveryPointAndTouchACornerOnEachSide) {
  Draw random(7);
  for (int i = 0; i < 300; ++i) {
    const Pose body = random.pose(3.0);
    const Vector3 centre = random.vector(1.0);
    const Quaternion turned = random.rotation();
    const Vector3 half = random.vector(2.0).cwiseAbs();
    const Bounds bounds = box_bounds(body, centre, turned, half);

    Vector3 lowest = Vector3::Constant(1e9), highest = -lowest;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 signs(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const Vector3 p = transform_point(body, centre + turned * half.cwiseProduct(signs));
      lowest = lowest.cwiseMin(p), highest = highest.cwiseMax(p);
    }
    EXPECT_LT((bounds.lower - lowest).norm(), kBoundsRounding);
    EXPECT_LT((bounds.upper - highest).norm(), kBoundsRounding);

    for (int k = 0; k < 20; ++k) {
      const Vector3 inside = half.cwiseProduct(random.vector(1.0));
      const Vector3 p = transform_point(body, centre + turned * inside);
      EXPECT_GE((p - bounds.lower).minCoeff(), -kBoundsRounding);
      EXPECT_GE((bounds.upper - p).minCoeff(), -kBoundsRounding);
    }
  }
}

TEST(BoxBounds, OfAnUprightBoxAreItself) {
  const Bounds bounds = box_bounds({Vector3(1, 2, 3), Quaternion::Identity()}, Vector3(0, 0, 1), Quaternion::Identity(),
                                   Vector3(0.5, 1, 2));
  EXPECT_EQ(bounds.lower, Vector3(0.5, 1, 2));
  EXPECT_EQ(bounds.upper, Vector3(1.5, 3, 6));
}

TEST(SphereBounds, ContainEveryPointAndTouchIt) {
  Draw random(8);
  for (int i = 0; i < 300; ++i) {
    const Pose body = random.pose(3.0);
    const Vector3 centre = random.vector(1.0);
    const double radius = random.uniform(0.0, 2.0);
    const Bounds bounds = sphere_bounds(body, centre, radius);
    const Vector3 middle = transform_point(body, centre);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(bounds.upper[k], middle[k] + radius, kBoundsRounding);
      EXPECT_NEAR(bounds.lower[k], middle[k] - radius, kBoundsRounding);
    }
    const Vector3 p = middle + radius * random.direction();
    EXPECT_GE((p - bounds.lower).minCoeff(), -kBoundsRounding);
    EXPECT_GE((bounds.upper - p).minCoeff(), -kBoundsRounding);
  }
}

}  // namespace
}  // namespace gravitas
