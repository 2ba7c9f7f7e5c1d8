// Events: each kind on its own is what it is among all, samples have the known impulse, and the order is that of the run.
#include "services/events/event_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class EventList final : public EventListener {
 public:
  void on_event(const Event& event) override { all.push_back(event); }
  std::vector<Event> all;
};

std::string text_of(const Event& event) {
  kernel::EnvironmentDescription ids;
  ids.bodies.resize(6);
  for (std::size_t i = 0; i < ids.bodies.size(); ++i) ids.bodies[i].id = std::to_string(i);
  ids.constraints.resize(2);
  return event_message(event, ids).ShortDebugString();
}

std::vector<std::string> heard_in(const kernel::EnvironmentDescription& description, EventKinds kinds,
                                  double rate = kOngoingRate) {
  Environment world(description);
  EventList list;
  EventSource source(&list, kinds, rate);
  world.set_commit_listener(&source);
  run_to_end(&world);
  std::vector<std::string> texts;
  for (const Event& event : list.all) texts.push_back(text_of(event));
  return texts;
}

// A box that rests, a ball that comes down on it and wakes it, two on a joint that one of them breaks at once, and one that falls
// into its rope.
kernel::EnvironmentDescription eventful(Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(200, 0.01).material({.restitution = 0.2}).ground();
  builder.box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0)).sphere(0.2, 1.0, Vector3(0, 6.0, 0));
  builder.sphere(0.2, 1.0, Vector3(3, 2.0, 0)).sphere(0.2, 1.0, Vector3(3.8, 2.0, 0), Vector3(1, 0, 0));
  builder.joint("Spherical", "constraint_spherical", 3, 4, {3.4, 2.0, 0.0});
  for (kernel::BodyDescription& body : builder.description().bodies)
    if ((body.flags & kMovable) != 0) body.flags |= kCanSleep;
  builder.description().constraints[0].breaking_force = 1e-3;
  constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
  builder.sphere(0.2, 1.0, Vector3(-6, 5, 0));
  builder.joint("Distance", "constraint_distance", kNone, 5, {-6, 5, 0, -6, 5, 0, kAbsent, 1, kAbsent, kAbsent, 0});
  return builder.gravity({0, -9.81, 0}).description();
}

TEST(EventSource, AKindAloneTellsWhatItTellsAmongAll) {
  const kernel::EnvironmentDescription scene = eventful(Hosting::kDirect);
  const std::vector<std::string> all = heard_in(scene, parse_event_kinds(std::vector<std::string>{"all"}));
  std::size_t sum = 0;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(EventKind::kCount); ++i) {
    const auto kind = static_cast<EventKind>(i);
    std::vector<std::string> of_kind;
    for (const std::string& text : all)
      if (text.find("kind: \"" + std::string(event_kind_name(kind)) + '"') != std::string::npos)
        of_kind.push_back(text);
    EXPECT_EQ(heard_in(scene, EventKinds(kind)), of_kind) << event_kind_name(kind);
    if (kind <= EventKind::kSleep) {
      EXPECT_FALSE(of_kind.empty()) << event_kind_name(kind);
    }
    sum += of_kind.size();
  }
  EXPECT_EQ(sum, all.size());
  EXPECT_TRUE(heard_in(scene, EventKinds()).empty());
}

TEST(EventSource, EventsAreTheSameInAnyHosting) {
  EventKinds kinds = default_event_kinds();
  kinds.add(EventKind::kCollisionOngoing);
  const std::vector<std::string> direct = heard_in(eventful(Hosting::kDirect), kinds);
  EXPECT_EQ(heard_in(eventful(Hosting::kSharedMemory), kinds), direct);
}

class Ongoing : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(Rate, Ongoing, ::testing::Values(2.0, 10.0, 30.0, 1e6));

// A ball of 3 kg at rest on the ground for a second: the ground carries its weight in each step.
TEST_P(Ongoing, ARestingBallIsToldAtTheRateWithItsWeight) {
  const double h = 0.01;
  WorldBuilder builder;
  builder.steps(100, h).material({}).ground().sphere(0.5, 3.0, Vector3(0, 0.5, 0)).gravity({0, -9.81, 0});
  Environment world(builder.description());
  EventList list;
  EventSource source(&list, EventKinds(EventKind::kCollisionOngoing), GetParam());
  world.set_commit_listener(&source);
  run_to_end(&world);
  // touching since the first step, where the collision starts
  std::vector<double> times;
  for (std::uint32_t step = 2; step <= 100; ++step)
    if (std::floor(step * h * GetParam() + 1e-6) > std::floor((step - 1) * h * GetParam() + 1e-6))
      times.push_back(step * h);
  ASSERT_EQ(list.all.size(), times.size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_DOUBLE_EQ(list.all[i].time, times[i]);
    EXPECT_EQ(list.all[i].a, 0U);
    EXPECT_EQ(list.all[i].b, 1U);
    EXPECT_NEAR(list.all[i].impulse, 3.0 * 9.81 * h, 1e-12);
    EXPECT_NEAR(list.all[i].relative_speed, 9.81 * h, 1e-12);
    EXPECT_NEAR((list.all[i].relative_velocity - Vector3(0, -9.81 * h, 0)).norm(), 0.0, 1e-12);
  }
}

// A run that begins in the middle samples as one that went through.
TEST(EventSource, SamplesDependOnTimeAlone) {
  WorldBuilder builder;
  builder.steps(60, 0.01).material({}).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0)).gravity({0, -9.81, 0});
  Environment whole(builder.description()), late(builder.description());
  EventList of_whole, of_late;
  EventSource whole_source(&of_whole, EventKinds(EventKind::kCollisionOngoing), 7.0);
  EventSource late_source(&of_late, EventKinds(EventKind::kCollisionOngoing), 7.0);
  whole.set_commit_listener(&whole_source);
  for (int i = 0; i < 33; ++i) step(&late);
  late.set_commit_listener(&late_source);
  run_to_end(&whole);
  run_to_end(&late);
  std::vector<double> after;
  for (const Event& event : of_whole.all)
    if (event.step > 33) after.push_back(event.time);
  std::vector<double> told;
  for (const Event& event : of_late.all) told.push_back(event.time);
  EXPECT_EQ(told, after);
  EXPECT_EQ(told.size(), 2U);
}

TEST(EventSource, FaultsAndSwapsAreToldAtTheirCommits) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(30, 0.01).material({}).ground().sphere(0.5, 1.0, Vector3(0, 2.0, 0)).gravity({0, -9.81, 0});
  Environment world(builder.description());
  EventList list;
  EventSource source(&list, EventKinds(EventKind::kFault, EventKind::kSwap));
  world.set_commit_listener(&source);
  world.inject({Slot::kSolver, "kill", 5});
  world.order_swap({Slot::kIntegrator, builder.description().integrator.plugins[0], Hosting::kDirect, 10});
  run_to_end(&world);
  ASSERT_EQ(list.all.size(), 3U);
  EXPECT_EQ(list.all[0].kind, EventKind::kFault);
  EXPECT_EQ(list.all[0].step, 5U);
  EXPECT_EQ(list.all[0].slot, "solver");
  EXPECT_EQ(list.all[0].plugin, "Sequential");
  EXPECT_EQ(list.all[0].what, "death");
  EXPECT_THAT(list.all[0].text, HasSubstr("answered by: standby"));
  EXPECT_EQ(list.all[1].kind, EventKind::kSwap);
  EXPECT_EQ(list.all[1].step, 10U);
  EXPECT_EQ(list.all[1].slot, "integrator");
  EXPECT_EQ(list.all[1].what, "probation");
  EXPECT_EQ(list.all[2].what, "committed");
  // what was before is left out by those who come later
  EventList late;
  EventSource late_source(&late, EventKinds(EventKind::kFault, EventKind::kSwap));
  late_source.leave_out_past(world);
  late_source.tell_incidents(world);
  EXPECT_TRUE(late.all.empty());
}

TEST(EventKinds, NamesAreChecked) {
  EXPECT_TRUE(parse_event_kinds(std::vector<std::string>{"none"}).is_empty());
  EXPECT_TRUE(parse_event_kinds(std::vector<std::string>{"break", "swap"}).has(EventKind::kSwap));
  EXPECT_FALSE(parse_event_kinds(std::vector<std::string>{"break", "swap"}).has(EventKind::kSleep));
  try {
    parse_event_kinds(std::vector<std::string>{"colision_start"});
    FAIL() << "it was taken";
  } catch (const std::invalid_argument& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("did you mean \"collision_start\"?"));
  }
}

}  // namespace
}  // namespace gravitas
