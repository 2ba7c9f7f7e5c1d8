// Digest of bytes: XXH3, 64 bits, the same on every processor.
#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstddef>
#include <cstdint>

namespace gravitas::channel {

class Digest {
 public:
  // Adds a run of bytes; runs are chained, so their borders count.
  void add(const void* data, std::size_t size) { value_ = XXH3_64bits_withSeed(data, size, value_); }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0;
};

}  // namespace gravitas::channel
