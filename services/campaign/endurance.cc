#include "services/campaign/endurance.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <thread>

#include "kernel/environment.h"
#include "plugin_sdk/slots.h"
#include "services/campaign/leftovers.h"
#include "services/campaign/scenes.h"
#include "services/run/session.h"

namespace gravitas::campaign {
namespace {

constexpr std::chrono::milliseconds kStep{1};
constexpr std::uint32_t kStepsPerKill = 1000;

void set_hosting(kernel::Hosting hosting, kernel::EnvironmentDescription* description) {
  for (const Slot slot : kSlots) description->slot(slot).hosting = hosting;
}

}  // namespace

EnduranceResult endure(const std::string& name, double seconds, const std::function<bool()>& interrupted,
                       const std::function<void(double)>& progress) {
  Scene scene = std::move(load_scenes({name.empty() ? "all" : name}, 0)[0]);
  scene.description.steps = static_cast<std::uint32_t>(std::lround(1e3 * seconds));
  scene.description.time_step = scene.description.last_time_step = 1e-3;
  EnduranceResult result;
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t made = 0;
  Hash chain;
  {
    set_hosting(kernel::Hosting::kSharedMemory, &scene.description);
    const std::unique_ptr<kernel::Environment> world = gravitas::start(scene.description);
    const std::uint32_t turn = kStepsPerKill / static_cast<std::uint32_t>(world->plan().slots.size());
    auto next = std::chrono::steady_clock::now();
    while (world->step_count() < scene.description.steps && !interrupted()) {
      // the slots take turns through the second
      const std::uint32_t step = world->step_count();
      if (step % turn == turn / 2) {
        const std::vector<kernel::PlannedSlot> slots = world->plan().slots;
        const int process = slots[step / turn % slots.size()].process_id;
        // the number of one that died and was not asked since may be another's
        if (std::ranges::binary_search(child_processes(), process)) {
          kill(process, SIGKILL);
          ++result.kills;
        }
      }
      if (world->step() != kernel::StepOutcome::kCommitted) {
        result.problem = fmt::format("paused at step {}: {}", step + 1, world->fault()->fault.text());
        break;
      }
      if (step % kStepsPerKill == 0) progress(1e-3 * step);
      next += kStep;
      std::this_thread::sleep_until(next);
    }
    made = world->step_count();
    chain = world->chain_hash();
    result.failures = world->faults().size();
    result.median_step_us = world->step_time().quantile_us(0.5);
    result.p99_step_us = world->step_time().quantile_us(0.99);
    result.max_step_us = world->step_time().max_us();
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.steps = made;
  set_hosting(kernel::Hosting::kDirect, &scene.description);
  const std::unique_ptr<kernel::Environment> quiet = gravitas::start(scene.description);
  while (quiet->step_count() < made && quiet->step() == kernel::StepOutcome::kCommitted) {
  }
  if (result.problem.empty() && !(quiet->chain_hash() == chain))
    result.problem = "the chain of hashes is not that of the quiet run";
  if (const auto left = child_processes(); result.problem.empty() && !left.empty())
    result.problem = fmt::format("process {} is left over", left[0]);
  return result;
}

}  // namespace gravitas::campaign
