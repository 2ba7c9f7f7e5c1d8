#include "services/run/machine_limits.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>

#include <latch>
#include <set>
#include <stdexcept>
#include <string>
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

// With small stacks: addresses are asked for by themselves.
bool has_threads(std::size_t wanted) {
  constexpr std::size_t kStack = 256 << 10;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, kStack);
  std::latch all{1};
  const auto wait = [](void* latch) -> void* {
    static_cast<std::latch*>(latch)->wait();
    return nullptr;
  };
  std::vector<pthread_t> threads(wanted);
  std::size_t count = 0;
  while (count < wanted && pthread_create(&threads[count], &attributes, wait, &all) == 0) ++count;
  all.count_down();
  for (std::size_t i = 0; i < count; ++i) pthread_join(threads[i], nullptr);
  pthread_attr_destroy(&attributes);
  return count == wanted;
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
