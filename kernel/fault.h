// A stage call that failed: who, how, how it was noticed. Thrown through the step; the slot's ladder (slot_host.h)
// catches it, and where that ends, Environment::step(). The committed state is untouched.
#pragma once

#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>

#include "plugin_sdk/plugin.h"

namespace gravitas::kernel {

enum class FaultKind : std::uint32_t {
  kDeath,         // the worker process ended
  kDeadline,      // no answer in time
  kRefusal,       // the plugin says that the request is impossible
  kFailure,       // the plugin itself failed
  kBadFrame,      // the answer's frame is wrong: sizes, epoch, digest
  kBadStructure,  // ids, order, uniqueness, lengths
  kBadNumbers,    // not finite, not unit, wrong sign
  kBadPhysics,    // momentum, energy, residuals, pairs that are missing
  kDisagreement,  // another process answers the same request with other bytes
  kHandshake      // the worker could not be started or refused to serve
};

class StageFault : public std::exception {
 public:
  // `rest` waits for the rest of the reason.
  StageFault(FaultKind what_failed, std::string how_noticed, std::string why, std::function<std::string()> rest = {})
      : kind(what_failed), detected_by(std::move(how_noticed)), text_(std::move(why)), rest_(std::move(rest)) {}

  const char* what() const noexcept override { return text().c_str(); }
  // The reason. May wait, since a worker that is known to be dying takes milliseconds until it is known how it ended.
  const std::string& text() const {
    if (const auto rest = std::exchange(rest_, nullptr)) text_ += rest();
    return text_;
  }

  FaultKind kind;
  std::string detected_by;   // "pidfd" (its process ended), "deadline", "status", "wire", "structure", "numbers" …
  Slot slot = Slot::kSpace;  // filled where the slot is known
  std::string plugin;
  bool is_unread = false;  // it died before it looked at the request, which is not to blame

 private:
  mutable std::string text_;
  mutable std::function<std::string()> rest_;
};

// One failed call and what became of it, as the report shows it.
struct FaultRecord {
  std::uint32_t step;  // that was being made
  StageFault fault;
  std::string recovered_by = {};  // "standby", "cold start", "rollback", "previous build", "fallback NAME"; "": paused
  std::string injected = {};      // kind of the fault that was ordered; empty: it came by itself
  double recovery_us = 0.0;       // from when it was noticed to the good answer
};

// A fault that a worker is ordered to commit, to test who calls it.
struct FaultInjection {
  Slot slot = Slot::kSolver;
  std::string order;        // "slow,factor=10": kinds and arguments are those of plugin_sdk/host/fault_kinds.h
  std::uint32_t step = 1;   // that is being made when it happens
  std::uint32_t times = 1;  // attempts at the first call of that step which are hit
};

}  // namespace gravitas::kernel
