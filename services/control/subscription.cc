#include "services/control/subscription.h"

#include <utility>

#include "services/control/served_run.h"

namespace gravitas::control {
namespace {

// That a listener may lag behind.
constexpr std::size_t kMostWaiting = 100'000;

}  // namespace

void Subscription::on_event(const Event& event) {
  events::v1::Event message = event_message(event, description_);
  const std::lock_guard lock(mutex_);
  is_lost_ |= waiting_.size() >= kMostWaiting;
  if (!is_lost_) waiting_.push_back(std::move(message));
  arrived_.notify_one();
}

std::optional<events::v1::Event> Subscription::next(std::chrono::milliseconds longest) {
  std::unique_lock lock(mutex_);
  if (!arrived_.wait_for(lock, longest, [&] { return !waiting_.empty() || is_lost_; })) return std::nullopt;
  if (waiting_.empty())
    throw NotNow("events: they come faster than they are read, and some are lost; ask for fewer kinds");
  events::v1::Event event = std::move(waiting_.front());
  waiting_.pop_front();
  return event;
}

}  // namespace gravitas::control
