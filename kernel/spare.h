// A host that is being prepared in a thread of its own: a slot's first worker, a warm standby, or what a swap will cut
// over to. Nothing of it touches the run before it is taken.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"

namespace gravitas::kernel {

class Spare {
 public:
  // Begins.
  Spare(SlotDescription host, std::uint32_t threads, const HostStarter& start);
  // Gives up what nobody took, and waits for its end.
  ~Spare();
  // Begins that, so that several end side by side.
  void give_up();
  Spare(const Spare&) = delete;
  Spare& operator=(const Spare&) = delete;

  // Prepared, or failed to be.
  bool is_done() const;
  // Why nobody needs to take it any more: its start failed, or its host has gone since. Empty: it may be taken.
  std::string problem() const;
  // Waits. Throws the StageFault of a failed start.
  std::unique_ptr<Carrier> take();

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::unique_ptr<Carrier> carrier_;
  std::optional<StageFault> fault_;
  std::jthread thread_;
};

}  // namespace gravitas::kernel
