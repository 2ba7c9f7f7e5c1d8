// How long what is done many times a step takes, for figures: read often, so it must cost next to nothing.
#pragma once

#include <x86intrin.h>

#include <cstdint>

#include "plugin_sdk/channel/mailbox.h"

namespace gravitas {
namespace detail {
// Nanoseconds in 2^32 ticks of the processor's counter; 0 where it does not run evenly. Measures for 1 ms.
std::uint64_t measure_tick_scale();
}  // namespace detail

// Nanoseconds since some moment, within 0.1 % of what the system's clock tells between two readings in this process;
// 10 ns in place of 25. Where the counter stops or changes its speed it is the system's clock.
inline std::uint64_t lap_ns() {
  __extension__ using Uint128 = unsigned __int128;
  static const std::uint64_t scale = detail::measure_tick_scale();
  if (scale == 0) return channel::now_ns();
  return static_cast<std::uint64_t>((static_cast<Uint128>(__rdtsc()) * scale) >> 32U);
}

// From one reading to a later one; 0 if the counter of another core is behind.
inline std::uint64_t lap_between(std::uint64_t start, std::uint64_t end) { return end > start ? end - start : 0; }

}  // namespace gravitas
