// A slot of an environment: where one kind of question goes. It hides which carrier is used, makes room when an
// answer needs more, and turns every failure into a StageFault that names the slot and the plugin.
#pragma once

#include <memory>
#include <string>

#include "kernel/carrier/carrier.h"
#include "kernel/validate.h"

namespace gravitas::kernel {

class StageSlot {
 public:
  StageSlot(Slot which, SlotDescription description);

  // Starting is split so that the workers of all slots start side by side.
  void start(std::uint32_t threads);
  void finish_start();
  // Lets the host end, and ends it: for a slot that is not asked any more.
  void stop();
  void drain();

  bool is_running() const { return carrier_ != nullptr; }
  Slot which() const { return which_; }
  const SlotDescription& description() const { return description_; }
  std::vector<std::string> take_complaints() {
    return carrier_ ? carrier_->take_complaints() : std::vector<std::string>();
  }
  int process_id() const { return carrier_ ? carrier_->process_id() : 0; }

  // Asks; the answer lies in the call's reply columns but is not to be used before validation.
  // Time the plugin worked is added to *compute_ns.
  Untrusted<StageCall> ask(const StageCall& call, Arena* arena, DerivativeSource* derivatives,
                           std::uint64_t* compute_ns);

  // Throws the fault with this slot and the plugin that was asked written into it.
  [[noreturn]] void fail(StageFault fault, std::uint32_t target) const;

 private:
  Slot which_;
  SlotDescription description_;
  std::unique_ptr<PendingCarrier> pending_;
  std::unique_ptr<Carrier> carrier_;
};

}  // namespace gravitas::kernel
