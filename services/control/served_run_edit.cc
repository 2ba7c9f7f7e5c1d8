// Changes of the scene of a served run: another environment goes on.
#include <fmt/format.h>

#include <algorithm>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/near_miss.h"
#include "services/control/served_run.h"
#include "services/edit/edited_scene.h"
#include "services/recorder/decision.h"
#include "services/run/kernel_names.h"
#include "services/run/report.h"

namespace gravitas::control {
namespace {

// Those of swaps that named their path, which the catalogue does not keep.
void add_libraries(const std::vector<recorder::v1::Decision>& decisions, Catalog* catalog) {
  const auto add = [&](const recorder::v1::Decision& one) {
    std::string problem;  // of who cannot be had: told where it is looked for
    if (!one.library().empty() && !catalog->knows_library(one.library())) catalog->add_library(one.library(), &problem);
  };
  for (const recorder::v1::Decision& one : decisions) {
    add(one);
    if (one.has_before()) add(one.before());
  }
}

}  // namespace

api::EditMade ServedRun::edit(const api::EditRequest& request) {
  if (request.changes_size() == 0) throw BadInput("edit: nothing to change; allowed: changes of the scene");
  return between_steps([&] {
    const Clock::time_point begin = Clock::now();
    require_steps_left("edit");
    api::EditMade made;
    made.set_step(environment_->step_count() + 1);
    edit::v1::Edit edit;
    edit.set_step(made.step());
    *edit.mutable_changes() = request.changes();
    Catalog catalog = catalog_;  // which other threads read; the scene's libraries are added again
    EditedScene edited(options_, scene_, description_, &catalog, &edit, &*environment_);
    kernel::EnvironmentDescription begun = edited.description(), active = description_;
    for (const Slot slot : kSlots) active.slot(slot) = active_.slot(slot);
    keep_who_answers(description_, active, &begun);
    std::vector<recorder::v1::Decision> decisions = recorder_->decisions();
    add_libraries(decisions, &catalog);
    EditedScene::Successor successor = edited.succeed(*environment_, begun, catalog, starter(), &decisions);
    std::unique_ptr<kernel::Environment> next = std::move(successor.environment);
    edited.look_at_limits(active, *environment_, begun, *next);
    const std::vector<std::uint32_t> woken = edited.woken(*environment_, *next);
    // swaps that are to come are ordered there, too
    std::vector<Order> pending;
    for (Order& one : pending_orders()) {
      // after it rows are those of other bodies: what is compared is counted anew
      if (one.compares()) one.swap.step = environment_->step_count() + 1;
      one.rank = rank_of(one.swap, *next);
      try {
        next->order_swap(one.swap, one.compares());
      } catch (const std::invalid_argument& problem) {
        throw BadInput(fmt::format("edit: a swap is ordered for step {} that could not be made then: {}", one.swap.step,
                                   problem.what()));
      }
      pending.push_back(std::move(one));
    }
    for (const kernel::FaultInjection& fault : injected_) {
      if (fault.step <= environment_->step_count()) continue;
      try {
        next->inject(fault);
      } catch (const std::invalid_argument&) {
        // status says of it then that it was not committed
      }
    }

    // from here on it is made
    const auto tell = [&](const Event& event) {
      events_->on_event(event);
      with_subscriptions([&](Subscription* one) { one->tell(event); });
    };
    for (const auto& [a, b] : successor.parted)
      tell({EventKind::kCollisionEnd, environment_->step_count(), environment_->time(), a, b});
    std::vector<api::ServedSwap> swaps = swap_messages();
    std::erase_if(swaps, [&](const api::ServedSwap& one) {
      return std::ranges::find(pending, one.number(), &Order::number) != pending.end();
    });
    *past_.mutable_swaps() = tally().swaps();
    for (const kernel::SwapRecord& swap : successor.settled) {
      renew_swap(swap, &swaps, static_cast<int>(swaps.size()));
      renew_swap(swap, past_.mutable_swaps(), past_.swaps_size());
      tell(swap_event(*environment_, swap));
    }
    past_swaps_ = std::move(swaps);
    write_faults(*environment_, &past_);
    note_edit(edit, &past_);
    orders_ = std::move(pending);
    next_collection_ = {};
    collect_warnings();
    for (const Slot slot : kSlots) active_.slot(slot) = begun.slot(slot);
    recorder_->set_decisions(std::move(decisions));
    scene_ = edited.scene();
    description_ = edited.description();
    pair_decisions_.follow(environment_->model(), next->model());
    environment_ = std::move(next);
    environment_->set_commit_listener(this);
    if (listener_ || pair_decisions_.has_decided()) environment_->set_pair_arbiter(&pair_decisions_);
    event_source_->begin_again(*environment_);
    reactions_->begin_again();
    with_subscriptions([&](Subscription* one) { one->source().begin_again(*environment_); });
    Event event{EventKind::kEdit, environment_->step_count(), environment_->time()};
    event.text = fmt::format("{} before step {}", counted(edit.changes_size(), "change"), edit.step());
    tell(event);
    for (const std::uint32_t body : woken)
      tell({EventKind::kWake, environment_->step_count(), environment_->time(), body});
    for (const std::string& warning : edited.warnings()) {
      if (std::ranges::find(warnings_, warning) != warnings_.end()) continue;
      made.add_warnings(warning);
      add_warning(warning);
    }
    // what may fail comes last, as the edit is made: a disk may be full, or who is asked for a potential fail
    bool has_failed = false;
    const auto attempt = [&](auto&& act) {
      try {
        act();
      } catch (const std::exception& problem) {
        fault_ = problem.what(), has_failed = true;
      }
    };
    attempt([&] { recorder_->note_edit(edit); });
    attempt([&] { figures_->begin_again(environment_.get()); });
    if (has_failed) {
      keep_faulted_state();
      made.add_warnings(fault_);
    }
    if (const std::unique_ptr<Survey> asked = std::move(survey_)) {
      try {
        surveyor();
        survey_->instrumentation.go_on_from(std::move(asked->instrumentation));
      } catch (const std::exception&) {
        survey_.reset();  // the next question says why
      }
    }
    made.set_pause_us(std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    return made;
  });
}

void ServedRun::wake(const api::WakeRequest& request) {
  between_steps([&] {
    require_steps_left("wake");
    const std::vector<std::string>& ids = environment_->model().body_id;
    const auto found = std::ranges::find(ids, request.body());
    if (found == ids.end())
      throw BadInput(fmt::format("wake: no body \"{}\"; {}", request.body(), allowed_names(request.body(), ids)));
    environment_->wake(static_cast<std::uint32_t>(found - ids.begin()));
  });
}

}  // namespace gravitas::control
