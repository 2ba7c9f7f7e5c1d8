#include "services/events/event.h"

#include <iterator>
#include <stdexcept>
#include <vector>

#include "plugin_sdk/near_miss.h"

namespace gravitas {
namespace {

constexpr const char* kEventKindNames[] = {"collision_start",
                                           "collision_ongoing",
                                           "collision_end",
                                           "limit_start",
                                           "break",
                                           "wake",
                                           "sleep",
                                           "fault",
                                           "swap",
                                           "edit",
                                           "listener"};
static_assert(std::size(kEventKindNames) == static_cast<std::size_t>(EventKind::kCount));

}  // namespace

const char* event_kind_name(EventKind kind) { return kEventKindNames[static_cast<std::size_t>(kind)]; }

EventKinds default_event_kinds() {
  return EventKinds(EventKind::kCollisionStart, EventKind::kCollisionEnd, EventKind::kBreak, EventKind::kWake,
                    EventKind::kSleep);
}

EventKinds parse_event_kinds(std::span<const std::string> names) {
  EventKinds kinds;
  for (const std::string& name : names) {
    bool is_known = name == "none" || name == "all";
    for (std::size_t i = 0; i < std::size(kEventKindNames); ++i) {
      if (name != "all" && name != kEventKindNames[i]) continue;
      kinds.add(static_cast<EventKind>(i));
      is_known = true;
    }
    if (is_known) continue;
    std::vector<std::string> allowed(std::begin(kEventKindNames), std::end(kEventKindNames));
    allowed.insert(allowed.end(), {"all", "none"});
    throw std::invalid_argument("no kind of event \"" + name + "\"; " + allowed_names(name, allowed));
  }
  return kinds;
}

events::v1::Event event_message(const Event& event, const kernel::EnvironmentDescription& description) {
  events::v1::Event message;
  message.set_time(event.time);
  message.set_step(event.step);
  message.set_kind(event_kind_name(event.kind));
  const auto add_body = [&](std::uint32_t body) {
    message.add_bodies(body == kNone ? "" : description.bodies[body].id);
  };
  const bool is_of_two = event.kind <= EventKind::kBreak, is_of_one = !is_of_two && event.kind <= EventKind::kSleep;
  if (is_of_two || is_of_one) add_body(event.a);
  if (is_of_two) add_body(event.b);
  if (event.constraint != kNone) message.set_constraint(description.constraints[event.constraint].id);
  if (event.kind <= EventKind::kCollisionOngoing)
    message.mutable_relative_velocity()->Add(event.relative_velocity.begin(), event.relative_velocity.end());
  message.set_relative_speed(event.relative_speed);
  message.set_impulse(event.impulse);
  if (is_of_two || is_of_one) return message;
  events::v1::Incident* incident = message.mutable_incident();
  incident->set_slot(event.slot);
  incident->set_plugin(event.plugin);
  incident->set_what(event.what);
  incident->set_text(event.text);
  return message;
}

}  // namespace gravitas
