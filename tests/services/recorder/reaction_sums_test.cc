// Sums of attempts at a part of a step that have a known limit, and such as have none.
#include "services/recorder/reaction_sums.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/extrapolation.h"

namespace gravitas {
namespace {

constexpr ReactionKey kJoint{false, {0, 0, 0}}, kContact{true, {1, 2, 7}}, kOther{true, {0, 3, 7}};
const Vector3 kTendsTo(1, 2, 3), kOfOneStep(4, -5, 6);
// 0 is the ground; 1 and 2 are connected, 3 is not
const std::vector<std::uint32_t> kFlags{0, kMovable, kMovable, kMovable};

ReactionSum sum_of(double pieces, std::array<std::uint32_t, 2> bodies) {
  ReactionSum sum;
  sum.impulse = kTendsTo + kOfOneStep / pieces;
  sum.turn = -sum.impulse;
  sum.point = 2.0 * sum.impulse;
  sum.inner_steps = static_cast<std::uint32_t>(pieces);
  sum.bodies = bodies;
  return sum;
}

std::vector<ReactionSums> attempts_of(std::uint32_t count) {
  std::vector<ReactionSums> attempts(count);
  for (std::uint32_t n = 1; n <= count; ++n) {
    attempts[n - 1][kJoint] = sum_of(n, {kNone, 1});
    attempts[n - 1][kJoint].drive_turn = attempts[n - 1][kJoint].impulse;
    attempts[n - 1][kContact] = sum_of(n, {1, 2});
    attempts[n - 1][kOther] = sum_of(n, {0, 3});
  }
  return attempts;
}

std::vector<double> weights_of(std::uint32_t count) {
  Extrapolation extrapolation;
  extrapolation.begin();
  for (std::uint32_t n = 1; n <= count; ++n) extrapolation.put(1.0 / n, 1.0), extrapolation.add();
  return {extrapolation.weights().begin(), extrapolation.weights().end()};
}

// To what was told of parts before, 10 of each number.
ReactionSums told(const std::vector<ReactionSums>& attempts, const std::vector<double>& weights) {
  ReactionSums sums = attempts.back();
  for (auto& [key, sum] : sums) sum.impulse += Vector3::Constant(10.0);
  extrapolate_reactions(attempts, weights, kFlags, &sums);
  for (auto& [key, sum] : sums) sum.impulse -= Vector3::Constant(10.0);
  return sums;
}

void expect_limit(const ReactionSum& sum) {
  EXPECT_LE((sum.impulse - kTendsTo).norm(), 1e-13);
  EXPECT_LE((sum.turn + kTendsTo).norm(), 1e-13);
  EXPECT_LE((sum.point - 2.0 * kTendsTo).norm(), 1e-13);
}
void expect_finest(const ReactionSum& sum, std::uint32_t count) {
  EXPECT_LE((sum.impulse - kTendsTo - kOfOneStep / count).norm(), 1e-13);
  EXPECT_EQ(sum.turn, -Vector3(kTendsTo + kOfOneStep / count));
}

TEST(ReactionSums, TendToTheirLimit) {
  for (const std::uint32_t count : {2U, 3U, 5U}) {
    const ReactionSums sums = told(attempts_of(count), weights_of(count));
    for (const auto& [key, sum] : sums) expect_limit(sum);
    EXPECT_LE((*sums.at(kJoint).drive_turn - kTendsTo).norm(), 1e-13);
  }
}

TEST(ReactionSums, OfAnImpactAreInOneInnerStepOfEach) {
  std::vector<ReactionSums> attempts = attempts_of(3);
  for (ReactionSums& attempt : attempts) attempt[kContact].inner_steps = 1;
  expect_limit(told(attempts, weights_of(3)).at(kContact));
}

// What is in some attempts, or in some of their inner steps only, leaves all that is connected as the finest attempt has it.
TEST(ReactionSums, OfDifferentThingsAreTheFinestAttempts) {
  for (const int way : {0, 1, 2, 3, 4}) {
    std::vector<ReactionSums> attempts = attempts_of(3);
    if (way == 0) attempts[1].erase(kContact);
    if (way == 1) attempts[2].erase(kContact);
    if (way == 2) attempts[2][kContact].inner_steps = 2;
    if (way == 3) attempts[1][kJoint].drive_turn.reset();
    if (way == 4) attempts[1][kContact].bounds.resize(1);
    const ReactionSums sums = told(attempts, weights_of(3));
    expect_finest(sums.at(kJoint), 3);
    EXPECT_EQ(sums.contains(kContact), way != 1);
    if (way != 1) expect_finest(sums.at(kContact), 3);
    expect_limit(sums.at(kOther));
  }
}

// Each attempt is within its bound, 1 / n below 1 / n + slack; the limit is within it by the slack.
TEST(ReactionSums, BeyondABoundAreTheFinestAttempts) {
  for (const double slack : {1.0, 0.0, -1e-3}) {
    std::vector<ReactionSums> attempts = attempts_of(3);
    for (std::uint32_t n = 1; n <= 3; ++n)
      attempts[n - 1][kContact].bounds = {
          {(1.0 + 1.0 / n) * Vector3::UnitX(), 1.0 + slack + (slack < 0.0 ? 2.0 : 1.0) / n}};
    const ReactionSums sums = told(attempts, weights_of(3));
    if (slack < 0.0)
      expect_finest(sums.at(kJoint), 3), expect_finest(sums.at(kContact), 3);
    else
      expect_limit(sums.at(kJoint)), expect_limit(sums.at(kContact));
    expect_limit(sums.at(kOther));
  }
}

TEST(ReactionSums, OfAttemptsThatAreLeftOutHaveNoPart) {
  std::vector<ReactionSums> attempts = attempts_of(3);
  attempts[0].clear();
  const std::vector<double> weights{0.0, -2.0, 3.0};
  for (const auto& [key, sum] : told(attempts, weights)) expect_limit(sum);
}

}  // namespace
}  // namespace gravitas
