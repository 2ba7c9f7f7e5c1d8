// Every index once, the same chunks and so the same bytes with any number of threads, and an
// exception that arrives when all work is done.
#include "plugin_sdk/thread_pool.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "plugin_sdk/floating_point.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

constexpr std::uint32_t kMostThreads = 4;

template <typename Body>
void run(ThreadPool* pool, std::uint64_t count, Body body) {
  pool->parallel_for(
      count,
      [](void* argument, std::uint64_t begin, std::uint64_t end) { (*static_cast<Body*>(argument))(begin, end); },
      &body);
}

TEST(ThreadPool, VisitsEveryIndexOnce) {
  for (std::uint32_t threads = 1; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    // one pool for all counts: work after work
    for (const std::uint64_t count : {0U, 1U, 63U, 64U, 65U, 128U, 1000U, 10007U}) {
      std::vector<std::atomic<int>> visits(count);
      run(&pool, count, [&](std::uint64_t begin, std::uint64_t end) {
        for (std::uint64_t i = begin; i < end; ++i) ++visits[i];
      });
      EXPECT_TRUE(std::all_of(visits.begin(), visits.end(), [](const auto& v) { return v == 1; }))
          << count << " items, " << threads << " threads";
    }
  }
}

// In a chunk there is nobody else to ask: it is done at once, and by the same chunks.
TEST(ThreadPool, DoesAtOnceWhatAChunkAsksFor) {
  constexpr std::uint64_t kOuter = 300, kInner = 200;
  for (std::uint32_t threads = 1; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    std::vector<std::atomic<int>> visits(kOuter * kInner);
    run(&pool, kOuter, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i)
        run(&pool, kInner, [&, i](std::uint64_t first, std::uint64_t last) {
          for (std::uint64_t k = first; k < last; ++k) ++visits[i * kInner + k];
        });
    });
    EXPECT_TRUE(std::all_of(visits.begin(), visits.end(), [](const auto& v) { return v == 1; })) << threads;
  }
}

TEST(ThreadPool, CutsTheSameChunksWithAnyNumberOfThreads) {
  using Chunks = std::vector<std::pair<std::uint64_t, std::uint64_t>>;
  Chunks expected;
  for (std::uint64_t begin = 0; begin < 1000; begin += ThreadPool::kChunk)
    expected.emplace_back(begin, std::min<std::uint64_t>(begin + ThreadPool::kChunk, 1000));
  for (std::uint32_t threads = 1; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    Chunks chunks;
    std::mutex mutex;
    run(&pool, 1000, [&](std::uint64_t begin, std::uint64_t end) {
      const std::lock_guard lock(mutex);
      chunks.emplace_back(begin, end);
    });
    std::sort(chunks.begin(), chunks.end());
    EXPECT_EQ(chunks, expected) << threads << " threads";
  }
}

// Sums inside a chunk depend on its borders: equal bits show equal chunks.
TEST(ThreadPool, GivesTheSameBitsWithAnyNumberOfThreads) {
  const auto sums = [](std::uint32_t threads) {
    ThreadPool pool(threads);
    std::vector<double> result(5000);
    run(&pool, result.size(), [&](std::uint64_t begin, std::uint64_t end) {
      double sum = 0.0;
      for (std::uint64_t i = begin; i < end; ++i) result[i] = sum += std::sqrt(static_cast<double>(i) + 0.1);
    });
    return result;
  };
  const std::vector<double> alone = sums(1);
  for (std::uint32_t threads = 2; threads <= kMostThreads; ++threads)
    EXPECT_EQ(sums(threads), alone) << threads << " threads";
}

TEST(ThreadPool, NoThreadsMeansTheCaller) {
  ThreadPool pool(0);
  std::uint64_t done = 0;
  run(&pool, 200, [&](std::uint64_t begin, std::uint64_t end) { done += end - begin; });
  EXPECT_EQ(done, 200U);
}

TEST(ThreadPool, ThrowsOnceAllOthersAreDone) {
  constexpr std::uint64_t kCount = 2000;
  for (std::uint32_t threads = 1; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    for (const std::uint64_t culprit : {0U, 700U, 1999U}) {
      std::atomic<std::uint64_t> visited{0};
      std::string text;
      try {
        run(&pool, kCount, [&](std::uint64_t begin, std::uint64_t end) {
          visited += end - begin;
          if (begin <= culprit && culprit < end) throw std::runtime_error("out of ideas");
        });
      } catch (const std::runtime_error& error) {
        text = error.what();
      }
      EXPECT_EQ(text, "out of ideas") << threads << " threads";
      EXPECT_EQ(visited, kCount) << threads << " threads";
    }
    // the pool goes on working
    std::atomic<std::uint64_t> visited{0};
    run(&pool, kCount, [&](std::uint64_t begin, std::uint64_t end) { visited += end - begin; });
    EXPECT_EQ(visited, kCount);
  }
}

// Which of several exceptions is thrown must not depend on who came first: every chunk throws, the
// first one last. Once the other threads have begun more chunks than there are of them, one of them
// has thrown.
TEST(ThreadPool, ThrowsThatOfTheFirstChunk) {
  for (std::uint32_t threads = 1; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    for (int round = 0; round < 20; ++round) {
      std::atomic<std::uint32_t> begun{0};
      std::string text;
      try {
        run(&pool, 1000, [&](std::uint64_t begin, std::uint64_t) {
          if (begin > 0) ++begun;
          while (begin == 0 && threads > 1 && begun < threads) std::this_thread::yield();
          throw std::runtime_error(std::to_string(begin));
        });
      } catch (const std::runtime_error& error) {
        text = error.what();
      }
      ASSERT_EQ(text, "0") << threads << " threads";
    }
  }
}

constexpr std::uint32_t kFlushing = 0x8040;

// The control of each thread in a chunk of its own: each waits until all have begun one.
std::vector<std::uint32_t> controls_of_all(ThreadPool* pool, std::uint32_t threads) {
  std::vector<std::uint32_t> controls(threads);
  std::atomic<std::uint32_t> begun{0};
  run(pool, threads * ThreadPool::kChunk, [&](std::uint64_t begin, std::uint64_t) {
    controls[begin / ThreadPool::kChunk] = floating_point_control();
    ++begun;
    while (begun < threads) std::this_thread::yield();
  });
  return controls;
}

// A plugin that flushes to zero around its first parallel_for must not leave threads behind that flush.
TEST(ThreadPool, EveryChunkBeginsWithTheCallersFloatingPointControl) {
  const std::uint32_t control = floating_point_control(), flushing = control | kFlushing;
  for (std::uint32_t threads = 2; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    set_floating_point_control(flushing);
    EXPECT_EQ(controls_of_all(&pool, threads), std::vector<std::uint32_t>(threads, flushing));
    EXPECT_EQ(floating_point_control(), flushing);
    set_floating_point_control(control);
    EXPECT_EQ(controls_of_all(&pool, threads), std::vector<std::uint32_t>(threads, control)) << threads << " threads";
  }
}

// Hosts look at the caller's.
TEST(ThreadPool, AControlThatAChunkLeavesChangedIsTheCallersWithAnyNumberOfThreads) {
  const std::uint32_t control = floating_point_control(), flushing = control | kFlushing;
  for (std::uint32_t threads = 1; threads <= kMostThreads; ++threads) {
    ThreadPool pool(threads);
    for (const std::uint64_t culprit : {0U, 700U, 1999U}) {
      std::atomic<int> spoiled{0};
      run(&pool, 2000, [&](std::uint64_t begin, std::uint64_t end) {
        if (floating_point_control() != control) ++spoiled;
        if (begin <= culprit && culprit < end) set_floating_point_control(flushing);
      });
      EXPECT_EQ(floating_point_control(), flushing) << threads << " threads, item " << culprit;
      set_floating_point_control(control);
      EXPECT_EQ(spoiled, 0) << threads << " threads, item " << culprit;
    }
    EXPECT_EQ(controls_of_all(&pool, threads), std::vector<std::uint32_t>(threads, control));
  }
}

// Address space for a few stacks is left: of a thousand threads most cannot be started.
TEST(ThreadPool, GoesOnWithTheThreadsThatCouldBeStarted) {
  if (harness::kSanitized) GTEST_SKIP() << "a sanitizer ends the process for want of memory";
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_AS, &before), 0);
  rlimit few = before;
  few.rlim_cur = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) + (std::uint64_t{64} << 20);
  ASSERT_EQ(setrlimit(RLIMIT_AS, &few), 0);
  std::atomic<std::uint64_t> visited{0};
  {
    ThreadPool pool(1000);
    for (int round = 0; round < 3; ++round)
      run(&pool, 1000, [&](std::uint64_t begin, std::uint64_t end) { visited += end - begin; });
  }
  ASSERT_EQ(setrlimit(RLIMIT_AS, &before), 0);
  EXPECT_EQ(visited, 3000U);
}

TEST(ThreadPool, ManyRoundsOfWorkAreAllDone) {
  ThreadPool pool(3);
  std::uint64_t total = 0;
  for (std::uint64_t round = 0; round < 2000; ++round) {
    std::atomic<std::uint64_t> sum{0};
    run(&pool, 130, [&](std::uint64_t begin, std::uint64_t end) { sum += end - begin; });
    total += sum;
  }
  EXPECT_EQ(total, 260000U);
}

}  // namespace
}  // namespace gravitas
