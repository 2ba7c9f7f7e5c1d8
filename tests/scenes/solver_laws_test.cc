// Laws that every solver keeps, tried on scenes by chance, and scenes that are written in another order or mirrored.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
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

constexpr std::uint64_t kLawSeeds = 6;

class SolverLaws : public ::testing::TestWithParam<std::tuple<const char*, Shapes>> {
 protected:
  static std::vector<RandomBody> bodies(std::uint64_t seed) { return random_bodies(seed, std::get<1>(GetParam())); }
  static SceneRun scene(const std::vector<RandomBody>& bodies, double duration) {
    return SceneRun(scene_text(bodies, 1.0 / 240, duration),
                    {set("Integrator", "Euler"), set("Solver", std::get<0>(GetParam()))});
  }
};

// Sequential's are in conservation_test.cc.
INSTANTIATE_TEST_SUITE_P(OfEach, SolverLaws,
                         ::testing::Combine(::testing::Values("Newton", "Direct"),
                                            ::testing::Values(Shapes::kIsotropic, Shapes::kAny)));

TEST_P(SolverLaws, MomentumStaysToRoundingAndEnergyNeverRises) {
  std::uint32_t impacts = 0;
  for (std::uint64_t seed = 1; seed <= kLawSeeds; ++seed) {
    SceneRun run = scene(bodies(seed), 1.5);
    const Vector3 momentum = run.momentum();
    double size = 0.0;
    for (const std::string& id : run.movable_bodies()) size += run.mass(id) * run.body(id).twist.linear.norm();
    const double energy = run.energy();
    double before = energy;
    while (!run.is_done()) {
      run.step();
      // rounding of the impulses, of which a step of 1e-16 each adds up over 360 steps
      ASSERT_LE((run.momentum() - momentum).norm(), 1e-13 * size) << "seed " << seed << " at " << run.time();
      // (Euler's gyroscopic term takes energy, never gives it)
      ASSERT_LE(run.energy(), before + 1e-13 * energy) << "seed " << seed << " at " << run.time();
      before = run.energy();
    }
    EXPECT_LE(run.report().max_penetration(), 1e-4) << "seed " << seed;
    impacts += run.count_events(EventKind::kCollisionStart);
  }
  EXPECT_GE(impacts, 5 * kLawSeeds);
}

// Seen in a mirror at x = 0: positions and velocities are vectors, turning is not.
SceneRun::Motion mirrored(const SceneRun::Motion& m) {
  const Quaternion& q = m.pose.orientation;
  return {.pose = {m.pose.position.cwiseProduct(Vector3(-1, 1, 1)), Quaternion(q.w(), q.x(), -q.y(), -q.z())},
          .twist = {m.twist.linear.cwiseProduct(Vector3(-1, 1, 1)), m.twist.angular.cwiseProduct(Vector3(1, -1, -1))}};
}

double difference(const SceneRun::Motion& one, const SceneRun::Motion& two) {
  return std::max({(one.pose.position - two.pose.position).norm(),
                   harness::angle_between(one.pose.orientation, two.pose.orientation),
                   (one.twist.linear - two.twist.linear).norm(), (one.twist.angular - two.twist.angular).norm()});
}

// Rounding grows by a factor of some ten in each of the few impacts that a body has in this time.
constexpr double kLawRounding = 1e-9;

TEST_P(SolverLaws, AnotherOrderOfTheBodiesGivesTheSameMotion) {
  for (std::uint64_t seed = 1; seed <= kLawSeeds; ++seed) {
    std::vector<RandomBody> all = bodies(seed);
    SceneRun one = scene(all, 0.8);
    std::reverse(all.begin(), all.end());
    std::rotate(all.begin(), all.begin() + 3, all.end());
    SceneRun other = scene(all, 0.8);
    one.to_end();
    other.to_end();
    for (const std::string& id : one.movable_bodies())
      EXPECT_LE(difference(one.body(id), other.body(id)), kLawRounding) << "seed " << seed << ", " << id;
  }
}

TEST_P(SolverLaws, AMirroredSceneMovesMirrored) {
  for (std::uint64_t seed = 1; seed <= kLawSeeds; ++seed) {
    std::vector<RandomBody> all = bodies(seed);
    SceneRun one = scene(all, 0.8);
    for (RandomBody& body : all) {
      const SceneRun::Motion seen = mirrored({body.pose, body.twist});
      body.pose = seen.pose, body.twist = seen.twist;
    }
    SceneRun other = scene(all, 0.8);
    one.to_end();
    other.to_end();
    for (const std::string& id : one.movable_bodies())
      EXPECT_LE(difference(mirrored(one.body(id)), other.body(id)), kLawRounding) << "seed " << seed << ", " << id;
  }
}

}  // namespace
}  // namespace gravitas
