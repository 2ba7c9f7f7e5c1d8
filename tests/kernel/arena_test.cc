#include "kernel/arena.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <numeric>

namespace gravitas::kernel {
namespace {

TEST(Arena, ColumnsAreAlignedAndApart) {
  Arena arena;
  const Column<double> a(&arena, 3, 0);
  const Column<std::uint32_t> b(&arena, 5, 0);
  const Column<std::uint64_t> c(&arena, 0, 7);
  arena.seal();
  for (const ColumnId id : {a.id(), b.id(), c.id()}) {
    EXPECT_EQ(arena.offset(id) % 64, 0U);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(arena.data(id)) % 64, 0U);
  }
  EXPECT_GE(arena.offset(b.id()), arena.offset(a.id()) + 3 * sizeof(double));
  EXPECT_GE(arena.offset(c.id()), arena.offset(b.id()) + 5 * sizeof(std::uint32_t));
  EXPECT_EQ(c.size(), 0U);
}

TEST(Arena, GrowingKeepsEveryColumnAndCountsTheGeneration) {
  Arena arena;
  const Column<double> a(&arena, 1000, 0);
  const Column<std::uint32_t> b(&arena, 0, 4);
  arena.seal();
  std::iota(a.data(), a.data() + 1000, 0.5);
  b.assign(std::vector<std::uint32_t>{1, 2, 3, 4});
  const std::uint64_t generation = arena.generation();
  b.resize(5);
  b[4] = 5;
  EXPECT_EQ(arena.generation(), generation + 1);
  EXPECT_GE(arena.capacity(b.id()), 8U);
  for (std::size_t i = 0; i < 1000; ++i) ASSERT_EQ(a[i], static_cast<double>(i) + 0.5);
  for (std::uint32_t i = 0; i < 5; ++i) EXPECT_EQ(b[i], i + 1);
  b.resize(8);
  EXPECT_EQ(arena.generation(), generation + 1);
}

TEST(Arena, WhatItLeavesStaysWhileItIsHeld) {
  Arena arena;
  const Column<double> a(&arena, 3, 0), b(&arena, 3, 0);
  arena.seal();
  const std::span<double> before = a.span();
  std::iota(before.begin(), before.end(), 1.0);
  arena.hold();
  arena.hold();
  b.resize(4);
  b.resize(100);
  ASSERT_NE(a.data(), before.data());
  arena.let_go();
  EXPECT_EQ(before[2], 3.0);
  before[2] = 5.0;
  EXPECT_EQ(a[2], 3.0);
  arena.let_go();
  EXPECT_EQ(a[2], 3.0);
}

TEST(Arena, AColumnIsAssignedThoughRoomForItMovesBoth) {
  Arena arena;
  const Column<double> from(&arena, 3, 3), to(&arena, 0, 0);
  arena.seal();
  const std::uint64_t generation = arena.generation();
  for (std::size_t i = 0; i < 3; ++i) from[i] = 1.0 + static_cast<double>(i);
  to.assign(from);
  EXPECT_EQ(arena.generation(), generation + 1);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(to[i], 1.0 + static_cast<double>(i));
}

TEST(Arena, NobodyElseCanWriteOrCutItsSegment) {
  Arena arena;
  const Column<double> a(&arena, 10, 0);
  arena.seal();
  a[0] = 1.0;
  const int descriptor = arena.segment().descriptor();
  EXPECT_NE(ftruncate(descriptor, 0), 0);
  EXPECT_EQ(mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0), MAP_FAILED);
  void* reader = mmap(nullptr, 4096, PROT_READ, MAP_SHARED, descriptor, 0);
  ASSERT_NE(reader, MAP_FAILED);
  EXPECT_EQ(static_cast<const double*>(reader)[arena.offset(a.id()) / 8], 1.0);
  a[0] = 2.0;
  EXPECT_EQ(static_cast<const double*>(reader)[arena.offset(a.id()) / 8], 2.0);
  munmap(reader, 4096);
}

}  // namespace
}  // namespace gravitas::kernel
