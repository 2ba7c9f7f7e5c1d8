// In which order rows of joints are eliminated: what a profile then holds is known for chains, trees and nets.
#include "plugin_sdk/solver/elimination_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/profile_ldlt.h"

namespace gravitas {
namespace {

using Rows = std::vector<RowEnds>;

// Three rows for each.
Rows rows_of(const Rows& joints) {
  Rows rows;
  for (const RowEnds& joint : joints) rows.insert(rows.end(), 3, joint);
  return rows;
}

std::size_t entries_of_profile(const Rows& rows) {
  std::map<std::uint32_t, std::size_t> first_of;
  std::size_t entries = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::size_t first = i;
    for (const std::uint32_t body : {rows[i].first, rows[i].second})
      if (body != kNone) first = std::min(first, first_of.emplace(body, i).first->second);
    entries += i - first;
  }
  return entries;
}

// Each row once, those of a joint in their order and next to each other.
Rows ordered(const Rows& rows) {
  const std::vector<std::uint32_t> order = elimination_order(rows);
  EXPECT_EQ(order.size(), rows.size());
  std::vector<std::uint32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  Rows result;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    EXPECT_EQ(sorted[i], i);
    EXPECT_EQ(order[i] % 3, i % 3);
    if (i % 3 != 0) EXPECT_EQ(order[i], order[i - 1] + 1);
    result.push_back(rows[order[i]]);
  }
  return result;
}

Rows shuffled(Rows joints, std::uint64_t seed) {
  conformance::Draw draw(seed);
  for (std::size_t i = joints.size(); i > 1; --i)
    std::swap(joints[i - 1], joints[static_cast<std::size_t>(draw.uniform(0.0, 1.0) * static_cast<double>(i))]);
  return joints;
}

Rows chain(std::uint32_t count) {
  Rows joints{{kNone, 0}};
  for (std::uint32_t i = 1; i < count; ++i) joints.emplace_back(i - 1, i);
  return joints;
}

TEST(EliminationOrder, ChainsAreBands) {
  constexpr std::uint32_t kLinks = 400;
  for (const std::uint64_t seed : {1U, 2U, 3U})
    EXPECT_EQ(entries_of_profile(ordered(rows_of(shuffled(chain(kLinks), seed)))),
              entries_of_profile(rows_of(chain(kLinks))));
}

TEST(EliminationOrder, ManyChainsAreApart) {
  Rows joints;
  for (std::uint32_t i = 0; i < 300; ++i) joints.emplace_back(kNone, 2 * i);
  for (std::uint32_t i = 0; i < 300; ++i) joints.emplace_back(2 * i, 2 * i + 1);
  EXPECT_EQ(entries_of_profile(ordered(rows_of(joints))), 300U * (0 + 1 + 2 + 3 + 4 + 5));
}

// The smaller branch of each body lies between: at most n log2 n / 2 of three rows, and what its joints share.
TEST(EliminationOrder, TreesCostNLogN) {
  Rows joints;
  constexpr std::uint32_t kBodies = 1023;
  for (std::uint32_t i = 1; i < kBodies; ++i) joints.emplace_back((i - 1) / 2, i);
  const double n = kBodies;
  EXPECT_LT(static_cast<double>(entries_of_profile(ordered(rows_of(joints)))), 9.0 * n * (0.5 * std::log2(n) + 2.0));
  EXPECT_LT(static_cast<double>(entries_of_profile(ordered(rows_of(shuffled(joints, 1))))),
            9.0 * n * (0.5 * std::log2(n) + 2.0));
}

// As wide as the net: two joints a bead.
TEST(EliminationOrder, NetsAreBands) {
  constexpr std::uint32_t kSide = 20;
  Rows joints;
  const auto bead = [](std::uint32_t x, std::uint32_t y) { return x + kSide * y; };
  for (std::uint32_t y = 0; y < kSide; ++y)
    for (std::uint32_t x = 1; x < kSide; ++x) joints.emplace_back(bead(x - 1, y), bead(x, y));
  for (std::uint32_t y = 1; y < kSide; ++y)
    for (std::uint32_t x = 0; x < kSide; ++x) joints.emplace_back(bead(x, y - 1), bead(x, y));
  const std::size_t wide = 3 * 2 * (kSide + 2);
  EXPECT_LT(entries_of_profile(ordered(rows_of(joints))), wide * 3 * joints.size());
}

TEST(EliminationOrder, LeavesWhatIsInOrder) {
  EXPECT_TRUE(elimination_order(rows_of(chain(1000))).empty());
  EXPECT_TRUE(elimination_order({}).empty());
  // whatever comes first, all meet
  Rows hub;
  for (std::uint32_t i = 1; i < 200; ++i) hub.emplace_back(0, i);
  EXPECT_TRUE(elimination_order(rows_of(hub)).empty());
}

TEST(EliminationOrder, TheSameTwiceAndForBodiesOfOtherNumbers) {
  const Rows rows = rows_of(shuffled(chain(300), 5));
  Rows moved = rows;
  for (RowEnds& ends : moved) {
    if (ends.first != kNone) ends.first += 1000;
    ends.second += 1000;
  }
  EXPECT_EQ(elimination_order(rows), elimination_order(rows));
  EXPECT_EQ(elimination_order(rows), elimination_order(moved));
}

TEST(ProfileLdlt, RefusesMoreThanTwoGigabytes) {
  ProfileLdlt factor;
  const std::vector<std::size_t> all_meet(40'000, 0);
  try {
    factor.start(all_meet);
    FAIL() << "took 6 GB";
  } catch (const Refusal& refusal) {
    EXPECT_EQ(std::string(refusal.what()),
              "40000 rows of joints depend on each other so that their factors take 5 GB; at most 2 GB are taken");
  }
}

}  // namespace
}  // namespace gravitas
