// Every space, with several settings, against the contract: wherever bodies are, however they move, whatever was asked
// before. An instance that has seen everything must answer as one that has seen nothing does.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/sanitized.h"
#include "tests/workers/space/space_scatters.h"

namespace gravitas::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kAbsentSetting = std::nan("");

struct Choice {
  std::string title, library;
  std::vector<double> settings;
};

const std::vector<Choice>& choices() {
  static const std::vector<Choice> all = {
      {"Basic", "space_basic", {}},
      {"GridOfDefaultCells", "space_grid", {kAbsentSetting, 60}},
      {"GridOfFineCells", "space_grid", {0.25, 3}},
      {"GridOfUnitCells", "space_grid", {1.0, 1}},
      {"GridOfCoarseCells", "space_grid", {1000.0, 1e9}},
      {"GridOfTinyCells", "space_grid", {1e-300, 2}},
      {"GridOfGiantCells", "space_grid", {1e300, 2}},
      {"KDTree", "space_kd_tree", {20, 12}},
      {"DeepKDTree", "space_kd_tree", {40, 1}},
      {"UncutKDTree", "space_kd_tree", {0, 1}},
      {"SweepAlongX", "space_sweep_and_prune", {1}},
      {"SweepAlongXOrY", "space_sweep_and_prune", {2}},
      {"SweepAlongAny", "space_sweep_and_prune", {3}},
      {"DynamicBVH", "space_dynamic_bvh", {}},
  };
  return all;
}

class SpaceAgreement : public testing::TestWithParam<Choice> {
 protected:
  std::unique_ptr<PluginUnderTest> fresh() const {
    return std::make_unique<PluginUnderTest>(GetParam().library, GetParam().settings);
  }
  std::unique_ptr<PluginUnderTest> space_ = fresh();
};

TEST_P(SpaceAgreement, HoldsWhereverBodiesAre) {
  std::size_t found = 0;
  const std::uint64_t seeds = harness::unless_sanitized(4000, 5);
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    conformance::Draw random(seed);
    const ScatterKind& kind = kScatters[seed % std::size(kScatters)];
    std::vector<BoundedBody> bodies(random.below(40));
    for (BoundedBody& body : bodies) {
      // now and then one that is none of the kind
      body = (random.below(10) == 0 ? kScatters[random.below(std::size(kScatters))] : kind).scatter(&random);
      give_filters(&random, &body);
    }
    const Pairs expected = expected_pairs(bodies);
    found += expected.size();
    ASSERT_EQ(ask_pairs(space_.get(), bodies), expected) << kind.name << ", seed " << seed;
  }
  // the scatters are not so thin that nothing was tested
  EXPECT_GT(found, 12 * seeds);
}

// Some drift, some rest, some are set elsewhere; now and then a filter, a flag, or the number of bodies changes.
TEST_P(SpaceAgreement, HoldsHoweverBodiesMove) {
  std::size_t found = 0;
  const std::uint64_t seeds = harness::unless_sanitized(250, 5);
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    conformance::Draw random(seed);
    const ScatterKind& kind = kScatters[seed % std::size(kScatters)];
    std::vector<BoundedBody> bodies(1 + random.below(50));
    std::vector<Vector3> velocities;
    for (BoundedBody& body : bodies) {
      body = kind.scatter(&random);
      give_filters(&random, &body);
      const double speed = random.below(3) == 0 ? 0.0 : 0.2 * random.uniform(0.0, 1.0);
      velocities.push_back(random.vector(speed));
    }
    for (int step = 0; step < 25; ++step) {
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        bodies[i].lower += velocities[i];
        bodies[i].upper += velocities[i];
      }
      if (random.below(4) == 0) bodies[random.below(static_cast<std::uint32_t>(bodies.size()))] = kind.scatter(&random);
      if (random.below(12) == 0) give_filters(&random, &bodies[0]);
      if (random.below(15) == 0) {
        bodies.push_back(kScatters[random.below(std::size(kScatters))].scatter(&random));
        velocities.push_back(random.vector(0.1));
      }
      if (random.below(15) == 0 && bodies.size() > 1) bodies.pop_back(), velocities.pop_back();
      const Pairs expected = expected_pairs(bodies);
      found += expected.size();
      ASSERT_EQ(ask_pairs(space_.get(), bodies), expected) << kind.name << ", seed " << seed << ", step " << step;
      // the same again is the same
      if (step == 7) {
        ASSERT_EQ(ask_pairs(space_.get(), bodies), expected) << kind.name << ", seed " << seed;
      }
      if (step == 24) {
        ASSERT_EQ(ask_pairs(fresh().get(), bodies), expected) << kind.name << ", seed " << seed;
      }
    }
  }
  EXPECT_GT(found, 400 * seeds);
}

// Enough bodies and steps that every structure is refitted, migrated and built anew on its way.
TEST_P(SpaceAgreement, HoldsForManyThatDriftThroughEachOther) {
  conformance::Draw random(5);
  std::vector<BoundedBody> bodies;
  std::vector<Vector3> velocities;
  bodies.push_back({Vector3::Constant(-kInfinity), Vector3(kInfinity, -3.0, kInfinity), kHasShape | kUnbounded});
  for (int i = 0; i < 400; ++i) {
    bodies.push_back(cube(random.vector(4.0), random.uniform(0.1, 0.6)));
    velocities.push_back(random.vector(0.05));
  }
  for (int step = 0; step < harness::unless_sanitized(240, 12); ++step) {
    for (std::size_t i = 1; i < bodies.size(); ++i) {
      // each rests for a third of the time, often outside of where it was when its place was last noted
      if ((i + static_cast<std::size_t>(step)) / 4 % 3 == 0) continue;
      Vector3& velocity = velocities[i - 1];
      for (int k = 0; k < 3; ++k)
        if (std::fabs(bodies[i].lower[k]) > 5.0) velocity[k] = -std::copysign(velocity[k], bodies[i].lower[k]);
      bodies[i].lower += velocity;
      bodies[i].upper += velocity;
    }
    ASSERT_EQ(ask_pairs(space_.get(), bodies), expected_pairs(bodies)) << "step " << step;
  }
}

// All in one place, then everywhere, then in one place again.
TEST_P(SpaceAgreement, HoldsThroughAnExplosion) {
  conformance::Draw random(6);
  std::vector<Vector3> directions;
  for (int i = 0; i < 150; ++i) directions.push_back(random.vector(1.0));
  for (const double time : {0.0, 0.0, 0.01, 0.3, 2.0, 30.0, 1e6, 1e12, 30.0, 0.3, 0.0}) {
    std::vector<BoundedBody> bodies;
    for (const Vector3& direction : directions) bodies.push_back(cube(time * direction, 0.25));
    ASSERT_EQ(ask_pairs(space_.get(), bodies), expected_pairs(bodies)) << "time " << time;
  }
}

// One among many goes far away and comes back, again and again.
TEST_P(SpaceAgreement, HoldsWhenOneIsSetElsewhere) {
  conformance::Draw random(7);
  std::vector<BoundedBody> bodies;
  for (int i = 0; i < 200; ++i) bodies.push_back(cube(random.vector(5.0), 0.5));
  for (int step = 0; step < 40; ++step) {
    const double place = step % 3 == 0 ? 1e9 : random.uniform(-5.0, 5.0);
    bodies[random.below(200)] = cube(Vector3(place, 0.0, random.uniform(-5.0, 5.0)), 0.5);
    ASSERT_EQ(ask_pairs(space_.get(), bodies), expected_pairs(bodies)) << "step " << step;
  }
}

TEST_P(SpaceAgreement, HoldsForSizesOfOneToAMillion) {
  conformance::Draw random(8);
  std::vector<BoundedBody> bodies;
  for (int i = 0; i < 500; ++i) {
    const double radius = 1e-3 * std::pow(10.0, random.uniform(0.0, 6.0));
    bodies.push_back(cube(random.vector(500.0), radius));
  }
  for (int step = 0; step < 5; ++step) {
    for (BoundedBody& body : bodies) {
      const Vector3 move = random.vector(0.1 * (body.upper.x() - body.lower.x()));
      body.lower += move, body.upper += move;
    }
    ASSERT_EQ(ask_pairs(space_.get(), bodies), expected_pairs(bodies)) << "step " << step;
  }
}

TEST_P(SpaceAgreement, NamesEachPairOfManyOnce) {
  const std::vector<BoundedBody> bodies(60, cube({0.1, -0.2, 0.3}, 1.4));
  EXPECT_EQ(ask_pairs(space_.get(), bodies).size(), 60U * 59U / 2U);
  EXPECT_EQ(ask_pairs(space_.get(), bodies), expected_pairs(bodies));
}

TEST_P(SpaceAgreement, OfNothingIsNothing) {
  EXPECT_EQ(ask_pairs(space_.get(), {}), Pairs{});
  EXPECT_EQ(ask_pairs(space_.get(), {cube({0, 0, 0}, 1)}), Pairs{});
  EXPECT_EQ(ask_pairs(space_.get(), {}), Pairs{});
}

TEST_P(SpaceAgreement, MarksProgress) {
  ask_pairs(space_.get(), std::vector<BoundedBody>(100, cube({0, 0, 0}, 1)));
  EXPECT_GE(space_->marks, 1);
}

INSTANTIATE_TEST_SUITE_P(All, SpaceAgreement, testing::ValuesIn(choices()),
                         [](const auto& choice) { return choice.param.title; });

}  // namespace
}  // namespace gravitas::test
