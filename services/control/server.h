// The gRPC service of a served run, on its Unix socket and, if so asked, at an address.
#pragma once

#include <memory>
#include <string>

#include "services/control/served_run.h"

namespace gravitas::control {

class ControlServer {
 public:
  // Listens on the socket from now on, where nothing may stand; and at `address` (ADDR:PORT; port 0: a free one) if that is
  // not empty. Throws BadInput if the address cannot be had, std::runtime_error if the socket cannot.
  ControlServer(ServedRun* run, const std::string& socket, const std::string& address = {});
  // Ends all calls.
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

  // With the port that was taken; empty if none was asked for.
  const std::string& address() const;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace gravitas::control
