#include "services/run/interruptible_host.h"

#include <memory>
#include <utility>

namespace gravitas {
namespace {

class InterruptibleHost final : public kernel::Carrier {
 public:
  InterruptibleHost(std::unique_ptr<kernel::Carrier> host, const std::function<bool()>& interrupted)
      : host_(std::move(host)), interrupted_(interrupted) {}

  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    if (interrupted_()) throw StepInterrupted();
    return host_->call(call, arena, derivatives);
  }
  void drain() override { host_->drain(); }
  void kill() override { host_->kill(); }
  bool is_alive() const override { return host_->is_alive(); }
  int process_id() const override { return host_->process_id(); }
  kernel::Hosting hosting() const override { return host_->hosting(); }
  std::vector<std::string> take_complaints() override { return host_->take_complaints(); }
  std::vector<std::string> sandbox() const override { return host_->sandbox(); }

 private:
  std::unique_ptr<kernel::Carrier> host_;
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
