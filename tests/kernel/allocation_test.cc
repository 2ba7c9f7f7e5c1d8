// No step allocates after warm-up: every allocation of this program, the plugins' included, is counted. The sanitizers
// count allocations of their own, so this is a test of ordinary builds.
#include "tests/sanitized.h"

#if !GRAVITAS_IS_SANITIZED

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "kernel/environment.h"
#include "tests/kernel/world_builder.h"

namespace {

std::atomic<std::uint64_t> allocations{0};
std::atomic<bool> next_fails{false};

void* counted(std::size_t size, std::size_t alignment) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  if (next_fails.exchange(false)) throw std::bad_alloc();
  const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
  void* memory = alignment <= alignof(std::max_align_t) ? std::malloc(size) : std::aligned_alloc(alignment, rounded);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size, 1); }
void* operator new[](std::size_t size) { return counted(size, 1); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept { return std::malloc(size); }
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept { return std::malloc(size); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

namespace gravitas {
namespace {

using kernel::Environment;
using kernel::StepOutcome;

TEST(Allocation, TheCounterCounts) {
  const std::uint64_t before = allocations;
  const std::vector<double> some(100);
  EXPECT_GT(allocations, before) << some.size();
}

TEST(Allocation, AStepAllocatesNothingAfterWarmUp) {
  harness::WorldBuilder builder(kernel::Hosting::kDirect);
  builder.steps(1000, 1.0 / 60.0).ground();
  builder.box(Vector3(0.5, 0.5, 0.5), 1.0, Vector3(0, 0.5, 0))
      .sphere(0.5, 1.0, Vector3(3, 2, 0))
      .sphere(0.5, 1.0, Vector3(4.5, 2, 0));
  builder.gravity(Vector3(0, -9.81, 0));
  // a force that is asked in every step, and a joint
  builder.force("Basic", "force_basic", {0.1, 0, 0, 0, 0.1, 0, 0, 0, 0, 1, 0, 0});
  builder.joint("Spherical", "constraint_spherical", 2, 3, {3.75, 2, 0});
  Environment world(builder.description());
  for (int i = 0; i < 200; ++i) ASSERT_EQ(world.step(), StepOutcome::kCommitted) << world.fault()->fault.what();
  const std::uint64_t before = allocations;
  for (int i = 0; i < 100; ++i) world.step();
  EXPECT_EQ(allocations - before, 0U);
  EXPECT_EQ(world.step_count(), 300U);
}

// Who falls asleep with a step is found at its end.
TEST(Allocation, AStepThatLacksMemoryIsNotCountedAndCanBeMadeAgain) {
  harness::WorldBuilder builder(kernel::Hosting::kDirect);
  builder.steps(100, 0.01).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0)).gravity(Vector3(0, -9.81, 0));
  builder.body().flags |= kCanSleep;
  Environment quiet(builder.description()), world(builder.description());
  int failures = 0;
  while (quiet.step_count() < 100) {
    const Hash chain = quiet.chain_hash();
    ASSERT_EQ(quiet.step(), StepOutcome::kCommitted);
    next_fails = world.step_count() > 20;
    try {
      ASSERT_EQ(world.step(), StepOutcome::kCommitted);
    } catch (const std::bad_alloc&) {
      ++failures;
      ASSERT_EQ(world.step_count() + 1, quiet.step_count());
      ASSERT_EQ(world.chain_hash(), chain);
      ASSERT_EQ(world.step(), StepOutcome::kCommitted);
    }
    next_fails = false;
    ASSERT_EQ(world.chain_hash(), quiet.chain_hash());
  }
  EXPECT_GT(failures, 0);
  EXPECT_TRUE(world.is_asleep(1));
}

}  // namespace
}  // namespace gravitas

#endif
