// The gRPC service of a served run, on its Unix socket.
#pragma once

#include <memory>
#include <string>

#include "services/control/served_run.h"

namespace gravitas::control {

class ControlServer {
 public:
  // Listens on the socket from now on; nothing may stand there. Throws std::runtime_error if that is impossible.
  ControlServer(ServedRun* run, const std::string& socket);
  // Ends all calls.
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace gravitas::control
