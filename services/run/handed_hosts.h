// Workers at an address serve one kernel at a time: where another environment takes the place of one (an edit, a reset), it gets
// the host that the one before has, instead of a connection of its own.
#pragma once

#include <memory>

#include "kernel/carrier/carrier.h"

namespace gravitas {

class HandedHosts {
 public:
  explicit HandedHosts(kernel::HostStarter starter);

  // Hosts of one environment. Who asks the same plugins of a worker at an address, with the same settings, as another environment
  // does that is still there, shares its host, once each: then only one of the two may ask. All others are `starter`'s.
  kernel::HostStarter for_environment() const;

 private:
  struct Known;

  const kernel::HostStarter starter_;
  const std::shared_ptr<Known> known_;
};

}  // namespace gravitas
