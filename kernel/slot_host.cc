#include "kernel/slot_host.h"

#include <algorithm>
#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

namespace gravitas::kernel {
namespace {

constexpr std::chrono::milliseconds kFirstBackOff{1}, kLongestBackOff{100};

}  // namespace

SlotHost::SlotHost(SlotDescription description, std::uint32_t threads, const HostStarter& start)
    : description_(std::move(description)), threads_(threads), start_(start) {}

std::uint32_t SlotHost::add(const PluginChoice& plugin) {
  description_.plugins.push_back(plugin);
  return static_cast<std::uint32_t>(description_.plugins.size() - 1);
}

void SlotHost::begin_start() {
  if (standbys_.empty()) standbys_.push_back(prepare(description_));
}

void SlotHost::finish_start() {
  if (carrier_) return;
  const std::unique_ptr<Spare> first = std::move(standbys_.front());
  standbys_.clear();
  carrier_ = first->take();
}

std::unique_ptr<Spare> SlotHost::prepare(const SlotDescription& description) const {
  return std::make_unique<Spare>(description, threads_, start_);
}

std::uint32_t SlotHost::wanted_standbys() const {
  const bool is_ours = description_.hosting != Hosting::kDirect && description_.plugins[0].address.empty();
  return is_ours ? description_.standbys : 0;
}

void SlotHost::keep_standbys() {
  std::erase_if(standbys_, [&](const std::unique_ptr<Spare>& spare) {
    const std::string problem = spare->problem();
    if (problem.empty()) return false;
    complaints_.push_back("a standby " + problem);
    ++lost_standbys_;
    return true;
  });
  while (standbys_.size() < wanted_standbys() && lost_standbys_ < description_.failures)
    standbys_.push_back(prepare(description_));
}

void SlotHost::drain() {
  for (const std::unique_ptr<Spare>& standby : standbys_) standby->give_up();
  for (const std::shared_ptr<Carrier>* carrier : {&carrier_, &old_})
    if (*carrier) (*carrier)->drain();
}

void SlotHost::retire(std::shared_ptr<Carrier> carrier) {
  std::erase_if(retired_, [](const std::future<void>& one) {
    return one.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  if (!carrier) return;
  carrier->drain();
  for (std::string& one : carrier->take_complaints()) complaints_.push_back(std::move(one));
  try {
    retired_.push_back(std::async(std::launch::async, [carrier = std::move(carrier)]() mutable { carrier.reset(); }));
  } catch (const std::system_error&) {
    // no thread to wait for its end in: that was waited for here
  }
}

void SlotHost::retire(std::unique_ptr<Spare> spare) {
  if (!spare) return;
  spare->give_up();
  try {
    retired_.push_back(std::async(std::launch::async, [spare = std::move(spare)]() mutable { spare.reset(); }));
  } catch (const std::system_error&) {
    // as above
  }
}

std::vector<std::string> SlotHost::take_complaints() {
  std::vector<std::string> all = std::exchange(complaints_, {});
  if (!carrier_) return all;
  for (std::string& one : carrier_->take_complaints()) all.push_back(std::move(one));
  return all;
}

// A standby that is not ready yet is still ahead of a cold start.
std::string SlotHost::take_host() {
  while (!standbys_.empty()) {
    const std::unique_ptr<Spare> spare = std::move(standbys_.front());
    standbys_.erase(standbys_.begin());
    const bool was_ready = spare->is_done();
    try {
      carrier_ = spare->take();
    } catch (const StageFault&) {
      continue;
    }
    if (carrier_->is_alive()) return was_ready ? "standby" : "standby, still starting";
    carrier_->kill();
    retire(std::move(carrier_));
  }
  try {
    carrier_ = start_(description_, threads_, {});
  } catch (const std::system_error& lacking) {
    throw StageFault(FaultKind::kHandshake, "start", lacking.what());
  }
  return description_.hosting == Hosting::kDirect ? "new instance" : "cold start";
}

void SlotHost::replace_description(SlotDescription description) {
  description_ = std::move(description);
  for (std::unique_ptr<Spare>& standby : std::exchange(standbys_, {})) retire(std::move(standby));
  budgets_ = {};
  lost_standbys_ = 0;
  ++revision_;
}

SlotDescription SlotHost::after_fallback(Slot slot) const {
  SlotDescription next = description_;
  // what nobody vouches for does not come into this process
  if (next.hosting == Hosting::kDirect) next.hosting = Hosting::kSharedMemory;
  for (PluginChoice& plugin : next.plugins) {
    if (plugin.declaration.slot != slot || !plugin.fallback) continue;
    plugin = PluginChoice(*plugin.fallback);
    plugin.fallback = nullptr;
    if (plugin.is_elsewhere()) next.hosting = Hosting::kGrpc;
  }
  next.end_attachment();
  return next;
}

std::string SlotHost::next_rung(Slot slot) {
  if (const auto previous = previous_.extract(slot)) {
    SlotDescription next = description_;
    next.hosting = previous.mapped().hosting;
    next.attached = previous.mapped().attached;
    for (std::size_t i = 0; i < next.plugins.size(); ++i)
      if (next.plugins[i].declaration.slot == slot) next.plugins[i] = previous.mapped().plugins[i];
    replace_description(std::move(next));
    return "previous build";
  }
  std::string names;
  for (const PluginChoice& plugin : description_.plugins)
    if (plugin.declaration.slot == slot && plugin.fallback)
      names += (names.empty() ? "" : ", ") + plugin.fallback->declaration.name;
  if (names.empty()) return {};
  replace_description(after_fallback(slot));
  return "fallback " + names;
}

Recovery SlotHost::recover(const StageFault& fault, Attempts* attempts, bool* poison) {
  if (carrier_) carrier_->kill();
  retire(std::move(carrier_));
  Budget& budget = budget_of(fault.slot);
  if (budget.good_answers >= kGoodAnswers) budget.failures = lost_standbys_ = 0;
  budget.failures_in_a_row = budget.good_answers == 0 ? budget.failures_in_a_row + 1 : 1;
  budget.good_answers = 0;
  ++budget.failures;
  ++attempts->made;
  if (old_) {
    carrier_ = std::move(old_);
    replace_description(std::move(previous_.extract(swapped_).mapped()));
    return {"rollback", true};
  }
  if (fault.kind != FaultKind::kDeadline && !fault.is_unread) ++attempts->rejections;

  Recovery recovery;
  StageFault last = fault;
  for (;;) {
    std::string rung;
    if (attempts->rejections >= 2 || budget.failures >= description_.failures) {
      const bool is_to_blame = attempts->rejections >= 2;
      rung = next_rung(fault.slot);
      *poison |= (is_to_blame || fault.kind == FaultKind::kDeadline) && rung != "previous build";
      if (rung.empty()) throw StageFault(last);
      recovery.plugins_changed = true;
      // one chance there
      attempts->rejections = 1;
    }
    if (budget.failures_in_a_row >= 2)
      std::this_thread::sleep_for(
          std::min(kLongestBackOff, kFirstBackOff * (1 << std::min(budget.failures_in_a_row - 2, 10U))));
    try {
      const std::string host = take_host();
      recovery.how = !rung.empty() ? rung : recovery.how.empty() ? host : recovery.how;
      return recovery;
    } catch (const StageFault& not_started) {
      if (!rung.empty()) recovery.how = rung;
      last = not_started;
      ++budget.failures;
      ++budget.failures_in_a_row;
    }
  }
}

void SlotHost::cut_over(Slot slot, std::unique_ptr<Carrier> carrier, SlotDescription description, bool has_taken_over) {
  end_probation();
  old_ = std::exchange(carrier_, std::move(carrier));
  swapped_ = slot;
  previous_.insert_or_assign(slot, description_);
  if (has_taken_over) {
    end_probation();
    previous_.erase(slot);
  }
  replace_description(std::move(description));
}

}  // namespace gravitas::kernel
