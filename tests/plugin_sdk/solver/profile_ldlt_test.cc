// ProfileLdlt: chains, dependent rows, sides that no solution has.
#include "plugin_sdk/solver/profile_ldlt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "plugin_sdk/conformance/draw.h"

namespace gravitas {
namespace {

using conformance::Draw;

// J J^T of rows with entries within a band, some of them combinations of those before.
struct Banded {
  Eigen::MatrixXd rows, matrix;
  ProfileLdlt factor;
};

Banded banded(std::uint64_t seed, int count, int dependent) {
  Draw draw(seed);
  Banded b;
  const int columns = 3 * count;
  b.rows = Eigen::MatrixXd::Zero(count + dependent, columns);
  for (int i = 0; i < count; ++i)
    for (int k = 0; k < 6 && 3 * i + k < columns; ++k) b.rows(i, 3 * i + k) = draw.uniform(-1, 1);
  for (int i = 0; i < dependent; ++i)
    b.rows.row(count + i) = draw.uniform(-1, 1) * b.rows.row(i) + draw.uniform(-1, 1) * b.rows.row(i + 1);
  b.matrix = b.rows * b.rows.transpose();
  std::vector<std::size_t> first;
  for (Eigen::Index i = 0; i < b.matrix.rows(); ++i) {
    Eigen::Index j = 0;
    while (b.matrix(i, j) == 0.0) ++j;
    first.push_back(static_cast<std::size_t>(j));
  }
  b.factor.start(first);
  for (std::size_t i = 0; i < first.size(); ++i)
    for (std::size_t j = first[i]; j <= i; ++j)
      b.factor.entry(i, j) = b.matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  b.factor.factorise();
  return b;
}

TEST(ProfileLdlt, SolvesAndDropsWhatDepends) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const int dependent : {0, 1, 4}) {
      const Banded b = banded(seed, 12, dependent);
      EXPECT_EQ(b.factor.dropped(), static_cast<std::size_t>(dependent));
      Draw draw(seed);
      // a side that has a solution
      Eigen::VectorXd truth(b.rows.cols());
      for (double& x : truth) x = draw.uniform(-1, 1);
      const Eigen::VectorXd side = b.rows * truth;
      std::vector<double> x(side.begin(), side.end());
      EXPECT_LE(b.factor.make_consistent(&x), 1e-12);
      b.factor.solve(&x);
      const Eigen::VectorXd left =
          b.matrix * Eigen::Map<Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size())) - side;
      EXPECT_LE(left.norm(), 1e-10);
    }
  }
}

// Two anchors of a hinge, whose six rows have rank five. With the axis tilted by t from y, the second anchor's y row adds t^2
// to those before, which rounding then leaves of the row that depends on it.
TEST(ProfileLdlt, SeesOneRowDependWhereAnotherAlmostDoes) {
  for (double tilt = 0.3; tilt > 1e-10; tilt *= 0.7) {
    Eigen::Matrix<double, 6, 6> rows;
    int next = 0;
    for (const Vector3& arm : {Vector3(0.3, -0.2, 0.1), Vector3(0.3 + 0.7 * tilt, 1.8, 0.1 - tilt)})
      for (int k = 0; k < 3; ++k)
        rows.row(next++) << Vector3::Unit(k).transpose(), arm.cross(Vector3::Unit(k)).transpose();
    const Eigen::MatrixXd matrix = rows * rows.transpose();
    ProfileLdlt factor;
    factor.start(std::vector<std::size_t>(6, 0));
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = 0; j <= i; ++j)
        factor.entry(i, j) = matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    factor.factorise();
    EXPECT_EQ(factor.dropped(), 1U) << tilt;
  }
}

// The nearest side that has a solution is that of least squares.
TEST(ProfileLdlt, ContradictionsEndAtLeastSquares) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Banded b = banded(seed, 10, 3);
    Draw draw(seed + 100);
    Eigen::VectorXd side(b.matrix.rows());
    for (double& x : side) x = draw.uniform(-1, 1);
    const Eigen::VectorXd best = b.rows * b.rows.completeOrthogonalDecomposition().solve(side);
    std::vector<double> x(side.begin(), side.end());
    EXPECT_NEAR(b.factor.make_consistent(&x), (side - best).norm(), 1e-10);
    b.factor.solve(&x);
    const Eigen::VectorXd reached =
        b.matrix * Eigen::Map<Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
    EXPECT_LE((reached - best).norm(), 1e-9);
  }
}

// Two pairs of equal rows that meet in nothing: each contradiction is halved where it is, and no rounding reaches the other;
// one of rounding alone stays as it is.
TEST(ProfileLdlt, ContradictionsStayAmongTheRowsThatDepend) {
  ProfileLdlt factor;
  factor.start({0, 0, 0, 0});
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j <= i; ++j) factor.entry(i, j) = i / 2 == j / 2 ? 2.0 : 1e-17;
  factor.factorise();
  ASSERT_EQ(factor.dropped(), 2U);
  std::vector<double> side = {1.0, 2.0, 3.0, 3.0};
  EXPECT_NEAR(factor.make_consistent(&side), std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(side[0], 1.5, 1e-15);
  EXPECT_NEAR(side[1], 1.5, 1e-15);
  EXPECT_EQ(side[2], 3.0);
  EXPECT_EQ(side[3], 3.0);
  std::vector<double> rounded = {1.0, 1.0 + 1e-15, 3.0, 3.0};
  const std::vector<double> before = rounded;
  EXPECT_EQ(factor.make_consistent(&rounded), 0.0);
  EXPECT_EQ(rounded, before);
}

// Large sides of a mechanism hide no contradiction of another one, whichever way their rows are ordered.
TEST(ProfileLdlt, ContradictionsAreSeenBesideLargerSides) {
  for (const std::vector<std::size_t>& mechanism :
       {std::vector<std::size_t>{0, 0, 1, 1, 2, 2}, std::vector<std::size_t>{0, 1, 0, 1, 2, 2}}) {
    std::vector<std::size_t> first(6);
    for (std::size_t i = 0; i < 6; ++i)
      first[i] =
          static_cast<std::size_t>(std::find(mechanism.begin(), mechanism.end(), mechanism[i]) - mechanism.begin());
    ProfileLdlt factor;
    factor.start(first);
    for (std::size_t i = 0; i < 6; ++i)
      for (std::size_t j = first[i]; j <= i; ++j) factor.entry(i, j) = mechanism[i] == mechanism[j] ? 2.0 : 0.0;
    factor.factorise();
    ASSERT_EQ(factor.dropped(), 3U);
    std::vector<double> side;
    double contradicts = 0.0;
    for (const std::size_t which : mechanism) {
      side.push_back(which == 0 ? 1e12 : which == 2 ? -1e12 : 1.0 + contradicts);
      if (which == 1) contradicts = 1e-3;
    }
    EXPECT_NEAR(factor.make_consistent(&side), 1e-3 * std::sqrt(0.5), 1e-12);
    for (std::size_t i = 0; i < 6; ++i) {
      if (mechanism[i] == 1) {
        EXPECT_NEAR(side[i], 1.0005, 1e-12);
      }
    }
  }
}

TEST(ProfileLdlt, OfNothing) {
  ProfileLdlt factor;
  factor.start({});
  factor.factorise();
  std::vector<double> none;
  factor.solve(&none);
  EXPECT_EQ(factor.size(), 0U);
}

}  // namespace
}  // namespace gravitas
