// The event log: what it counts, what it writes, whom it remembers.
#include "services/recorder/event_log.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "gravitas/events/v1/events.pb.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ScratchFolder;
using ::testing::ElementsAre;

// Ground (fixed), Ball and Cube (movable), Lift (kinematic), and a joint that hangs Ball from the world.
kernel::EnvironmentDescription description() {
  kernel::EnvironmentDescription d;
  for (const auto& [id, flags] :
       {std::pair{"Ground", 0U}, {"Ball", kMovable}, {"Cube", kMovable}, {"Lift", kKinematic}}) {
    kernel::BodyDescription body;
    body.id = id;
    body.flags = flags | kHasShape;
    d.bodies.push_back(body);
  }
  kernel::ConstraintDescription joint;
  joint.id = "Rope";
  joint.body2 = 1;
  d.constraints.push_back(joint);
  return d;
}

Event meeting(std::uint32_t step, std::uint32_t a, std::uint32_t b) {
  return {EventKind::kCollisionStart, step, 0.1 * step, a, b, kNone, 2.5, 7.0};
}
Event parting(std::uint32_t step, std::uint32_t a, std::uint32_t b) {
  return {EventKind::kCollisionEnd, step, 0.1 * step, a, b};
}

TEST(EventLog, WritesALineOfJsonPerEvent) {
  const ScratchFolder folder;
  const kernel::EnvironmentDescription d = description();
  EventLog log(folder.path("events"), d);
  log.on_event(meeting(3, 0, 1));
  log.on_event(parting(4, 0, 1));
  log.on_event({EventKind::kBreak, 5, 0.5, kNone, 1, 0});
  log.on_event({EventKind::kSleep, 6, 0.6, 1});
  log.close();
  std::istringstream text(harness::read_file(folder.path("events")));
  std::vector<events::v1::Event> events;
  for (std::string line; std::getline(text, line);)
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(line, &events.emplace_back()).ok()) << line;
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].kind(), "collision_start");
  EXPECT_EQ(events[0].step(), 3U);
  EXPECT_EQ(events[0].time(), 0.1 * 3);
  EXPECT_THAT(events[0].bodies(), ElementsAre("Ground", "Ball"));
  EXPECT_EQ(events[0].relative_speed(), 2.5);
  EXPECT_EQ(events[0].impulse(), 7.0);
  EXPECT_EQ(events[1].kind(), "collision_end");
  EXPECT_EQ(events[2].kind(), "break");
  EXPECT_EQ(events[2].constraint(), "Rope");
  // the world has no id
  EXPECT_THAT(events[2].bodies(), ElementsAre("", "Ball"));
  EXPECT_EQ(events[3].kind(), "sleep");
  EXPECT_THAT(events[3].bodies(), ElementsAre("Ball"));
}

TEST(EventLog, CountsEachKind) {
  const kernel::EnvironmentDescription d = description();
  EventLog log("", d);
  for (std::uint32_t step = 1; step <= 5; ++step) log.on_event(meeting(step, 1, 2));
  log.on_event(parting(6, 1, 2));
  log.on_event({EventKind::kBreak, 7, 0.7, kNone, 1, 0});
  for (std::uint32_t step = 8; step <= 10; ++step) log.on_event({EventKind::kSleep, step, 0.8, 1});
  for (std::uint32_t step = 11; step <= 12; ++step) log.on_event({EventKind::kWake, step, 1.1, 1});
  recorder::v1::Tally tally;
  log.write(&tally);
  EventLog resumed("", d);
  resumed.resume(tally);
  for (const EventLog* each : {&log, &resumed}) {
    EXPECT_EQ(each->counts().collision_start(), 5U);
    EXPECT_EQ(each->counts().collision_end(), 1U);
    EXPECT_EQ(each->counts().break_(), 1U);
    EXPECT_EQ(each->counts().sleep(), 3U);
    EXPECT_EQ(each->counts().wake(), 2U);
  }
}

TEST(EventLog, RemembersWhenEachMovableBodyFirstMetAnImmovableOne) {
  const kernel::EnvironmentDescription d = description();
  EventLog log("", d);
  log.on_event(meeting(1, 1, 2));  // both move
  log.on_event(meeting(2, 0, 2));
  log.on_event(meeting(3, 0, 2));  // again
  log.on_event(meeting(4, 0, 1));
  log.on_event(meeting(5, 2, 3));  // a lift is not the ground
  ASSERT_EQ(log.meetings().size(), 2U);
  EXPECT_EQ(log.meetings()[0].body, "Cube");
  EXPECT_EQ(log.meetings()[0].with, "Ground");
  EXPECT_EQ(log.meetings()[0].time, 0.1 * 2);
  EXPECT_EQ(log.meetings()[0].speed, 2.5);
  EXPECT_EQ(log.meetings()[1].body, "Ball");
}

TEST(EventLog, AFileThatCannotBeMadeOrWrittenIsSaid) {
  const ScratchFolder folder;
  const kernel::EnvironmentDescription d = description();
  EXPECT_THROW(EventLog(folder.path("none/events"), d), std::system_error);
  EventLog log("/dev/full", d);
  const auto write_all = [&] {
    for (std::uint32_t step = 1; step <= 1000; ++step) log.on_event(meeting(step, 0, 1));
    log.close();
  };
  EXPECT_THROW(write_all(), std::system_error);
}

}  // namespace
}  // namespace gravitas
