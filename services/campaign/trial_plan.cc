#include "services/campaign/trial_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "kernel/slot_host.h"
#include "plugin_sdk/host/fault_kinds.h"
#include "plugin_sdk/host/faulty_reply.h"
#include "plugin_sdk/host/handshake_lie.h"

namespace gravitas::campaign {
namespace {

using host::RandomNumbers;

constexpr std::uint32_t kFewestSteps = 24;
// Failures of a slot in one trial: its budget (slot_host.h) would call the next a broken build. In the simulated tier a
// start may fail besides.
constexpr std::uint32_t kMostReal = kernel::SlotDescription::kBudget - 1,
                        kMostSimulated = kernel::SlotDescription::kBudget - 2;

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : numbers_(seed) {}
  std::uint64_t below(std::uint64_t end) { return numbers_.next() % end; }
  bool chance(std::uint64_t percent) { return below(100) < percent; }
  template <typename Range>
  const auto& one_of(const Range& range) {
    return range[below(std::size(range))];
  }

 private:
  RandomNumbers numbers_;
};

struct Weight {
  std::string_view group;
  std::uint64_t percent;
};
// Deadlines cost their time in the real tier alone.
constexpr std::array<Weight, 8> kReal = {{{"process", 38},
                                          {"hang", 5},
                                          {"resources", 7},
                                          {"wire", 16},
                                          {"values", 14},
                                          {"sandbox", 6},
                                          {"rounding", 2},
                                          {"outside", 12}}};
constexpr std::array<Weight, 8> kSimulated = {{{"process", 28},
                                               {"hang", 12},
                                               {"resources", 6},
                                               {"wire", 26},
                                               {"values", 20},
                                               {"sandbox", 2},
                                               {"rounding", 4},
                                               {"outside", 2}}};

constexpr std::array<std::string_view, 3> kMoments = {"read", "compute", "write"};
constexpr std::array<std::string_view, 7> kEnds = {"kill", "segv", "abort", "fpe", "stack", "throw", "exit"};
constexpr std::array<std::string_view, 4> kSlow = {"slow,factor=2", "slow,factor=10", "jitter,seconds=0.01",
                                                   "slow,seconds=0.005"};
constexpr std::array<std::string_view, 3> kEndless = {"hang", "deadlock", "stop"};
constexpr std::array<std::string_view, 4> kResources = {"leak,bytes=1048576", "descriptors", "flood,bytes=100000",
                                                        "memory"};
constexpr std::array<std::string_view, 3> kLost = {"drop", "stale", "sequence"};
constexpr std::array<std::string_view, 7> kSandbox = {"open", "connect", "fork", "exec", "ptrace", "signal", "map"};
constexpr std::array<std::string_view, 4> kFactors = {"1000", "-1", "1.5", "0.001"};

std::string wire_order(Draw* draw, Tier tier) {
  if (draw->chance(tier == Tier::kReal ? 12 : 40)) return std::string(draw->one_of(kLost));
  switch (draw->below(6)) {
    case 0:
      return "truncate";
    case 1:
      return "oversize";
    case 2:
      return fmt::format("scribble,seed={}", draw->below(1U << 20));
    case 3:
      return draw->chance(50) ? "duplicate" : "delay,seconds=0.01";
    default:
      return fmt::format("flip,bit={}", draw->below(1U << 16));
  }
}

// What is asked of a slot in a step.
stage::Method method_of(Slot slot) {
  switch (slot) {
    case Slot::kSpace:
      return stage::Method::kSpacePairs;
    case Slot::kCollision:
      return stage::Method::kCollisionManifolds;
    case Slot::kConstraint:
      return stage::Method::kConstraintDiscrepancies;
    case Slot::kForce:
      return stage::Method::kForceWrenches;
    case Slot::kSolver:
      return stage::Method::kSolverSolve;
    case Slot::kIntegrator:
      break;
  }
  return stage::Method::kIntegratorIntegrate;
}

// Which numbers are changed: the first column's if it is not said.
std::string draw_column(Draw* draw, Slot slot) {
  if (draw->chance(40)) return {};
  std::vector<const char*> names;
  for (const stage::ColumnInfo& column : stage::method_info(method_of(slot)).reply)
    if (column.type == stage::ElementType::kF64 && column.rows_index != stage::kScalar) names.push_back(column.name);
  return names.empty() ? "" : fmt::format(",column={}", draw->one_of(names));
}

// Fills in the order and what has to become of it.
void draw_value(Draw* draw, PlannedFault* fault) {
  const bool has_numbers = fault->slot != Slot::kSpace;
  const bool has_ids = fault->slot == Slot::kSpace || fault->slot == Slot::kCollision;
  std::string rows = draw->chance(25) ? ",all=1" : "";
  rows += draw_column(draw, fault->slot);
  const std::uint64_t kind = has_numbers ? draw->below(11) : 7 + draw->below(4);
  fault->duty = Duty::kWrong;
  switch (kind) {
    case 0:
    case 1:
      fault->order = (kind == 0 ? "nan" : "inf") + rows;
      fault->duty = Duty::kRecover;
      break;
    case 2:
      fault->order = "denormal" + rows;
      fault->duty = Duty::kInTolerance;
      break;
    case 3:
      fault->order = "ulp" + rows;
      fault->duty = Duty::kInTolerance;
      break;
    case 4:
      fault->order = "sign" + rows;
      break;
    case 5:
      fault->order = fmt::format("scale,factor={}{}", draw->one_of(kFactors), rows);
      break;
    case 6:
      fault->order = "zero" + rows;
      break;
    case 7:
      fault->order = "permute";
      if (has_ids) fault->duty = Duty::kRecover;
      break;
    case 8:
      fault->order = "double";
      if (has_ids) fault->duty = Duty::kRecover;
      break;
    case 9:
      fault->order = "missing";
      break;
    default:
      fault->order = "phantom";
      break;
  }
  // wrong values of the right form are counted by themselves (table.cc)
  fault->group = fault->duty == Duty::kRecover ? "malformed" : fault->duty == Duty::kWrong ? "values" : "tolerance";
}

// `is_command`: the worker commits no orders.
void draw_order(Draw* draw, Tier tier, bool is_command, PlannedFault* fault) {
  const auto& weights = tier == Tier::kReal ? kReal : kSimulated;
  std::uint64_t at = draw->below(100);
  std::size_t group = 0;
  while (at >= weights[group].percent) at -= weights[group++].percent;
  if (is_command) group = weights.size() - 1;
  fault->group = weights[group].group;
  switch (group) {
    case 0:
      fault->order = fmt::format("{},at={}", draw->one_of(kEnds), draw->chance(12) ? "reply" : draw->one_of(kMoments));
      break;
    case 1:
      fault->order = draw->chance(tier == Tier::kReal ? 40 : 70) ? draw->one_of(kEndless) : draw->one_of(kSlow);
      break;
    case 2:
      fault->order = draw->one_of(kResources);
      break;
    case 3:
      fault->order = wire_order(draw, tier);
      break;
    case 4:
      draw_value(draw, fault);
      fault->rerun = fault->duty != Duty::kRecover;
      if (fault->rerun) fault->group = "re-run";
      break;
    case 5:
      fault->order = draw->one_of(kSandbox);
      break;
    case 6:
      fault->order = "rounding";
      break;
    default: {
      // nobody is outside in the simulated tier
      const std::uint64_t means = tier == Tier::kSimulated ? 99 : draw->below(is_command ? 70 : 100);
      fault->means = means < 32   ? Means::kKill
                     : means < 36 ? Means::kStop
                     : means < 44 ? Means::kPause
                     : means < 70 ? Means::kKillStandby
                     : means < 82 ? Means::kSwapKilled
                     : means < 88 ? Means::kSwapRefused
                                  : Means::kSwapFaulty;
      if (fault->means == Means::kPause) fault->pause = 0.1 * static_cast<double>(1 + draw->below(15));
      const bool is_swap = fault->means >= Means::kSwapKilled;
      if (is_swap) fault->group = "swap";
      if (fault->means == Means::kSwapRefused && draw->chance(75)) {
        std::vector<std::string> lies;
        for (const host::HandshakeLie& lie : host::handshake_lies())
          if (!lie.refusal.empty()) lies.emplace_back(lie.what);
        fault->lie = draw->one_of(lies);
        fault->group = "protocol";
      }
      fault->order = fault->means == Means::kKill   ? "SIGKILL from outside"
                     : fault->means == Means::kStop ? "SIGSTOP from outside"
                     : fault->means == Means::kPause
                         ? fmt::format("SIGSTOP from outside, SIGCONT after {:.1f} deadlines", fault->pause)
                     : !fault->lie.empty() ? "a swap to a worker that lies in its handshake: " + fault->lie
                     : fault->means == Means::kSwapRefused ? "a swap to what is no library"
                     : fault->means == Means::kKillStandby ? "SIGKILL to a standby"
                     : fault->means == Means::kSwapKilled  ? "a swap, killed in preparation"
                                                           : "kill,at=compute";
    }
  }
}

// What ends a trial, since what follows could not be judged: poison, or a wrong value that nobody looks for.
PlannedFault draw_last(Draw* draw, Slot slot) {
  PlannedFault fault;
  fault.slot = slot;
  if (draw->chance(40)) {
    fault.group = "poison";
    fault.duty = Duty::kPoison;
    fault.times = 2;
    fault.order = draw->chance(70) || slot == Slot::kSpace
                      ? fmt::format("{},at={}", draw->one_of(kEnds), draw->one_of(kMoments))
                      : "nan";
  } else {
    draw_value(draw, &fault);
  }
  return fault;
}

// Its process holds one plugin; else a command, which is how a liar is started, cannot serve there.
bool is_alone(const Scene& scene, Slot slot) {
  return sharing(scene, slot).size() == 1 && scene.description.slot(slot).plugins.size() == 1;
}

}  // namespace

std::vector<Slot> slots_hit(const PlannedFault& fault, const Scene& scene) {
  if (is_between_calls(fault)) return sharing(scene, fault.slot);
  const bool is_wrong = fault.duty == Duty::kWrong || fault.duty == Duty::kInTolerance;
  if (fault.slot == Slot::kForce && is_wrong) return {Slot::kForce, Slot::kIntegrator};
  return {fault.slot};
}

std::uint64_t trial_seed(std::uint64_t campaign_seed, std::uint64_t index) {
  RandomNumbers of_campaign(campaign_seed);
  return RandomNumbers(of_campaign.next() + index).next();
}

TrialPlan draw_trial(std::uint64_t seed, const std::vector<Scene>& scenes, const DrawOptions& options) {
  Draw draw(seed);
  TrialPlan plan;
  plan.seed = seed;
  plan.scene = draw.below(scenes.size());
  plan.hosting = draw.one_of(options.hostings);
  plan.steps = static_cast<std::uint32_t>(kFewestSteps + draw.below(kMostSteps - kFewestSteps + 1));
  plan.has_fallbacks = draw.chance(50);
  plan.has_neighbour = draw.chance(20);
  const std::uint64_t trouble = draw.below(100);
  if (options.tier == Tier::kReal && trouble < 20)
    plan.trouble = trouble < 10 ? HostTrouble::kSignals : HostTrouble::kSurroundings;
  const std::vector<Slot>& slots = scenes[plan.scene].slots;
  const std::uint32_t most = options.tier == Tier::kReal ? kMostReal : kMostSimulated;

  // Two failures of a slot in neighbouring steps could meet in one request, and would be taken for poison.
  std::map<Slot, std::vector<std::uint32_t>> taken;
  std::map<Slot, bool> is_swapped;
  // A standby that is killed may be any slot's.
  std::uint32_t anywhere = 0;
  const auto has_room = [&](Slot slot) { return taken[slot].size() + anywhere < most; };
  const auto is_free = [&](Slot slot, std::uint32_t step) {
    return has_room(slot) && std::ranges::all_of(taken[slot], [&](std::uint32_t other) {
             return other + 2 <= step || step + 2 <= other;
           });
  };
  const auto is_command = [&](Slot slot) {
    return std::ranges::find(scenes[plan.scene].commands, slot) != scenes[plan.scene].commands.end();
  };
  const bool wants_last = draw.chance(60);
  const Slot last_slot = draw.one_of(slots);
  const bool has_last = wants_last && !is_command(last_slot);
  const std::uint32_t last_step = plan.steps - 3;
  if (has_last) taken[last_slot].push_back(last_step);
  if (has_last && last_slot == Slot::kForce) taken[Slot::kIntegrator].push_back(last_step);
  for (std::uint32_t tries = 0; plan.faults.size() < options.faults_per_trial && tries < 8 * options.faults_per_trial;
       ++tries) {
    PlannedFault fault;
    fault.slot = draw.one_of(slots);
    // often with another in the same step: nested, or in another slot
    const bool joins = !plan.faults.empty() && draw.chance(25);
    fault.step = joins ? plan.faults.back().step : static_cast<std::uint32_t>(2 + draw.below(last_step - 4));
    draw_order(&draw, options.tier, is_command(fault.slot), &fault);
    if (!fault.lie.empty() && !is_alone(scenes[plan.scene], fault.slot)) continue;
    const std::vector<Slot> hit = slots_hit(fault, scenes[plan.scene]);
    if (!std::ranges::all_of(hit, [&](Slot slot) { return is_free(slot, fault.step); })) continue;
    const bool hits_anybody = fault.means == Means::kKillStandby || fault.means == Means::kSwapKilled;
    if (hits_anybody && !std::ranges::all_of(slots, has_room)) continue;
    if (fault.means >= Means::kSwapKilled) {
      if (is_swapped[fault.slot]) continue;
      for (const Slot slot : sharing(scenes[plan.scene], fault.slot)) is_swapped[slot] = true;
    }
    for (const Slot slot : hit) taken[slot].push_back(fault.step);
    anywhere += hits_anybody ? 1 : 0;
    plan.faults.push_back(std::move(fault));
  }
  if (has_last) {
    PlannedFault fault = draw_last(&draw, last_slot);
    fault.step = last_step;
    plan.faults.push_back(std::move(fault));
  }
  std::ranges::stable_sort(plan.faults, {}, &PlannedFault::step);
  return plan;
}

}  // namespace gravitas::campaign
