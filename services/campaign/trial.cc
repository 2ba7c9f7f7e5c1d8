#include "services/campaign/trial.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <thread>

#include "kernel/environment.h"
#include "kernel/slot_host.h"
#include "plugin_sdk/host/handshake_lie.h"
#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/slots.h"
#include "services/campaign/host_trouble.h"
#include "services/campaign/leftovers.h"
#include "services/campaign/simulated_carrier.h"
#include "services/run/fault_desk.h"
#include "services/run/kernel_names.h"
#include "services/run/session.h"

namespace gravitas::campaign {
namespace {

using kernel::Environment;
using kernel::FaultRecord;
using kernel::StepOutcome;

struct NamedDefence {
  const char* name;
  bool kernel::Defences::*member;
};
constexpr NamedDefence kDefences[] = {
    {"structure", &kernel::Defences::structure}, {"numbers", &kernel::Defences::numbers},
    {"physics", &kernel::Defences::physics},     {"replay", &kernel::Defences::replay},
    {"digest", &kernel::Defences::digest},       {"epoch", &kernel::Defences::epoch},
    {"deadline", &kernel::Defences::deadline}};

constexpr const char* kConfirmation = "confirmation";

// Counts commits: none may be lost or made twice.
class CommitCount final : public kernel::CommitListener {
 public:
  void on_commit(const Environment& environment) override {
    ++commits_;
    is_in_order_ &= environment.step_count() == commits_;
  }
  bool is(std::uint32_t steps) const { return is_in_order_ && commits_ == steps; }

 private:
  std::uint32_t commits_ = 0;
  bool is_in_order_ = true;
};

// The plugins themselves: a fallback is then judged by the bits, too.
kernel::EnvironmentDescription with_fallbacks(kernel::EnvironmentDescription description) {
  for (const Slot slot : kSlots)
    for (kernel::PluginChoice& plugin : description.slot(slot).plugins)
      plugin.fallback = std::make_shared<const kernel::PluginChoice>(plugin);
  return description;
}

kernel::EnvironmentDescription description_of(const TrialPlan& plan, const Scene& scene, const TrialOptions& options) {
  kernel::EnvironmentDescription description = scene.description;
  description.steps = plan.steps;
  description.check_physics_every = 1;
  for (const Slot slot : kSlots) {
    kernel::SlotDescription& one = description.slot(slot);
    one.hosting = plan.hosting;
    one.deadline = options.deadline;
    one.standbys = 1;
    one.failures = kernel::SlotDescription::kBudget;
    one.defences = options.defences;
  }
  return plan.has_fallbacks ? with_fallbacks(std::move(description)) : description;
}

bool is_finite(const Environment& world) {
  const kernel::StateView state = world.state();
  const auto finite = [](std::span<const double> numbers) {
    return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
  };
  return finite(state.position) && finite(state.orientation) && finite(state.linear_velocity) &&
         finite(state.angular_velocity);
}

// To rounding, of metres, m/s, rad/s and quaternions of a few ones each: a speed of 1e-17 m/s that has the other sign is above
// no tolerance.
bool are_alike(const kernel::StateView& a, const kernel::StateView& b) {
  constexpr double kRounding = 1e-13;
  const auto alike = [](std::span<const double> one, std::span<const double> two) {
    return std::ranges::equal(one, two, [](double x, double y) {
      return std::fabs(x - y) <= kRounding * std::max(1.0, std::max(std::fabs(x), std::fabs(y)));
    });
  };
  return alike(a.position, b.position) && alike(a.orientation, b.orientation) &&
         alike(a.linear_velocity, b.linear_velocity) && alike(a.angular_velocity, b.angular_velocity);
}

class Run {
 public:
  Run(const TrialPlan& plan, const Scene& scene, const TrialOptions& options)
      : plan_(plan), scene_(scene), options_(options), hosts_(plan.seed) {
    trial_.set_seed(plan.seed);
    trial_.set_scene(scene.name);
    trial_.set_carrier(options.tier == Tier::kSimulated ? "simulated" : kernel::hosting_name(plan.hosting));
    trial_.set_steps(plan.steps);
    for (const PlannedFault& fault : plan.faults) faults_.push_back({&fault});
  }

  v1::Trial make() {
    try {
      go();
    } catch (const std::exception& problem) {
      forbid(fmt::format("an exception came out of the kernel: {}", problem.what()));
    }
    world_.reset();
    return std::move(trial_);
  }

 private:
  // A planned fault and what is known of it.
  struct Injected {
    const PlannedFault* plan;
    bool happened = false;
    std::vector<FaultRecord> records = {};
    std::string outcome = {};
  };

  void go();
  void begin(std::uint32_t step);
  void attack_from_outside(const PlannedFault& fault);
  void order_swap(const PlannedFault& fault);
  // Which slots' answers of this step are confirmed by another process.
  void set_reruns(std::uint32_t step);
  // The step is not what it was in the quiet run.
  void judge_divergence(std::uint32_t step);
  // But it is, to what no check can tell from rounding.
  bool is_quiet_to_rounding(std::uint32_t step) const;
  void judge_pause(std::uint32_t step);
  void attribute_records();
  void judge_swaps();
  void step_neighbour(std::uint32_t step);
  void write();
  void note_fallbacks();
  std::vector<Slot> hit_by(const PlannedFault& fault) const;
  // A busy machine's deadlines have used up the slot's budget, with faults that it would have borne: what follows is right.
  bool is_worn_out(Slot slot) const;
  int process_of(Slot slot) const;
  // The same run without faults, in the kernel's process.
  kernel::EnvironmentDescription alone_description() const;
  void forbid(std::string what) { trial_.add_forbidden(std::move(what)); }
  Injected* find(const FaultRecord& record);
  // The start of a worker that was dead before it was asked.
  bool is_failed_start(const FaultRecord& record);

  const TrialPlan& plan_;
  const Scene& scene_;
  const TrialOptions& options_;
  SimulatedHosts hosts_;
  kernel::EnvironmentDescription description_;
  std::unique_ptr<Environment> world_;
  std::unique_ptr<Environment> neighbour_;
  std::vector<std::jthread> pauses_;
  std::vector<Injected> faults_;
  std::vector<std::pair<SimulatedHosts::FailedStart, std::optional<FaultRecord>>> failed_starts_;
  std::set<Slot> late_;  // whose call overran its deadline though nothing had been injected
  bool is_over_ = false, has_other_plugin_ = false;
  v1::Trial trial_;
};

int Run::process_of(Slot slot) const {
  for (const kernel::PlannedSlot& planned : world_->plan().slots)
    if (planned.slot == slot) return planned.process_id;
  return 0;
}

kernel::EnvironmentDescription Run::alone_description() const {
  kernel::EnvironmentDescription description = scene_.description;
  description.steps = plan_.steps;
  for (const Slot slot : kSlots) description.slot(slot).hosting = kernel::Hosting::kDirect;
  return description;
}

void Run::order_swap(const PlannedFault& fault) {
  kernel::SwapOrder order;
  order.slot = fault.slot;
  const std::vector<kernel::PluginChoice>& own = description_.slot(fault.slot).plugins;
  order.plugin = own[0];
  if (fault.means == Means::kSwapRefused && fault.lie.empty()) order.plugin.library = "/dev/null";
  if (!fault.lie.empty())
    order.plugin.command = fmt::format("'{}' --lie {} '{}'", kernel::worker_program(), fault.lie, order.plugin.library);
  order.step = fault.step;
  world_->order_swap(order);
}

void Run::attack_from_outside(const PlannedFault& fault) {
  const auto send = [](int process, int signal) {
    if (process > 0) ::kill(process, signal);
  };
  switch (fault.means) {
    case Means::kKill:
      return send(process_of(fault.slot), SIGKILL);
    case Means::kPause:
      pauses_.push_back(continue_later(process_of(fault.slot), fault.pause * options_.deadline));
      [[fallthrough]];
    case Means::kStop:
      return send(process_of(fault.slot), SIGSTOP);
    case Means::kSwapRefused:
      return order_swap(fault);
    case Means::kSwapKilled:
      order_swap(fault);
      [[fallthrough]];
    case Means::kKillStandby: {
      std::vector<int> waiting = child_processes();
      for (const kernel::PlannedSlot& planned : world_->plan().slots) std::erase(waiting, planned.process_id);
      if (waiting.empty()) return;
      // the youngest is what is being prepared
      const std::size_t which = fault.means == Means::kSwapKilled ? waiting.size() - 1 : plan_.seed % waiting.size();
      return send(waiting[which], SIGKILL);
    }
    default:
      return;
  }
}

void Run::set_reruns(std::uint32_t step) {
  for (const Slot slot : kSlots) {
    const bool has_no_law = std::ranges::find(kConfirmed, slot) != std::end(kConfirmed);
    const bool is_asked = std::ranges::any_of(faults_, [&](const Injected& one) {
      return one.plan->step == step && one.plan->slot == slot && one.plan->rerun;
    });
    world_->set_rerun_every(slot, is_asked || (has_no_law && options_.confirms && options_.defences.physics) ? 1 : 0);
  }
}

// It shares the process with all that happens, and may not notice any of it.
void Run::step_neighbour(std::uint32_t step) {
  if (neighbour_->step() != StepOutcome::kCommitted || !(neighbour_->chain_hash() == scene_.chains[step]))
    forbid(fmt::format("step {} of another environment in the same process was disturbed", step));
}

void Run::begin(std::uint32_t step) {
  set_reruns(step);
  for (Injected& fault : faults_) {
    if (fault.plan->step != step) continue;
    fault.happened = true;
    attack_from_outside(*fault.plan);
  }
}

void Run::go() {
  description_ = description_of(plan_, scene_, options_);
  world_ = options_.tier == Tier::kReal
               ? std::make_unique<Environment>(description_, with_fault_desk(kernel::start_host, &world_))
               : std::make_unique<Environment>(description_, hosts_.starter());
  if (plan_.has_neighbour) neighbour_ = std::make_unique<Environment>(alone_description());
  CommitCount commits;
  world_->set_commit_listener(&commits);
  for (const PlannedFault& fault : plan_.faults) {
    if (fault.means == Means::kSwapFaulty) order_swap(fault);
    if (fault.means == Means::kOrder || fault.means == Means::kSwapFaulty)
      world_->inject({fault.slot, fault.order, fault.step, fault.times});
  }
  for (std::uint32_t step = 1; step <= plan_.steps && !is_over_; ++step) {
    begin(step);
    const StepOutcome outcome = world_->step();
    if (neighbour_) step_neighbour(step);
    const std::uint32_t expected = outcome == StepOutcome::kCommitted ? step : step - 1;
    if (world_->step_count() != expected || !commits.is(expected))
      forbid(fmt::format("step {} was lost or made twice: {} are counted", step, world_->step_count()));
    if (outcome == StepOutcome::kPaused) {
      is_over_ = true;
    } else if (!(world_->chain_hash() == scene_.chains[step]) && !has_other_plugin_) {
      judge_divergence(step);
    }
  }
  attribute_records();
  if (world_->fault()) judge_pause(world_->fault()->step);
  judge_swaps();
  write();
}

std::vector<Slot> Run::hit_by(const PlannedFault& fault) const { return slots_hit(fault, scene_); }

Run::Injected* Run::find(const FaultRecord& record) {
  Injected* later = nullptr;
  for (Injected& fault : faults_) {
    const bool is_hit = std::ranges::count(hit_by(*fault.plan), record.fault.slot) > 0;
    if (!fault.happened || !is_hit || fault.records.size() >= fault.plan->times) continue;
    if (fault.plan->step == record.step) return &fault;
    // one that is seen in the next call
    if (fault.plan->step + 1 == record.step) later = &fault;
  }
  return later;
}

bool Run::is_worn_out(Slot slot) const {
  const auto failures =
      std::ranges::count(world_->faults(), slot, [](const FaultRecord& one) { return one.fault.slot; });
  return failures >= kernel::SlotDescription::kBudget && late_.contains(slot);
}

void Run::note_fallbacks() {
  if (plan_.has_fallbacks) return;  // the plugins themselves: their bits are those of the quiet run
  for (const FaultRecord& record : world_->faults()) has_other_plugin_ |= record.recovered_by.starts_with("fallback");
}

void Run::judge_divergence(std::uint32_t step) {
  note_fallbacks();
  if (has_other_plugin_) {
    if (!is_finite(*world_)) forbid(fmt::format("the fallback's step {} is not finite", step));
    return;
  }
  is_over_ = true;
  for (Injected& fault : faults_) {
    const bool may_be_wrong = fault.plan->duty == Duty::kWrong || fault.plan->duty == Duty::kInTolerance;
    // what it changed may have slept in the warm start for a step
    if (!fault.happened || !may_be_wrong || fault.plan->rerun) continue;
    fault.outcome = fault.plan->duty == Duty::kWrong && !is_quiet_to_rounding(step) ? "not caught" : "needs re-run";
    return;
  }
  for (Injected& fault : faults_)
    if (fault.plan->step == step) fault.outcome = "forbidden";
  forbid(fmt::format("step {} was committed with other bits than in the quiet run, and nobody said so", step));
}

bool Run::is_quiet_to_rounding(std::uint32_t step) const {
  const std::unique_ptr<Environment> quiet = gravitas::start(alone_description());
  while (quiet->step_count() < step && quiet->step() == StepOutcome::kCommitted) {
  }
  return quiet->step_count() == step && are_alike(quiet->state(), world_->state());
}

// A pause is right after poison that no fallback takes over; what it leaves must go on as the quiet run does.
void Run::judge_pause(std::uint32_t step) {
  const kernel::StageFault& last = world_->fault()->fault;
  Injected* poison = nullptr;
  for (Injected& fault : faults_)
    if (fault.plan->duty == Duty::kPoison && fault.plan->step == step && fault.plan->slot == last.slot) poison = &fault;
  const bool is_tired = is_worn_out(last.slot);
  if ((poison == nullptr || plan_.has_fallbacks) && !is_tired) {
    for (Injected& fault : faults_)
      if (fault.plan->step == step) fault.outcome = "forbidden";
    forbid(
        fmt::format("paused at step {} where it had to recover: slot {}: {}", step, slot_name(last.slot), last.text()));
    return;
  }
  if (poison != nullptr) poison->outcome = "Q";
  note_fallbacks();
  Environment resumed(alone_description());
  const std::string problem = resumed.restore(world_->saved_state());
  if (!problem.empty()) return forbid(fmt::format("the state of the pause cannot be resumed: {}", problem));
  while (resumed.step_count() < plan_.steps && resumed.step() == StepOutcome::kCommitted) {
  }
  if (resumed.fault())
    return forbid(fmt::format("what the pause left goes on to step {} only: {}", resumed.step_count(),
                              resumed.fault()->fault.text()));
  if (!is_finite(resumed)) return forbid("what the pause left goes on to what is not finite");
  if (!has_other_plugin_ && !(resumed.chain_hash() == scene_.chains[plan_.steps]))
    forbid("what the pause left does not go on as the quiet run does");
}

bool Run::is_failed_start(const FaultRecord& record) {
  if (record.fault.kind != kernel::FaultKind::kDeath || !record.fault.is_unread) return false;
  const std::vector<Slot> shared = sharing(scene_, record.fault.slot);
  for (auto& [start, missed] : failed_starts_)
    if (start.dies && !missed && std::ranges::count(shared, start.slot) > 0) {
      missed = record;
      return true;
    }
  return false;
}

void Run::attribute_records() {
  if (options_.tier == Tier::kSimulated)
    for (const SimulatedHosts::FailedStart& start : hosts_.failed_starts()) failed_starts_.push_back({start, {}});
  for (const FaultRecord& record : world_->faults()) {
    const bool is_cold = record.recovered_by == "cold start" || record.recovered_by == "standby, still starting";
    if (record.recovery_us > 0.0 && record.recovered_by == "standby") trial_.add_standby_us(record.recovery_us);
    if (record.recovery_us > 0.0 && is_cold) trial_.add_cold_start_us(record.recovery_us);
    if (Injected* fault = find(record); fault != nullptr) {
      fault->records.push_back(record);
    } else if (!is_failed_start(record)) {
      if (record.fault.kind == kernel::FaultKind::kDeadline) late_.insert(record.fault.slot);
      trial_.add_unprovoked(fmt::format("step {}, slot {}: {}: {}", record.step, slot_name(record.fault.slot),
                                        fault_kind_name(record.fault.kind), record.fault.text()));
    }
  }
}

void Run::judge_swaps() {
  for (const kernel::SwapRecord& swap : world_->swaps()) {
    if (swap.pause_us > 0.0) trial_.add_swap_pause_us(swap.pause_us);
    for (const Injected& fault : faults_) {
      const bool is_it = fault.happened && fault.plan->means == Means::kSwapRefused && fault.plan->slot == swap.slot;
      const host::HandshakeLie* lie = host::find_handshake_lie(fault.plan->lie);
      const bool has_reason = lie == nullptr || swap.reason.find(lie->refusal) != std::string::npos;
      if (is_it && (swap.state != kernel::SwapState::kRefused || !has_reason))
        forbid(fmt::format("{} in slot {} is {}{}{}", fault.plan->order, slot_name(swap.slot),
                           swap_state_name(swap.state), swap.reason.empty() ? "" : ": ", swap.reason));
    }
  }
}

void Run::write() {
  for (const Injected& fault : faults_) {
    if (!fault.happened) continue;
    v1::Fault* line = trial_.add_faults();
    line->set_step(fault.plan->step);
    line->set_slot(slot_name(fault.plan->slot));
    line->set_order(fault.plan->means == Means::kSwapFaulty ? "a swap, " + fault.plan->order : fault.plan->order);
    line->set_group(fault.plan->group);
    line->set_times(fault.plan->times);
    line->set_rerun(fault.plan->rerun);
    std::string outcome = fault.outcome;
    if (outcome.empty()) outcome = fault.records.empty() ? "M" : "B";
    bool is_tired = false;
    for (const FaultRecord& record : fault.records) {
      line->set_detected_by(record.fault.detected_by);
      line->set_recovered_by(record.recovered_by);
      if (record.recovered_by.starts_with("fallback") && fault.outcome.empty()) outcome = "F";
      is_tired |= is_worn_out(record.fault.slot);
    }
    if (outcome == "F" && fault.plan->duty != Duty::kPoison && !is_tired) {
      outcome = "forbidden";
      forbid(fmt::format("the fallback took over at step {} from {}, which had to be recovered", fault.plan->step,
                         fault.plan->order));
    }
    line->set_outcome(outcome);
  }
  if (plan_.trouble != HostTrouble::kNone) {
    v1::Fault* line = trial_.add_faults();
    line->set_order(plan_.trouble == HostTrouble::kSignals ? "a storm of signals" : "a proxy and a locale");
    line->set_group("host");
    line->set_times(1);
    line->set_outcome("M");
  }
  for (const auto& [start, missed] : failed_starts_) {
    v1::Fault* line = trial_.add_faults();
    line->set_slot(slot_name(start.slot));
    line->set_order(start.dies ? "a start dies after its handshake" : "a start refused in the handshake");
    line->set_group("start");
    line->set_times(1);
    // most are missed where a standby is taken, before they are asked
    line->set_outcome(missed ? "B" : "M");
    if (!missed) continue;
    line->set_step(missed->step);
    line->set_detected_by(missed->fault.detected_by);
    line->set_recovered_by(missed->recovered_by);
  }
}

}  // namespace

void leave_out_defence(const std::string& name, TrialOptions* options) {
  std::vector<std::string> names = {kConfirmation};
  for (const NamedDefence& one : kDefences) {
    names.emplace_back(one.name);
    if (name == one.name) options->defences.*one.member = false;
  }
  if (name == kConfirmation) options->confirms = false;
  if (std::ranges::find(names, name) == names.end())
    throw BadInput(fmt::format("--without {}: there is no such defence; {}", name, allowed_names(name, names)));
}

namespace {

v1::Trial make_trial(const TrialPlan& plan, const Scene& scene, const TrialOptions& options) {
  std::optional<SignalStorm> storm;
  std::optional<ForeignSurroundings> surroundings;
  if (plan.trouble == HostTrouble::kSignals) storm.emplace();
  if (plan.trouble == HostTrouble::kSurroundings) surroundings.emplace();
  return Run(plan, scene, options).make();
}

}  // namespace

v1::Trial run_trial(const TrialPlan& plan, const Scene& scene, const TrialOptions& options) {
  // libraries and gRPC keep some of what the first trials open
  constexpr std::uint32_t kWarmUp = 4;
  constexpr std::size_t kSlack = 16;
  static std::uint32_t trials = 0;
  static std::size_t most_descriptors = 0;
  v1::Trial trial = make_trial(plan, scene, options);
  if (options.tier == Tier::kSimulated) return trial;
  // the supervisor's thread lets go of a process a moment after its end
  std::vector<std::string> leftovers = find_leftovers();
  for (int tries = 0; !leftovers.empty() && tries < 200; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    leftovers = find_leftovers();
  }
  for (std::string& left : leftovers) trial.add_forbidden(std::move(left));
  const std::size_t descriptors = open_descriptors();
  if (++trials <= kWarmUp) {
    most_descriptors = std::max(most_descriptors, descriptors);
  } else if (descriptors > most_descriptors + kSlack) {
    trial.add_forbidden(
        fmt::format("{} descriptors are open, {} were after the first trials", descriptors, most_descriptors));
  }
  return trial;
}

}  // namespace gravitas::campaign
