// Reference problems of jointed motion at their targets, with the simulator Smooth: closed forms and references of 17
// digits, each at a fixed step of a millisecond and at the best that is asked for.
#include <gtest/gtest.h>

#include "tests/numerics/motion_problem.h"

namespace gravitas {
namespace {

using testing::MotionMethod;
using testing::MotionProblem;
using testing::MotionResult;

const MotionMethod kRk4{"RK4", "integrator_rk4", {}};
const MotionMethod kSixth{"SymplecticSplitting 6", "integrator_symplectic_splitting", {6}};

MotionMethod dormand_prince(double accuracy) { return {"DormandPrince54", "integrator_dormand_prince54", {accuracy}}; }

// IFToMM A01.
TEST(Problems, PointPendulum) {
  const MotionProblem problem = testing::point_pendulum();
  const MotionResult millisecond = testing::run_motion(problem, kRk4, 10000);
  EXPECT_LT(millisecond.error, 1e-6);
  EXPECT_LT(millisecond.joint_error, 1e-13);
  const MotionResult accurate = testing::run_motion(problem, kSixth, 4000);
  EXPECT_LT(accurate.error, 1e-11);
  EXPECT_LT(accurate.joint_error, 1e-13);
}

TEST(Problems, SphericalPendulum) {
  EXPECT_LT(testing::run_motion(testing::spherical_pendulum(), dormand_prince(1e-12), 200).error, 1e-10);
}

// Bruels and Cardona.
TEST(Problems, HeavyTop) {
  const MotionProblem problem = testing::heavy_top();
  EXPECT_LT(testing::run_motion(problem, kRk4, 2000).error, 1e-4);
  const MotionResult accurate = testing::run_motion(problem, dormand_prince(1e-12), 100);
  EXPECT_LT(accurate.error, 1e-9);
  EXPECT_LT(accurate.joint_error, 1e-13);
}

// Chaotic, so that 1e-12 at 5 s is some roundings at the start.
TEST(Problems, DoublePendulum) {
  EXPECT_LT(testing::run_motion(testing::double_pendulum(), dormand_prince(1e-12), 100).error, 1e-11);
}

// IFToMM A02, half of its 20 s: two loops of rods that are redundant in space and singular twice a turn. The step must
// be small enough that the state at the singularity is nearer to its own branch than to the other.
TEST(Problems, FourBarPassesItsSingularities) {
  const MotionResult result = testing::run_motion(testing::four_bar(), kRk4, 6400);
  EXPECT_LT(result.error, 1e-3);
  EXPECT_LT(result.joint_error, 1e-12);
}

}  // namespace
}  // namespace gravitas
