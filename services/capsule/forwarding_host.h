// Base of hosts that stand before another one and do something of their own with its calls.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kernel/carrier/carrier.h"

namespace gravitas::capsule {

class ForwardingHost : public kernel::Carrier {
 public:
  void drain() override { host_->drain(); }
  void kill() override { host_->kill(); }
  bool is_alive() const override { return host_->is_alive(); }
  int process_id() const override { return host_->process_id(); }
  kernel::Hosting hosting() const override { return host_->hosting(); }
  std::vector<std::string> take_complaints() override { return host_->take_complaints(); }
  std::vector<std::string> sandbox() const override { return host_->sandbox(); }

 protected:
  explicit ForwardingHost(std::shared_ptr<kernel::Carrier> host) : host_(std::move(host)) {}

  const std::shared_ptr<kernel::Carrier> host_;
};

}  // namespace gravitas::capsule
