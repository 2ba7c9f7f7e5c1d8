// Simulator `Smooth`: what its derivatives are told, and what begins anew with an edit.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <span>
#include <utility>

#include "kernel/environment.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Carrier;
using kernel::Environment;
using kernel::Hosting;
using kernel::Simulator;

constexpr double kRadius = 0.1, kMass = 2.0, kImpulse = 6.0;

// A ball that a blow at t = 0 sets going about a joint, 1 m away.
WorldBuilder struck_ball() {
  WorldBuilder builder = WorldBuilder().steps(20, 0.01).integrator("integrator_rk4");
  builder.description().simulator = Simulator::kSmooth;
  builder.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 100.0});
  builder.sphere(kRadius, kMass, Vector3(1, 0, 0));
  builder.force("Basic", "force_basic", {0, kImpulse, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1});
  builder.joint("Spherical", "constraint_spherical", kNone, 0, {0, 0, 0});
  return builder;
}

TEST(Smooth, ABlowIsStruckOnceThoughTheRunBeginsAnew) {
  const WorldBuilder builder = struck_ball();
  Environment world(builder.description());
  for (int i = 0; i < 5; ++i) step(&world);
  kernel::SavedState saved = world.saved_state();
  saved.is_anew = true;  // as after an edit
  Environment again(builder.description());
  ASSERT_EQ(again.restore(saved), "");
  run_to_end(&again);
  const double inertia = kMass + 0.4 * kMass * kRadius * kRadius;
  EXPECT_NEAR(vector_at(again.state().angular_velocity, 0).z(), kImpulse / inertia, 1e-9);
  EXPECT_NEAR(vector_at(again.state().linear_velocity, 0).norm(), kImpulse / inertia, 1e-9);
}

// Notes whether an integrator that is to ask for derivatives is told of wrenches, before or after it did.
class Telling final : public Carrier {
 public:
  Telling(std::unique_ptr<Carrier> plugins, int* calls, bool* tells)
      : plugins_(std::move(plugins)), calls_(*calls), tells_(*tells) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    const auto is_told = [&] {
      const kernel::ColumnId id = call.request[stage::IntegratorIntegrateRequest::kWrench];
      const std::span wrench(reinterpret_cast<const double*>(arena->data(id)), arena->count(id));
      return std::ranges::any_of(wrench, [](double number) { return number != 0.0; });
    };
    const bool asks = call.method == stage::Method::kIntegratorIntegrate && derivatives != nullptr;
    calls_ += asks ? 1 : 0;
    tells_ |= asks && is_told();
    const kernel::CallResult result = plugins_->call(call, arena, derivatives);
    tells_ |= asks && is_told();
    return result;
  }
  int process_id() const override { return 0; }
  Hosting hosting() const override { return Hosting::kDirect; }

 private:
  std::unique_ptr<Carrier> plugins_;
  int& calls_;
  bool& tells_;
};

TEST(Smooth, WhoIsToAskForWrenchesIsToldOfNone) {
  for (const bool is_smooth : {false, true}) {
    WorldBuilder builder = struck_ball().gravity(Vector3(0, -9.81, 0));
    if (!is_smooth) {
      builder.description().simulator = Simulator::kBasic;
      builder.force("Drag", "force_drag", {0.1, 0.5});
    }
    int calls = 0;
    bool tells = false;
    Environment world(
        builder.description(), [&](const kernel::SlotDescription& slot, std::uint32_t threads, std::stop_token) {
          return std::make_unique<Telling>(kernel::make_direct_carrier(slot.plugins, threads), &calls, &tells);
        });
    run_to_end(&world);
    EXPECT_EQ(calls, 20);
    EXPECT_FALSE(tells);
  }
}

}  // namespace
}  // namespace gravitas
