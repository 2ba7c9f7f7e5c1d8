#include "services/recorder/event_log.h"

#include <system_error>
#include <utility>

#include "services/recorder/json.h"

namespace gravitas {
namespace {

// Meetings that a summary would still name.
constexpr std::size_t kMostMeetings = 16;

}  // namespace

EventLog::EventLog(const std::string& path, const kernel::EnvironmentDescription& description)
    : description_(description), file_("events", path) {}

void EventLog::on_event(const Event& event) {
  switch (event.kind) {
    case EventKind::kCollisionStart:
      counts_.set_collision_start(counts_.collision_start() + 1);
      remember_meeting(event);
      break;
    case EventKind::kCollisionEnd:
      counts_.set_collision_end(counts_.collision_end() + 1);
      break;
    case EventKind::kBreak:
      counts_.set_break_(counts_.break_() + 1);
      break;
    case EventKind::kWake:
      counts_.set_wake(counts_.wake() + 1);
      break;
    case EventKind::kSleep:
      counts_.set_sleep(counts_.sleep() + 1);
      break;
    default:
      break;
  }
  if (!file_.is_open() || failure_) return;
  try {
    file_.write(to_json(event_message(event, description_), JsonForm::kLine));
  } catch (const std::system_error&) {
    failure_ = std::current_exception();
  }
}

void EventLog::remember_meeting(const Event& event) {
  const auto is_fixed = [&](std::uint32_t body) {
    return (description_.bodies[body].flags & (kMovable | kKinematic)) == 0;
  };
  if (is_fixed(event.a) == is_fixed(event.b) || meetings_.size() >= kMostMeetings) return;
  const std::uint32_t mover = is_fixed(event.a) ? event.b : event.a, other = is_fixed(event.a) ? event.a : event.b;
  if (!has_met_.insert(description_.bodies[mover].id).second) return;
  meetings_.push_back({description_.bodies[mover].id, description_.bodies[other].id, event.time, event.relative_speed});
}

void EventLog::write(recorder::v1::Tally* tally) const {
  tally->set_collision_start(counts_.collision_start());
  tally->set_collision_end(counts_.collision_end());
  tally->set_break_(counts_.break_());
  tally->set_sleep(counts_.sleep());
  tally->set_wake(counts_.wake());
  tally->clear_meetings();
  for (const Meeting& meeting : meetings_) {
    recorder::v1::Meeting* message = tally->add_meetings();
    message->set_body(meeting.body);
    message->set_with(meeting.with);
    message->set_time(meeting.time);
    message->set_speed(meeting.speed);
  }
}

void EventLog::resume(const recorder::v1::Tally& tally) {
  counts_.set_collision_start(tally.collision_start());
  counts_.set_collision_end(tally.collision_end());
  counts_.set_break_(tally.break_());
  counts_.set_sleep(tally.sleep());
  counts_.set_wake(tally.wake());
  for (const recorder::v1::Meeting& message : tally.meetings()) {
    if (meetings_.size() >= kMostMeetings) break;
    has_met_.insert(message.body());
    meetings_.push_back({message.body(), message.with(), message.time(), message.speed()});
  }
}

void EventLog::close() {
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  file_.close();
}

}  // namespace gravitas
