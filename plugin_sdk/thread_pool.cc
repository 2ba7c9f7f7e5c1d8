#include "plugin_sdk/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace gravitas {

struct ThreadPool::Crew {
  std::mutex mutex;
  std::condition_variable start, done;
  std::vector<std::thread> threads;
  std::uint64_t round = 0;
  std::uint32_t busy = 0;
  bool stopping = false;

  void (*body)(void*, std::uint64_t, std::uint64_t) = nullptr;
  void* argument = nullptr;
  std::uint64_t count = 0;
  std::atomic<std::uint64_t> next{0};
  // Of the first chunk that threw.
  std::exception_ptr failure;
  std::uint64_t failure_begin = 0;

  // Takes chunks until none is left.
  void work() {
    for (;;) {
      const std::uint64_t begin = next.fetch_add(kChunk);
      if (begin >= count) return;
      try {
        body(argument, begin, std::min(begin + kChunk, count));
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure || begin < failure_begin) failure = std::current_exception(), failure_begin = begin;
      }
    }
  }

  void run() {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex);
    for (;;) {
      start.wait(lock, [&] { return stopping || round != seen; });
      if (stopping) return;
      seen = round;
      lock.unlock();
      work();
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
  if (threads_ == 1 || count <= kChunk) {
    std::exception_ptr failure;
    for (std::uint64_t begin = 0; begin < count; begin += kChunk) {
      try {
        body(argument, begin, std::min(begin + kChunk, count));
      } catch (...) {
        if (!failure) failure = std::current_exception();
      }
    }
    if (failure) std::rethrow_exception(failure);
    return;
  }
  if (!crew_) {
    crew_ = std::make_unique<Crew>();
    for (std::uint32_t i = 1; i < threads_; ++i) crew_->threads.emplace_back([crew = crew_.get()] { crew->run(); });
  }
  {
    const std::lock_guard lock(crew_->mutex);
    crew_->body = body;
    crew_->argument = argument;
    crew_->count = count;
    crew_->next = 0;
    crew_->failure = nullptr;
    crew_->busy = threads_ - 1;
    ++crew_->round;
  }
  crew_->start.notify_all();
  crew_->work();
  std::unique_lock lock(crew_->mutex);
  crew_->done.wait(lock, [&] { return crew_->busy == 0; });
  if (crew_->failure) std::rethrow_exception(crew_->failure);
}

}  // namespace gravitas
