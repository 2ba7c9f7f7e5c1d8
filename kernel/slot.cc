#include "kernel/slot.h"

#include <algorithm>
#include <array>
#include <utility>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/checks.h"

namespace gravitas::kernel {

StageSlot::StageSlot(Slot which, SlotDescription description) : which_(which), description_(std::move(description)) {}

void StageSlot::find_hosts(std::span<StageSlot* const> slots, std::uint32_t threads, const HostStarter& starter) {
  slots_ = slots;
  for (const PluginChoice& plugin : description_.plugins) {
    // a command may have to take over, which serves nobody besides
    const auto is_alone = [](const PluginChoice& one) {
      return !one.command.empty() || (one.address.empty() && one.fallback && one.fallback->is_elsewhere());
    };
    const auto shares = [&](const StageSlot* slot) {
      return slot == this || (!description_.process.empty() && slot->description_.process == description_.process &&
                              slot->description_.hosting == description_.hosting && plugin.address.empty() &&
                              description_.hosting != Hosting::kDirect);
    };
    const auto takes = [&](const std::shared_ptr<SlotHost>& one) {
      const PluginChoice& first = one->description().plugins[0];
      return !is_alone(first) && !is_alone(plugin) && first.address == plugin.address;
    };
    std::shared_ptr<SlotHost> host;
    for (const StageSlot* slot : slots_) {
      if (host || !shares(slot)) continue;
      const auto found = std::ranges::find_if(slot->hosts_, takes);
      if (found != slot->hosts_.end()) host = *found;
    }
    if (!host) {
      SlotDescription description = description_;
      description.plugins.clear();
      if (plugin.is_elsewhere()) description.hosting = Hosting::kGrpc;
      host = std::make_shared<SlotHost>(std::move(description), threads, starter);
    }
    if (std::ranges::find(hosts_, host) == hosts_.end()) hosts_.push_back(host);
    const auto place = std::ranges::find(hosts_, host) - hosts_.begin();
    routes_.push_back({static_cast<std::size_t>(place), host->add(plugin)});
  }
}

void StageSlot::start(SlotObserver* observer, std::vector<FaultRecord>* log) {
  observer_ = observer;
  log_ = log;
  for (const std::shared_ptr<SlotHost>& host : hosts_) host->begin_start();
}

void StageSlot::finish_start() {
  for (std::size_t i = 0; i < hosts_.size(); ++i) {
    try {
      hosts_[i]->finish_start();
    } catch (StageFault& fault) {
      const auto first = std::ranges::find_if(routes_, [&](const Route& route) { return route.host == i; });
      name(&fault, static_cast<std::uint32_t>(first - routes_.begin()));
      throw;
    }
    needs_attention_ |= hosts_[i]->description().hosting != Hosting::kDirect;
  }
}

void StageSlot::stop() {
  hosts_.clear();
  needs_attention_ = false;
}

void StageSlot::drain() {
  for (const std::shared_ptr<SlotHost>& host : hosts_) host->drain();
}

std::vector<std::string> StageSlot::take_complaints() {
  std::vector<std::string> all = std::exchange(complaints_, {});
  std::string slow = slow_calls_.take_complaint();
  if (!slow.empty() && description().hosting != Hosting::kDirect) all.push_back(std::move(slow));
  for (const std::shared_ptr<SlotHost>& host : hosts_)
    for (std::string& one : host->take_complaints()) all.push_back(std::move(one));
  return all;
}

std::vector<PlannedSlot> StageSlot::hosts() const {
  std::vector<PlannedSlot> planned;
  for (const std::shared_ptr<SlotHost>& host : hosts_) {
    PlannedSlot& one = planned.emplace_back();
    one.slot = which_;
    one.hosting = host->description().hosting;
    one.process_id = host->process_id();
    one.is_attached = host->description().attached;
    one.standbys = host->wanted_standbys();
    one.sandbox = host->sandbox();
    for (const PluginChoice& plugin : host->description().plugins)
      if (plugin.declaration.slot == which_) one.plugins.push_back(plugin.declaration.name);
  }
  return planned;
}

void StageSlot::make_room(std::span<const ColumnId> columns, Arena* arena) {
  // what is only wanted holds nothing yet that could be copied when the arena moves
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> wanted;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    wanted[i] = arena->count(columns[i]);
    arena->set_count(columns[i], 0);
  }
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (wanted[i] > kLargestColumn)
      throw StageFault(FaultKind::kBadStructure, "structure",
                       "it asks for room for " + std::to_string(wanted[i]) + " numbers in one column");
    if (wanted[i] > arena->capacity(columns[i])) arena->grow(columns[i], wanted[i]);
  }
}

void StageSlot::call_with_room(Carrier* carrier, const StageCall& call, Arena* arena, DerivativeSource* derivatives,
                               CallTimes* times) {
  for (int round = 0; round < kCapacityRounds; ++round) {
    const CallResult result = carrier->call(call, arena, derivatives);
    times->compute += result.compute_ns;
    times->check += result.check_ns;
    if (result.status == GRAVITAS_OK) return;
    // who took over in the middle may know none: the question has no answer any more
    if (result.status == GRAVITAS_UNKNOWN_METHOD &&
        (call.method == stage::Method::kForceJacobians || call.method == stage::Method::kSolverReactionJacobians)) {
      // what was refused of the attempt before is none; in a comparison they hold what the answer is held against
      if (!call.is_compared)
        for (const ColumnId column : call.reply) arena->set_count(column, 0);
      return;
    }
    if (result.status == GRAVITAS_REFUSED)
      throw StageFault(FaultKind::kRefusal, "status", "it refused: " + result.text);
    if (result.status != GRAVITAS_NEEDS_CAPACITY)
      throw StageFault(FaultKind::kFailure, "status", "it failed: " + result.text);
    make_room(call.reply, arena);
  }
  throw StageFault(FaultKind::kBadStructure, "structure", "it asks for more room again and again");
}

void StageSlot::attempt(const StageCall& call, Arena* arena, DerivativeSource* derivatives, Attempts* attempts,
                        CallTimes* times) {
  const Route route = routes_[call.target];
  StageCall routed = call;
  routed.target = route.target;
  routed.attempt = attempts->made;
  order_.clear();
  const auto due = std::ranges::find_if(armed_, [&](const FaultInjection& one) { return one.step == step_; });
  if (due != armed_.end()) {
    order_ = due->order;
    routed.fault = order_;
    if (--due->times == 0) armed_.erase(due);
  }
  Carrier* carrier = hosts_[route.host]->carrier().get();
  if (carrier == nullptr) {
    // the ladder ended in a call before
    StageFault fault(FaultKind::kHandshake, "start", "nobody is left to ask");
    name(&fault, call.target);
    throw StageFault(fault);
  }
  if (derivatives != nullptr) derivatives->begin_attempt(true);
  // whom a nested call of the same process takes away must outlast this one
  if (derivatives != nullptr) attempts->asked = hosts_[route.host]->carrier();
  const bool is_compared = !pending_.empty();
  const std::uint64_t begin = is_compared ? lap_ns() : 0;
  call_with_room(carrier, routed, arena, derivatives, times);
  if (is_compared) times->whole = lap_between(begin, lap_ns());
}

void StageSlot::name(StageFault* fault, std::uint32_t target) const {
  fault->slot = which_;
  fault->plugin = description_.plugins[target].declaration.name;
}

void StageSlot::recover(StageFault fault, const StageCall& call, Attempts* attempts) {
  // a nested call's ladder is at its end: nobody here is to blame
  if (!fault.plugin.empty()) throw StageFault(fault);
  SlotHost& host = host_of(call.target);
  // nor if its process failed in a call of another slot, which others answer by now
  if (attempts->asked && attempts->asked != host.carrier() && ++attempts->made < SlotDescription::kBudget) return;
  attempts->asked.reset();  // else its worker's end would be waited for here
  const bool is_answer = call.may_be_refused && fault.kind == FaultKind::kRefusal && !host.is_on_probation();
  if (is_answer) note_recovery(*attempts), host.count_good_answer(which_);
  if (is_answer || !description_.defences.replay) {
    name(&fault, call.target);
    throw StageFault(fault);
  }
  attempts->noticed_ns.push_back(channel::now_ns());
  name(&fault, call.target);
  const PluginChoice plugin = description_.plugins[call.target];
  log_->push_back({step_, fault});
  log_->back().injected = order_.substr(0, order_.find(','));
  Recovery recovery;
  bool poison = false;
  try {
    recovery = host.recover(fault, attempts, &poison);
  } catch (StageFault& last) {
    if (poison) observer_->on_poison(call, plugin, fault);
    name(&last, call.target);
    throw;
  }
  log_->back().recovered_by = recovery.how;
  if (poison) observer_->on_poison(call, plugin, fault);
  if (!recovery.plugins_changed) return;
  if (recovery.how == "rollback")
    close_all_probations(&host, SwapState::kRolledBack, "in step " + std::to_string(step_) + ": " + fault.text());
  let_all_adopt(host, recovery.how);
}

void StageSlot::note_recovery(const Attempts& attempts) {
  const std::uint64_t now = channel::now_ns();
  // the last records are this call's, but for those of calls nested in it
  std::size_t next = attempts.noticed_ns.size();
  for (auto record = log_->rbegin(); record != log_->rend() && next > 0; ++record) {
    if (record->fault.slot != which_) continue;
    record->recovery_us = 1e-3 * static_cast<double>(now - attempts.noticed_ns[--next]);
  }
}

void StageSlot::let_all_adopt(const SlotHost& host, const std::string& why, std::uint32_t swapped) {
  const std::uint32_t revision = host.revision();
  for (StageSlot* slot : slots_)
    if (host.revision() == revision) slot->adopt(host, why, slot == this, swapped);
}

void StageSlot::adopt(const SlotHost& host, const std::string& why, bool by_us, std::uint32_t swapped) {
  const SlotDescription& now = host.description();
  needs_attention_ = true;
  // who comes in is asked, and may fail: then all have adopted who came after
  const std::uint32_t revision = host.revision();
  for (std::uint32_t target = 0; target < routes_.size() && host.revision() == revision; ++target) {
    if (hosts_.empty() || &host_of(target) != &host) continue;
    // who answers for comparison has the plugins of before
    const std::size_t place = routes_[target].host;
    if (place < rerun_.checkers.size())
      hosts_[place]->retire(std::move(std::exchange(rerun_.checkers[place], {}).process));
    const PluginChoice& plugin = now.plugins[routes_[target].target];
    if (!by_us && now.hosting == description_.hosting && is_same_plugin(plugin, description_.plugins[target])) continue;
    const PluginChoice before = std::exchange(description_.plugins[target], plugin);
    if (place == 0) description_.hosting = now.hosting;
    for (PendingSwap& swap : pending_)
      if (swap.only_compare && swap.target == target) count_anew(&swap, !is_same_plugin(plugin, before));
    if (!by_us || swapped == kNone || swapped == target)
      observer_->on_decision({which_, target, step_, why, &now, &description_.plugins[target]});
    observer_->on_plugin_change(*this, target, before);
  }
}

}  // namespace gravitas::kernel
