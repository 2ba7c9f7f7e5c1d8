// A client of a served run that decides about pairs of bodies.
#include <fmt/format.h>

#include "services/control/served_run.h"

namespace gravitas::control {

void ServedRun::listen(std::shared_ptr<RemoteListener> listener, double deadline) {
  const double seconds = deadline == 0.0 ? kListenerDeadline : deadline;
  if (!(seconds > 0.0 && seconds <= 60.0))
    throw BadInput(fmt::format("a deadline of {:g} s; allowed: more than 0, up to 60", deadline));
  between_steps([&] {
    if (listener_) throw NotNow("another client decides about pairs");
    // first: where a disk is full it throws, and nobody is asked
    attend_listener();
    pair_decisions_.listen(listener, seconds);
    listener_ = std::move(listener);
  });
}

void ServedRun::end_listening(const std::shared_ptr<RemoteListener>& listener) {
  between_steps([&] {
    if (listener_ != listener) return;
    pair_decisions_.leave();
    listener_.reset();
  });
}

void ServedRun::attend_listener() {
  const bool has_listened = recorder_->has_listened();
  recorder_->note_listener();
  try {
    // no journal knows of it
    if (recorder_->keeps()) recorder_->save(*environment_);
  } catch (...) {
    recorder_->note_listener(has_listened);
    throw;
  }
  environment_->set_pair_arbiter(&pair_decisions_);
}

void ServedRun::leave_aside(const std::string& why) {
  warnings_.push_back(why);
  Event event{EventKind::kListener, environment_->step_count() + 1, environment_->time()};
  event.text = why;
  with_subscriptions([&](Subscription* one) { one->tell(event); });
  listener_->dismiss(why);
  listener_.reset();
}

}  // namespace gravitas::control
