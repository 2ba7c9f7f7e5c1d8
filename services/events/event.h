// What happens in a run, and who hears of it (§ 3.6). Each kind is enabled on its own; one that is not is not looked for.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "gravitas/events/v1/events.pb.h"
#include "kernel/description.h"

namespace gravitas {

enum class EventKind : std::uint32_t {
  // of the trajectory, so the same in any hosting
  kCollisionStart,
  kCollisionOngoing,  // sampled
  kCollisionEnd,
  kLimitStart,  // a limit of a joint is met, or a rope is taut
  kBreak,
  kWake,
  kSleep,
  // of the run
  kFault,     // a call failed, and somebody else answered
  kSwap,      // a plugin took over, and what became of it
  kEdit,      // the scene was changed
  kListener,  // a listener that decides about pairs was left aside
  kCount
};

// "collision_start" …
const char* event_kind_name(EventKind kind);

class EventKinds {
 public:
  EventKinds() = default;
  template <typename... Kinds>
  explicit EventKinds(EventKind first, Kinds... rest) {
    add(first), (add(rest), ...);
  }

  void add(EventKind kind) { bits_ |= bit(kind); }
  void add(EventKinds others) { bits_ |= others.bits_; }
  bool has(EventKind kind) const { return (bits_ & bit(kind)) != 0; }
  bool is_empty() const { return bits_ == 0; }

 private:
  static std::uint32_t bit(EventKind kind) { return 1U << static_cast<std::uint32_t>(kind); }
  std::uint32_t bits_ = 0;
};

// What the trajectory determines, without samples: what a run looks for unless it is told otherwise.
EventKinds default_event_kinds();

// Names of kinds; "all" and "none" are words for these. Throws std::invalid_argument with what is allowed.
EventKinds parse_event_kinds(std::span<const std::string> names);

struct Event {
  EventKind kind;
  std::uint32_t step;                  // number of the committed state; the initial one is 0
  double time;                         // s
  std::uint32_t a = kNone, b = kNone;  // bodies; of a joint too (kNone: the world); a alone woke or fell asleep
  std::uint32_t constraint = kNone;    // that broke, or of the limit
  // Of a collision that starts or goes on, at S*: the largest speed of approach along the normal of a contact, and how b's
  // surface moves against a's there, m/s, world; the normal impulse of all contacts of the pair, N s, in the inner step.
  // Of a limit: the rate at which it closes where the inner step begins, m/s or rad/s, and its impulse, N s or N m s, in that
  // step (with Smooth at its end).
  double relative_speed = 0.0, impulse = 0.0;
  Vector3 relative_velocity = Vector3::Zero();
  // Of the run: the slot, the plugin, what it was ("death", "committed"), and why.
  std::string slot = {}, plugin = {}, what = {}, text = {};
};

class EventListener {
 public:
  virtual ~EventListener() = default;
  // In the order in which they are, between two steps. What it throws comes out of Environment::step().
  virtual void on_event(const Event& event) = 0;
};

// With the ids of the description instead of rows.
events::v1::Event event_message(const Event& event, const kernel::EnvironmentDescription& description);

}  // namespace gravitas
