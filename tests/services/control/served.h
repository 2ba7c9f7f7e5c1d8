// A served run of the sample, with server and client in this process.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "services/control/client.h"
#include "services/control/served_run.h"
#include "services/control/server.h"
#include "services/control/server_socket.h"
#include "services/run/edit_spec.h"
#include "tests/services/cli/program.h"

namespace gravitas::harness {

namespace api = control::api;
using control::ControlClient;
using control::ControlError;
using control::ControlServer;
using control::parse_set_request;
using control::parse_swap_request;
using control::ServedRun;
using control::ServeOptions;
using control::ServerSocket;

inline constexpr std::uint32_t kSteps = 120;

inline ServeOptions sample(const std::string& hosting = "shm") {
  ServeOptions options;
  options.run.scenes = {shipped_scene("two_spheres_motor")};
  options.run.steps = kSteps;
  options.run.hosting = {
      {std::nullopt, hosting == "direct" ? kernel::Hosting::kDirect : kernel::Hosting::kSharedMemory}};
  options.speed = 0.0;
  options.is_paused = true;
  return options;
}

// A server and a client of it.
struct Served {
  ScratchFolder folder;
  ServedRun run;
  ServerSocket socket{folder.path("control.sock")};
  ControlServer server{&run, socket.path()};
  ControlClient client{socket.path()};

  explicit Served(const ServeOptions& options = sample()) : run(options) {}

  api::ServedSwap swap(const std::string& text) {
    const api::SwapOrdered ordered = client.swap(parse_swap_request(text));
    client.step(20);  // over its probation
    return last_swap(ordered);
  }
  api::ServedSwap set(const std::string& text) {
    const api::SwapOrdered ordered = client.set_property(parse_set_request(text));
    client.step(20);
    return last_swap(ordered);
  }
  api::EditMade edit(const std::vector<std::string>& changes) {
    api::EditRequest request;
    for (const std::string& change : changes) *request.add_changes() = parse_change(change);
    return client.edit(request);
  }
  api::ServedSwap last_swap(const api::SwapOrdered& ordered) {
    const api::Status status = client.status();
    EXPECT_EQ(status.swaps(status.swaps_size() - 1).number(), ordered.number());
    return status.swaps(status.swaps_size() - 1);
  }
  api::Status to_the_end() { return client.step(kSteps); }
};

// Where the run is when nobody touches it.
inline const std::string& quiet_chain() {
  static const std::string chain = [] {
    Served served(sample("direct"));
    return served.to_the_end().chain_hash();
  }();
  return chain;
}

// Why the server refuses it.
template <typename Action>
std::string refusal(Action&& action) {
  try {
    action();
  } catch (const ControlError& error) {
    EXPECT_EQ(error.kind, ControlError::Kind::kRefused) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "it was not refused";
  return {};
}

}  // namespace gravitas::harness
