// One host of a slot, or of several that share a process: the worker that answers, those that stand by, and the ladder that a failed call climbs:
//
//   replay on a standby -> cold start -> previous good build -> declared fallback -> the environment pauses
//
// A host that fails SlotDescription::failures times, each fewer than kGoodAnswers good answers after the one before, goes
// to the next rung, and so does a request that two incarnations died of or answered wrongly (no deadline counts, nor a
// death before the request was read; over gRPC a first death counts once it was written). What fails is charged to the
// slot that was asked; the others that share the host go on with whoever comes next, all alike.
#pragma once

#include <array>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"
#include "kernel/saved_state.h"
#include "kernel/spare.h"
#include "plugin_sdk/slots.h"

namespace gravitas::kernel {

// One request's way up the ladder.
struct Attempts {
  std::uint32_t made = 0;
  std::uint32_t rejections = 0;  // by death or a wrong answer, on this rung
  std::vector<std::uint64_t> noticed_ns;
  std::shared_ptr<Carrier> asked;  // where calls of the same process may be made during the call
};

// What a failed call led to.
struct Recovery {
  std::string how;               // as FaultRecord::recovered_by
  bool plugins_changed = false;  // others answer now
};

class SlotHost {
 public:
  static constexpr std::uint32_t kGoodAnswers = 100;
  // Steps for which a swap is on probation.
  static constexpr std::uint32_t kProbation = 8;

  // Without plugins: add() them before the start, and get their rows.
  SlotHost(SlotDescription description, std::uint32_t threads, const HostStarter& start);
  std::uint32_t add(const PluginChoice& plugin);

  // Split so that the workers of all hosts start side by side. The second throws StageFault. Each slot asks for both.
  void begin_start();
  void finish_start();
  // Begins the standbys that are missing, unless as many were lost as may fail.
  void keep_standbys();
  void drain();

  const SlotDescription& description() const { return description_; }
  const std::shared_ptr<Carrier>& carrier() const { return carrier_; }
  // Counted up when the description changes.
  std::uint32_t revision() const { return revision_; }
  int process_id() const { return carrier_ ? carrier_->process_id() : 0; }
  std::vector<std::string> sandbox() const { return carrier_ ? carrier_->sandbox() : std::vector<std::string>(); }
  std::uint32_t wanted_standbys() const;
  // What its processes, past ones included, said went wrong besides their answers; taken out.
  std::vector<std::string> take_complaints();
  Budget& budget_of(Slot slot) { return budgets_[static_cast<std::size_t>(slot)]; }
  void count_good_answer(Slot slot) { ++budget_of(slot).good_answers; }

  // After a failed call of the fault's slot: the next host is in place, for the same request again. Throws the last
  // fault where the ladder ends. `poison` becomes true if the request is to blame, or hung as the last straw.
  Recovery recover(const StageFault& fault, Attempts* attempts, bool* poison);

  // A host for a swap, in preparation.
  std::unique_ptr<Spare> prepare(const SlotDescription& description) const;
  // Lets `carrier`, with another plugin of the slot, answer from now on; the old one stays warm until end_probation(), or is gone.
  void cut_over(Slot slot, std::unique_ptr<Carrier> carrier, SlotDescription description, bool has_taken_over);
  // Why the slot's fallbacks could not be held; empty if they could.
  std::string why_no_fallback(Slot slot) const { return why_apart(after_fallback(slot).plugins); }
  bool is_on_probation() const { return old_ != nullptr; }
  void end_probation() { retire(std::move(old_)); }
  // Ends a host in the background: a dying process must not hold up a step.
  void retire(std::shared_ptr<Carrier> carrier);
  void retire(std::unique_ptr<Spare> spare);

 private:
  std::string take_host();
  // Empty: there is none.
  std::string next_rung(Slot slot);
  // Once those plugins of the slot that have a fallback are replaced by it.
  SlotDescription after_fallback(Slot slot) const;
  void replace_description(SlotDescription description);

  SlotDescription description_;
  std::uint32_t threads_;
  HostStarter start_;
  std::shared_ptr<Carrier> carrier_;
  std::vector<std::unique_ptr<Spare>> standbys_;
  std::shared_ptr<Carrier> old_;                   // what answered before, during probation
  Slot swapped_ = Slot::kSpace;                    // the last
  std::map<Slot, SlotDescription> previous_;       // what a slot's last swap took the place of
  std::array<Budget, kSlots.size() + 1> budgets_;  // by slot, which counts from 1
  std::uint32_t revision_ = 0, lost_standbys_ = 0;
  std::vector<std::string> complaints_;  // of those that are gone
  std::vector<std::future<void>> retired_;
};

}  // namespace gravitas::kernel
