#include "services/run/machine_limits.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <latch>
#include <set>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "plugin_sdk/slots.h"

namespace gravitas {
namespace {

constexpr rlim_t kDescriptors = 64, kAddresses = rlim_t{1} << 30;
// what gRPC starts, in this process and in a worker
constexpr std::size_t kThreads = 20, kThreadsOfWorker = 12;

// With those that wait; one for a process that slots share.
std::size_t workers_of(const kernel::EnvironmentDescription& description) {
  std::size_t count = 0;
  std::set<std::string> shared;
  for (const Slot slot : kSlots) {
    const kernel::SlotDescription& one = description.slot(slot);
    if (one.plugins.empty() || one.hosting == kernel::Hosting::kDirect) continue;
    if (!one.process.empty() && !shared.insert(one.process).second) continue;
    count += 1 + one.standbys;
  }
  return count;
}

bool has_threads(std::size_t wanted) {
  std::vector<std::jthread> threads;
  std::latch all{1};
  bool has = true;
  try {
    for (std::size_t i = 0; i < wanted; ++i) threads.emplace_back([&all] { all.wait(); });
  } catch (const std::system_error&) {
    has = false;
  }
  all.count_down();
  return has;
}

// Empty: nothing is in the way.
std::string too_little_for_workers(std::size_t workers) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur < kDescriptors)
    return fmt::format("workers need at least {} open files, and Linux allows this program {} (ulimit -n)",
                       kDescriptors, limit.rlim_cur);
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < kAddresses)
    return fmt::format("workers need at least {} MB of addresses, and Linux allows this program {} (ulimit -v)",
                       kAddresses >> 20, limit.rlim_cur >> 20);
  const std::size_t threads = kThreads + kThreadsOfWorker * workers;
  if (!has_threads(threads))
    return fmt::format(
        "{} workers need some {} threads, and Linux allows this program fewer (ulimit -u, or what the container may "
        "have; Standby = 0 halves them)",
        workers, threads);
  return {};
}

}  // namespace

void require_workers(const kernel::EnvironmentDescription& description) {
  const std::size_t workers = workers_of(description);
  const std::string lacking = workers > 0 ? too_little_for_workers(workers) : "";
  if (!lacking.empty()) throw std::runtime_error(lacking + "; --hosting direct does without workers");
}

}  // namespace gravitas
