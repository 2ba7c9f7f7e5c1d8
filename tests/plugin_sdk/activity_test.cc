// Who falls asleep, and who wakes with whom, on states made by hand.
#include "plugin_sdk/activity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace gravitas {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::uint32_t kBody = kMovable | kCanSleep, kGround = 0;

struct World {
  explicit World(const std::vector<std::uint32_t>& kinds)
      : flags(kinds),
        mass(kinds.size(), 2.0),
        inertia(3 * kinds.size(), 0.5),
        orientation(4 * kinds.size(), 0.0),
        linear_velocity(3 * kinds.size(), 0.0),
        angular_velocity(3 * kinds.size(), 0.0),
        rested(kinds.size(), 0) {
    for (std::size_t i = 0; i < kinds.size(); ++i) orientation[4 * i] = 1.0;
  }

  BodiesAtRest bodies() const { return {flags, mass, inertia, orientation, linear_velocity, angular_velocity}; }
  Connections connections() const { return {contacts, joints}; }

  // Bodies that fall asleep in the next so many steps.
  std::vector<std::uint32_t> settle(std::uint32_t steps, std::uint32_t needed = 3) {
    std::vector<std::uint32_t> all;
    for (std::uint32_t i = 0; i < steps; ++i) {
      activity.count_rest(bodies(), needed, rested);
      const auto fallen = activity.fall_asleep(bodies(), connections(), needed, rested);
      all.insert(all.end(), fallen.begin(), fallen.end());
    }
    return all;
  }

  std::vector<std::uint32_t> flags;
  std::vector<double> mass, inertia, orientation, linear_velocity, angular_velocity;
  std::vector<std::uint32_t> contacts, joints, rested;
  Activity activity{SleepRule{1e-12, 0.5}};
};

TEST(Activity, TheTimeIsAWholeNumberOfSteps) {
  EXPECT_EQ(Activity({1e-12, 0.5}).steps_to_sleep(0.125), 4U);
  EXPECT_EQ(Activity({1e-12, 0.5}).steps_to_sleep(0.2), 3U);
  EXPECT_EQ(Activity({1e-12, 0.0}).steps_to_sleep(0.2), 1U);
  EXPECT_LT(Activity({1e-12, 1e300}).steps_to_sleep(1e-9), kAsleep);
}

TEST(Activity, WhatIsHeldAndAtRestLongEnoughFallsAsleepOnce) {
  World world({kGround, kBody});
  world.contacts = {0, 1};
  EXPECT_THAT(world.settle(2), IsEmpty());
  EXPECT_THAT(world.settle(1), ElementsAre(1));
  EXPECT_EQ(world.rested[1], kAsleep);
  EXPECT_THAT(world.settle(10), IsEmpty());
}

TEST(Activity, MovingBeginsAgain) {
  World world({kGround, kBody});
  world.contacts = {0, 1};
  EXPECT_THAT(world.settle(2), IsEmpty());
  world.linear_velocity[4] = 0.1;
  EXPECT_THAT(world.settle(5), IsEmpty());
  world.linear_velocity[4] = 0.0;
  EXPECT_THAT(world.settle(2), IsEmpty());
  EXPECT_THAT(world.settle(1), ElementsAre(1));
}

// v^2/2 and I w^2/(2 m) against the energy.
TEST(Activity, TheThresholdIsKineticEnergyPerMass) {
  for (const double excess : {0.999, 1.001}) {
    World slides({kGround, kBody}), turns({kGround, kBody});
    slides.contacts = turns.contacts = {0, 1};
    slides.linear_velocity[3] = std::sqrt(2e-12 * excess);
    turns.angular_velocity[4] = std::sqrt(2e-12 * excess * 2.0 / 0.5);
    EXPECT_EQ(slides.settle(3).size(), excess < 1.0 ? 1U : 0U);
    EXPECT_EQ(turns.settle(3).size(), excess < 1.0 ? 1U : 0U);
  }
}

TEST(Activity, WhatNothingHoldsNeverSleeps) {
  World world({kBody, kBody, kBody});
  world.contacts = {0, 1};
  world.joints = {1, 2};
  EXPECT_THAT(world.settle(10), IsEmpty());
  world.joints = {1, 2, 2, kNone};
  EXPECT_THAT(world.settle(1), ElementsAre(0, 1, 2));
}

TEST(Activity, AnIslandSleepsWholeOrNotAtAll) {
  // 1 2 touch, 2 3 are joined, all on the ground; 4 is alone on it
  World world({kGround, kBody, kBody, kBody, kBody});
  world.contacts = {0, 1, 0, 2, 0, 3, 0, 4, 1, 2};
  world.joints = {2, 3};
  world.linear_velocity[9] = 1e-3;
  EXPECT_THAT(world.settle(5), ElementsAre(4));
  world.linear_velocity[9] = 0.0;
  EXPECT_THAT(world.settle(3), ElementsAre(1, 2, 3));
}

TEST(Activity, OneThatMayNotSleepKeepsItsIslandAwake) {
  World world({kGround, kBody, kMovable, kBody});
  world.contacts = {0, 1, 0, 3, 1, 2};
  EXPECT_THAT(world.settle(10), ElementsAre(3));
}

TEST(Activity, OnAKinematicBodyItSleepsWhereThatStands) {
  World world({kKinematic, kBody, kGround});
  world.contacts = {0, 1, 1, 2};
  world.angular_velocity[1] = 1e-9;
  EXPECT_THAT(world.settle(10), IsEmpty());
  world.angular_velocity[1] = 0.0;
  EXPECT_THAT(world.settle(1), ElementsAre(1));
}

TEST(Activity, AnIslandWakesWhole) {
  World world({kGround, kBody, kBody, kBody, kBody});
  world.contacts = {0, 1, 0, 2, 0, 3, 0, 4, 1, 2};
  world.joints = {2, 3};
  EXPECT_EQ(world.settle(3).size(), 4U);
  const auto sleepers = [&](std::uint32_t body) {
    const auto with = world.activity.sleepers_with(body, 5, world.connections(),
                                                   [&](std::uint32_t i) { return world.rested[i] == kAsleep; });
    return std::vector<std::uint32_t>(with.begin(), with.end());
  };
  EXPECT_THAT(sleepers(3), ElementsAre(1, 2, 3));
  EXPECT_THAT(sleepers(1), ElementsAre(1, 2, 3));
  EXPECT_THAT(sleepers(4), ElementsAre(4));
}

// A force of f N more brings 2 kg to t^2/2 (f/m)^2 J/kg in t = 0.5 s: 1e-12 at f = 2^1.5 2e-6 N.
TEST(Activity, AForceHasChangedIfItCouldMoveTheBody) {
  World world({kGround, kBody});
  world.contacts = {0, 1};
  std::vector<double> wrench(12, 0.0), rest_wrench(12, 0.0);
  wrench[7] = -19.62;
  const auto begins_again = [&] {
    world.rested[1] = 2;
    world.activity.start_again_where_pushed(world.bodies(), wrench, rest_wrench, world.rested);
    return world.rested[1] == 0;
  };
  EXPECT_TRUE(begins_again());
  EXPECT_FALSE(begins_again());
  const double limit = std::sqrt(2.0) * 2.0 * 1e-6 / 0.5;
  wrench[6] = 0.999 * limit;
  EXPECT_FALSE(begins_again());
  wrench[6] = 1.001 * limit;
  EXPECT_TRUE(begins_again());
  // torque: t^2/2 tau^2/(m I)
  wrench[9] = 1.001 * std::sqrt(2e-12 * 2.0 * 0.5) / 0.5;
  EXPECT_TRUE(begins_again());
  EXPECT_FALSE(begins_again());
  wrench[9] = std::nan("");
  EXPECT_TRUE(begins_again());
}

TEST(Activity, ASleeperThatMovesOrMayNotSleepIsWrong) {
  World world({kGround, kBody, kMovable});
  EXPECT_EQ(find_wrong_sleeper(world.bodies(), world.rested), kNone);
  world.rested = {0, kAsleep, 7};
  EXPECT_EQ(find_wrong_sleeper(world.bodies(), world.rested), kNone);
  world.linear_velocity[3] = 1e-300;
  EXPECT_EQ(find_wrong_sleeper(world.bodies(), world.rested), 1U);
  world.linear_velocity[3] = 0.0;
  world.rested[2] = kAsleep;
  EXPECT_EQ(find_wrong_sleeper(world.bodies(), world.rested), 2U);
  world.rested = {kAsleep, 0, 0};
  EXPECT_EQ(find_wrong_sleeper(world.bodies(), world.rested), 0U);
}

}  // namespace
}  // namespace gravitas
