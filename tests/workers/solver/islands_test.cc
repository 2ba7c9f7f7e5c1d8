// Islands: what connects, what does not, and that order is none of it.
#include "plugin_sdk/solver/islands.h"

#include <gtest/gtest.h>

#include <span>
#include <vector>

#include "tests/workers/solver/solver_problem.h"

namespace gravitas {
namespace {

std::vector<Island> islands_of(const SolverProblem& problem) {
  struct Finder {
    std::vector<Island> found;
    void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply&) {
      SolverBodies bodies;
      bodies.load(request);
      IslandFinder finder;
      const std::span<const Island> islands = finder.find(request, bodies);
      found.assign(islands.begin(), islands.end());
    }
  } finder;
  problem.solve(finder);
  return finder.found;
}

TEST(Islands, TheGroundConnectsNothingJointsAndContactsDo) {
  SolverProblem p;
  const auto ground = p.add_immovable();
  std::vector<std::uint32_t> body;
  for (int i = 0; i < 7; ++i) body.push_back(p.add_body({}));
  const auto lift = p.add_body({.kinematic = true});
  for (const std::uint32_t b : {body[0], body[1], body[2], body[5]})
    p.add_contact({.body1 = ground, .body2 = b, .key = b});
  p.add_contact({.body1 = body[2], .body2 = body[1], .key = 100});
  p.add_contact({.body1 = ground, .body2 = lift, .key = 101});
  p.add_discrepancy(body[5], body[3], Discrepancy{});
  p.add_discrepancy(lift, body[0], Discrepancy{});
  p.add_discrepancy(kNone, body[4], Discrepancy{});

  const std::vector<Island> islands = islands_of(p);
  ASSERT_EQ(islands.size(), 4U);  // body 6 is free
  EXPECT_EQ(islands[0].bodies, (std::vector<std::uint32_t>{body[0]}));
  EXPECT_EQ(islands[0].contacts, (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(islands[0].discrepancies, (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(islands[1].bodies, (std::vector<std::uint32_t>{body[1], body[2]}));
  EXPECT_EQ(islands[1].contacts, (std::vector<std::uint32_t>{1, 2, 4}));
  EXPECT_EQ(islands[2].bodies, (std::vector<std::uint32_t>{body[3], body[5]}));
  EXPECT_EQ(islands[2].contacts, (std::vector<std::uint32_t>{3}));
  EXPECT_EQ(islands[2].discrepancies, (std::vector<std::uint32_t>{0}));
  EXPECT_EQ(islands[3].bodies, (std::vector<std::uint32_t>{body[4]}));
}

TEST(Islands, ALongChainIsOneWhateverItsOrder) {
  SolverProblem forward, backward;
  for (int i = 0; i < 50; ++i) forward.add_body({}), backward.add_body({});
  for (std::uint32_t i = 0; i + 1 < 50; ++i) {
    forward.add_discrepancy(i, i + 1, Discrepancy{});
    backward.add_discrepancy(49 - i, 48 - i, Discrepancy{});
  }
  ASSERT_EQ(islands_of(forward).size(), 1U);
  ASSERT_EQ(islands_of(backward).size(), 1U);
  EXPECT_EQ(islands_of(forward)[0].bodies, islands_of(backward)[0].bodies);
}

}  // namespace
}  // namespace gravitas
