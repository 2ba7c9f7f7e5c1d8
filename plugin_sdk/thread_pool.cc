#include "plugin_sdk/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "plugin_sdk/floating_point.h"

namespace gravitas {
namespace {

// In a chunk: what is to be done in parallel there is done at once, by who asks.
thread_local bool is_at_work = false;

}  // namespace

// The chunks of one parallel_for. Each begins with the floating-point control of the caller, whoever runs it. What the first
// that changes it leaves is the caller's in the end, as if the caller had run them alone: hosts look at that.
struct ThreadPool::Chunks {
  std::mutex mutex;
  void (*body)(void*, std::uint64_t, std::uint64_t) = nullptr;
  void* argument = nullptr;
  std::uint64_t count = 0;
  std::atomic<std::uint64_t> next{0};
  std::uint32_t control = 0;
  // Of the first chunk that threw.
  std::exception_ptr failure;
  std::uint64_t failure_begin = 0;
  // Of the first chunk that left another control than the caller's.
  std::uint32_t left_control = 0;
  std::uint64_t left_begin = 0;

  void begin(std::uint64_t items, void (*function)(void*, std::uint64_t, std::uint64_t), void* context) {
    body = function;
    argument = context;
    count = items;
    next = 0;
    failure = nullptr;
    left_control = control = floating_point_control();
  }

  // Takes chunks until none is left.
  void work() {
    const bool was_at_work = std::exchange(is_at_work, true);
    for (;;) {
      const std::uint64_t begin = next.fetch_add(kChunk);
      if (begin >= count) break;
      restore_floating_point_control(control);
      try {
        body(argument, begin, std::min(begin + kChunk, count));
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure || begin < failure_begin) failure = std::current_exception(), failure_begin = begin;
      }
      if (const std::uint32_t left = floating_point_control(); left != control) {
        const std::lock_guard lock(mutex);
        if (left_control == control || begin < left_begin) left_control = left, left_begin = begin;
      }
    }
    is_at_work = was_at_work;
  }

  // In the caller, once all are done.
  void end() {
    restore_floating_point_control(left_control);
    if (failure) std::rethrow_exception(failure);
  }
};

struct ThreadPool::Crew {
  std::mutex mutex;
  std::condition_variable start, done;
  std::vector<std::thread> threads;
  std::uint64_t round = 0;
  std::size_t busy = 0;
  bool stopping = false;
  Chunks chunks;

  void run() {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex);
    for (;;) {
      start.wait(lock, [&] { return stopping || round != seen; });
      if (stopping) return;
      seen = round;
      lock.unlock();
      chunks.work();
      lock.lock();
      if (--busy == 0) done.notify_one();
    }
  }
};

ThreadPool::ThreadPool(std::uint32_t threads) : threads_(std::max(1U, threads)) {}

ThreadPool::~ThreadPool() {
  if (!crew_) return;
  {
    const std::lock_guard lock(crew_->mutex);
    crew_->stopping = true;
  }
  crew_->start.notify_all();
  for (std::thread& thread : crew_->threads) thread.join();
}

void ThreadPool::parallel_for(std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t), void* argument) {
  if (threads_ == 1 || count <= kChunk || is_at_work) {
    Chunks chunks;
    chunks.begin(count, body, argument);
    chunks.work();
    chunks.end();
    return;
  }
  if (!crew_) {
    crew_ = std::make_unique<Crew>();
    try {
      for (std::uint32_t i = 1; i < threads_; ++i) crew_->threads.emplace_back([crew = crew_.get()] { crew->run(); });
    } catch (const std::system_error&) {
      // no more threads are to be had: fewer give the same bytes
    }
  }
  {
    const std::lock_guard lock(crew_->mutex);
    crew_->chunks.begin(count, body, argument);
    crew_->busy = crew_->threads.size();
    ++crew_->round;
  }
  crew_->start.notify_all();
  crew_->chunks.work();
  std::unique_lock lock(crew_->mutex);
  crew_->done.wait(lock, [&] { return crew_->busy == 0; });
  crew_->chunks.end();
}

}  // namespace gravitas
