// The whole step, with real plugins: known motions, equal bits on every hosting, and what happens when it fails.
#include "kernel/environment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using kernel::StepOutcome;

constexpr double kG = 9.81;
const Vector3 kDown(0.0, -kG, 0.0);

Vector3 position(const Environment& world, std::size_t body) { return vector_at(world.state().position, body); }
Vector3 velocity(const Environment& world, std::size_t body) { return vector_at(world.state().linear_velocity, body); }

TEST(Environment, FreeFallOfSemiImplicitEulerIsItsOwnClosedForm) {
  WorldBuilder builder;
  builder.steps(100, 0.01).sphere(0.5, 2.0, Vector3(0, 10, 0), Vector3(3, 0, 0)).gravity(kDown);
  Environment world(builder.description());
  run_to_end(&world);
  // v_n = -n g h and y_n = y0 - g h^2 n(n+1)/2 for this method
  EXPECT_NEAR(velocity(world, 0).y(), -kG, 1e-12);
  EXPECT_NEAR(position(world, 0).y(), 10.0 - kG * 1e-4 * 100 * 101 / 2, 1e-12);
  EXPECT_NEAR(position(world, 0).x(), 3.0, 1e-12);
}

TEST(Environment, ASceneOfOneFreeBodyNeedsTheIntegratorAlone) {
  WorldBuilder builder;
  builder.steps(3, 0.01).sphere(0.5, 2.0, Vector3(0, 10, 0)).gravity(kDown);
  Environment world(builder.description());
  ASSERT_EQ(world.plan().slots.size(), 1U);
  EXPECT_EQ(world.plan().slots[0].slot, Slot::kIntegrator);
  EXPECT_EQ(world.plan().left_out.size(), 6U);
}

TEST(Environment, TheBallThatBouncesIsTheSameInEveryHosting) {
  const auto hash = [](Hosting hosting, Slot other) {
    WorldBuilder builder(hosting);
    builder.steps(120, 1.0 / 60.0).material({.restitution = 0.5}).ground();
    builder.sphere(0.5, 1.0, Vector3(0, 2, 0), Vector3(1, 0, 0)).gravity(kDown);
    builder.hosting(other, Hosting::kDirect);
    Environment world(builder.description());
    run_to_end(&world);
    EXPECT_NEAR(position(world, 1).y(), 0.5, 1e-9);
    return world.chain_hash();
  };
  const Hash direct = hash(Hosting::kDirect, Slot::kSolver);
  EXPECT_EQ(direct, hash(Hosting::kSharedMemory, Slot::kForce));
  EXPECT_EQ(direct, hash(Hosting::kSharedMemory, Slot::kSolver));
  EXPECT_EQ(direct, hash(Hosting::kSharedMemory, Slot::kCollision));
}

}  // namespace
}  // namespace gravitas
