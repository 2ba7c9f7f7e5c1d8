#include "services/run/machine_limits.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <latch>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "plugin_sdk/slots.h"

namespace gravitas {
namespace {

constexpr rlim_t kDescriptors = 64, kAddresses = rlim_t{1} << 30;
constexpr int kThreads = 16;  // what gRPC starts in one process

bool has_threads() {
  std::vector<std::jthread> threads;
  std::latch all{1};
  bool has = true;
  try {
    for (int i = 0; i < kThreads; ++i) threads.emplace_back([&all] { all.wait(); });
  } catch (const std::system_error&) {
    has = false;
  }
  all.count_down();
  return has;
}

// Empty: nothing is in the way.
std::string too_little_for_workers() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < kDescriptors)
    return fmt::format("workers need at least {} open files, and Linux allows this program {} (ulimit -n)",
                       kDescriptors, limit.rlim_cur);
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < kAddresses)
    return fmt::format("workers need at least {} MB of addresses, and Linux allows this program {} (ulimit -v)",
                       kAddresses >> 20, limit.rlim_cur >> 20);
  if (!has_threads())
    return fmt::format(
        "workers need at least {} threads, and Linux allows this program fewer (ulimit -u, or what the "
        "container may have)",
        kThreads);
  return {};
}

}  // namespace

void require_workers(const kernel::EnvironmentDescription& description) {
  const bool any = std::ranges::any_of(
      kSlots, [&](Slot slot) { return description.slot(slot).hosting != kernel::Hosting::kDirect; });
  const std::string lacking = any ? too_little_for_workers() : "";
  if (!lacking.empty()) throw std::runtime_error(lacking + "; --hosting direct does without workers");
}

}  // namespace gravitas
