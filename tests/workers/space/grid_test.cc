// Space `Grid` answers what the contract says, and so what `Basic` does, wherever the bodies are.
#include <gtest/gtest.h>

#include <cmath>

#include "plugin_sdk/conformance/draw.h"
#include "tests/workers/space/space_problem.h"

namespace gravitas::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kAbsent = std::nan("");

// CellSize and CleanupInterval.
std::vector<double> settings(double cell_size) { return {cell_size, 1.0}; }

// ---- how bodies may lie -------------------------------------------------------------------------

using Scatter = BoundedBody (*)(conformance::Draw* random);

BoundedBody spread(conformance::Draw* random) { return cube(random->vector(10.0), random->uniform(0.2, 1.5)); }
BoundedBody clustered(conformance::Draw* random) {
  const Vector3 centre(random->below(3) * 50.0, random->below(2) * -50.0, 0.0);
  return cube(centre + random->vector(1.0), random->uniform(0.1, 0.6));
}
BoundedBody huge_and_small(conformance::Draw* random) {
  const double size = std::ldexp(1.0, static_cast<int>(random->below(40)) - 25);
  return cube(random->vector(5.0), size);
}
BoundedBody flat_and_long(conformance::Draw* random) {
  const Vector3 centre = random->vector(10.0);
  Vector3 half = random->vector(0.5).cwiseAbs();
  half[static_cast<int>(random->below(3))] *= 200.0;
  return {centre - half, centre + half};
}
BoundedBody in_one_place(conformance::Draw*) { return cube({3.25, -1.5, 7.0}, 0.5); }
BoundedBody points(conformance::Draw* random) {
  const Vector3 p(random->below(4) * 1.0, random->below(4) * 1.0, random->below(2) * 1.0);
  return {p, p};
}
// Bounds on the borders of cells, where bodies touch exactly.
BoundedBody on_a_lattice(conformance::Draw* random) {
  const Vector3 lower(random->below(8) - 4.0, random->below(8) - 4.0, random->below(4) - 2.0);
  return {lower, lower + Vector3(random->below(3), random->below(3), random->below(3))};
}
BoundedBody far_away(conformance::Draw* random) {
  const double scale = std::ldexp(1.0, static_cast<int>(random->below(4)) * 20);
  return cube(scale * random->vector(2.0), scale * random->uniform(0.1, 1.0));
}
// As far as doubles go, where a cell's number no longer fits.
BoundedBody at_the_end_of_the_world(conformance::Draw* random) {
  const double place = random->below(2) == 0 ? 1e300 : -1e300;
  return cube(Vector3(place, 1e18 * random->uniform(-1, 1), 0), random->uniform(0.5, 1e17));
}
BoundedBody unbounded(conformance::Draw* random) {
  BoundedBody body = spread(random);
  if (random->below(4) != 0) return body;
  for (int k = 0; k < 3; ++k) {
    if (random->below(3) != 0) body.lower[k] = -kInfinity;
    if (random->below(3) != 0) body.upper[k] = kInfinity;
  }
  return body;
}

struct Kind {
  const char* name;
  Scatter scatter;
};
constexpr Kind kKinds[] = {{"spread", spread},
                           {"clustered", clustered},
                           {"huge and small", huge_and_small},
                           {"flat and long", flat_and_long},
                           {"in one place", in_one_place},
                           {"points", points},
                           {"on a lattice", on_a_lattice},
                           {"far away", far_away},
                           {"at the end of the world", at_the_end_of_the_world},
                           {"unbounded", unbounded}};

void give_filters(conformance::Draw* random, BoundedBody* body) {
  if (random->below(4) == 0) body->flags = random->below(32);
  if (random->below(3) == 0) {
    body->group = random->below(8);
    body->mask = random->below(8);
  }
}

// One instance of each answers one scatter after the other: what it keeps must not matter.
TEST(GridSpace, AgreesWithBasicAndWithTheContractWhereverBodiesAre) {
  PluginUnderTest basic("space_basic"), by_default("space_grid", settings(kAbsent)), fine("space_grid", settings(0.25)),
      unit("space_grid", settings(1.0)), coarse("space_grid", settings(1000.0)), tiny("space_grid", settings(1e-300)),
      giant("space_grid", settings(1e300));
  std::size_t found = 0;
  for (std::uint64_t seed = 0; seed < 6000; ++seed) {
    conformance::Draw random(seed);
    const Kind& kind = kKinds[seed % std::size(kKinds)];
    std::vector<BoundedBody> bodies(random.below(40));
    for (BoundedBody& body : bodies) {
      // now and then one that is none of the kind
      body = (random.below(10) == 0 ? kKinds[random.below(std::size(kKinds))] : kind).scatter(&random);
      give_filters(&random, &body);
    }
    const Pairs expected = expected_pairs(bodies);
    found += expected.size();
    ASSERT_EQ(ask_pairs(&basic, bodies), expected) << "Basic, " << kind.name << ", seed " << seed;
    for (PluginUnderTest* grid : {&by_default, &fine, &unit, &coarse, &tiny, &giant})
      ASSERT_EQ(ask_pairs(grid, bodies), expected) << kind.name << ", seed " << seed;
  }
  // the scatters are not so thin that nothing was tested
  EXPECT_GT(found, 100'000U);
}

TEST(GridSpace, AgreesOnAThousandBodies) {
  PluginUnderTest grid("space_grid", settings(kAbsent));
  conformance::Draw random(7);
  std::vector<BoundedBody> bodies;
  for (int i = 0; i < 1000; ++i) bodies.push_back(cube(random.vector(8.0), 0.5));
  bodies.push_back({Vector3::Constant(-kInfinity), Vector3(kInfinity, -7.0, kInfinity), kHasShape | kUnbounded});
  const Pairs expected = expected_pairs(bodies);
  EXPECT_GT(expected.size(), 900U);
  EXPECT_EQ(ask_pairs(&grid, bodies), expected);
}

TEST(GridSpace, OfNothingIsNothing) {
  PluginUnderTest grid("space_grid", settings(kAbsent));
  EXPECT_EQ(ask_pairs(&grid, {}), Pairs{});
  EXPECT_EQ(ask_pairs(&grid, {cube({0, 0, 0}, 1)}), Pairs{});
}

// Two bodies that share many cells, one of them tested against all besides.
TEST(GridSpace, NamesEachPairOnce) {
  PluginUnderTest grid("space_grid", settings(1.0));
  const std::vector<BoundedBody> bodies = {cube({0, 0, 0}, 1.4), cube({0.1, 0, 0}, 1.4), cube({0, 0, 0}, 400.0),
                                           cube({0, 1, 0}, 500.0)};
  EXPECT_EQ(ask_pairs(&grid, bodies), (Pairs{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}));
}

TEST(GridSpace, DeclaresItsSettings) {
  PluginUnderTest grid("space_grid", settings(kAbsent));
  const PluginDeclaration& declared = grid.declaration();
  EXPECT_EQ(declared.name, "Grid");
  ASSERT_EQ(declared.properties.size(), 2U);
  EXPECT_EQ(declared.properties[0].name, "CellSize");
  EXPECT_TRUE(declared.properties[0].exclusive_minimum);
  EXPECT_EQ(declared.properties[1].name, "CleanupInterval");
  EXPECT_THROW(PluginUnderTest("space_grid"), std::runtime_error);
}

}  // namespace
}  // namespace gravitas::test
