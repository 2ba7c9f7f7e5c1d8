// What faults and swaps cost a run: until a failure is noticed, and from then to the good answer, by its kind; the pause
// of a cut-over, by carrier; and what checkpoints take of a run of pile1000.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "kernel/environment.h"
#include "kernel/slot_host.h"
#include "plugin_sdk/channel/private_folder.h"
#include "services/recorder/identity.h"
#include "services/recorder/recorder.h"
#include "services/run/session.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using kernel::Environment;
using kernel::Hosting;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t kRecoverySteps = 1U << 31;
constexpr int kTimes = 200;

bool take_step(Environment* world, benchmark::State* state) {
  if (world->step() == kernel::StepOutcome::kCommitted) return true;
  state->SkipWithError(world->fault()->fault.text().c_str());
  return false;
}

// Writes `name`_median_us and `name`_p99_us.
void report(std::string_view name, std::vector<double> microseconds, benchmark::State* state) {
  if (microseconds.empty()) return state->SkipWithError("nothing was measured");
  std::ranges::sort(microseconds);
  const auto at = [&](double share) {
    return microseconds[static_cast<std::size_t>(share * static_cast<double>(microseconds.size() - 1))];
  };
  state->counters[fmt::format("{}_median_us", name)] = at(0.5);
  state->counters[fmt::format("{}_p99_us", name)] = at(0.99);
}

// How long (us) a step takes after a pause in which all workers fell asleep, or < 0.
double step_after_a_pause(Environment* world, benchmark::State* state) {
  // a standby takes as long as that to start
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const Clock::time_point start = Clock::now();
  if (!take_step(world, state)) return -1.0;
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

// The solver's worker fails in a call again and again, each time with a budget that is whole. `recovery` is from when
// the failure is noticed to the good answer, `delay` what the step took more than the one before, and `noticed` the
// difference: from the failure until it is noticed.
void recovery(benchmark::State& state, Hosting hosting, const std::string& fault, std::uint32_t standbys) {
  kernel::EnvironmentDescription description = harness::busy_world(hosting).steps(kRecoverySteps, 1e-4).description();
  description.solver.deadline = 0.05;
  description.solver.standbys = standbys;
  Environment world(description);
  const std::string expected = standbys > 0 ? "standby" : "cold start";
  std::vector<double> recoveries, delays, notices;
  for (auto _ : state) {
    for (int i = 0; i < kTimes; ++i) {
      for (std::uint32_t k = 0; k < kernel::SlotHost::kGoodAnswers + 10; ++k)
        if (!take_step(&world, &state)) return;
      const double quiet = step_after_a_pause(&world, &state);
      world.inject({Slot::kSolver, fault, world.step_count() + 1});
      const double faulty = step_after_a_pause(&world, &state);
      if (quiet < 0.0 || faulty < 0.0) return;
      if (world.faults().empty()) continue;
      const kernel::FaultRecord& record = world.faults().back();
      if (record.step != world.step_count() || record.recovered_by != expected) continue;
      recoveries.push_back(record.recovery_us);
      delays.push_back(faulty - quiet);
      notices.push_back(faulty - quiet - record.recovery_us);
    }
  }
  state.counters["samples"] = static_cast<double>(recoveries.size());
  report("recovery", std::move(recoveries), &state);
  report("delay", std::move(delays), &state);
  report("noticed", std::move(notices), &state);
}

void swap_pause(benchmark::State& state, Hosting hosting) {
  Environment world(harness::busy_world(hosting).steps(kRecoverySteps, 1e-4).description());
  const kernel::PluginChoice solver = harness::busy_world(hosting).description().solver.plugins[0];
  for (auto _ : state) {
    for (int i = 0; i < kTimes; ++i) {
      world.order_swap({Slot::kSolver, solver, std::nullopt, world.step_count() + 2});
      for (std::uint32_t k = 0; k < kernel::SlotHost::kProbation + 4; ++k)
        if (!take_step(&world, &state)) return;
    }
  }
  std::vector<double> times;
  for (const kernel::SwapRecord& swap : world.swaps())
    if (swap.state == kernel::SwapState::kCommitted) times.push_back(swap.pause_us);
  report("pause", std::move(times), &state);
}

// Takes the time that a recorder takes of the steps.
class TimedRecorder final : public kernel::CommitListener {
 public:
  explicit TimedRecorder(Recorder* recorder) : recorder_(*recorder) {}
  void on_commit(const Environment& environment) override {
    const Clock::time_point start = Clock::now();
    recorder_.on_commit(environment);
    took += Clock::now() - start;
  }

  Clock::duration took{};

 private:
  Recorder& recorder_;
};

void checkpoints(benchmark::State& state) {
  constexpr std::uint32_t kEvery = 100;
  RunOptions options;
  options.scenes = {in_source("/deploy/scenes/pile1000.gravitas")};
  options.hosting = {{std::nullopt, Hosting::kDirect, ""}};
  options.steps = kRecoverySteps;
  std::vector<std::string> warnings;
  const kernel::EnvironmentDescription description = load(options, &warnings);
  const std::unique_ptr<Environment> world = start(description);
  const channel::PrivateFolder folder;
  Recorder recorder(identity_of(description), [] { return recorder::v1::Tally(); });
  recorder.keep(folder.path() + "/kept", kEvery, {}, *world);
  TimedRecorder timed(&recorder);
  world->set_commit_listener(&timed);
  const Clock::time_point start = Clock::now();
  for (auto _ : state)
    if (!take_step(world.get(), &state)) return;
  state.counters["percent"] = 100.0 * std::chrono::duration<double>(timed.took) / (Clock::now() - start);
}

// Each is a median of many already.
void once(benchmark::internal::Benchmark* row) { row->Iterations(1)->Repetitions(1)->Unit(benchmark::kMillisecond); }

BENCHMARK_CAPTURE(recovery, kill, Hosting::kSharedMemory, "kill", 1)->Apply(once);
BENCHMARK_CAPTURE(recovery, segv, Hosting::kSharedMemory, "segv", 1)->Apply(once);
BENCHMARK_CAPTURE(recovery, abort, Hosting::kSharedMemory, "abort", 1)->Apply(once);
BENCHMARK_CAPTURE(recovery, hang, Hosting::kSharedMemory, "hang", 1)->Apply(once);
BENCHMARK_CAPTURE(recovery, nan, Hosting::kSharedMemory, "nan", 1)->Apply(once);
BENCHMARK_CAPTURE(recovery, kill_grpc, Hosting::kGrpc, "kill", 1)->Apply(once);
BENCHMARK_CAPTURE(recovery, kill_cold, Hosting::kSharedMemory, "kill", 0)->Apply(once);
BENCHMARK_CAPTURE(swap_pause, direct, Hosting::kDirect)->Apply(once);
BENCHMARK_CAPTURE(swap_pause, shm, Hosting::kSharedMemory)->Apply(once);
BENCHMARK_CAPTURE(swap_pause, grpc, Hosting::kGrpc)->Apply(once);
BENCHMARK(checkpoints)->UseRealTime()->Iterations(200)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gravitas
