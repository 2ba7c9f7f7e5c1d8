// Finds the events of an environment and tells them after each commit, always in this order: those of the inner steps as
// they follow (pairs ascending, then joints), who woke, who fell asleep, collisions that go on, faults, swaps.
//
//   EventSource source(&listener, kinds);
//   environment.set_commit_listener(&source);        // or hand on to it what another commit listener hears
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

#include "kernel/environment.h"
#include "services/events/event.h"

namespace gravitas {

inline constexpr double kOngoingRate = 10.0;  // Hz (§ 3.6.2)

// How a swap stands.
Event swap_event(const kernel::Environment& environment, const kernel::SwapRecord& swap);

class EventSource final : public kernel::CommitListener {
 public:
  // `ongoing_rate`, Hz: how often collisions that go on are told: at the first commit at or after k / rate.
  explicit EventSource(EventListener* listener, EventKinds kinds = default_event_kinds(),
                       double ongoing_rate = kOngoingRate)
      : listener_(*listener), kinds_(kinds), ongoing_rate_(ongoing_rate) {}

  EventKinds kinds() const { return kinds_; }

  // This environment takes the place of the one before. Swaps that it has made were told.
  void begin_again(const kernel::Environment& environment);
  // Faults and swaps so far are not told.
  void leave_out_past(const kernel::Environment& environment);
  // Those alone that were made already: of a run that is resumed, before its checkpoint.
  void leave_out_swaps(const kernel::Environment& environment);

  void on_inner_step(const kernel::Environment& environment, const kernel::InnerStep& inner) override;
  void on_commit(const kernel::Environment& environment) override;
  // Faults and swaps since the last commit, of a run that ends or pauses.
  void tell_incidents(const kernel::Environment& environment);

 private:
  // Contacts of a pair in the order of the columns, from `contact` on.
  Event collision(EventKind kind, const kernel::Environment& environment, const kernel::InnerStep& inner,
                  std::size_t* contact) const;
  void find_changes(const kernel::Environment& environment, const kernel::InnerStep& inner);
  void find_ongoing(const kernel::Environment& environment, const kernel::InnerStep& inner);
  void find_limits(const kernel::Environment& environment, const kernel::InnerStep& inner);
  void find_breaks(const kernel::Environment& environment, const kernel::InnerStep& inner);
  void find_activity(const kernel::Environment& environment);
  void find_faults(const kernel::Environment& environment);
  void find_swaps(const kernel::Environment& environment);
  template <typename Visit>
  void visit_swaps(const kernel::Environment& environment, Visit&& visit);

  EventListener& listener_;
  const EventKinds kinds_;
  const double ongoing_rate_;

  std::vector<Event> events_, ongoing_;  // of the step so far; of its last inner step, if they are due
  std::vector<bool> slept_;              // before the step; empty: no inner step was made
  std::size_t faults_ = 0;               // told
  // Last state told of a swap, by slot, step and rank among those.
  std::map<std::tuple<Slot, std::uint32_t, std::uint32_t>, kernel::SwapState> swaps_;
};

}  // namespace gravitas
