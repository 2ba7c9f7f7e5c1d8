#include "kernel/slot.h"

#include <algorithm>
#include <array>
#include <utility>

namespace gravitas::kernel {
namespace {

// More rounds than any honest plugin needs: each at least doubles the room.
constexpr int kCapacityRounds = 64;

}  // namespace

StageSlot::StageSlot(Slot which, SlotDescription description) : which_(which), description_(std::move(description)) {}

void StageSlot::assign_hosts() {
  const auto same_host = [](const PluginChoice& a, const PluginChoice& b) {
    return a.command.empty() && b.command.empty() && a.address == b.address;
  };
  for (const PluginChoice& plugin : description_.plugins) {
    const auto found =
        std::ranges::find_if(hosts_, [&](const Host& host) { return same_host(host.description.plugins[0], plugin); });
    const auto host = static_cast<std::size_t>(found - hosts_.begin());
    if (found == hosts_.end()) {
      hosts_.emplace_back().description = description_;
      hosts_.back().description.plugins.clear();
      if (!plugin.command.empty() || !plugin.address.empty()) hosts_.back().description.hosting = Hosting::kGrpc;
    }
    routes_.push_back({host, static_cast<std::uint32_t>(hosts_[host].description.plugins.size())});
    hosts_[host].description.plugins.push_back(plugin);
  }
}

void StageSlot::start(std::uint32_t threads) {
  assign_hosts();
  for (Host& host : hosts_) {
    try {
      if (host.description.hosting == Hosting::kDirect) {
        host.carrier = make_direct_carrier(host.description.plugins, threads);
      } else if (host.description.hosting == Hosting::kSharedMemory) {
        host.pending = start_shared_memory_carrier(host.description, threads);
      } else {
        host.pending = start_grpc_carrier(host.description, threads);
      }
    } catch (StageFault& fault) {
      fail(std::move(fault), host);
    }
  }
}

void StageSlot::finish_start() {
  for (Host& host : hosts_) {
    if (!host.pending) continue;
    try {
      host.carrier = host.pending->finish();
    } catch (StageFault& fault) {
      fail(std::move(fault), host);
    }
    host.pending.reset();
  }
}

void StageSlot::stop() { hosts_.clear(); }

void StageSlot::drain() {
  for (Host& host : hosts_)
    if (host.carrier) host.carrier->drain();
}

std::vector<std::string> StageSlot::take_complaints() {
  std::vector<std::string> all;
  for (Host& host : hosts_)
    for (std::string& one : host.carrier->take_complaints()) all.push_back(std::move(one));
  return all;
}

std::vector<PlannedSlot> StageSlot::hosts() const {
  std::vector<PlannedSlot> planned;
  for (const Host& host : hosts_) {
    PlannedSlot& one = planned.emplace_back();
    one.slot = which_;
    one.hosting = host.description.hosting;
    one.process_id = host.carrier ? host.carrier->process_id() : 0;
    for (const PluginChoice& plugin : host.description.plugins) one.plugins.push_back(plugin.declaration.name);
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

Untrusted<StageCall> StageSlot::ask(const StageCall& call, Arena* arena, DerivativeSource* derivatives,
                                    CallTimes* times) {
  const Route route = routes_[call.target];
  StageCall routed = call;
  routed.target = route.target;
  try {
    for (int round = 0; round < kCapacityRounds; ++round) {
      const CallResult result = hosts_[route.host].carrier->call(routed, arena, derivatives);
      times->compute += result.compute_ns;
      times->check += result.check_ns;
      if (result.status == GRAVITAS_OK) return Untrusted<StageCall>(call);
      if (result.status == GRAVITAS_REFUSED)
        throw StageFault(FaultKind::kRefusal, "status", "it refused: " + result.text);
      if (result.status != GRAVITAS_NEEDS_CAPACITY)
        throw StageFault(FaultKind::kFailure, "status", "it failed: " + result.text);
      make_room(call.reply, arena);
    }
    throw StageFault(FaultKind::kBadStructure, "structure", "it asks for more room again and again");
  } catch (StageFault& fault) {
    // a fault of a nested call has its slot already
    if (!fault.plugin.empty()) throw;
    fail(std::move(fault), call.target);
  }
}

void StageSlot::fail(StageFault fault, const Host& host) const {
  fault.slot = which_;
  fault.plugin = host.description.plugins[0].declaration.name;
  throw fault;
}

void StageSlot::fail(StageFault fault, std::uint32_t target) const {
  fault.slot = which_;
  fault.plugin = description_.plugins[target].declaration.name;
  throw fault;
}

}  // namespace gravitas::kernel
