// What happened at a commit, for those who listen. Nobody listens: no event is made.
#pragma once

#include <cstdint>

namespace gravitas::kernel {

enum class EventKind : std::uint32_t { kCollisionStart, kCollisionEnd, kBreak, kWake, kSleep };

struct Event {
  EventKind kind;
  std::uint32_t step;        // number of the committed state; the initial one is 0
  double time;               // s
  std::uint32_t a, b;        // bodies; of a broken joint too (kNone: the world); a alone woke or fell asleep
  std::uint32_t constraint;  // of a broken joint
  double relative_speed;     // m/s, of arrival along the normal (kCollisionStart)
  double impulse;            // N s, along the normal, all contacts of the pair (kCollisionStart)
};

class EventListener {
 public:
  virtual ~EventListener() = default;
  // Called in order, during the commit.
  virtual void on_event(const Event& event) = 0;
};

}  // namespace gravitas::kernel
