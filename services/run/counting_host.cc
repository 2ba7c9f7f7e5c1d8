#include "services/run/counting_host.h"

#include <memory>
#include <utility>

#include "services/capsule/forwarding_host.h"

namespace gravitas {
namespace {

// What the hosts of an environment share.
struct Count {
  std::function<void()> on_call;
  std::uint32_t compared = 0;  // calls that are open, and only compared
};

class CountingHost final : public capsule::ForwardingHost {
 public:
  CountingHost(std::unique_ptr<kernel::Carrier> host, std::shared_ptr<Count> count)
      : ForwardingHost(std::move(host)), count_(std::move(count)) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    if (!call.is_compared) {
      if (count_->compared == 0) count_->on_call();
      return host_->call(call, arena, derivatives);
    }
    struct Open {
      std::uint32_t& calls;
      explicit Open(std::uint32_t* all) : calls(*all) { ++calls; }
      ~Open() { --calls; }
    } const open(&count_->compared);
    return host_->call(call, arena, derivatives);
  }

 private:
  const std::shared_ptr<Count> count_;
};

}  // namespace

kernel::HostStarter counting(kernel::HostStarter starter, std::function<void()> on_call) {
  return [starter = std::move(starter), count = std::make_shared<Count>(Count{std::move(on_call)})](
             const kernel::SlotDescription& slot, std::uint32_t threads,
             std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    return std::make_unique<CountingHost>(starter(slot, threads, std::move(stop)), count);
  };
}

}  // namespace gravitas
