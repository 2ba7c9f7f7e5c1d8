// One host of a slot: the worker that answers, those that stand by, and the ladder that a failed call climbs:
//
//   replay on a standby -> cold start -> previous good build -> declared fallback -> the environment pauses
//
// A host that fails kBudget times with fewer than kGoodAnswers good answers between goes to the next rung, and so does
// a request that two incarnations died of or answered wrongly (there a deadline alone does not count, nor a death
// before the request was read, as far as the carrier can tell: in gRPC, before it was written).
#pragma once

#include <cstdint>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"
#include "kernel/spare.h"

namespace gravitas::kernel {

// One request's way up the ladder.
struct Attempts {
  std::uint32_t made = 0;
  std::uint32_t rejections = 0;  // by death or a wrong answer, on this rung
  std::vector<std::uint64_t> noticed_ns;
};

// What a failed call led to.
struct Recovery {
  std::string how;               // as FaultRecord::recovered_by
  bool plugins_changed = false;  // others answer now
};

class SlotHost {
 public:
  static constexpr std::uint32_t kBudget = 5;
  static constexpr std::uint32_t kGoodAnswers = 100;
  // Steps for which a swap is on probation.
  static constexpr std::uint32_t kProbation = 8;

  SlotHost(SlotDescription description, std::uint32_t threads, const HostStarter& start);
  ~SlotHost();
  SlotHost(SlotHost&&) = default;

  // Starting is split so that the workers of all hosts start side by side. finish_start() throws StageFault.
  void begin_start();
  void finish_start();
  // Begins the standbys that are missing, unless kBudget of them were lost.
  void keep_standbys();
  void drain();

  const SlotDescription& description() const { return description_; }
  Carrier& carrier() const { return *carrier_; }
  int process_id() const { return carrier_ ? carrier_->process_id() : 0; }
  std::vector<std::string> sandbox() const { return carrier_ ? carrier_->sandbox() : std::vector<std::string>(); }
  std::uint32_t wanted_standbys() const;
  // What its processes, past ones included, said went wrong besides their answers; taken out.
  std::vector<std::string> take_complaints();
  void count_good_answer() { ++good_answers_; }

  // After a failed call: the next host is in place, for the same request again. Throws the last fault where the ladder
  // ends. `poison` becomes true if the request itself is to blame, as far as anybody can tell.
  Recovery recover(const StageFault& fault, Attempts* attempts, bool* poison);

  // A host for a swap, in preparation.
  std::unique_ptr<Spare> prepare(const SlotDescription& description) const;
  // Lets `carrier` answer from now on; the old one stays warm until end_probation().
  void cut_over(std::unique_ptr<Carrier> carrier, SlotDescription description);
  bool is_on_probation() const { return old_ != nullptr; }
  void end_probation();
  // Ends a host in the background: a dying process must not hold up a step.
  void retire(std::unique_ptr<Carrier> carrier);
  void retire(std::vector<std::unique_ptr<Spare>> spares);

 private:
  std::string take_host();
  // Empty: there is none.
  std::string next_rung();
  void replace_description(SlotDescription description);

  SlotDescription description_;
  std::uint32_t threads_;
  HostStarter start_;
  std::unique_ptr<Carrier> carrier_;
  std::vector<std::unique_ptr<Spare>> standbys_;
  // During probation: what answered before. After it: what it was made of.
  std::unique_ptr<Carrier> old_;
  std::optional<SlotDescription> previous_;
  std::uint32_t failures_ = 0, failures_in_a_row_ = 0, lost_standbys_ = 0;
  std::uint64_t good_answers_ = 0;       // since the last failure
  std::vector<std::string> complaints_;  // of those that are gone
  std::vector<std::future<void>> retired_;
};

}  // namespace gravitas::kernel
