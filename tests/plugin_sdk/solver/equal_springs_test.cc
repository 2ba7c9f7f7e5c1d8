// EqualSprings: nearest sides, and shares of a load, against dense least squares and closed forms.
#include "plugin_sdk/solver/equal_springs.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "plugin_sdk/conformance/draw.h"

namespace gravitas {
namespace {

using conformance::Draw;

struct TestRow {
  std::uint32_t body1, body2;
  ConstraintDirection direction;
};

std::vector<SolverBody> bodies_of(std::uint32_t count, double mass) {
  SolverBody body;
  body.inverse_mass = 1.0 / mass;
  body.inverse_inertia = Matrix3::Identity() * (3.0 / mass);
  std::vector<SolverBody> bodies(count, body);
  bodies.push_back(SolverBody{});  // the world
  return bodies;
}

// By row, what a motion of the bodies does to it.
Eigen::MatrixXd matrix_of(const std::vector<TestRow>& rows, std::uint32_t count) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), 6 * (count + 1));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto r = static_cast<Eigen::Index>(i);
    matrix.block<1, 3>(r, 6 * rows[i].body1) -= rows[i].direction.linear.transpose();
    matrix.block<1, 3>(r, 6 * rows[i].body1 + 3) += rows[i].direction.angular1.transpose();
    matrix.block<1, 3>(r, 6 * rows[i].body2) += rows[i].direction.linear.transpose();
    matrix.block<1, 3>(r, 6 * rows[i].body2 + 3) += rows[i].direction.angular2.transpose();
  }
  return matrix.leftCols(6 * count);
}

// Three bodies in a ring with the world and across it, six rows each: twice as many as freedoms.
std::vector<TestRow> ring(Draw* draw) {
  std::vector<TestRow> rows;
  for (const auto& [one, two] : {std::pair(3U, 0U), {0U, 1U}, {1U, 2U}, {2U, 3U}, {0U, 2U}, {1U, 3U}})
    for (int k = 0; k < 6; ++k) {
      TestRow row{one, two, {}};
      row.direction.linear = draw->vector(1.0);
      row.direction.angular1 = one == 3 ? Vector3::Zero() : draw->vector(1.0);
      row.direction.angular2 = two == 3 ? Vector3::Zero() : draw->vector(1.0);
      rows.push_back(row);
    }
  return rows;
}

// With roots of their stiffnesses.
EqualSprings springs_of(const std::vector<TestRow>& rows, const Eigen::VectorXd& weight) {
  const std::vector<SolverBody> bodies = bodies_of(3, 2.0);
  EqualSprings springs;
  springs.start(bodies.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double root = weight[static_cast<Eigen::Index>(i)];
    springs.add(rows[i], bodies, root * root);
  }
  springs.factorise();
  return springs;
}

TEST(EqualSprings, FitsTheNearestThatMotionsMake) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Draw draw(seed);
    const std::vector<TestRow> rows = ring(&draw);
    Eigen::VectorXd weight(36), target(36);
    for (double& number : weight) number = draw.uniform(0.1, 10);
    for (double& number : target) number = draw.uniform(-1, 1);
    const EqualSprings springs = springs_of(rows, weight);
    const Eigen::MatrixXd matrix = matrix_of(rows, 3);
    const Eigen::VectorXd motion =
        (weight.asDiagonal() * matrix).colPivHouseholderQr().solve(weight.asDiagonal() * target);
    std::vector<double> fitted(target.begin(), target.end());
    springs.fit(&fitted);
    EXPECT_LE((Eigen::VectorXd::Map(fitted.data(), 36) - matrix * motion).norm(), 1e-9) << seed;
  }
}

// The same push, and the shortest that is.
TEST(EqualSprings, ShareTheLoadTheyAreGiven) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Draw draw(seed);
    const std::vector<TestRow> rows = ring(&draw);
    const EqualSprings springs = springs_of(rows, Eigen::VectorXd::Ones(36));
    std::vector<double> shares(36);
    for (double& share : shares) share = draw.uniform(-1, 1);
    const Eigen::MatrixXd push = matrix_of(rows, 3).transpose();
    const Eigen::VectorXd load = push * Eigen::VectorXd::Map(shares.data(), 36);
    ASSERT_TRUE(springs.share(&shares));
    const Eigen::VectorXd shared = Eigen::VectorXd::Map(shares.data(), 36);
    EXPECT_LE((push * shared - load).norm(), 1e-12) << seed;
    EXPECT_LE((shared - push.completeOrthogonalDecomposition().solve(load)).norm(), 1e-9) << seed;
  }
}

// A beam on three supports, pressed at a: each bears F/3 + F a x/sum of x^2, both from their middle, whatever
// the beam's mass. Tilts by rounding alone are none: balanced, too, they would leave the shares as they came.
TEST(EqualSprings, ABeamOnThreeSupports) {
  constexpr double kForce = 60.0;
  for (const double mass : {1e-3, 1.0, 1e4})
    for (const double at : {0.0, 0.7})
      for (const double tilt : {0.0, 1e-16, 1e-13}) {
        const std::vector<SolverBody> bodies = bodies_of(1, mass);
        EqualSprings springs;
        springs.start(bodies.size());
        const double places[] = {-1.0, 0.5, 2.0};
        for (int i = 0; i < 3; ++i)
          springs.add(TestRow{1, 0,
                              ConstraintDirection::through({places[i], 0, 0}, Vector3(tilt * i, 1, tilt * (i - 1)),
                                                           bodies[1], bodies[0])},
                      bodies, 1.0);
        springs.factorise();
        // two of them bear it all
        std::vector<double> shares = {kForce * (2.0 - at) / 3.0, 0.0, kForce * (at + 1.0) / 3.0};
        ASSERT_TRUE(springs.share(&shares));
        for (int i = 0; i < 3; ++i) {
          const double x = places[i] - 0.5;
          EXPECT_NEAR(shares[static_cast<std::size_t>(i)], kForce / 3.0 + kForce * (at - 0.5) * x / 4.5, 1e-7)
              << mass << ' ' << at << ' ' << tilt;
        }
      }
}

// Rows that give way by themselves, and bodies that nothing pushes or turns, take no part.
TEST(EqualSprings, LeaveWhatIsNoSpring) {
  std::vector<SolverBody> bodies = bodies_of(2, 1.0);
  bodies[1].inverse_inertia.setZero();
  EqualSprings springs;
  springs.start(bodies.size());
  const auto row = [&](std::uint32_t one, std::uint32_t two, double x) {
    return TestRow{one, two, ConstraintDirection::through({x, 0, 0}, Vector3::UnitY(), bodies[one], bodies[two])};
  };
  springs.add(row(2, 0, 0), bodies, 1.0);
  springs.add(row(2, 0, 0), bodies, 3.0);
  springs.add(row(2, 0, 0), bodies, 0.0);
  springs.add(row(2, 1, 5), bodies, 1.0);
  springs.add(row(2, 2, 0), bodies, 1.0);
  springs.factorise();
  std::vector<double> shares = {4.0, 0.0, 7.0, 2.0, 0.0};
  ASSERT_TRUE(springs.share(&shares));
  EXPECT_NEAR(shares[0], 1.0, 1e-12);
  EXPECT_NEAR(shares[1], 3.0, 1e-12);
  EXPECT_EQ(shares[2], 7.0);
  EXPECT_NEAR(shares[3], 2.0, 1e-12);
  std::vector<double> numbers = {1.0, 2.0, 7.0, 2.0, 3.0};
  springs.fit(&numbers);
  EXPECT_NEAR(numbers[0], 1.75, 1e-12);
  EXPECT_NEAR(numbers[1], 1.75, 1e-12);
  EXPECT_EQ(numbers[2], 7.0);
  EXPECT_NEAR(numbers[3], 2.0, 1e-12);
  EXPECT_EQ(numbers[4], 0.0);
}

}  // namespace
}  // namespace gravitas
