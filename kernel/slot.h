// A slot of an environment: where one kind of question goes. It hides which carrier is used, makes room when an
// answer needs more, has a failed call answered by somebody else, and exchanges plugins between two steps.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"
#include "kernel/plan.h"
#include "kernel/slot_host.h"
#include "kernel/swap.h"
#include "kernel/validate.h"
#include "plugin_sdk/lap_clock.h"
#include "plugin_sdk/slow_calls.h"

namespace gravitas::kernel {

// Of a call with all its attempts at room, ns.
struct CallTimes {
  std::uint64_t compute = 0;  // the plugin worked, where its carrier knows
  std::uint64_t whole = 0;    // all of a call that is compared
  std::uint64_t check = 0;    // the frame of the answer was checked
  std::uint64_t begin = 0;    // when it was asked again after a failed call; 0: it is the first attempt
};

// Who answers from now on, and why: what a run must know again to be resumed.
struct Decision {
  Slot slot;
  std::uint32_t target;  // of the slot's plugins
  std::uint32_t step;    // first that is made so
  std::string why;       // "swap", "rollback", "previous build", "fallback NAME"
  const SlotDescription* host;
  const PluginChoice* plugin;
};

class StageSlot;

// What a slot tells its environment, before the step that it concerns is committed.
class SlotObserver {
 public:
  virtual ~SlotObserver() = default;
  // Another plugin is in place and has not been asked yet. May ask the slot itself.
  virtual void on_plugin_change(const StageSlot& slot, std::uint32_t target, const PluginChoice& before) = 0;
  virtual void on_decision(const Decision& decision) = 0;
  // `plugin` is not asked this again: it died of it, or answered it wrongly, twice, or hung in it once too often.
  virtual void on_poison(const StageCall& call, const PluginChoice& plugin, const StageFault& fault) = 0;
};

class StageSlot {
 public:
  StageSlot(Slot which, SlotDescription description);

  // Starting is split so that all of `slots`, this one too, have their hosts, which some share, before the workers start
  // side by side. `log` gets the failed calls.
  void find_hosts(std::span<StageSlot* const> slots, std::uint32_t threads, const HostStarter& starter);
  void start(SlotObserver* observer, std::vector<FaultRecord>* log);
  void finish_start();
  // Lets the host end, and ends it: for a slot that is not asked any more.
  void stop();
  void drain();

  bool is_running() const { return !hosts_.empty(); }
  // Why the host of the plugin in row `target` could not hold its fallback; empty if it could.
  std::string why_no_fallback(std::uint32_t target) const {
    return hosts_[routes_[target].host]->why_no_fallback(which_);
  }
  // Of the host of the plugin in row `target`; null where there is none.
  Budget* budget_of(std::uint32_t target) {
    return is_running() && target < routes_.size() ? &host_of(target).budget_of(which_) : nullptr;
  }
  Slot which() const { return which_; }
  const SlotDescription& description() const { return description_; }
  std::vector<std::string> take_complaints();
  // The hosts as the plan shows them.
  std::vector<PlannedSlot> hosts() const;

  // Before step number `step` is made: standbys, swaps.
  void begin_step(std::uint32_t step) {
    step_ = step;
    if (needs_attention_) attend();
  }

  // Asks until somebody gives an answer that `check` accepts: check(Untrusted<StageCall>, const CallTimes*) makes a
  // Trusted<…> of it, or throws (times are null for an answer that is only compared). Throws the last StageFault, with
  // this slot and the plugin in it, where the ladder ends.
  template <typename Check>
  auto ask(const StageCall& call, Arena* arena, DerivativeSource* derivatives, Check&& check) {
    Attempts attempts;
    for (;;) {
      try {
        CallTimes times;
        if (attempts.made > 0) times.begin = lap_ns();
        attempt(call, arena, derivatives, &attempts, &times);
        auto checked = check(Untrusted<StageCall>(call), &times);
        if (attempts.made > 0) note_recovery(attempts);
        host_of(call.target).count_good_answer(which_);
        if (is_watched_) watch(call, times, arena, derivatives, [&] { check(Untrusted<StageCall>(call), nullptr); });
        return checked;
      } catch (StageFault& fault) {
        recover(std::move(fault), call, &attempts);
      }
    }
  }

  // How long a call took in all. One that takes far longer than the calls before is counted as slow.
  void note_duration(std::uint64_t nanoseconds) { slow_calls_.note(nanoseconds); }

  // A worker commits a fault; consumed by the first attempts at that step.
  void inject(FaultInjection fault) { armed_.push_back(std::move(fault)); }
  // True if a call of this step is to be hit.
  bool has_order() const { return std::ranges::find(armed_, step_, &FaultInjection::step) != armed_.end(); }
  // True if a question about nothing, whose answer the contract says, need not be asked. A worker is asked: who looks after
  // it wants to know how it is.
  bool may_be_spared() const { return description_.hosting == Hosting::kDirect && !is_watched_; }

  // Begins a swap of the plugin in row `target`; see swap.h. With `only_compare` it never cuts over.
  void order_swap(SwapOrder order, std::uint32_t target, bool only_compare = false);
  // Before it cuts over; false if it has, or was refused. Of those ordered for that step, the one of that rank, from 0.
  bool call_off_swap(std::uint32_t step, std::uint32_t rank);
  // All so far, in the order they were asked for.
  std::vector<SwapRecord> swaps() const;
  // In every so many steps another process is asked the same, and must give the same bytes; 0: never.
  void set_rerun_every(std::uint32_t steps);

 private:
  // Plugins of a slot share a host, but for those that are commands, at an address, or may be followed by such.
  struct Route {
    std::size_t host;
    std::uint32_t target;
  };
  // A swap that has cut over and may still be rolled back.
  struct Probation {
    SlotHost* host;
    std::size_t record;
  };
  struct Checker {
    std::unique_ptr<Carrier> process;
    bool is_lacking = false;  // it could not be started, which takes its time
    std::uint32_t asked = 0;  // calls
  };
  struct Rerun {
    std::uint32_t every = 0;
    std::vector<Checker> checkers;  // per host
  };

  SlotHost& host_of(std::uint32_t target) { return *hosts_[routes_[target].host]; }
  // Makes room for as much as the columns' counts say, and leaves them empty.
  static void make_room(std::span<const ColumnId> columns, Arena* arena);
  static void call_with_room(Carrier* carrier, const StageCall& call, Arena* arena, DerivativeSource* derivatives,
                             CallTimes* times);
  void attempt(const StageCall& call, Arena* arena, DerivativeSource* derivatives, Attempts* attempts,
               CallTimes* times);
  void recover(StageFault fault, const StageCall& call, Attempts* attempts);
  void note_recovery(const Attempts& attempts);
  void name(StageFault* fault, std::uint32_t target) const;

  void attend();
  void prepare_swaps();
  void advance_swaps();
  bool advance_swap(PendingSwap* swap);
  void cut_over(PendingSwap* swap);
  void name_pair(const PendingSwap& swap);
  // Where another one answers than a comparison counts: another plugin, or elsewhere.
  void count_anew(PendingSwap* comparison, bool is_other);
  void refuse(PendingSwap* swap, const std::string& reason);
  void close_probation(const SlotHost* host, SwapState state, const std::string& reason);
  void close_all_probations(SlotHost* host, SwapState state, const std::string& reason);
  void update_watch();
  // The plugins of a host have changed: tells, and notes who serves; `by_us`: for this slot, whose row `swapped` changes.
  void adopt(const SlotHost& host, const std::string& why, bool by_us, std::uint32_t swapped);
  void let_all_adopt(const SlotHost& host, const std::string& why, std::uint32_t swapped = kNone);

  void watch(const StageCall& call, const CallTimes& times, Arena* arena, DerivativeSource* derivatives,
             const std::function<void()>& recheck);
  bool watch_swap(PendingSwap* swap, const StageCall& call, const CallTimes& first, Arena* arena,
                  DerivativeSource* derivatives, const std::function<void()>& recheck);
  void rerun(const StageCall& call, Arena* arena, DerivativeSource* derivatives, const std::function<void()>& recheck);

  Slot which_;
  SlotDescription description_;
  SlotObserver* observer_ = nullptr;
  std::vector<FaultRecord>* log_ = nullptr;
  std::span<StageSlot* const> slots_;  // of the environment
  std::vector<std::shared_ptr<SlotHost>> hosts_;
  std::vector<Route> routes_;  // per plugin of the slot
  std::uint32_t step_ = 0;
  bool needs_attention_ = false;
  bool is_watched_ = false;

  std::vector<FaultInjection> armed_;
  std::string order_;  // of the fault that is being injected
  std::vector<PendingSwap> pending_;
  std::vector<SwapRecord> swaps_;
  std::vector<Probation> probation_;
  SlowCalls slow_calls_;
  Rerun rerun_;
  std::vector<std::string> complaints_;
};

}  // namespace gravitas::kernel
