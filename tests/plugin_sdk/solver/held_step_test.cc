// HeldStep against the dense matrix of the same rows.
#include "plugin_sdk/solver/held_step.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

#include "tests/workers/solver/solver_problem.h"

namespace gravitas {
namespace {

struct Row {
  std::uint32_t body1, body2;
  ConstraintDirection direction;
};

struct BodyReader {
  SolverBodies* bodies;
  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply&) { bodies->load(request); }
};

class HeldStepTest : public testing::Test {
 protected:
  // An immovable body, and others of which one has infinite moments.
  HeldStepTest() {
    SolverProblem problem;
    problem.add_immovable();
    const std::vector<double> masses = {1.0, 1e3, 0.01, 7.0};
    for (const double mass : masses)
      problem.add_body({.mass = mass,
                        .moments = mass * Vector3(0.1, 0.2, 0.25),
                        .pose = {random_vector(), Quaternion(1, 0.3, -0.2, 0.5).normalized()}});
    set_vector(problem.inverse_inertia, 2, Vector3::Zero());
    problem.solve(BodyReader{&bodies_});
  }

  double random() { return std::uniform_real_distribution<double>(-1.0, 1.0)(draw_); }
  Vector3 random_vector() { return {random(), random(), random()}; }

  void add(std::uint32_t one, std::uint32_t two, const Vector3& point, const Vector3& axis) {
    rows_.push_back({one, two, ConstraintDirection::through(point, axis.normalized(), bodies_[one], bodies_[two])});
  }

  const Row& row(Eigen::Index i) const { return rows_[static_cast<std::size_t>(i)]; }
  double scale(const Row& row) const { return std::sqrt(coupling(row, row, bodies_)); }

  Eigen::MatrixXd response(double softness) const {
    const auto count = static_cast<Eigen::Index>(rows_.size());
    Eigen::MatrixXd w(count, count);
    for (Eigen::Index i = 0; i < count; ++i)
      for (Eigen::Index j = 0; j < count; ++j)
        w(i, j) = coupling(row(i), row(j), bodies_) / (scale(row(i)) * scale(row(j)));
    w.diagonal().array() += softness;
    return w;
  }

  // What the step leaves of the side, as a share of it.
  double missed(double softness, const std::vector<double>& side) {
    HeldStep step;
    step.start(bodies_);
    for (const Row& row : rows_) step.add(row.body1, row.body2, row.direction, scale(row), softness);
    EXPECT_TRUE(step.factorise());
    std::vector<double> change = side;
    step.solve(&change);
    const Eigen::Map<const Eigen::VectorXd> d(change.data(), static_cast<Eigen::Index>(change.size())),
        r(side.data(), static_cast<Eigen::Index>(side.size()));
    return (response(softness) * d - r).norm() / r.norm();
  }

  std::mt19937_64 draw_{7};
  SolverBodies bodies_;
  std::vector<Row> rows_;
};

TEST_F(HeldStepTest, SolvesWhatTheDenseMatrixDoes) {
  for (const auto& [one, two] : std::vector<std::pair<std::uint32_t, std::uint32_t>>{
           {0, 1}, {2, 1}, {1, 3}, {3, 4}, {4, 0}, {1, 4}})  // a loop, in either order of bodies
    for (int k = 0; k < 2; ++k) add(one, two, random_vector(), random_vector());
  std::vector<double> side;
  for (std::size_t i = 0; i < rows_.size(); ++i) side.push_back(random());
  // rounding of a difference that the softness divides
  for (const double softness : {0.5, 1e-3, 1e-6}) EXPECT_LE(missed(softness, side), 1e-14 / softness) << softness;
}

TEST_F(HeldStepTest, RowsThatDependOnEachOtherAreSharedOut) {
  // eight rows on one body, which has six freedoms, and a side that a motion of it meets
  for (int k = 0; k < 8; ++k) add(0, 1, random_vector(), random_vector());
  const Twist motion{random_vector(), random_vector()};
  std::vector<double> side;
  for (const Row& row : rows_) side.push_back(row.direction.along({}, motion) / scale(row));
  EXPECT_LE(missed(1e-7, side), 1e-7);
}

TEST_F(HeldStepTest, WithoutBodiesToPushNothingIsMet) {
  rows_.push_back({0, 0, {}});
  HeldStep step;
  step.start(bodies_);
  step.add(0, 0, rows_[0].direction, 1.0, 0.25);
  ASSERT_TRUE(step.factorise());
  std::vector<double> change = {1.0};
  step.solve(&change);
  EXPECT_EQ(change[0], 4.0);
}

}  // namespace
}  // namespace gravitas
