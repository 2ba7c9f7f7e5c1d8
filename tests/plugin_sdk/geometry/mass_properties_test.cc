// Mass properties against closed forms, the laws that connect them (translation, rotation, sums of
// parts), and sums over the mass itself.
#include "plugin_sdk/geometry/mass_properties.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

// some roundings, relative to the largest number involved
constexpr double kMassRounding = 1e-14;

double difference(const Matrix3& a, const Matrix3& b) { return (a - b).cwiseAbs().maxCoeff(); }

Matrix3 diagonal(double x, double y, double z) { return Vector3(x, y, z).asDiagonal(); }

Matrix3 rebuilt(const PrincipalAxes& axes) { return world_inertia(axes.orientation, axes.moments); }

// The second moments of a solid by the midpoint rule over a grid of small cubes.
template <typename Inside>
MassProperties sum_over_cells(double extent, int cells, double density, Inside inside) {
  const double size = 2.0 * extent / cells;
  const double mass = size * size * size * density;
  MassProperties result;
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      for (int k = 0; k < cells; ++k) {
        const Vector3 p = size * Vector3(i + 0.5, j + 0.5, k + 0.5) - Vector3::Constant(extent);
        if (!inside(p)) continue;
        result.mass += mass;
        result.inertia += translated_inertia(Matrix3::Zero(), mass, p);
      }
    }
  }
  return result;
}

TEST(MassProperties, SphereHasItsClosedForm) {
  const MassProperties sphere = sphere_mass_properties(2.0, 3.0);
  EXPECT_NEAR(sphere.mass, 32.0 * std::numbers::pi, 100 * kMassRounding);
  const double moment = 0.4 * 32.0 * std::numbers::pi * 4.0;
  EXPECT_LE(difference(sphere.inertia, moment * Matrix3::Identity()), 200 * kMassRounding);
  EXPECT_EQ(sphere.centre_of_mass, Vector3::Zero());
}

TEST(MassProperties, BoxTakesHalfExtents) {
  const MassProperties box = box_mass_properties(Vector3(1.0, 2.0, 3.0), 0.5);
  EXPECT_EQ(box.mass, 24.0);
  EXPECT_LE(difference(box.inertia, diagonal(104.0, 80.0, 40.0)), 100 * kMassRounding);
}

TEST(MassProperties, CylinderStandsAlongY) {
  const MassProperties cylinder = cylinder_mass_properties(2.0, 3.0, 1.0);
  EXPECT_NEAR(cylinder.mass, 12.0 * std::numbers::pi, 40 * kMassRounding);
  EXPECT_LE(difference(cylinder.inertia, 12.0 * std::numbers::pi * diagonal(1.75, 2.0, 1.75)), 100 * kMassRounding);
}

// Independent of the formulas: the integrals themselves. The midpoint rule errs by the boundary
// cells, a hundredth of the size each with either sign; 1 % is far below any wrong factor.
TEST(MassProperties, ClosedFormsAreTheIntegrals) {
  if (harness::kSanitized) GTEST_SKIP() << "millions of cells, and formulas that the tests above call";
  const auto expect_close = [](const MassProperties& exact, const MassProperties& summed) {
    EXPECT_NEAR(exact.mass, summed.mass, 0.01 * exact.mass);
    EXPECT_LE(difference(exact.inertia, summed.inertia), 0.01 * exact.inertia.maxCoeff());
  };
  expect_close(sphere_mass_properties(0.9, 2.0),
               sum_over_cells(1.0, 100, 2.0, [](const Vector3& p) { return p.squaredNorm() <= 0.81; }));
  // faces on cell boundaries
  expect_close(box_mass_properties(Vector3(0.5, 0.8, 0.9), 2.0), sum_over_cells(1.0, 100, 2.0, [](const Vector3& p) {
                 return std::fabs(p.x()) < 0.5 && std::fabs(p.y()) < 0.8 && std::fabs(p.z()) < 0.9;
               }));
  expect_close(cylinder_mass_properties(0.7, 1.6, 2.0), sum_over_cells(1.0, 100, 2.0, [](const Vector3& p) {
                 return p.x() * p.x() + p.z() * p.z() <= 0.49 && std::fabs(p.y()) < 0.8;
               }));
}

// A rectangle of two triangles in the plane z = 2, and a triangle: I about the centroid from the textbook.
TEST(MassProperties, ShellsAreThinPlates) {
  constexpr double kWidth = 0.6, kHeight = 0.4, kDensity = 3.0;
  const std::vector<Vector3> corners = {
      {1, 1, 2}, {1 + kWidth, 1, 2}, {1 + kWidth, 1 + kHeight, 2}, {1, 1 + kHeight, 2}};
  const std::vector<std::uint32_t> triangles = {0, 1, 2, 0, 2, 3};
  const MassProperties plate = shell_mass_properties(corners, triangles, kDensity);
  const double mass = kDensity * kWidth * kHeight;
  EXPECT_NEAR(plate.mass, mass, 1e-15);
  EXPECT_LT((plate.centre_of_mass - Vector3(1 + 0.5 * kWidth, 1 + 0.5 * kHeight, 2)).norm(), 1e-15);
  const double xx = mass * kHeight * kHeight / 12.0, yy = mass * kWidth * kWidth / 12.0;
  const Vector3 moments(xx, yy, xx + yy);
  EXPECT_LT((plate.inertia - Matrix3(moments.asDiagonal())).norm(), 1e-15);

  // legs b along x and h along y: m h^2/18, m b^2/18, and the product m b h/36
  const MassProperties triangle = shell_mass_properties(corners, std::span(triangles).first(3), kDensity);
  EXPECT_NEAR(triangle.inertia(0, 0), 0.5 * mass * kHeight * kHeight / 18.0, 1e-15);
  EXPECT_NEAR(triangle.inertia(1, 1), 0.5 * mass * kWidth * kWidth / 18.0, 1e-15);
  EXPECT_NEAR(triangle.inertia(0, 1), -0.5 * mass * kWidth * kHeight / 36.0, 1e-15);
  EXPECT_TRUE(validate(triangle, nullptr));
}

TEST(MassProperties, ScaledToMassKeepsTheShape) {
  const MassProperties box = box_mass_properties(Vector3(1.0, 2.0, 3.0), 0.5);
  const MassProperties heavy = scaled_to_mass(box, 240.0);
  EXPECT_EQ(heavy.mass, 240.0);
  EXPECT_LE(difference(heavy.inertia, 10.0 * box.inertia), 1000 * kMassRounding);
}

TEST(MassProperties, ParallelAxisTheoremIsTheSumOverPoints) {
  // four masses whose centre is the origin
  const std::array<Vector3, 4> points = {Vector3(1.0, 2.0, -1.0), Vector3(-1.0, 0.5, 3.0), Vector3(2.0, -3.0, 0.5),
                                         Vector3(-2.0, 0.5, -2.5)};
  const double m = 1.5;
  const Vector3 d(4.0, -1.0, 2.0);
  Matrix3 about_centre = Matrix3::Zero();
  Matrix3 about_d = Matrix3::Zero();
  for (const Vector3& p : points) {
    about_centre += m * (p.squaredNorm() * Matrix3::Identity() - p * p.transpose());
    const Vector3 q = p - d;
    about_d += m * (q.squaredNorm() * Matrix3::Identity() - q * q.transpose());
  }
  EXPECT_LE(difference(translated_inertia(about_centre, 4 * m, d), about_d), 1000 * kMassRounding);
}

TEST(MassProperties, TwoHalfBoxesMakeTheBox) {
  const MassProperties half = box_mass_properties(Vector3(1.0, 2.0, 1.5), 0.7);
  const MassProperties lower = transformed(half, Pose{Vector3(5.0, 1.0, -1.5 + 2.0)});
  const MassProperties upper = transformed(half, Pose{Vector3(5.0, 1.0, 1.5 + 2.0)});
  const std::array<MassProperties, 2> parts = {lower, upper};
  const MassProperties both = combined(parts);
  const MassProperties box = box_mass_properties(Vector3(1.0, 2.0, 3.0), 0.7);
  EXPECT_NEAR(both.mass, box.mass, 100 * kMassRounding);
  EXPECT_LE((both.centre_of_mass - Vector3(5.0, 1.0, 2.0)).norm(), 10 * kMassRounding);
  EXPECT_LE(difference(both.inertia, box.inertia), 1000 * kMassRounding);
  // the products of inertia are rounding errors, and do not turn the axes
  EXPECT_EQ(principal_axes(both).orientation.coeffs(), Quaternion::Identity().coeffs());
}

TEST(MassProperties, CombiningCommutesWithMoving) {
  const Pose move{Vector3(3.0, -1.0, 2.0), exp_rotation(Vector3(1.0, 0.5, -0.7))};
  std::vector<MassProperties> parts = {transformed(sphere_mass_properties(1.0, 2.0), Pose{Vector3(2.0, 0.0, 0.0)}),
                                       transformed(cylinder_mass_properties(0.5, 4.0, 1.0),
                                                   Pose{Vector3(0.0, 1.0, 1.0), exp_rotation(Vector3(0.3, 0.2, 0.9))}),
                                       box_mass_properties(Vector3(1.0, 0.2, 0.6), 5.0)};
  const MassProperties expected = transformed(combined(parts), move);
  for (MassProperties& part : parts) part = transformed(part, move);
  const MassProperties moved = combined(parts);
  EXPECT_NEAR(moved.mass, expected.mass, 20 * kMassRounding);
  EXPECT_LE((moved.centre_of_mass - expected.centre_of_mass).norm(), 10 * kMassRounding);
  EXPECT_LE(difference(moved.inertia, expected.inertia), 100 * kMassRounding);
  EXPECT_EQ(moved.inertia, moved.inertia.transpose());
}

TEST(MassProperties, CombiningNothingGivesNothing) {
  const MassProperties none = combined({});
  EXPECT_EQ(none.mass, 0.0);
  EXPECT_EQ(none.centre_of_mass, Vector3::Zero());
  EXPECT_EQ(none.inertia, Matrix3::Zero());
}

TEST(MassProperties, TranslationLeavesTheInertiaAboutTheCentre) {
  const MassProperties box = box_mass_properties(Vector3(1.0, 2.0, 3.0), 0.5);
  const MassProperties moved = transformed(box, Pose{Vector3(10.0, 20.0, 30.0)});
  EXPECT_EQ(moved.inertia, box.inertia);
  EXPECT_EQ(moved.centre_of_mass, Vector3(10.0, 20.0, 30.0));
}

TEST(MassProperties, DiagonalInertiaKeepsItsAxesAndTheirOrder) {
  for (const MassProperties& plain : {box_mass_properties(Vector3(3.0, 1.0, 2.0), 1.0),
                                      sphere_mass_properties(0.3, 1000.0), cylinder_mass_properties(1.0, 0.1, 10.0)}) {
    MassProperties noisy = plain;
    const double rounding = 1e-16 * plain.inertia.maxCoeff();
    noisy.inertia(0, 1) = noisy.inertia(1, 0) = rounding;
    noisy.inertia(1, 2) = noisy.inertia(2, 1) = -rounding;
    for (const MassProperties& body : {plain, noisy}) {
      const PrincipalAxes axes = principal_axes(body);
      EXPECT_EQ(axes.moments, Vector3(plain.inertia.diagonal()));
      EXPECT_EQ(axes.orientation.coeffs(), Quaternion::Identity().coeffs());
    }
  }
}

TEST(MassProperties, PrincipalAxesRebuildTheInertia) {
  const std::array<Vector3, 5> boxes = {Vector3(3.0, 1.0, 2.0), Vector3(1.0, 1.0, 2.0), Vector3(1.0, 1.0, 1.0),
                                        Vector3(1.0, 1.0 + 1e-9, 1e-3), Vector3(1e-4, 1e-4, 5e2)};
  for (const Vector3& extents : boxes) {
    const MassProperties box = box_mass_properties(extents, 2.0);
    const double largest = box.inertia.maxCoeff();
    for (int i = 0; i < 200; ++i) {
      const Vector3 v(std::sin(3.0 * i), std::sin(5.0 * i + 1.0), std::sin(7.0 * i + 2.0));
      const MassProperties turned = transformed(box, Pose{Vector3::Zero(), exp_rotation(3.0 * v)});
      const PrincipalAxes axes = principal_axes(turned);
      EXPECT_NEAR(axes.orientation.norm(), 1.0, kMassRounding);
      // 2^-48 of the largest moment may be left beside the diagonal, and some roundings
      EXPECT_LE(difference(rebuilt(axes), turned.inertia), 2e-14 * largest);
    }
  }
}

TEST(MassProperties, SmallTurnIsRecoveredAsASmallTurn) {
  const MassProperties box = box_mass_properties(Vector3(3.0, 1.0, 2.0), 1.0);
  for (const double angle : {1e-6, 1e-3, 0.1, 0.3}) {
    const Vector3 v = angle * Vector3(2.0, -1.0, 2.0) / 3.0;
    const PrincipalAxes axes = principal_axes(transformed(box, Pose{Vector3::Zero(), exp_rotation(v)}));
    // rounding of the inertia over the gap of the moments
    EXPECT_LE((log_rotation(axes.orientation) - v).norm(), 1e-13) << angle;
    EXPECT_LE((axes.moments - box.inertia.diagonal()).norm(), 1e-13 * box.inertia.maxCoeff());
  }
}

TEST(MassProperties, PrincipalAxesOfTheAllOnesTensor) {
  // eigenvalues 1, 1, 4
  MassProperties body;
  body.mass = 1.0;
  body.inertia = Matrix3::Identity() + Matrix3::Ones();
  const PrincipalAxes axes = principal_axes(body);
  EXPECT_NEAR(axes.moments.maxCoeff(), 4.0, kMassRounding);
  EXPECT_NEAR(axes.moments.minCoeff(), 1.0, kMassRounding);
  EXPECT_NEAR(axes.moments.sum(), 6.0, kMassRounding);
  EXPECT_LE(difference(rebuilt(axes), body.inertia), kMassRounding);
}

TEST(MassProperties, PrincipalAxesOfNonsenseAreNaN) {
  MassProperties body = sphere_mass_properties(1.0, 1.0);
  body.inertia(0, 2) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(principal_axes(body).moments.hasNaN());
  EXPECT_EQ(principal_axes(body).orientation.coeffs(), Quaternion::Identity().coeffs());
}

MassProperties unit_mass(const Matrix3& inertia) { return MassProperties{1.0, Vector3::Zero(), inertia}; }

TEST(MassPropertiesValidate, AcceptsSolidsAndFlatPlates) {
  std::string why = "untouched";
  EXPECT_TRUE(validate(sphere_mass_properties(1e-3, 1e4), &why));
  EXPECT_TRUE(validate(box_mass_properties(Vector3(1.0, 1.0, 1e-9), 1.0), &why));
  EXPECT_TRUE(validate(unit_mass(diagonal(0.083333, 0.083333, 0.166667)), &why));
  EXPECT_TRUE(validate(unit_mass(diagonal(1.0, 1.0, 2.0)), nullptr));
  EXPECT_EQ(why, "untouched");
}

TEST(MassPropertiesValidate, NamesTheBrokenRule) {
  const auto reason = [](const MassProperties& body) {
    std::string why;
    EXPECT_FALSE(validate(body, &why));
    EXPECT_FALSE(validate(body, nullptr));
    return why;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto contains = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_TRUE(contains(reason(unit_mass(diagonal(1.0, 1.0, 2.1))), "sum of the other two"));
  EXPECT_TRUE(contains(reason(unit_mass(diagonal(1.0, 1.0, 0.0))), "must be positive"));
  EXPECT_TRUE(contains(reason(unit_mass(diagonal(1.0, 1.0, nan))), "inertia is not finite"));

  // positive diagonal, yet a negative moment about a slanted axis
  Matrix3 indefinite = diagonal(1.0, 1.0, 1.0);
  indefinite(0, 1) = indefinite(1, 0) = 1.5;
  EXPECT_TRUE(contains(reason(unit_mass(indefinite)), "moments must be positive"));

  Matrix3 skewed = diagonal(1.0, 1.0, 1.0);
  skewed(0, 1) = 0.1;
  EXPECT_TRUE(contains(reason(unit_mass(skewed)), "symmetric"));

  MassProperties body = sphere_mass_properties(1.0, 1.0);
  body.mass = 0.0;
  EXPECT_TRUE(contains(reason(body), "mass must be positive"));
  body.mass = -1.0;
  EXPECT_TRUE(contains(reason(body), "-1 kg"));
  body.mass = nan;
  EXPECT_TRUE(contains(reason(body), "mass is not finite"));
  body = sphere_mass_properties(1.0, 1.0);
  body.centre_of_mass.y() = nan;
  EXPECT_TRUE(contains(reason(body), "centre of mass"));
}

// A turned tensor that breaks the triangle inequality does so in every frame.
TEST(MassPropertiesValidate, DoesNotDependOnTheFrame) {
  for (int i = 0; i < 50; ++i) {
    const Vector3 v(std::sin(3.0 * i), std::sin(5.0 * i + 1.0), std::sin(7.0 * i + 2.0));
    const Pose turn{Vector3::Zero(), exp_rotation(2.0 * v)};
    EXPECT_TRUE(validate(transformed(unit_mass(diagonal(1.0, 2.0, 2.99)), turn), nullptr));
    EXPECT_FALSE(validate(transformed(unit_mass(diagonal(1.0, 2.0, 3.01)), turn), nullptr));
  }
}

}  // namespace
}  // namespace gravitas
