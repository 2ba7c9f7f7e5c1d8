#include "kernel/slot.h"

#include <algorithm>
#include <array>
#include <utility>

#include "plugin_sdk/channel/mailbox.h"

namespace gravitas::kernel {
namespace {

// More rounds than any honest plugin needs: each at least doubles the room.
constexpr int kCapacityRounds = 64;

}  // namespace

StageSlot::StageSlot(Slot which, SlotDescription description) : which_(which), description_(std::move(description)) {}

void StageSlot::assign_hosts(std::uint32_t threads, const HostStarter& starter) {
  const auto same_host = [](const PluginChoice& a, const PluginChoice& b) {
    return a.command.empty() && b.command.empty() && a.address == b.address;
  };
  std::vector<SlotDescription> hosts;
  for (const PluginChoice& plugin : description_.plugins) {
    const auto found =
        std::ranges::find_if(hosts, [&](const SlotDescription& host) { return same_host(host.plugins[0], plugin); });
    const auto host = static_cast<std::size_t>(found - hosts.begin());
    if (found == hosts.end()) {
      hosts.push_back(description_);
      hosts.back().plugins.clear();
      if (!plugin.command.empty() || !plugin.address.empty()) hosts.back().hosting = Hosting::kGrpc;
    }
    routes_.push_back({host, static_cast<std::uint32_t>(hosts[host].plugins.size())});
    hosts[host].plugins.push_back(plugin);
  }
  for (SlotDescription& host : hosts) hosts_.emplace_back(std::move(host), threads, starter);
}

void StageSlot::start(std::uint32_t threads, const HostStarter& starter, SlotObserver* observer,
                      std::vector<FaultRecord>* log) {
  observer_ = observer;
  log_ = log;
  assign_hosts(threads, starter);
  for (SlotHost& host : hosts_) host.begin_start();
}

void StageSlot::finish_start() {
  for (std::size_t i = 0; i < hosts_.size(); ++i) {
    try {
      hosts_[i].finish_start();
    } catch (StageFault& fault) {
      const auto first = std::ranges::find_if(routes_, [&](const Route& route) { return route.host == i; });
      name(&fault, static_cast<std::uint32_t>(first - routes_.begin()));
      throw;
    }
    needs_attention_ |= hosts_[i].description().hosting != Hosting::kDirect;
  }
}

void StageSlot::stop() {
  hosts_.clear();
  needs_attention_ = false;
}

void StageSlot::drain() {
  for (SlotHost& host : hosts_) host.drain();
}

std::vector<std::string> StageSlot::take_complaints() {
  std::vector<std::string> all = std::exchange(complaints_, {});
  if (slow_calls_ > 0)
    all.push_back("it was slow " + std::to_string(std::exchange(slow_calls_, 0)) + " times: up to " +
                  std::to_string(slowest_call_ns_ / 1'000'000) + " ms, over " + std::to_string(kSlowFactor) +
                  " times as long as it usually takes");
  for (SlotHost& host : hosts_)
    for (std::string& one : host.take_complaints()) all.push_back(std::move(one));
  return all;
}

std::vector<PlannedSlot> StageSlot::hosts() const {
  std::vector<PlannedSlot> planned;
  for (const SlotHost& host : hosts_) {
    PlannedSlot& one = planned.emplace_back();
    one.slot = which_;
    one.hosting = host.description().hosting;
    one.process_id = host.process_id();
    one.is_attached = host.description().attached;
    one.standbys = host.wanted_standbys();
    one.sandbox = host.sandbox();
    for (const PluginChoice& plugin : host.description().plugins) one.plugins.push_back(plugin.declaration.name);
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
    if (result.status == GRAVITAS_REFUSED)
      throw StageFault(FaultKind::kRefusal, "status", "it refused: " + result.text);
    if (result.status != GRAVITAS_NEEDS_CAPACITY)
      throw StageFault(FaultKind::kFailure, "status", "it failed: " + result.text);
    make_room(call.reply, arena);
  }
  throw StageFault(FaultKind::kBadStructure, "structure", "it asks for more room again and again");
}

void StageSlot::attempt(const StageCall& call, Arena* arena, DerivativeSource* derivatives, CallTimes* times) {
  const Route route = routes_[call.target];
  StageCall routed = call;
  routed.target = route.target;
  order_.clear();
  if (!armed_.empty()) {
    const auto due = std::ranges::find_if(armed_, [&](const FaultInjection& one) { return one.step == step_; });
    if (due != armed_.end()) {
      order_ = due->order;
      routed.fault = order_;
      if (--due->times == 0) armed_.erase(due);
    }
  }
  if (derivatives != nullptr) derivatives->begin_attempt(true);
  call_with_room(&hosts_[route.host].carrier(), routed, arena, derivatives, times);
}

void StageSlot::name(StageFault* fault, std::uint32_t target) const {
  fault->slot = which_;
  fault->plugin = description_.plugins[target].declaration.name;
}

void StageSlot::recover(StageFault fault, const StageCall& call, Attempts* attempts) {
  // a nested call's ladder is at its end: nobody here is to blame
  if (!fault.plugin.empty()) throw StageFault(fault);
  if (!description_.defences.replay) {
    name(&fault, call.target);
    throw StageFault(fault);
  }
  attempts->noticed_ns.push_back(channel::now_ns());
  name(&fault, call.target);
  const std::size_t host = routes_[call.target].host;
  const PluginChoice plugin = description_.plugins[call.target];
  log_->push_back({step_, fault});
  log_->back().injected = order_.substr(0, order_.find(','));
  Recovery recovery;
  bool poison = false;
  try {
    recovery = hosts_[host].recover(fault, attempts, &poison);
  } catch (StageFault& last) {
    if (poison) observer_->on_poison(call, plugin, fault);
    name(&last, call.target);
    throw;
  }
  log_->back().recovered_by = recovery.how;
  if (poison) observer_->on_poison(call, plugin, fault);
  if (!recovery.plugins_changed) return;
  if (recovery.how == "rollback") close_probation(host, SwapState::kRolledBack, fault.text);
  adopt(host, recovery.how);
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

void StageSlot::adopt(std::size_t host, const std::string& why) {
  const SlotDescription& now = hosts_[host].description();
  for (std::uint32_t target = 0; target < routes_.size(); ++target) {
    if (routes_[target].host != host) continue;
    const PluginChoice before = std::exchange(description_.plugins[target], now.plugins[routes_[target].target]);
    const PluginChoice& plugin = description_.plugins[target];
    if (host == 0) description_.hosting = now.hosting;
    observer_->on_decision({which_, target, step_, why, &now, &plugin});
    observer_->on_plugin_change(*this, target, before);
  }
  needs_attention_ = true;
}

}  // namespace gravitas::kernel
