// A slot of an environment: where one kind of question goes. It hides which carrier is used, makes room when an
// answer needs more, and turns every failure into a StageFault that names the slot and the plugin.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "kernel/carrier/carrier.h"
#include "kernel/plan.h"
#include "kernel/validate.h"

namespace gravitas::kernel {

// Of a call with all its attempts at room, ns.
struct CallTimes {
  std::uint64_t compute = 0;  // the plugin worked
  std::uint64_t check = 0;    // the frame of the answer was checked
};

class StageSlot {
 public:
  StageSlot(Slot which, SlotDescription description);

  // Starting is split so that the workers of all slots start side by side.
  void start(std::uint32_t threads);
  void finish_start();
  // Lets the host end, and ends it: for a slot that is not asked any more.
  void stop();
  void drain();

  bool is_running() const { return !hosts_.empty(); }
  Slot which() const { return which_; }
  const SlotDescription& description() const { return description_; }
  std::vector<std::string> take_complaints();
  // The hosts as the plan shows them.
  std::vector<PlannedSlot> hosts() const;

  // Asks; the answer lies in the call's reply columns but is not to be used before validation.
  Untrusted<StageCall> ask(const StageCall& call, Arena* arena, DerivativeSource* derivatives, CallTimes* times);

  // Throws the fault with this slot and the plugin that was asked written into it.
  [[noreturn]] void fail(StageFault fault, std::uint32_t target) const;

 private:
  Slot which_;
  SlotDescription description_;
  // The plugins of a slot live in one host, but for those that are commands or at an address.
  struct Host {
    SlotDescription description;
    std::unique_ptr<PendingCarrier> pending;
    std::unique_ptr<Carrier> carrier;
  };
  struct Route {
    std::size_t host;
    std::uint32_t target;
  };
  void assign_hosts();
  // Makes room for as much as the columns' counts say, and leaves them empty.
  static void make_room(std::span<const ColumnId> columns, Arena* arena);
  [[noreturn]] void fail(StageFault fault, const Host& host) const;

  std::vector<Host> hosts_;
  std::vector<Route> routes_;  // per plugin of the slot
};

}  // namespace gravitas::kernel
