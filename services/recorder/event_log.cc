#include "services/recorder/event_log.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "gravitas/events/v1/events.pb.h"
#include "services/recorder/json.h"

namespace gravitas {
namespace {

// Meetings that a summary would still name.
constexpr std::size_t kMostMeetings = 16;

const char* kind_name(kernel::EventKind kind) {
  switch (kind) {
    case kernel::EventKind::kCollisionStart:
      return "collision_start";
    case kernel::EventKind::kCollisionEnd:
      return "collision_end";
    case kernel::EventKind::kBreak:
      return "break";
    case kernel::EventKind::kWake:
      return "wake";
    case kernel::EventKind::kSleep:
      return "sleep";
  }
  return "unknown";
}

}  // namespace

EventLog::EventLog(const std::string& path, const kernel::EnvironmentDescription& description)
    : description_(description), path_(path), has_met_(description.bodies.size(), false) {
  if (path.empty()) return;
  file_ = std::fopen(path.c_str(), "we");
  if (file_ == nullptr) throw std::system_error(errno, std::generic_category(), "events '" + path + "'");
}

EventLog::~EventLog() {
  if (file_ != nullptr) std::fclose(file_);
}

std::string EventLog::body_id(std::uint32_t body) const {
  return body == kNone ? std::string() : description_.bodies[body].id;
}

void EventLog::on_event(const kernel::Event& event) {
  switch (event.kind) {
    case kernel::EventKind::kCollisionStart:
      counts_.set_collision_start(counts_.collision_start() + 1);
      remember_meeting(event);
      break;
    case kernel::EventKind::kCollisionEnd:
      counts_.set_collision_end(counts_.collision_end() + 1);
      break;
    case kernel::EventKind::kBreak:
      counts_.set_break_(counts_.break_() + 1);
      break;
    case kernel::EventKind::kWake:
      counts_.set_wake(counts_.wake() + 1);
      break;
    case kernel::EventKind::kSleep:
      counts_.set_sleep(counts_.sleep() + 1);
      break;
  }
  if (file_ != nullptr) write(event, kind_name(event.kind));
}

void EventLog::remember_meeting(const kernel::Event& event) {
  const auto is_fixed = [&](std::uint32_t body) {
    return (description_.bodies[body].flags & (kMovable | kKinematic)) == 0;
  };
  if (is_fixed(event.a) == is_fixed(event.b) || meetings_.size() >= kMostMeetings) return;
  const std::uint32_t mover = is_fixed(event.a) ? event.b : event.a, other = is_fixed(event.a) ? event.a : event.b;
  if (has_met_[mover]) return;
  has_met_[mover] = true;
  meetings_.push_back({body_id(mover), body_id(other), event.time, event.relative_speed});
}

void EventLog::write(const kernel::Event& event, const char* kind) {
  events::v1::Event message;
  message.set_time(event.time);
  message.set_step(event.step);
  message.set_kind(kind);
  message.add_bodies(body_id(event.a));
  const bool is_of_one = event.kind == kernel::EventKind::kWake || event.kind == kernel::EventKind::kSleep;
  if (!is_of_one) message.add_bodies(body_id(event.b));
  if (event.constraint != kNone) message.set_constraint(description_.constraints[event.constraint].id);
  message.set_relative_speed(event.relative_speed);
  message.set_impulse(event.impulse);
  const std::string line = to_json(message, JsonForm::kLine);
  write_failed_ |= std::fwrite(line.data(), 1, line.size(), file_) != line.size();
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
    const auto body = std::ranges::find(description_.bodies, message.body(), &kernel::BodyDescription::id);
    if (body == description_.bodies.end() || meetings_.size() >= kMostMeetings) continue;
    has_met_[static_cast<std::size_t>(body - description_.bodies.begin())] = true;
    meetings_.push_back({message.body(), message.with(), message.time(), message.speed()});
  }
}

void EventLog::close() {
  std::FILE* file = std::exchange(file_, nullptr);
  if (file == nullptr) return;
  const bool closed = std::fclose(file) == 0;
  if (!closed || write_failed_) throw std::system_error(errno, std::generic_category(), "events '" + path_ + "'");
}

}  // namespace gravitas
