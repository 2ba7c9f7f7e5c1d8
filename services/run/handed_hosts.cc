#include "services/run/handed_hosts.h"

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "services/capsule/forwarding_host.h"

namespace gravitas {
namespace {

// Ends with the last environment that has it.
class SharedHost final : public capsule::ForwardingHost {
 public:
  explicit SharedHost(std::shared_ptr<kernel::Carrier> host) : ForwardingHost(std::move(host)) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    return host_->call(call, arena, derivatives);
  }
  void drain() override {
    if (host_.use_count() == 1) ForwardingHost::drain();
  }
};

bool is_at_address(const kernel::SlotDescription& slot) {
  return std::ranges::any_of(slot.plugins, [](const kernel::PluginChoice& one) { return !one.address.empty(); });
}

}  // namespace

struct HandedHosts::Known {
  struct Host {
    kernel::SlotDescription slot;
    std::uint32_t threads;
    std::weak_ptr<kernel::Carrier> carrier;

    bool serves(const kernel::SlotDescription& other, std::uint32_t other_threads) const {
      return threads == other_threads && slot.call_deadline() == other.call_deadline() &&
             std::ranges::equal(slot.plugins, other.plugins, kernel::is_same_plugin);
    }
  };
  std::mutex mutex;
  std::vector<Host> hosts;
};

HandedHosts::HandedHosts(kernel::HostStarter starter)
    : starter_(std::move(starter)), known_(std::make_shared<Known>()) {}

kernel::HostStarter HandedHosts::for_environment() const {
  // those that it has: a second one of the same would be no other process
  auto own = std::make_shared<std::vector<std::weak_ptr<kernel::Carrier>>>();
  return [starter = starter_, known = known_, own](const kernel::SlotDescription& slot, std::uint32_t threads,
                                                   std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    if (!is_at_address(slot)) return starter(slot, threads, std::move(stop));
    const auto has = [&](const std::shared_ptr<kernel::Carrier>& host) {
      return std::ranges::any_of(*own, [&](const auto& one) { return one.lock() == host; });
    };
    {
      const std::lock_guard lock(known->mutex);
      for (const Known::Host& one : known->hosts) {
        const std::shared_ptr<kernel::Carrier> host = one.carrier.lock();
        if (!host || !host->is_alive() || !one.serves(slot, threads) || has(host)) continue;
        own->push_back(host);
        return std::make_unique<SharedHost>(host);
      }
    }
    const std::shared_ptr<kernel::Carrier> host = starter(slot, threads, std::move(stop));
    const std::lock_guard lock(known->mutex);
    std::erase_if(known->hosts, [](const Known::Host& one) { return one.carrier.expired(); });
    known->hosts.push_back({slot, threads, host});
    own->push_back(host);
    return std::make_unique<SharedHost>(host);
  };
}

}  // namespace gravitas
