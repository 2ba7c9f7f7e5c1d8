// Poses: the algebra of composition against the homogeneous matrices that define it, and what is
// refused as a rigid transform.
#include "plugin_sdk/math/pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

// a dozen roundings of numbers up to 10
constexpr double kPoseRounding = 2e-14;

const Pose kX_AB{Vector3(1.0, -2.0, 3.0), exp_rotation(Vector3(0.4, -1.9, 0.8))};
const Pose kX_BC{Vector3(-0.5, 4.0, 2.5), exp_rotation(Vector3(-2.2, 0.1, 1.3))};

double difference(const Pose& a, const Pose& b) { return (to_matrix(a) - to_matrix(b)).cwiseAbs().maxCoeff(); }

TEST(Pose, DefaultIsTheIdentity) {
  EXPECT_EQ(to_matrix(Pose{}), Matrix4::Identity());
  EXPECT_EQ(transform_point(Pose{}, Vector3(1.0, 2.0, 3.0)), Vector3(1.0, 2.0, 3.0));
}

TEST(Pose, ComposeIsTheMatrixProduct) {
  const Matrix4 product = to_matrix(kX_AB) * to_matrix(kX_BC);
  EXPECT_LE((to_matrix(compose(kX_AB, kX_BC)) - product).cwiseAbs().maxCoeff(), kPoseRounding);
}

TEST(Pose, QuarterTurnThenShiftOfAPoint) {
  // B stands at (1, 0, 0) in A, its x axis along A's y axis
  const double half = std::sqrt(0.5);
  const Pose X_AB{Vector3(1.0, 0.0, 0.0), Quaternion(half, 0.0, 0.0, half)};
  EXPECT_LE((transform_point(X_AB, Vector3(2.0, 0.0, 0.0)) - Vector3(1.0, 2.0, 0.0)).norm(), kPoseRounding);
}

TEST(Pose, InverseUndoes) {
  EXPECT_LE(difference(compose(kX_AB, inverse(kX_AB)), Pose{}), kPoseRounding);
  EXPECT_LE(difference(compose(inverse(kX_AB), kX_AB), Pose{}), kPoseRounding);
  const Vector3 p(0.3, 7.0, -2.0);
  EXPECT_LE((inverse_transform_point(kX_AB, transform_point(kX_AB, p)) - p).norm(), kPoseRounding);
  EXPECT_LE((transform_point(inverse(kX_AB), p) - inverse_transform_point(kX_AB, p)).norm(), kPoseRounding);
}

TEST(Pose, RelativeRecoversTheSecondFactor) {
  EXPECT_LE(difference(relative(kX_AB, compose(kX_AB, kX_BC)), kX_BC), kPoseRounding);
}

TEST(Pose, RelativeKeepsItsDigitsFarFromTheOrigin) {
  const Pose a{Vector3(1e9, 1e9, 1e9), kX_AB.orientation};
  Pose b = a;
  b.position.x() += 0.5;
  const Vector3 expected = a.orientation.conjugate() * Vector3(0.5, 0.0, 0.0);
  EXPECT_LE((relative(a, b).position - expected).norm(), kPoseRounding);
}

TEST(Pose, MatrixRoundTrip) {
  for (const Pose& X : {Pose{}, kX_AB, kX_BC, compose(kX_AB, kX_BC)}) {
    const auto back = from_matrix(to_matrix(X));
    ASSERT_TRUE(back.has_value());
    EXPECT_EQ(back->position, X.position);
    EXPECT_LE(difference(*back, X), kPoseRounding);
    EXPECT_GE(back->orientation.w(), 0.0);
  }
}

TEST(Pose, FromMatrixRepairsWhatWasWrittenInSinglePrecision) {
  const Matrix4 written = to_matrix(kX_AB).cast<float>().cast<double>();
  const auto X = from_matrix(written);
  ASSERT_TRUE(X.has_value());
  EXPECT_NEAR(X->orientation.norm(), 1.0, 1e-15);
  // the rounding of a float near 1
  EXPECT_LE(difference(*X, kX_AB), 3e-7);
}

TEST(Pose, FromMatrixRefusesScaleShearAndMirror) {
  Matrix4 m = to_matrix(kX_AB);
  m.topLeftCorner<3, 3>() *= 1.0 + 4e-4;
  EXPECT_TRUE(from_matrix(m).has_value());
  m.topLeftCorner<3, 3>() *= 1.0 + 4e-4;
  EXPECT_FALSE(from_matrix(m).has_value());

  m = to_matrix(kX_AB);
  m.col(1) += 0.002 * m.col(0);
  EXPECT_FALSE(from_matrix(m).has_value());

  m = to_matrix(kX_AB);
  m.col(2) = -m.col(2);
  EXPECT_FALSE(from_matrix(m).has_value());

  m.topLeftCorner<3, 3>().setZero();
  EXPECT_FALSE(from_matrix(m).has_value());
}

TEST(Pose, FromMatrixRefusesProjectiveAndNonFinite) {
  for (int column = 0; column < 4; ++column) {
    Matrix4 m = to_matrix(kX_AB);
    m(3, column) += 1e-12;
    EXPECT_FALSE(from_matrix(m).has_value()) << column;
  }
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int entry = 0; entry < 16; ++entry) {
      Matrix4 m = to_matrix(kX_AB);
      m(entry / 4, entry % 4) = bad;
      EXPECT_FALSE(from_matrix(m).has_value()) << entry;
    }
  }
  Matrix4 m = to_matrix(kX_AB);
  m(0, 0) = 1e200;
  EXPECT_FALSE(from_matrix(m).has_value());
}

}  // namespace
}  // namespace gravitas
