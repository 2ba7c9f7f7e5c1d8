#include "services/run/interruptible_host.h"

#include <memory>
#include <utility>

#include "services/capsule/forwarding_host.h"

namespace gravitas {
namespace {

class InterruptibleHost final : public capsule::ForwardingHost {
 public:
  InterruptibleHost(std::unique_ptr<kernel::Carrier> host, const std::function<bool()>& interrupted)
      : ForwardingHost(std::move(host)), interrupted_(interrupted) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    if (interrupted_()) throw StepInterrupted();
    return host_->call(call, arena, derivatives);
  }

 private:
  std::function<bool()> interrupted_;
};

}  // namespace

kernel::HostStarter interruptible(kernel::HostStarter starter, std::function<bool()> interrupted) {
  return [starter = std::move(starter), interrupted = std::move(interrupted)](
             const kernel::SlotDescription& slot, std::uint32_t threads,
             std::stop_token stop) -> std::unique_ptr<kernel::Carrier> {
    return std::make_unique<InterruptibleHost>(starter(slot, threads, std::move(stop)), interrupted);
  };
}

}  // namespace gravitas
