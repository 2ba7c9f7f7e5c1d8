#include "kernel/slot.h"

#include <utility>

namespace gravitas::kernel {
namespace {

// More rounds than any honest plugin needs: each at least doubles the room.
constexpr int kCapacityRounds = 64;

}  // namespace

StageSlot::StageSlot(Slot which, SlotDescription description) : which_(which), description_(std::move(description)) {}

void StageSlot::start(std::uint32_t threads) {
  if (description_.plugins.empty()) return;
  try {
    if (description_.hosting == Hosting::kDirect) {
      carrier_ = make_direct_carrier(description_.plugins, threads);
    } else {
      pending_ = start_shared_memory_carrier(description_.plugins, threads, description_.deadline);
    }
  } catch (StageFault& fault) {
    fail(std::move(fault), 0);
  }
}

void StageSlot::finish_start() {
  if (!pending_) return;
  try {
    carrier_ = pending_->finish();
  } catch (StageFault& fault) {
    fail(std::move(fault), 0);
  }
  pending_.reset();
}

void StageSlot::stop() { carrier_.reset(); }

void StageSlot::drain() {
  if (carrier_) carrier_->drain();
}

Untrusted<StageCall> StageSlot::ask(const StageCall& call, Arena* arena, DerivativeSource* derivatives,
                                    std::uint64_t* compute_ns) {
  try {
    for (int round = 0; round < kCapacityRounds; ++round) {
      const CallResult result = carrier_->call(call, arena, derivatives);
      *compute_ns += result.compute_ns;
      if (result.status == GRAVITAS_OK) return Untrusted<StageCall>(call);
      if (result.status == GRAVITAS_REFUSED)
        throw StageFault(FaultKind::kRefusal, "status", "it refused: " + result.text);
      if (result.status != GRAVITAS_NEEDS_CAPACITY)
        throw StageFault(FaultKind::kFailure, "status", "it failed: " + result.text);
      for (const ColumnId column : call.reply) {
        const std::uint64_t wanted = arena->count(column);
        if (wanted <= arena->capacity(column)) continue;
        if (wanted > kLargestColumn)
          throw StageFault(FaultKind::kBadStructure, "structure",
                           "it asks for room for " + std::to_string(wanted) + " numbers in one column");
        arena->set_count(column, 0);
        arena->grow(column, wanted);
      }
    }
    throw StageFault(FaultKind::kBadStructure, "structure", "it asks for more room again and again");
  } catch (StageFault& fault) {
    // a fault of a nested call has its slot already
    if (!fault.plugin.empty()) throw;
    fail(std::move(fault), call.target);
  }
}

void StageSlot::fail(StageFault fault, std::uint32_t target) const {
  fault.slot = which_;
  fault.plugin = description_.plugins[target].declaration.name;
  throw fault;
}

}  // namespace gravitas::kernel
