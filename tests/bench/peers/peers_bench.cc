// What Gravitas and the engines that Debian ships need for a step of the same scenes, and how well they do.
//
//   <scene>/<engine>      one_body/Gravitas, one_body/Bullet, ...
//
// scene.h says what the scenes are, judges.h what the figures mean. An iteration is a whole run, from the start to the end
// of the scene; of it the steps alone are timed. us_per_step is their mean, worst_us the longest, by the clock of this
// thread. What an engine is used with is the label. A run that ends badly is an error of the benchmark, with its reason.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/bench/peers/engine.h"
#include "tests/bench/peers/scene.h"
#include "tests/bench/thread_clock.h"

namespace gravitas::peers {
namespace {

constexpr double kFarAway = 1e6;  // m; who gets there has blown up

struct Run {
  double seconds = 0.0;  // of all steps
  double longest = 0.0;  // of one, s; where each is looked at
  Figures figures;
};

void look(const Scene& scene, World* world, std::uint32_t steps, Figures* figures) {
  const double time = scene.time_step * steps;
  std::vector<BodyState> bodies;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    bodies.push_back(world->state(i));
    if (!(bodies.back().pose.position.norm() < kFarAway))
      throw std::runtime_error("blew up after " + std::to_string(time) + " s");
  }
  scene.judge(scene, bodies, time, figures);
}

Run run(const Scene& scene, World* world) {
  Run result;
  for (std::uint32_t done = 0; done < scene.steps;) {
    const std::uint32_t until = std::min(done + scene.steps_per_look, scene.steps);
    const double start = thread_seconds();
    for (; done < until; ++done) world->step();
    const double taken = thread_seconds() - start;
    result.seconds += taken;
    result.longest = std::max(result.longest, taken);
    look(scene, world, done, &result.figures);
  }
  return result;
}

void measure(benchmark::State& state, const Scene& scene, const Engine& engine) {
  state.SetLabel(engine.how);
  double seconds = 0.0;
  Run last;
  try {
    for (auto _ : state) {
      const std::unique_ptr<World> world = engine.make(scene);
      last = run(scene, world.get());
      state.SetIterationTime(last.seconds);
      seconds += last.seconds;
    }
  } catch (const std::exception& problem) {
    state.SkipWithError(problem.what());
    return;
  }
  state.counters["us_per_step"] = 1e6 * seconds / static_cast<double>(state.iterations()) / scene.steps;
  if (scene.steps_per_look == 1) state.counters["worst_us"] = 1e6 * last.longest;
  for (const auto& [name, value] : last.figures) state.counters[name] = value;
}

void add_all() {
  for (const Scene& scene : all_scenes())
    for (const Engine& engine : engines_for(scene))
      benchmark::RegisterBenchmark((scene.name + "/" + engine.name).c_str(),
                                   [=](benchmark::State& state) { measure(state, scene, engine); })
          ->UseManualTime()
          ->Unit(benchmark::kMillisecond);
}

}  // namespace

std::vector<Engine> engines_for(const Scene& scene) {
  std::vector<Engine> engines = {gravitas_for(scene)};
  // no other engine may be here
  [[maybe_unused]] const auto append = [&](const std::vector<Engine>& more) {
    engines.insert(engines.end(), more.begin(), more.end());
  };
#ifdef GRAVITAS_HAS_BULLET
  append(bullet_for(scene));
#endif
#ifdef GRAVITAS_HAS_ODE
  append(ode_for(scene));
#endif
#ifdef GRAVITAS_HAS_MUJOCO
  append(mujoco_for(scene));
#endif
  return engines;
}

}  // namespace gravitas::peers

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  gravitas::peers::add_all();
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
