// A state out of one environment and into another: the next steps have the same bits, and what does not fit the
// description is refused and changes nothing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "kernel/environment.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using kernel::SavedColumn;
using kernel::SavedState;
using kernel::StepOutcome;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::uint32_t kRestoreSteps = 60;

// A saved state that owns its columns, so that it outlives its environment and can be spoilt.
class OwnedState {
 public:
  explicit OwnedState(const SavedState& saved) : head(saved) {
    for (const SavedColumn& column : saved.columns) {
      names_.emplace_back(column.name);
      std::visit(
          [this]<typename T>(std::span<const T> numbers) {
            numbers_.emplace_back(std::vector<T>(numbers.begin(), numbers.end()));
          },
          column.numbers);
    }
  }

  SavedState view() const {
    SavedState saved = head;
    saved.columns.clear();
    for (std::size_t i = 0; i < names_.size(); ++i)
      std::visit(
          [&]<typename T>(const std::vector<T>& numbers) {
            saved.columns.push_back({names_[i], std::span<const T>(numbers)});
          },
          numbers_[i]);
    return saved;
  }

  template <typename T>
  std::vector<T>& column(std::string_view name) {
    for (std::size_t i = 0; i < names_.size(); ++i)
      if (names_[i] == name) return std::get<std::vector<T>>(numbers_[i]);
    throw std::logic_error("no such column");
  }
  std::vector<double>& f64(std::string_view name) { return column<double>(name); }
  std::vector<std::uint32_t>& u32(std::string_view name) { return column<std::uint32_t>(name); }

  void rename(std::size_t column, const std::string& name) { names_.at(column) = name; }
  void drop_last() { names_.pop_back(), numbers_.pop_back(); }
  void add() { names_.emplace_back("more"), numbers_.emplace_back(std::vector<double>{}); }

  SavedState head;  // its columns are void

 private:
  std::vector<std::string> names_;
  std::vector<std::variant<std::vector<double>, std::vector<std::uint32_t>, std::vector<std::uint64_t>>> numbers_;
};

void steps(Environment* world, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i)
    ASSERT_EQ(world->step(), StepOutcome::kCommitted) << world->fault()->fault.what();
}

OwnedState state_after(const WorldBuilder& builder, std::uint32_t count) {
  Environment world(builder.description());
  steps(&world, count);
  return OwnedState(world.saved_state());
}

class FromTo : public ::testing::TestWithParam<std::pair<Hosting, Hosting>> {};

INSTANTIATE_TEST_SUITE_P(Hosting, FromTo,
                         ::testing::Values(std::pair{Hosting::kDirect, Hosting::kDirect},
                                           std::pair{Hosting::kDirect, Hosting::kSharedMemory},
                                           std::pair{Hosting::kSharedMemory, Hosting::kDirect}),
                         [](const auto& which) {
                           return std::string(kernel::hosting_name(which.param.first)) + "_" +
                                  kernel::hosting_name(which.param.second);
                         });

TEST_P(FromTo, EveryStepAfterARestoreHasTheBitsOfTheUninterruptedRun) {
  constexpr double kLoadOfLanding = 30.0;  // N
  Environment whole(busy_world(Hosting::kDirect, kLoadOfLanding).description());
  std::vector<Hash> chain = {whole.chain_hash()};
  bool breaks = false, touches = false;
  while (whole.step_count() < kRestoreSteps) {
    steps(&whole, 1);
    chain.push_back(whole.chain_hash());
    breaks = breaks || !whole.is_intact(0);
    touches = touches || !OwnedState(whole.saved_state()).u32("touching").empty();
  }
  // the scene has what a checkpoint must carry: contacts, and a joint that holds at first
  ASSERT_TRUE(breaks && touches);
  ASSERT_EQ(OwnedState(whole.saved_state()).u32("intact"), std::vector<std::uint32_t>{0});

  for (const std::uint32_t stop : {0U, 1U, 2U, 17U, 40U, kRestoreSteps}) {
    const OwnedState saved = state_after(busy_world(GetParam().first, kLoadOfLanding), stop);
    Environment resumed(busy_world(GetParam().second, kLoadOfLanding).description());
    ASSERT_EQ(resumed.restore(saved.view()), "");
    EXPECT_EQ(resumed.step_count(), stop);
    EXPECT_EQ(resumed.chain_hash(), chain[stop]);
    while (resumed.step_count() < kRestoreSteps) {
      steps(&resumed, 1);
      ASSERT_EQ(resumed.chain_hash(), chain[resumed.step_count()]) << "resumed at " << stop;
    }
  }
}

TEST(Restore, WhatIsAskedOfTheEnvironmentIsAsBefore) {
  Environment before(busy_world(Hosting::kDirect).description());
  steps(&before, 30);
  Environment after(busy_world(Hosting::kDirect).description());
  ASSERT_EQ(after.restore(OwnedState(before.saved_state()).view()), "");
  EXPECT_EQ(after.time(), before.time());
  EXPECT_EQ(after.state_hash(), before.state_hash());
  EXPECT_EQ(after.figures().penetration, before.figures().penetration);
  EXPECT_EQ(after.figures().joint_error, before.figures().joint_error);
  // potential energy is measured from the initial state of the scene, not from the restored one
  EXPECT_EQ(after.potential_energy(), before.potential_energy());
  // and what would be saved now is what was restored
  const OwnedState again(after.saved_state());
  OwnedState saved(before.saved_state());
  for (const char* name : {"contact_impulse", "contact_correction", "discrepancy_impulse", "discrepancy_correction"})
    EXPECT_EQ(OwnedState(again).f64(name), saved.f64(name)) << name;
  EXPECT_EQ(OwnedState(again).column<std::uint64_t>("contact_key"), saved.column<std::uint64_t>("contact_key"));
  EXPECT_FALSE(saved.f64("contact_impulse").empty());
}

TEST(Restore, StateOfThePluginComesBackAsItWas) {
  const WorldBuilder builder = busy_world(Hosting::kDirect);
  OwnedState saved = state_after(builder, 5);
  saved.f64("plugin_state") = {1.5, -2.5, 3.5};
  saved.u32("state_changed") = {0, 1, 0, 1};
  Environment world(builder.description());
  ASSERT_EQ(world.restore(saved.view()), "");
  OwnedState again(world.saved_state());
  EXPECT_THAT(again.f64("plugin_state"), ElementsAre(1.5, -2.5, 3.5));
  EXPECT_THAT(again.u32("state_changed"), ElementsAre(0, 1, 0, 1));
}

struct Spoilt {
  const char* name;
  std::function<void(OwnedState*)> spoil;
  const char* reason;  // part of it
};

void PrintTo(const Spoilt& spoilt, std::ostream* out) { *out << spoilt.name; }

const double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

const std::vector<Spoilt>& ways_to_spoil() {
  static const std::vector<Spoilt> ways = {
      {"missing", [](OwnedState* s) { s->drop_last(); }, "column rest_wrench is missing"},
      {"added", [](OwnedState* s) { s->add(); }, "more columns"},
      {"renamed", [](OwnedState* s) { s->rename(2, "speed"); }, "column linear_velocity is missing"},
      {"short", [](OwnedState* s) { s->f64("position").pop_back(); }, "column position has 11 numbers, not 3"},
      {"long", [](OwnedState* s) { s->f64("orientation").resize(20); }, "column orientation has 20 numbers"},
      {"empty", [](OwnedState* s) { s->f64("angular_velocity").clear(); }, "column angular_velocity has 0 numbers"},
      {"joints",
       [](OwnedState* s) {
         s->u32("intact") = {1, 1};
       },
       "column intact has 2 numbers"},
      {"not_a_row", [](OwnedState* s) { s->f64("contact_impulse").pop_back(); }, "column contact_impulse has"},
      {"other_rows", [](OwnedState* s) { s->u32("contact_feature").push_back(0); }, "column contact_feature has"},
      {"nan", [](OwnedState* s) { s->f64("position")[4] = kNan; }, "row 1 of position is not finite"},
      {"infinite", [](OwnedState* s) { s->f64("plugin_state") = {kInfinity}; }, "row 0 of plugin_state is not finite"},
      {"nan_memory", [](OwnedState* s) { s->f64("contact_impulse")[0] = kNan; }, "contact_impulse is not finite"},
      {"not_unit", [](OwnedState* s) { s->f64("orientation")[4] += 0.1; }, "row 1 of orientation is not of unit"},
      {"flag", [](OwnedState* s) { s->u32("state_changed")[0] = 2; }, "state_changed is neither"},
      {"intact", [](OwnedState* s) { s->u32("intact")[0] = 77; }, "intact is neither"},
      {"ground_moved", [](OwnedState* s) { s->f64("position")[1] = 1.0; }, "immovable body 'body0' has moved"},
      {"ground_turns", [](OwnedState* s) { s->f64("angular_velocity")[0] = 1.0; }, "immovable body 'body0'"},
      {"no_body", [](OwnedState* s) { s->u32("contact_body")[1] = 4; }, "not two bodies that can touch"},
      {"huge_body", [](OwnedState* s) { s->u32("contact_body")[1] = ~0U; }, "not two bodies that can touch"},
      {"itself", [](OwnedState* s) { s->u32("contact_body")[1] = s->u32("contact_body")[0]; }, "can touch"},
      {"twice", [](OwnedState* s) { s->u32("contact_feature")[1] = s->u32("contact_feature")[0]; }, "stands twice"},
      {"pulls", [](OwnedState* s) { s->f64("contact_correction")[0] = -1.0; },
       "contact_correction of row 0 is negative"},
      {"no_joint", [](OwnedState* s) { s->u32("discrepancy_constraint")[0] = 1; }, "is no joint"},
      {"no_pair", [](OwnedState* s) { s->u32("touching")[0] = 9; },
       "pairs that touch, pair of row 0 is not two bodies"},
      {"moved", [](OwnedState* s) { s->f64("position")[3] += 1e-15; }, "not those of its hash"},
      {"negative_zero", [](OwnedState* s) { s->f64("linear_velocity")[0] = -0.0; }, "immovable body 'body0'"},
      {"beyond", [](OwnedState* s) { s->head.step = kRestoreSteps + 1; }, "after step 61, and the run has 60"},
      {"step_length", [](OwnedState* s) { s->head.step_length = 0.001; }, "shortened last step"},
      {"nan_length", [](OwnedState* s) { s->head.step_length = kNan; }, "shortened last step"},
      {"figure", [](OwnedState* s) { s->head.figures.penetration = -1.0; }, "impossible"},
      {"wakes_nobody", [](OwnedState* s) { s->head.wake_orders = {4}; }, "wakes a body that there is not"},
      {"initial", [](OwnedState* s) { s->head.step = 0, s->head.step_length = 0; }, "another initial state"}};
  return ways;
}

class Refused : public ::testing::TestWithParam<Spoilt> {};

INSTANTIATE_TEST_SUITE_P(Way, Refused, ::testing::ValuesIn(ways_to_spoil()),
                         [](const auto& which) { return std::string(which.param.name); });

TEST_P(Refused, WithTheReasonAndNothingHasChanged) {
  const WorldBuilder builder = busy_world(Hosting::kDirect);
  Environment quiet(builder.description());
  steps(&quiet, 1);
  // two contacts and the joint's discrepancy are remembered
  OwnedState saved = state_after(builder, 30);
  ASSERT_GE(saved.u32("contact_feature").size(), 2U);
  ASSERT_EQ(saved.u32("contact_body")[0], saved.u32("contact_body")[2]);
  ASSERT_GE(saved.u32("discrepancy_constraint").size(), 1U);
  GetParam().spoil(&saved);
  Environment world(builder.description());
  EXPECT_THAT(world.restore(saved.view()), HasSubstr(GetParam().reason));
  EXPECT_EQ(world.step_count(), 0U);
  steps(&world, 1);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  EXPECT_EQ(OwnedState(world.saved_state()).u32("touching"), OwnedState(quiet.saved_state()).u32("touching"));
}

TEST(Restore, OnlyBeforeTheFirstStep) {
  const WorldBuilder builder = busy_world(Hosting::kDirect);
  const OwnedState saved = state_after(builder, 3);
  Environment world(builder.description());
  steps(&world, 1);
  EXPECT_THAT(world.restore(saved.view()), HasSubstr("steps of its own"));
}

TEST(Restore, ContactsWhereNothingCanTouchAreRefused) {
  WorldBuilder builder;
  builder.steps(3, 0.01).sphere(0.5, 1.0, Vector3(0, 1, 0));
  OwnedState saved = state_after(builder, 2);
  saved.u32("contact_body") = {0, 0};
  saved.u32("contact_feature") = {0};
  saved.column<std::uint64_t>("contact_key") = {0};
  saved.f64("contact_impulse") = {0, 0, 0};
  saved.f64("contact_correction") = {0};
  Environment world(builder.description());
  EXPECT_THAT(world.restore(saved.view()), HasSubstr("nothing can touch"));
}

TEST(Restore, AShortenedLastStepIsTheEndOfItsOwnRunAlone) {
  WorldBuilder builder;
  builder.steps(3, 0.01).sphere(0.5, 1.0, Vector3(0, 1, 0), Vector3(1, 0, 0));
  builder.description().last_time_step = 0.004;
  const OwnedState end = state_after(builder, 3), middle = state_after(builder, 2);
  Environment same(builder.description());
  EXPECT_EQ(same.restore(end.view()), "");
  EXPECT_EQ(same.time(), 2 * 0.01 + 0.004);

  builder.steps(5, 0.01);
  Environment longer(builder.description());
  EXPECT_THAT(longer.restore(end.view()), HasSubstr("shortened last step can neither be continued"));
  EXPECT_EQ(longer.restore(middle.view()), "");
}

// A run that ends somewhere is at the same time there as one that goes on, to the last bit: a kinematic body is where its
// Motion has it.
TEST(Restore, ARunThatEndsSoonerHasTheSameTimes) {
  for (std::uint32_t steps = 1; steps < 100; ++steps) {
    WorldBuilder builder;
    builder.steps(steps, 0.01).sphere(0.5, 1.0, Vector3(0, 1, 0), Vector3(1, 0, 0));
    Environment shorter(builder.description());
    builder.steps(100, 0.01);
    Environment longer(builder.description());
    ASSERT_EQ(shorter.restore(state_after(builder, steps).view()), "");
    ASSERT_EQ(longer.restore(state_after(builder, steps).view()), "");
    EXPECT_EQ(shorter.time(), longer.time()) << steps;
  }
}

class CountCommits final : public kernel::CommitListener {
 public:
  void on_commit(const Environment& environment) override {
    steps.push_back(environment.step_count());
    if (environment.step_count() == 3) throw std::runtime_error("no room");
  }
  std::vector<std::uint32_t> steps;
};

TEST(CommitListener, HearsEveryCommitAndItsErrorLeavesTheCommitStanding) {
  Environment world(busy_world(Hosting::kDirect).description());
  CountCommits listener;
  world.set_commit_listener(&listener);
  steps(&world, 2);
  EXPECT_THROW(world.step(), std::runtime_error);
  EXPECT_EQ(world.step_count(), 3U);
  steps(&world, 1);
  EXPECT_THAT(listener.steps, ElementsAre(1, 2, 3, 4));
}

}  // namespace
}  // namespace gravitas
