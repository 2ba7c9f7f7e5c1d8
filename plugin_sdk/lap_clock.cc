#include "plugin_sdk/lap_clock.h"

#include <cpuid.h>

#include <optional>

namespace gravitas::detail {
namespace {

constexpr std::uint64_t kMeasuredNs = 1'000'000;
constexpr std::uint64_t kTogetherNs = 150;  // looks at both clocks: farther apart, something came between them
constexpr int kLooks = 100;

struct Look {
  std::uint64_t ns, ticks;
};

std::optional<Look> look_at_both() {
  for (int i = 0; i < kLooks; ++i) {
    const std::uint64_t before = channel::now_ns(), ticks = __rdtsc();
    if (channel::now_ns() - before < kTogetherNs) return Look{before, ticks};
  }
  return std::nullopt;
}

bool has_even_counter() {
  constexpr std::uint32_t kPowerLeaf = 0x80000007, kInvariantCounter = 1U << 8U;
  std::uint32_t a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(kPowerLeaf, &a, &b, &c, &d) != 0 && (d & kInvariantCounter) != 0;
}

}  // namespace

std::uint64_t measure_tick_scale() {
  if (!has_even_counter()) return 0;
  const std::optional<Look> first = look_at_both();
  if (!first) return 0;
  while (channel::now_ns() - first->ns < kMeasuredNs) {
  }
  const std::optional<Look> last = look_at_both();
  if (!last || last->ticks <= first->ticks) return 0;
  return ((last->ns - first->ns) << 32U) / (last->ticks - first->ticks);
}

}  // namespace gravitas::detail
