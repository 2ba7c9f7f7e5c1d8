// Laws that hold in every scene, tried on scenes by chance: eight bodies of all shapes and materials that fly into each
// other in free space, and scenes that are turned, moved, or written in another order.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <vector>

#include "tests/scenes/random_scene.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::random_bodies;
using harness::RandomBody;
using harness::SceneRun;
using harness::set;
using harness::Shapes;

constexpr std::uint64_t kSeeds = 10;

class Conservation : public ::testing::TestWithParam<std::tuple<const char*, Shapes>> {
 protected:
  static std::string integrator() { return std::get<0>(GetParam()); }
  static SceneRun scene(std::uint64_t seed, double time_step, double duration) {
    return SceneRun(scene_text(random_bodies(seed, std::get<1>(GetParam())), time_step, duration),
                    {set("Integrator", integrator())});
  }
};

// Ten scenes for each: sixty in all.
INSTANTIATE_TEST_SUITE_P(EachMethodAndShape, Conservation,
                         ::testing::Combine(::testing::Values("Euler", "SemiImplicitEuler"),
                                            ::testing::Values(Shapes::kSpheres, Shapes::kIsotropic, Shapes::kAny)));

// What momentum is measured against: the sum of the bodies' magnitudes.
double size_of_momentum(const SceneRun& run) {
  double sum = 0.0;
  for (const std::string& id : run.movable_bodies()) sum += run.mass(id) * run.body(id).twist.linear.norm();
  return sum;
}

double size_of_angular_momentum(const SceneRun& run) {
  double sum = 0.0;
  for (const std::string& id : run.movable_bodies()) {
    const SceneRun::Motion m = run.body(id);
    sum += angular_momentum(run.mass(id), run.moments(id), m.pose, m.twist).norm();
  }
  return sum;
}

// The gyroscopic term, taken explicitly, changes a free body's energy in a step by h^2/2 alpha.(I alpha): up where the
// attitude turns by the new velocity, down where by the old one. Zero for bodies with one moment.
double gyroscopic_gain(const SceneRun& run) {
  double sum = 0.0;
  for (const std::string& id : run.movable_bodies()) {
    const SceneRun::Motion m = run.body(id);
    const Vector3 moments = run.moments(id);
    const Vector3 alpha =
        angular_acceleration(m.pose.orientation, m.twist.angular, moments, moments.cwiseInverse(), Vector3::Zero());
    sum += 0.5 * run.time_step() * run.time_step() *
           alpha.dot(m.pose.orientation * moments.cwiseProduct(m.pose.orientation.conjugate() * alpha));
  }
  return sum;
}

TEST_P(Conservation, MomentumStaysToRoundingAndEnergyNeverRises) {
  std::uint32_t impacts = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SceneRun run = scene(seed, 1.0 / 240, 1.5);
    const Vector3 momentum = run.momentum();
    const double size = size_of_momentum(run), energy = run.energy();
    double before = energy;
    while (!run.is_done()) {
      const double gain = integrator() == "Euler" ? 0.0 : gyroscopic_gain(run);
      run.step();
      ASSERT_LE((run.momentum() - momentum).norm(), 1e-14 * size) << "seed " << seed << " at " << run.time();
      // a body that is hit in this step gains less than it would alone, so this bounds it too
      ASSERT_LE(run.energy(), before + gain + 1e-14 * energy) << "seed " << seed << " at " << run.time();
      before = run.energy();
    }
    // sweeps may run out where three bodies meet edge on edge; what they leave is taken back in the next steps
    EXPECT_LE(run.report().max_penetration(), 1e-4) << "seed " << seed;
    impacts += run.count_events(EventKind::kCollisionStart);
  }
  EXPECT_GE(impacts, 5 * kSeeds);
}

// An impact is put right at the end of the step that it falls into: the overlap is taken back along the normal, across
// the bodies' sliding motion, which changes the angular momentum by n x v_t times the reduced mass times the overlap. The
// overlap is of first order, and so is the change. (The impulses themselves act at one point and change nothing.)
TEST_P(Conservation, AngularMomentumStaysToFirstOrder) {
  double sum[2] = {0.0, 0.0};
  for (int fine = 0; fine < 2; ++fine) {
    const double h = fine == 0 ? 1.0 / 240 : 1.0 / 960;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      SceneRun run = scene(seed, h, 1.5);
      const Vector3 turn = run.angular_momentum();
      const double size = size_of_angular_momentum(run);
      double worst = 0.0;
      while (!run.is_done()) {
        run.step();
        worst = std::max(worst, (run.angular_momentum() - turn).norm() / size);
      }
      EXPECT_LE(worst, 4.0 * h) << "seed " << seed;
      sum[fine] += worst;
    }
  }
  // a quarter of the time step leaves about a quarter
  EXPECT_GT(sum[0] / sum[1], 2.5);
  EXPECT_LT(sum[0] / sum[1], 6.5);
}

// Largest differences of positions and velocities between two runs, the first seen from a moved frame.
double difference(const SceneRun& a, const Pose& by, const SceneRun& b) {
  double largest = 0.0;
  for (const std::string& id : a.movable_bodies()) {
    const SceneRun::Motion one = a.body(id), two = b.body(id);
    const Pose moved = compose(by, one.pose);
    largest = std::max({largest, (moved.position - two.pose.position).norm(),
                        harness::angle_between(moved.orientation, two.pose.orientation),
                        (by.orientation * one.twist.linear - two.twist.linear).norm(),
                        (by.orientation * one.twist.angular - two.twist.angular).norm()});
  }
  return largest;
}

// Rounding grows by a factor of some ten in each of the few impacts that a body has in this time.
constexpr double kGrownRounding = 1e-9;

TEST_P(Conservation, TheOrderOfTheBodiesInTheSceneDoesNotMatter) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    std::vector<RandomBody> bodies = random_bodies(seed, std::get<1>(GetParam()));
    SceneRun one(scene_text(bodies, 1.0 / 240, 1.0), {set("Integrator", integrator())});
    std::reverse(bodies.begin(), bodies.end());
    std::rotate(bodies.begin(), bodies.begin() + 3, bodies.end());
    SceneRun other(scene_text(bodies, 1.0 / 240, 1.0), {set("Integrator", integrator())});
    one.to_end();
    other.to_end();
    EXPECT_LE(difference(one, Pose{}, other), kGrownRounding) << "seed " << seed;
  }
}

TEST_P(Conservation, AMovedAndTurnedSceneMovesAlike) {
  const Pose by{Vector3(3, -2, 5), harness::turned(Vector3(1, 2, -1), 1.1)};
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    std::vector<RandomBody> bodies = random_bodies(seed, std::get<1>(GetParam()));
    SceneRun one(scene_text(bodies, 1.0 / 240, 1.0), {set("Integrator", integrator())});
    for (RandomBody& body : bodies) body = harness::displaced(body, by);
    SceneRun other(scene_text(bodies, 1.0 / 240, 1.0), {set("Integrator", integrator())});
    one.to_end();
    other.to_end();
    EXPECT_LE(difference(one, by, other), kGrownRounding) << "seed " << seed;
  }
}

}  // namespace
}  // namespace gravitas
