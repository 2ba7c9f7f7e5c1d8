// What finding the pairs costs in every space, and in Bullet's two where it is there, on the same bodies.
//
//   space/<space>/<sparse|dense|mixed>/<still|few|moving>/<bodies>
//
// Balls of radius 0.3 to 0.6 m, evenly drawn in a cube: with `sparse` one in thirty overlaps another, with `dense` each
// overlaps some seven. With `mixed` the largest of 100,000 is some 300 times as large as the smallest: radius 0.1 m / sqrt(u),
// u even in 0 to 1. `still` ones keep their bounds to the bit, with `few` every hundredth moves, with `moving` all do:
// they keep their velocities, up to 2 m/s along each axis, in steps of 1/60 s, and turn back at the walls. A call is given
// the bounds of all bodies and answers the pairs, ours exact and sorted; Bullet is given them with setAabb, and answers
// with its pair cache, neither exact nor sorted.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/library.h"
#include "plugin_sdk/message_columns.h"
#include "plugin_sdk/property_value.h"
#include "tests/bench/thread_clock.h"
#include "tests/paths.h"

#ifdef GRAVITAS_HAS_BULLET
#include <BulletCollision/BroadphaseCollision/btAxisSweep3.h>
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#endif

namespace gravitas {
namespace {

constexpr double kTimeStep = 1.0 / 60.0;

struct Layout {
  const char* name;
  double bodies_per_cubic_metre;
  double (*radius)(conformance::Draw* draw);  // m
};

double even_radius(conformance::Draw* draw) { return draw->uniform(0.3, 0.6); }
double mixed_radius(conformance::Draw* draw) { return 0.1 / std::sqrt(draw->uniform(1e-5, 1.0)); }

constexpr Layout kLayouts[] = {
    {"sparse", 0.005, even_radius}, {"dense", 1.1, even_radius}, {"mixed", 1.1, mixed_radius}};

// Every how many bodies one moves; 0: none does.
struct Motion {
  const char* name;
  std::size_t every;
};
constexpr Motion kMotions[] = {{"still", 0}, {"few", 100}, {"moving", 1}};

// The bodies of one benchmark: bounds as columns.
class Crowd {
 public:
  Crowd(std::uint32_t count, const Layout& layout, const Motion& motion) : every_(motion.every) {
    conformance::Draw draw(count);
    half_edge_ = 0.5 * std::cbrt(count / layout.bodies_per_cubic_metre);
    for (std::uint32_t i = 0; i < count; ++i) {
      radius_.push_back(layout.radius(&draw));
      centre_.push_back(draw.vector(half_edge_));
      velocity_.push_back(draw.vector(2.0));
    }
    request.f64("lower").resize(std::size_t{3} * count);
    request.f64("upper").resize(std::size_t{3} * count);
    request.u32("flags").assign(count, kMovable | kHasShape);
    request.u64("filter_group").assign(count, 1);
    request.u64("filter_mask").assign(count, ~std::uint64_t{0});
    bound();
  }

  void step() {
    if (every_ == 0) return;
    for (std::size_t i = 0; i < centre_.size(); i += every_) {
      for (int k = 0; k < 3; ++k) {
        if (std::abs(centre_[i][k]) > half_edge_) velocity_[i][k] = -std::copysign(velocity_[i][k], centre_[i][k]);
        centre_[i][k] += kTimeStep * velocity_[i][k];
      }
    }
    bound();
  }

  std::size_t count() const { return centre_.size(); }
  double half_edge() const { return half_edge_; }

  MessageColumns request{stage::method_info(stage::Method::kSpacePairs).request};

 private:
  void bound() {
    std::vector<double>&lower = request.f64("lower"), &upper = request.f64("upper");
    for (std::size_t i = 0; i < centre_.size(); ++i) {
      set_vector(lower, i, centre_[i] - Vector3::Constant(radius_[i]));
      set_vector(upper, i, centre_[i] + Vector3::Constant(radius_[i]));
    }
  }

  std::size_t every_;
  double half_edge_;
  std::vector<double> radius_;
  std::vector<Vector3> centre_, velocity_;
};

// A space plugin with its defaults, called as the direct carrier does.
class SpaceUnderLoad {
 public:
  SpaceUnderLoad(const std::string& library, const Crowd&) {
    std::string problem;
    const PluginLibrary loaded = load_plugin_library(in_build("/lib/gravitas/space_") + library + ".so", &problem);
    if (loaded.table == nullptr) throw std::runtime_error(problem);
    table_ = loaded.table;
    std::vector<double> settings;
    std::vector<PropertyProblem> problems;
    flatten(loaded.declaration.properties, {}, &settings, &problems);
    gravitas_error error{};
    if (table_->create(settings.data(), settings.size(), &instance_, &error) != GRAVITAS_OK)
      throw std::runtime_error(error.text);
    host_.mark_progress = [](void*) {};
  }
  ~SpaceUnderLoad() { table_->destroy(instance_); }
  SpaceUnderLoad(const SpaceUnderLoad&) = delete;
  SpaceUnderLoad& operator=(const SpaceUnderLoad&) = delete;

  std::size_t find_pairs(const Crowd& crowd) {
    const std::vector<gravitas_column> columns = crowd.request.plain();
    for (;;) {
      gravitas_reply_column reply{pairs_.data(), pairs_.size(), 0};
      gravitas_error error{};
      const std::int32_t status = table_->call(instance_, static_cast<std::uint32_t>(stage::Method::kSpacePairs),
                                               columns.data(), &reply, &host_, &error);
      if (status == GRAVITAS_OK) return reply.count / 2;
      if (status != GRAVITAS_NEEDS_CAPACITY) throw std::runtime_error(error.text);
      pairs_.resize(2 * reply.count);
    }
  }

 private:
  const gravitas_plugin_table* table_ = nullptr;
  void* instance_ = nullptr;
  gravitas_host host_{};
  std::vector<std::uint32_t> pairs_;
};

#ifdef GRAVITAS_HAS_BULLET

btVector3 row(const std::vector<double>& column, std::size_t i) {
  return {static_cast<btScalar>(column[3 * i]), static_cast<btScalar>(column[3 * i + 1]),
          static_cast<btScalar>(column[3 * i + 2])};
}

class NoDispatcher final : public btDispatcher {
 public:
  btCollisionAlgorithm* findAlgorithm(const btCollisionObjectWrapper*, const btCollisionObjectWrapper*,
                                      btPersistentManifold*, ebtDispatcherQueryType) override {
    return nullptr;
  }
  btPersistentManifold* getNewManifold(const btCollisionObject*, const btCollisionObject*) override { return nullptr; }
  void releaseManifold(btPersistentManifold*) override {}
  void clearManifold(btPersistentManifold*) override {}
  bool needsCollision(const btCollisionObject*, const btCollisionObject*) override { return true; }
  bool needsResponse(const btCollisionObject*, const btCollisionObject*) override { return true; }
  void dispatchAllCollisionPairs(btOverlappingPairCache*, const btDispatcherInfo&, btDispatcher*) override {}
  int getNumManifolds() const override { return 0; }
  btPersistentManifold* getManifoldByIndexInternal(int) override { return nullptr; }
  btPersistentManifold** getInternalManifoldPointer() override { return nullptr; }
  btPoolAllocator* getInternalManifoldPool() override { return nullptr; }
  const btPoolAllocator* getInternalManifoldPool() const override { return nullptr; }
  void* allocateCollisionAlgorithm(int) override { return nullptr; }
  void freeCollisionAlgorithm(void*) override {}
};

class BulletSpaceUnderLoad {
 public:
  BulletSpaceUnderLoad(const std::string& name, const Crowd& crowd) {
    const auto far = static_cast<btScalar>(2.0 * crowd.half_edge() + 10.0);
    const auto most = static_cast<unsigned>(crowd.count() + 2);
    if (name == "dbvt") {
      broad_phase_ = std::make_unique<btDbvtBroadphase>();
    } else {
      broad_phase_ = std::make_unique<bt32BitAxisSweep3>(btVector3(-far, -far, -far), btVector3(far, far, far), most,
                                                         nullptr, true);
    }
    const std::vector<double>&lower = crowd.request.f64("lower"), &upper = crowd.request.f64("upper");
    // upwards along z: the sweep, which looks for pairs along its last axis, then has few to look at for each
    std::vector<std::size_t> order(crowd.count());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return lower[3 * i + 2]; });
    proxies_.resize(crowd.count());
    for (const std::size_t i : order)
      proxies_[i] = broad_phase_->createProxy(row(lower, i), row(upper, i), 0, &objects_, 1, -1, &dispatcher_);
  }

  std::size_t find_pairs(const Crowd& crowd) {
    const std::vector<double>&lower = crowd.request.f64("lower"), &upper = crowd.request.f64("upper");
    for (std::size_t i = 0; i < proxies_.size(); ++i)
      broad_phase_->setAabb(proxies_[i], row(lower, i), row(upper, i), &dispatcher_);
    broad_phase_->calculateOverlappingPairs(&dispatcher_);
    return static_cast<std::size_t>(broad_phase_->getOverlappingPairCache()->getNumOverlappingPairs());
  }

 private:
  NoDispatcher dispatcher_;
  // any object: Bullet demands one
  int objects_ = 0;
  std::unique_ptr<btBroadphaseInterface> broad_phase_;
  std::vector<btBroadphaseProxy*> proxies_;
};

#endif

template <typename Space>
void find_pairs(benchmark::State& state, const std::string& name, const Layout& layout, const Motion& motion) {
  Crowd crowd(static_cast<std::uint32_t>(state.range(0)), layout, motion);
  Space space(name, crowd);
  std::size_t pairs = 0;
  const auto timed_call = [&] {
    crowd.step();
    const double start = thread_seconds();
    pairs = space.find_pairs(crowd);
    return thread_seconds() - start;
  };
  // room, caches, and velocities known
  for (int i = 0; i < 4; ++i) timed_call();
  for (auto _ : state) state.SetIterationTime(timed_call());
  state.counters["pairs"] = static_cast<double>(pairs);
}

// As far as `most` bodies: beyond it a call takes more than a second or so. With `calls`, so many are timed.
template <typename Space>
void add(const std::string& name, const std::string& library, std::int64_t most, std::int64_t fewest = 100,
         std::int64_t calls = 0) {
  for (const Layout& layout : kLayouts) {
    for (const Motion& motion : kMotions) {
      const std::string title = "space/" + name + "/" + layout.name + "/" + motion.name;
      benchmark::internal::Benchmark* const bench = benchmark::RegisterBenchmark(
          title.c_str(), [=](benchmark::State& state) { find_pairs<Space>(state, library, layout, motion); });
      bench->RangeMultiplier(10)->Range(fewest, most)->UseManualTime()->Unit(benchmark::kMicrosecond);
      calls > 0 ? bench->Iterations(calls)->Repetitions(1) : bench->MinTime(0.05);
    }
  }
}

const bool kSpacesAreAdded = [] {
  add<SpaceUnderLoad>("Basic", "basic", 10'000);
  add<SpaceUnderLoad>("Grid", "grid", 100'000);
  add<SpaceUnderLoad>("KDTree", "kd_tree", 100'000);
  add<SpaceUnderLoad>("SweepAndPrune", "sweep_and_prune", 100'000);
  add<SpaceUnderLoad>("DynamicBVH", "dynamic_bvh", 100'000);
#ifdef GRAVITAS_HAS_BULLET
  add<BulletSpaceUnderLoad>("BulletDbvt", "dbvt", 100'000);
  add<BulletSpaceUnderLoad>("BulletSweep", "sweep", 10'000);
  // putting these in takes it two minutes, nine times
  if (std::getenv("GRAVITAS_LONG_BENCHMARKS") != nullptr)
    add<BulletSpaceUnderLoad>("BulletSweep", "sweep", 100'000, 100'000, 3);
#endif
  return true;
}();

}  // namespace
}  // namespace gravitas
