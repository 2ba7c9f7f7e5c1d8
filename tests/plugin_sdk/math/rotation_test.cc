// Rotations against closed forms, inverses of each other, and the places where the textbook
// formulas fail: half turns, no turn at all, drifted and dependent matrices.
#include "plugin_sdk/math/rotation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace gravitas {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// a dozen roundings of numbers near 1
constexpr double kRounding = 2e-15;

std::vector<Vector3> axes() {
  std::vector<Vector3> result;
  for (int x = -2; x <= 2; ++x) {
    for (int y = -2; y <= 2; ++y) {
      for (int z = -2; z <= 2; ++z) {
        if (x == 0 && y == 0 && z == 0) continue;
        const Vector3 axis(x, y, z + 0.1 * x);
        result.push_back(axis / std::sqrt(axis.squaredNorm()));
      }
    }
  }
  return result;
}

std::vector<double> angles() {
  return {0.0,     1e-300, 1e-12, 1e-8, 1e-4,       0.0099,     0.0101,     0.3,        1.0,
          kPi / 2, 2.0,    2.1,   3.0,  kPi - 1e-4, kPi - 1e-6, kPi - 1e-9, kPi - 1e-13};
}

double distance(const Quaternion& a, const Quaternion& b) { return std::sqrt((a.coeffs() - b.coeffs()).squaredNorm()); }

double norm(const Quaternion& q) { return std::sqrt(q.squaredNorm()); }

// Rodrigues' formula: the rotation by an angle about a unit axis.
Matrix3 rodrigues(const Vector3& axis, double angle) {
  const Matrix3 K = skew(axis);
  return Matrix3::Identity() + std::sin(angle) * K + (1.0 - std::cos(angle)) * K * K;
}

double orthonormality_error(const Matrix3& R) {
  return (R.transpose() * R - Matrix3::Identity()).cwiseAbs().maxCoeff();
}

TEST(Rotation, ExponentialIsRodriguesFormula) {
  for (const Vector3& axis : axes()) {
    for (const double angle : angles()) {
      const Matrix3 R = to_rotation_matrix(exp_rotation(angle * axis));
      EXPECT_LE((R - rodrigues(axis, angle)).cwiseAbs().maxCoeff(), kRounding) << angle;
    }
  }
}

TEST(Rotation, ExponentialAndLogarithmAreInverse) {
  for (const Vector3& axis : axes()) {
    for (const double angle : angles()) {
      const Vector3 v = angle * axis;
      const Vector3 back = log_rotation(exp_rotation(v));
      // relative, so that the smallest rotations keep their digits too
      EXPECT_LE((back - v).cwiseAbs().maxCoeff(), kRounding * angle) << angle;
    }
  }
}

TEST(Rotation, ExponentialOfTheSmallestAndTheLargestVectors) {
  EXPECT_EQ(exp_rotation(Vector3::Zero()).coeffs(), Quaternion::Identity().coeffs());
  const double tiny = 1e-310;
  EXPECT_EQ(exp_rotation(Vector3(0.0, tiny, 0.0)).coeffs(), Quaternion(1.0, 0.0, tiny / 2, 0.0).coeffs());
  EXPECT_EQ(log_rotation(Quaternion(1.0, 0.0, 0.0, tiny)), Vector3(0.0, 0.0, 2 * tiny));
  for (const double angle : {1e3, 1e10, 1e160, 1e300}) {
    EXPECT_NEAR(norm(exp_rotation(Vector3(0.6 * angle, 0.0, -0.8 * angle))), 1.0, kRounding) << angle;
  }
  // past half a turn w changes sign, past a whole one the path goes on
  EXPECT_NEAR(exp_rotation(Vector3(0.0, 0.0, 2.0 * kPi)).w(), -1.0, kRounding);
  EXPECT_TRUE(exp_rotation(Vector3(kNaN, 0.0, 0.0)).coeffs().hasNaN());
  EXPECT_TRUE(exp_rotation(Vector3(kInf, 0.0, 0.0)).coeffs().hasNaN());
}

TEST(Rotation, SeriesMeetsTheClosedFormWithoutAStep) {
  // both sides of the squared angle of 1e-4 against the values of sin(x/2)
  for (const double angle : {0.00999999, 0.01, 0.01000001}) {
    const auto exact = static_cast<double>(std::sin(0.5L * static_cast<long double>(angle)));
    EXPECT_NEAR(exp_rotation(Vector3(angle, 0.0, 0.0)).x(), exact, 2e-18) << angle;
  }
}

TEST(Rotation, LogarithmTakesTheShorterArc) {
  for (const Vector3& axis : axes()) {
    for (const double angle : {0.1, 1.0, 3.0}) {
      const Quaternion q = exp_rotation(angle * axis);
      const Quaternion other(-q.w(), -q.x(), -q.y(), -q.z());
      EXPECT_EQ(log_rotation(q), log_rotation(other));
      const Vector3 beyond = log_rotation(exp_rotation((2.0 * kPi - angle) * axis));
      EXPECT_LE((beyond + angle * axis).cwiseAbs().maxCoeff(), 2.0 * kRounding) << angle;
    }
  }
}

TEST(Rotation, LogarithmAtHalfATurnHasLengthPi) {
  for (const Vector3& axis : axes()) {
    const Vector3 v = log_rotation(Quaternion(0.0, axis.x(), axis.y(), axis.z()));
    EXPECT_LE((v - kPi * axis).cwiseAbs().maxCoeff(), kRounding);
    EXPECT_EQ(v, log_rotation(Quaternion(-0.0, axis.x(), axis.y(), axis.z())));
  }
}

TEST(Rotation, LogarithmIgnoresTheNorm) {
  const Quaternion q = exp_rotation(Vector3(0.3, -0.2, 0.5));
  for (const double factor : {0.5, 3.0, 1e-20}) {
    const Quaternion longer(factor * q.w(), factor * q.x(), factor * q.y(), factor * q.z());
    EXPECT_LE((log_rotation(longer) - Vector3(0.3, -0.2, 0.5)).cwiseAbs().maxCoeff(), kRounding);
  }
  EXPECT_TRUE(log_rotation(Quaternion(0.0, 0.0, 0.0, 0.0)).hasNaN());
}

TEST(Rotation, QuaternionOfAMatrixIsAccurateUpToHalfATurn) {
  for (const Vector3& axis : axes()) {
    for (const double angle : angles()) {
      const Quaternion q = exp_rotation(angle * axis);
      const Quaternion back = to_quaternion(to_rotation_matrix(q));
      EXPECT_GE(back.w(), 0.0);
      EXPECT_LE(distance(back, shorter_arc(q, back)), kRounding) << angle;
    }
    const Quaternion half(0.0, axis.x(), axis.y(), axis.z());
    const Quaternion back = to_quaternion(to_rotation_matrix(half));
    EXPECT_LE(distance(back, shorter_arc(half, back)), kRounding);
  }
}

// (2.16b) loses half the digits here and divides by zero at the half turn itself.
TEST(Rotation, QuaternionOfAMatrixOnEachBranch) {
  EXPECT_EQ(to_quaternion(Matrix3::Identity()).coeffs(), Quaternion::Identity().coeffs());
  for (int i = 0; i < 3; ++i) {
    Matrix3 half_turn = -Matrix3::Identity();
    half_turn(i, i) = 1.0;
    Vector3 axis = Vector3::Zero();
    axis[i] = 1.0;
    const Quaternion q = to_quaternion(half_turn);
    EXPECT_EQ(q.w(), 0.0);
    EXPECT_EQ(Vector3(q.vec()), axis);
  }
}

TEST(Rotation, MatrixRotatesLikeTheQuaternion) {
  for (const Vector3& axis : axes()) {
    const Quaternion q = exp_rotation(1.3 * axis);
    const Vector3 v(0.3, -4.0, 2.0);
    EXPECT_LE((to_rotation_matrix(q) * v - q * v).cwiseAbs().maxCoeff(), 4.0 * kRounding);
  }
}

TEST(Rotation, NormalizedReachesUnitNormFromAnyScale) {
  for (const double scale : {1.0, 1e-320, 1e-200, 1e-140, 1e140, 1e200, 1e308}) {
    const Quaternion q = normalized(Quaternion(-0.5 * scale, 0.5 * scale, 0.5 * scale, -0.5 * scale));
    EXPECT_LE(distance(q, Quaternion(-0.5, 0.5, 0.5, -0.5)), kRounding) << scale;
  }
  EXPECT_TRUE(normalized(Quaternion(0.0, 0.0, 0.0, 0.0)).coeffs().hasNaN());
}

TEST(Rotation, ShorterArcFoldsToTheReference) {
  const Quaternion q(-0.5, 0.5, -0.5, 0.5);
  EXPECT_EQ(shorter_arc(q).coeffs(), Quaternion(0.5, -0.5, 0.5, -0.5).coeffs());
  EXPECT_EQ(shorter_arc(q, q).coeffs(), q.coeffs());
  EXPECT_EQ(shorter_arc(Quaternion(0.0, -1.0, 0.0, 0.0)).x(), -1.0);
}

TEST(Rotation, RotateByTurnsAboutWorldAxesByTheFullAngle) {
  // 3.3 rad in one step: adding half the product, as (2.41) does, would turn by 2.05
  const Quaternion start = exp_rotation(Vector3(0.0, 0.7, 0.0));
  const Quaternion turned = rotate_by(start, Vector3(0.0, 0.0, 3.3));
  const Matrix3 expected = rodrigues(Vector3::UnitZ(), 3.3) * rodrigues(Vector3::UnitY(), 0.7);
  EXPECT_LE((to_rotation_matrix(turned) - expected).cwiseAbs().maxCoeff(), kRounding);
}

TEST(Rotation, RotateByZeroKeepsEveryBit) {
  const Quaternion drifted(0.6, 0.8000001, 0.0, 0.0);
  EXPECT_EQ(rotate_by(drifted, Vector3::Zero()).coeffs(), drifted.coeffs());
  EXPECT_EQ(rotate_by(drifted, Vector3(-0.0, 0.0, -0.0)).coeffs(), drifted.coeffs());
}

TEST(Rotation, ManySmallTurnsMakeTheWholeAndStayUnit) {
  Quaternion q = Quaternion::Identity();
  const int steps = 100000;
  const Vector3 step = Vector3(2.0, -1.0, 2.0) / 3.0 * (2.0 * kPi / steps);
  for (int i = 0; i < steps; ++i) q = rotate_by(q, step);
  EXPECT_NEAR(norm(q), 1.0, kRounding);
  // a rounding of 1e-16 per step, in one direction at worst
  EXPECT_LE(std::sqrt(log_rotation(q).squaredNorm()), 1e-16 * steps);
}

TEST(Rotation, OrthonormalizedRepairsDrift) {
  for (const Vector3& axis : axes()) {
    const Matrix3 R = rodrigues(axis, 2.0);
    Matrix3 drifted = R;
    drifted(0, 1) += 1e-4;
    drifted(2, 0) -= 2e-4;
    const auto repaired = orthonormalized(3.0 * drifted);
    ASSERT_TRUE(repaired.has_value());
    EXPECT_LE(orthonormality_error(*repaired), kRounding);
    EXPECT_NEAR(repaired->determinant(), 1.0, kRounding);
    EXPECT_LE((*repaired - R).cwiseAbs().maxCoeff(), 1e-3);
  }
  EXPECT_EQ(*orthonormalized(Matrix3::Identity()), Matrix3::Identity());
}

TEST(Rotation, OrthonormalizedKeepsTheFirstDirectionAndTheFirstPlane) {
  Matrix3 m;
  m << 2.0, 1.0, 0.3, 0.0, 1.0, -0.2, 0.0, 0.0, 5.0;
  EXPECT_EQ(*orthonormalized(m), Matrix3::Identity());
}

TEST(Rotation, OrthonormalizedOfNearlyParallelColumnsIsStillOrthonormal) {
  Matrix3 m;
  const Vector3 u(0.3, 0.5, 0.7);
  m.col(0) = u;
  m.col(1) = u + Vector3(1e-7, 0.0, 0.0);
  m.col(2) = m.col(0).cross(m.col(1)) * 1e7;
  const auto R = orthonormalized(m);
  ASSERT_TRUE(R.has_value());
  EXPECT_LE(orthonormality_error(*R), kRounding);
}

TEST(Rotation, OrthonormalizedWorksAtAnyScale) {
  const Matrix3 R = rodrigues(Vector3(2.0, -1.0, 2.0) / 3.0, 1.0);
  for (const double scale : {1e-300, 1e-150, 1e150, 1e300}) {
    const auto result = orthonormalized(scale * R);
    ASSERT_TRUE(result.has_value()) << scale;
    EXPECT_LE((*result - R).cwiseAbs().maxCoeff(), kRounding) << scale;
  }
}

TEST(Rotation, OrthonormalizedRefusesWhatIsNoFrame) {
  EXPECT_FALSE(orthonormalized(Matrix3::Zero()).has_value());
  Matrix3 m = Matrix3::Identity();
  m.col(1) = 2.0 * m.col(0);
  EXPECT_FALSE(orthonormalized(m).has_value());
  m = Matrix3::Identity();
  m.col(2) = m.col(0) - m.col(1);
  EXPECT_FALSE(orthonormalized(m).has_value());
  m = Matrix3::Identity();
  m(2, 2) = -1.0;
  EXPECT_FALSE(orthonormalized(m).has_value());
  for (const double bad : {kNaN, kInf}) {
    m = Matrix3::Identity();
    m(1, 2) = bad;
    EXPECT_FALSE(orthonormalized(m).has_value());
  }
}

TEST(Rotation, TangentBasisIsOrthonormalAndRightHanded) {
  std::vector<Vector3> normals = axes();
  normals.emplace_back(0.0, 0.0, -1.0);
  normals.emplace_back(1e-9, 0.0, -std::sqrt(1.0 - 1e-18));
  for (const Vector3& n : normals) {
    const TangentBasis basis = orthonormal_basis(n);
    Matrix3 frame;
    frame << basis.first, basis.second, n;
    EXPECT_LE(orthonormality_error(frame), kRounding) << n.transpose();
    EXPECT_NEAR(frame.determinant(), 1.0, kRounding);
  }
}

TEST(Rotation, TangentBasisDoesNotSeeTheSignOfZero) {
  const TangentBasis plus = orthonormal_basis(Vector3(0.6, 0.8, 0.0));
  const TangentBasis minus = orthonormal_basis(Vector3(0.6, 0.8, -0.0));
  EXPECT_EQ(plus.first, minus.first);
  EXPECT_EQ(plus.second, minus.second);
}

TEST(Rotation, SkewIsTheCrossProduct) {
  const Vector3 a(1.0, -2.0, 3.0);
  const Vector3 b(4.0, 5.0, -6.0);
  EXPECT_EQ(Vector3(skew(a) * b), a.cross(b));
  EXPECT_EQ(skew(a).transpose(), -skew(a));
}

TEST(Rotation, WorldInertiaIsSymmetricAndHasThePrincipalMoments) {
  const Vector3 moments(1.0, 20.0, 300.0);
  for (const Vector3& axis : axes()) {
    const Quaternion q = exp_rotation(1.1 * axis);
    const Matrix3 I = world_inertia(q, moments);
    EXPECT_EQ(I, I.transpose());
    for (int i = 0; i < 3; ++i) {
      Vector3 e = Vector3::Zero();
      e[i] = 1.0;
      const Vector3 principal = q * e;
      // some roundings of the largest moment
      EXPECT_LE((I * principal - moments[i] * principal).cwiseAbs().maxCoeff(), 300.0 * kRounding);
    }
    const Matrix3 W = world_inverse_inertia(q, moments.cwiseInverse());
    EXPECT_EQ(W, W.transpose());
    EXPECT_LE((W * I - Matrix3::Identity()).cwiseAbs().maxCoeff(), 300.0 * kRounding);
  }
}

TEST(Rotation, WorldInertiaOfAnUnturnedBodyIsDiagonal) {
  const Vector3 moments(1.0 / 3.0, 0.0, 7.0);
  const Matrix3 expected = moments.asDiagonal();
  EXPECT_EQ(world_inertia(Quaternion::Identity(), moments), expected);
  EXPECT_EQ(world_inverse_inertia(Quaternion::Identity(), Vector3::Zero()), Matrix3::Zero());
}

}  // namespace
}  // namespace gravitas
