// What a whole step costs, how much of it is validation, and what memory bodies and workers take.
#include <benchmark/benchmark.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/environment.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/integrator.h"
#include "services/run/session.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"

extern char** environ;

namespace gravitas {
namespace {

using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;

constexpr std::uint32_t kEndless = 1U << 31;

void step(Environment* world, benchmark::State* state) {
  if (world->step() == kernel::StepOutcome::kPaused) state->SkipWithError(world->fault()->fault.text().c_str());
}

// One body without a shape, in free flight.
void free_body(benchmark::State& state, Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(kEndless, 1e-9).point(1.0, Vector3(1, 2, 3), Vector3::Zero());
  builder.body().twist = {Vector3(1, 0, 0), Vector3(0, 1, 0)};
  Environment world(builder.description());
  for (int i = 0; i < 100; ++i) step(&world, &state);
  for (auto _ : state) step(&world, &state);
  state.SetLabel("chain " + world.chain_hash().text().substr(0, 8));
}

// n balls in free fall that can touch and do not: integrator, space and collision run. One shape.
WorldBuilder falling_balls(std::uint32_t count, Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(kEndless, 1e-6).space("space_grid");
  for (std::uint32_t i = 0; i < count; ++i)
    builder.sphere(0.5, 1.0, Vector3(2.0 * (i % 300), 2.0 * (i / 300 % 300), 2.0 * (i / 90000)));
  builder.gravity(Vector3(0, -10, 0));
  builder.description().shapes.resize(1);
  for (kernel::BodyDescription& body : builder.description().bodies) body.shape = 0;
  return builder;
}

void falling(benchmark::State& state, Hosting hosting) {
  Environment world(falling_balls(static_cast<std::uint32_t>(state.range(0)), hosting).description());
  for (int i = 0; i < 5; ++i) step(&world, &state);
  for (auto _ : state) step(&world, &state);
  state.SetLabel("chain " + world.chain_hash().text().substr(0, 8));
}

// n boxes at rest on the ground, far from each other; with `energy` 0 they stay awake. With a visitor, a ball flies past.
void resting(benchmark::State& state, double energy, bool has_visitor) {
  WorldBuilder builder;
  builder.steps(kEndless, 0.01).space("space_dynamic_bvh").ground();
  const auto count = static_cast<std::uint32_t>(state.range(0));
  for (std::uint32_t i = 0; i < count; ++i) {
    builder.box(Vector3(0.5, 0.25, 0.5), 1.0, Vector3(3.0 * (i % 100), 0.25, 3.0 * (i / 100)));
    builder.body().flags |= kCanSleep;
  }
  builder.gravity(Vector3(0, -9.81, 0));
  if (has_visitor) builder.sphere(0.5, 1.0, Vector3(-10, 50, 0), Vector3(0, 0, 0.01));
  builder.description().sleep.energy = energy;
  Environment world(builder.description());
  for (int i = 0; i < 60; ++i) step(&world, &state);
  for (auto _ : state) step(&world, &state);
  state.SetLabel("chain " + world.chain_hash().text().substr(0, 8));
}

// A vortex-like force that depends on time asks the force slot at every derivative: four times a step.
void four_derivatives(benchmark::State& state, Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(kEndless, 1e-6);
  for (int i = 0; i < state.range(0); ++i) builder.point(1.0, Vector3(1, 2, 3), Vector3(i, 0, 0));
  builder.plugin(Slot::kIntegrator, in_build("/lib/gravitas-bench/four_derivatives.so"));
  // in the body's frame: not constant
  builder.force("Basic", "force_basic", {0.1, 0, 0, 0, 0.1, 0, 0, 0, 0, 1, 0, 0});
  Environment world(builder.description());
  for (int i = 0; i < 20; ++i) step(&world, &state);
  for (auto _ : state) step(&world, &state);
}

// From exec to the end of a run of one step, every worker started: more than exec to the first commit.
void start_to_first_step(benchmark::State& state) {
  const std::string program = in_build("/bin/gravitas");
  const std::string scene = in_source("/deploy/scenes/two_spheres_motor.gravitas");
  for (auto _ : state) {
    const char* arguments[] = {program.c_str(), "run", scene.c_str(), "--steps", "1", "--quiet", nullptr};
    pid_t process = 0;
    int status = 0;
    if (posix_spawn(&process, arguments[0], nullptr, nullptr, const_cast<char**>(arguments), environ) != 0 ||
        waitpid(process, &status, 0) != process || status != 0)
      state.SkipWithError("gravitas run failed");
  }
}

// The shipped pile of 1000 bodies, where it has come to rest, in workers: share of the step in which answers are
// checked (wire, structure, numbers; and every so many steps the physics).
void pile_in_workers(benchmark::State& state, std::uint32_t check_physics_every) {
  RunOptions options;
  options.scenes = {in_source("/deploy/scenes/pile1000.gravitas")};
  options.hosting = {{std::nullopt, Hosting::kSharedMemory, ""}};
  options.steps = kEndless;
  std::vector<std::string> warnings;
  kernel::EnvironmentDescription description = load(options, &warnings);
  description.check_physics_every = check_physics_every;
  const std::unique_ptr<Environment> world = start(description);
  for (int i = 0; i < 50; ++i) step(world.get(), &state);
  double before = 0.0, after = 0.0;
  const auto checked = [&] {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(kernel::Stage::kCount); ++i) {
      const DurationHistogram& time = world->validation_time(static_cast<kernel::Stage>(i));
      sum += time.mean_us() * static_cast<double>(time.count());
    }
    return sum;
  };
  const auto begin = std::chrono::steady_clock::now();
  before = checked();
  for (auto _ : state) step(world.get(), &state);
  after = checked();
  const double all = std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
  state.counters["validation_percent"] = 100.0 * (after - before) / all;
}

// Resident memory of a process, bytes.
double resident(int process) {
  long total = 0, pages = 0;
  std::ifstream("/proc/" + std::to_string(process) + "/statm") >> total >> pages;
  return static_cast<double>(pages) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// Memory: per body in the kernel (direct, all slots), and of a worker that serves 100 bodies.
void memory(benchmark::State& state) {
  for (auto _ : state) {
    const double empty = resident(getpid());
    Environment world(falling_balls(100'000, Hosting::kDirect).description());
    step(&world, &state);
    state.counters["bytes_per_body"] = (resident(getpid()) - empty) / 1e5;
    Environment workers(falling_balls(100, Hosting::kSharedMemory).description());
    step(&workers, &state);
    double sum = 0.0;
    std::set<int> processes;
    for (const kernel::PlannedSlot& slot : workers.plan().slots) processes.insert(slot.process_id);
    for (const int process : processes) sum += resident(process);
    state.counters["megabytes_per_worker"] = sum / static_cast<double>(processes.size()) / 1e6;
  }
}

// What leaving out saves: a hundred bodies in free flight that have no use for a feature, with a use of one, and a loop over
// them that knows of no features at all.
constexpr std::uint32_t kFlying = 100;
constexpr double kFlightStep = 1e-6;

enum class Use { kNothing, kSleep, kJoints, kContacts, kBoxes };

Vector3 start_of_flight(std::uint32_t body) { return {2.0 * (body % 10), 2.0 * (body / 10), 0}; }
Twist twist_of_flight() { return {Vector3(1, 0, 0), Vector3(0, 1, 0)}; }

WorldBuilder flight_with(Use use, Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(kEndless, kFlightStep).space("space_dynamic_bvh");
  const auto add = [&](const Vector3& position) {
    if (use == Use::kContacts)
      builder.sphere(0.5, 1.0, position);
    else if (use == Use::kBoxes)
      builder.box(Vector3(0.5, 0.4, 0.3), 1.0, position);
    else
      builder.point(1.0, Vector3(0.1, 0.1, 0.1), position);
    builder.body().twist = twist_of_flight();
    if (use == Use::kSleep) builder.body().flags |= kCanSleep;
  };
  for (std::uint32_t i = 0; i < kFlying; ++i) add(start_of_flight(i));
  if (use == Use::kJoints) {
    add(Vector3(1e4, 0, 0));
    builder.joint("Spherical", "constraint_spherical", kFlying, kNone, {1e4, 0, 0});
  }
  return builder;
}

void plan(benchmark::State& state, Use use) {
  Environment world(flight_with(use, Hosting::kDirect).description());
  for (int i = 0; i < 20; ++i) step(&world, &state);
  for (auto _ : state) step(&world, &state);

  Environment workers(flight_with(use, Hosting::kSharedMemory).description());
  step(&workers, &state);
  std::set<int> processes;
  for (const kernel::PlannedSlot& slot : workers.plan().slots) processes.insert(slot.process_id);
  double bytes = 0.0;
  for (const int process : processes) bytes += resident(process);
  state.counters["processes"] = static_cast<double>(processes.size());
  state.counters["megabytes"] = bytes / 1e6;
}

// The same motion where there is nothing else: no columns, checks, states, hashes or slots.
void without_engine(benchmark::State& state) {
  std::vector<BodyState> bodies;
  for (std::uint32_t i = 0; i < kFlying; ++i)
    bodies.push_back({{start_of_flight(i), Quaternion::Identity()}, twist_of_flight()});
  const Acceleration none{Vector3::Zero(), Vector3::Zero()};
  for (auto _ : state) {
    for (BodyState& body : bodies) {
      body.twist = accelerated(body.twist, none, 0.0, kFlightStep);
      body.pose = displaced(body.pose, kFlightStep * body.twist.linear, kFlightStep * body.twist.angular);
    }
    benchmark::ClobberMemory();
  }
}

BENCHMARK_CAPTURE(free_body, direct, Hosting::kDirect)->UseRealTime();
BENCHMARK_CAPTURE(free_body, shm, Hosting::kSharedMemory)->UseRealTime();
BENCHMARK_CAPTURE(free_body, grpc, Hosting::kGrpc)->UseRealTime();
BENCHMARK_CAPTURE(four_derivatives, direct, Hosting::kDirect)->Arg(1)->Arg(1000)->UseRealTime();
BENCHMARK_CAPTURE(four_derivatives, shm, Hosting::kSharedMemory)->Arg(1)->Arg(1000)->UseRealTime();
BENCHMARK_CAPTURE(four_derivatives, grpc, Hosting::kGrpc)->Arg(1)->Arg(1000)->UseRealTime();
BENCHMARK_CAPTURE(falling, direct, Hosting::kDirect)->RangeMultiplier(10)->Range(1, 100'000)->UseRealTime();
BENCHMARK_CAPTURE(falling, shm, Hosting::kSharedMemory)->RangeMultiplier(10)->Range(1, 100'000)->UseRealTime();
BENCHMARK_CAPTURE(falling, grpc, Hosting::kGrpc)->RangeMultiplier(10)->Range(1, 100'000)->UseRealTime();
BENCHMARK_CAPTURE(resting, awake, 0.0, false)->Arg(10'000)->UseRealTime()->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(resting, asleep, SleepRule{}.energy, false)
    ->Arg(10'000)
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(resting, visited, SleepRule{}.energy, true)
    ->Arg(10'000)
    ->UseRealTime()
    ->Unit(benchmark::kMicrosecond);
BENCHMARK(without_engine)->UseRealTime();
BENCHMARK_CAPTURE(plan, nothing, Use::kNothing)->UseRealTime();
BENCHMARK_CAPTURE(plan, sleep, Use::kSleep)->UseRealTime();
BENCHMARK_CAPTURE(plan, joints, Use::kJoints)->UseRealTime();
BENCHMARK_CAPTURE(plan, contacts, Use::kContacts)->UseRealTime();
BENCHMARK_CAPTURE(plan, boxes, Use::kBoxes)->UseRealTime();
BENCHMARK(start_to_first_step)->UseRealTime()->Iterations(20)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pile_in_workers, cheap, 0)->UseRealTime()->Iterations(100)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(pile_in_workers, physics, 1)->UseRealTime()->Iterations(100)->Unit(benchmark::kMillisecond);
BENCHMARK(memory)->UseRealTime()->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gravitas

int main(int argc, char** argv) {
  // this program stands beside gravitas-worker
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
