// Threads of a host for parallel_for. Work is cut into chunks of a fixed size, whatever the number of threads,
// so a plugin that writes each item's result to the item's own place answers the same bytes with any number.
#pragma once

#include <cstdint>
#include <memory>

#include "plugin_sdk/abi.h"

namespace gravitas {

class ThreadPool {
 public:
  // Items per chunk.
  static constexpr std::uint64_t kChunk = 64;

  // `threads` >= 1 counts the caller. Threads start with the first work that needs them, fewer where no more
  // are to be had.
  explicit ThreadPool(std::uint32_t threads);
  ~ThreadPool();

  // Calls body(argument, begin, end) for every chunk of 0 … count; returns when all are done. Of the
  // exceptions of bodies that of the first chunk is thrown here once all are done. Every chunk begins with the caller's
  // floating-point control; one that is left changed is the caller's then.
  void parallel_for(std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t), void* argument);

 private:
  struct Chunks;
  struct Crew;
  std::uint32_t threads_;
  std::unique_ptr<Crew> crew_;
};

}  // namespace gravitas
