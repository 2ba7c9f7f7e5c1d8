// Events of a served run on their way to somebody who listens: found in the thread that steps, taken by another.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

#include "services/events/event_source.h"

namespace gravitas::control {

class Subscription final : private EventListener {
 public:
  Subscription(const kernel::EnvironmentDescription& description, EventKinds kinds, double ongoing_rate)
      : description_(description), source_(this, kinds, ongoing_rate) {}

  // Of the thread that steps: what the environment does is told to it.
  EventSource& source() { return source_; }
  // An event that the environment does not know of, if it is of a kind that is listened to.
  void tell(const Event& event) {
    if (source_.kinds().has(event.kind)) on_event(event);
  }

  // The next event, or nothing if none comes in time. Throws NotNow where so many wait that some had to go.
  std::optional<events::v1::Event> next(std::chrono::milliseconds longest);

 private:
  void on_event(const Event& event) override;

  const kernel::EnvironmentDescription& description_;
  EventSource source_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<events::v1::Event> waiting_;
  bool is_lost_ = false;
};

}  // namespace gravitas::control
