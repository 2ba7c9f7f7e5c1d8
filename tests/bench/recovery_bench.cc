// What faults and swaps cost a run: from the moment at which a failure is noticed to the good answer, by its kind; the
// pause of a cut-over, by carrier; and what checkpoints take of a run of pile1000.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
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
  state->SkipWithError(world->fault()->fault.text.c_str());
  return false;
}

void report(std::vector<double> microseconds, benchmark::State* state) {
  if (microseconds.empty()) return state->SkipWithError("nothing was measured");
  std::ranges::sort(microseconds);
  const auto at = [&](double share) {
    return microseconds[static_cast<std::size_t>(share * static_cast<double>(microseconds.size() - 1))];
  };
  state->counters["median_us"] = at(0.5);
  state->counters["p99_us"] = at(0.99);
  state->counters["samples"] = static_cast<double>(microseconds.size());
}

// The solver's worker fails in a call again and again, each time with a warm standby and a budget that is whole.
void recovery(benchmark::State& state, Hosting hosting, const std::string& fault) {
  kernel::EnvironmentDescription description = harness::busy_world(hosting).steps(kRecoverySteps, 1e-4).description();
  description.solver.deadline = 0.05;
  Environment world(description);
  for (auto _ : state) {
    for (int i = 0; i < kTimes; ++i) {
      for (std::uint32_t k = 0; k < kernel::SlotHost::kGoodAnswers + 10; ++k)
        if (!take_step(&world, &state)) return;
      // a standby takes as long as that to start
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      world.inject({Slot::kSolver, fault, world.step_count() + 1});
      if (!take_step(&world, &state)) return;
    }
  }
  std::vector<double> times;
  for (const kernel::FaultRecord& record : world.faults())
    if (record.recovered_by == "standby") times.push_back(record.recovery_us);
  report(std::move(times), &state);
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
  report(std::move(times), &state);
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

BENCHMARK_CAPTURE(recovery, kill, Hosting::kSharedMemory, "kill")->Apply(once);
BENCHMARK_CAPTURE(recovery, segv, Hosting::kSharedMemory, "segv")->Apply(once);
BENCHMARK_CAPTURE(recovery, abort, Hosting::kSharedMemory, "abort")->Apply(once);
BENCHMARK_CAPTURE(recovery, hang, Hosting::kSharedMemory, "hang")->Apply(once);
BENCHMARK_CAPTURE(recovery, nan, Hosting::kSharedMemory, "nan")->Apply(once);
BENCHMARK_CAPTURE(recovery, kill_grpc, Hosting::kGrpc, "kill")->Apply(once);
BENCHMARK_CAPTURE(swap_pause, direct, Hosting::kDirect)->Apply(once);
BENCHMARK_CAPTURE(swap_pause, shm, Hosting::kSharedMemory)->Apply(once);
BENCHMARK_CAPTURE(swap_pause, grpc, Hosting::kGrpc)->Apply(once);
BENCHMARK(checkpoints)->UseRealTime()->Iterations(200)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gravitas
