#include "plugin_sdk/lap_clock.h"

#include <cpuid.h>

namespace gravitas::detail {
namespace {

constexpr std::uint64_t kMeasuredNs = 200'000;

bool has_even_counter() {
  constexpr std::uint32_t kPowerLeaf = 0x80000007, kInvariantCounter = 1U << 8U;
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(kPowerLeaf, &a, &b, &c, &d) != 0 && (d & kInvariantCounter) != 0;
}

}  // namespace

std::uint64_t measure_tick_scale() {
  if (!has_even_counter()) return 0;
  const std::uint64_t begin = channel::now_ns(), first = __rdtsc();
  std::uint64_t end = begin;
  while (end - begin < kMeasuredNs) end = channel::now_ns();
  const std::uint64_t ticks = __rdtsc() - first;
  return ticks == 0 ? 0 : ((end - begin) << 32U) / ticks;
}

}  // namespace gravitas::detail
