// The exact free rotor and what it is made of: closed forms, published values, and the flow's own laws.
#include "plugin_sdk/math/free_rotor.h"

#include <gtest/gtest.h>

#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/elliptic.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::test {
namespace {

double apart(const Quaternion& a, const Quaternion& b) { return log_rotation(a * b.conjugate()).norm(); }

// ---- elliptic functions

TEST(Elliptic, AreThoseOfTheLibrary) {
  for (const double k : {0.0, 0.1, 0.5, 0.9}) {
    const EllipticFunctions functions(1.0 - k * k);
    for (double u = -20.0; u < 20.0; u += 0.0731) {
      double cn = 0.0, dn = 0.0;
      const double sn = boost::math::jacobi_elliptic(k, u, &cn, &dn);
      const EllipticValues v = functions.at(u);
      // roundings of k, of u, and of both algorithms
      EXPECT_NEAR(v.sn, sn, 2e-14) << k << ' ' << u;
      EXPECT_NEAR(v.cn, cn, 2e-14) << k << ' ' << u;
      EXPECT_NEAR(v.dn, dn, 2e-14) << k << ' ' << u;
    }
  }
}

TEST(Elliptic, AtTheSeparatrixAreHyperbolic) {
  const EllipticFunctions functions(0.0);
  for (double u = -20.0; u < 20.0; u += 0.37) {
    const EllipticValues v = functions.at(u);
    EXPECT_NEAR(v.sn, std::tanh(u), 1e-15);
    EXPECT_NEAR(v.cn, 1.0 / std::cosh(u), 1e-14);
    EXPECT_NEAR(v.dn, 1.0 / std::cosh(u), 1e-14);
  }
}

TEST(Elliptic, NearZeroAreTheirArgument) {
  const EllipticFunctions functions(0.3);
  for (const double u : {0.0, 1e-300, 1e-200, -1e-160, 1e-120, 1e-9}) {
    EXPECT_DOUBLE_EQ(functions.at(u).sn, u);
    EXPECT_EQ(functions.at(u).cn, 1.0);
  }
}

TEST(Elliptic, KnowTheirPeriod) {
  EXPECT_DOUBLE_EQ(EllipticFunctions(1.0).quarter_period(), 1.5707963267948966);
  // K(k^2 = 1/2) = Gamma(1/4)^2 / (4 sqrt pi)
  EXPECT_DOUBLE_EQ(EllipticFunctions(0.5).quarter_period(), 1.8540746773013719);
}

// ---- the rotor

const Vector3 kBox(0.97 / 1.2, 0.82 / 1.2, 0.17 / 1.2);  // 0.1 x 0.4 x 0.9 m, 10 kg

// PROBLEMS 1: a tumbling box close to its unstable axis, in one step and in 10,000.
TEST(FreeRotor, MeetsTheTumblingBox) {
  const Quaternion q(0.2251645634139581639, -0.6199275624994524883, -0.2770291506871945918, 0.6987457236403101407);
  const Vector3 w(2.755840405146849406, -3.735963519216219904, -3.161809003467518335);
  const Vector3 inverse = kBox.cwiseInverse(), start = kBox.cwiseProduct(Vector3(0.1, 5, 0.1));
  const RotorMotion once = free_rotor(inverse, start, 10.0);
  // thirty radians, and the unstable axis multiplies rounding by a hundred
  EXPECT_LT(apart(once.turn, q), 1e-13);
  EXPECT_LT((inverse.cwiseProduct(once.momentum) - w).norm(), 5e-13);

  RotorMotion sum{start, Quaternion::Identity()};
  for (int i = 0; i < 10000; ++i) {
    const RotorMotion step = free_rotor(inverse, sum.momentum, 1e-3);
    sum = {step.momentum, normalized(sum.turn * step.turn)};
  }
  // 10,000 roundings, each multiplied so, and the target of the problem is 1e-8
  EXPECT_LT(apart(sum.turn, q), 1e-9);
  EXPECT_LT((sum.turn * sum.momentum - start).norm() / start.norm(), 1e-12);
}

// PROBLEMS 2.
TEST(FreeRotor, MeetsTheOtherBox) {
  const Vector3 moments = Vector3(0.04 + 0.09, 0.01 + 0.09, 0.01 + 0.04) / 3.0;
  const RotorMotion end = free_rotor(moments.cwiseInverse(), moments.cwiseProduct(Vector3(1, 2, 3)), 5.0);
  const Quaternion q(-0.3648637429868626004, 0.02356335734258868336, 0.02126200105200739735, -0.9305198249127347748);
  EXPECT_LT(apart(end.turn, q), 1e-13);
  const Vector3 w = end.momentum.cwiseQuotient(moments);
  EXPECT_LT((w - Vector3(0.2808619408146004726, -2.432266939712798093, 2.750101480033983193)).norm(), 1e-13);
}

// PROBLEMS 3: precession about the momentum at L/J, spin about the axis: two rotations.
TEST(FreeRotor, OfASymmetricBodyIsTwoRotations) {
  for (int axis = 0; axis < 3; ++axis) {
    Vector3 moments = Vector3::Constant(0.2);
    moments[axis] = 1.0;
    for (const double time : {0.01, 0.5, 10.0, -3.0}) {
      Vector3 w = Vector3::Zero();
      w[axis] = 30.0, w[(axis + 1) % 3] = 2.0;
      const Vector3 momentum = moments.cwiseProduct(w);
      const RotorMotion end = free_rotor(moments.cwiseInverse(), momentum, time);
      const Vector3 spin = (w[axis] - momentum[axis] / 0.2) * time * Vector3::Unit(axis);
      const Quaternion right = exp_rotation(time / 0.2 * momentum) * exp_rotation(spin);
      // rounding of an angle of up to 1500 rad
      EXPECT_LT(apart(end.turn, right), 1e-12) << axis << ' ' << time;
      EXPECT_LT((end.turn * end.momentum - momentum).norm(), 1e-12 * momentum.norm());
    }
  }
}

// Flow of t is that of t/7, seven times; back is back; momentum and energy stay.
TEST(FreeRotor, IsAFlow) {
  conformance::Draw random(1);
  for (int i = 0; i < 3000; ++i) {
    Vector3 moments{random.uniform(0.2, 1.2), random.uniform(0.2, 1.2), random.uniform(0.2, 1.2)};
    if (i % 4 == 0) moments[i % 3] = moments[(i + 1) % 3];
    if (i % 9 == 0) moments[0] = moments[1] * (1.0 + 1e-14);
    Vector3 momentum = random.vector(1.0);
    if (i % 5 == 0) momentum[i % 3] = 0.0;
    const Vector3 inverse = moments.cwiseInverse();
    const double time = random.uniform(-5.0, 5.0);
    const RotorMotion whole = free_rotor(inverse, momentum, time);
    RotorMotion parts{momentum, Quaternion::Identity()};
    for (int k = 0; k < 7; ++k) {
      const RotorMotion step = free_rotor(inverse, parts.momentum, time / 7);
      parts = {step.momentum, parts.turn * step.turn};
    }
    // rounding, times what an unstable axis makes of it
    ASSERT_LT(apart(parts.turn, whole.turn), 2e-12) << i;
    ASSERT_LT((parts.momentum - whole.momentum).norm(), 2e-12) << i;
    ASSERT_LT((whole.turn * whole.momentum - momentum).norm(), 2e-14) << i;
    const auto energy = [&](const Vector3& m) { return 0.5 * m.dot(inverse.cwiseProduct(m)); };
    ASSERT_NEAR(energy(whole.momentum) / energy(momentum), 1.0, 1e-13) << i;
    const RotorMotion back = free_rotor(inverse, whole.momentum, -time);
    ASSERT_LT(apart(whole.turn * back.turn, Quaternion::Identity()), 2e-12) << i;
  }
}

// Closer and closer to the unstable axis, and on the separatrix itself: m = (sech, tanh, sech) of the time.
TEST(FreeRotor, CrossesTheSeparatrix) {
  const Vector3 moments(1, 2, 4), inverse = moments.cwiseInverse();
  const double a1 = 0.25, a2 = 0.75, a3 = 0.5;
  for (const double off : {0.0, 1e-15, -1e-12, 1e-9, -1e-6}) {
    const double m2 = 0.3;
    const Vector3 n =
        Vector3(std::sqrt(a1 / a2 * (1 - m2 * m2)), m2, std::sqrt(a3 / a2 * (1 - m2 * m2))) + Vector3(off, 0, 0);
    for (const double time : {0.1, 1.0, 4.0}) {
      const RotorMotion end = free_rotor(inverse, n, time);
      ASSERT_TRUE(end.momentum.allFinite());
      // delta of the order of `off` moves the path by it times e^(rate t), rate t < 2
      EXPECT_NEAR(end.momentum[1], std::tanh(std::atanh(m2) + std::sqrt(a1 * a3) * time), 1e-13 + 20 * std::fabs(off));
      EXPECT_LT((end.turn * end.momentum - n).norm(), 1e-14);
    }
  }
}

TEST(FreeRotor, BearsExtremes) {
  // spin of 1e4 rad/s for 1e3 s, moments 1 : 1e-8
  for (const Vector3& moments :
       {Vector3(1, 1, 1e-8), Vector3(1, 0.999, 1e-8), Vector3(1e-8, 1, 1.0), Vector3(1e-100, 1, 1)}) {
    const Vector3 momentum = moments.cwiseProduct(Vector3(1e4, 3e3, -1e4));
    const RotorMotion end = free_rotor(moments.cwiseInverse(), momentum, 1e3);
    ASSERT_TRUE(end.momentum.allFinite());
    EXPECT_LT((end.turn * end.momentum - momentum).norm(), 1e-13 * momentum.norm());
  }
  const RotorMotion still = free_rotor(Vector3(1, 2, 3), Vector3::Zero(), 1.0);
  EXPECT_EQ(still.turn.coeffs(), Quaternion::Identity().coeffs());
  EXPECT_EQ(free_rotor(Vector3(1, 2, 3), Vector3(1, 1, 1), 0.0).turn.coeffs(), Quaternion::Identity().coeffs());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(free_rotor(Vector3(1, 2, 3), Vector3(1, nan, 1), 1.0).momentum.allFinite());
}

}  // namespace
}  // namespace gravitas::test
