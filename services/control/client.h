// The other side of the control API: calls to a served run.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "gravitas/control_api/v1/control_api.pb.h"

namespace gravitas::control {

namespace api = control_api::v1;

class ControlError : public std::runtime_error {
 public:
  enum class Kind : std::uint32_t { kRefused, kNoServer, kOther };
  ControlError(Kind what, const std::string& text) : std::runtime_error(text), kind(what) {}
  Kind kind;
};

// All functions throw ControlError: kRefused with the server's reason, kNoServer if nobody answers.
class ControlClient {
 public:
  // At the path of a socket, or at ADDR:PORT.
  explicit ControlClient(const std::string& place);
  ~ControlClient();
  ControlClient(const ControlClient&) = delete;
  ControlClient& operator=(const ControlClient&) = delete;

  // From now on each call that waits for a second or more while one step is being made calls it once: with the status
  // then, whose `waited` says since when. Streams tell by themselves.
  void on_wait(std::function<void(const api::Status&)> tell);

  api::Status status();
  api::Status pause();
  api::Status resume();
  api::Status step(std::uint32_t steps);
  api::Status reset();
  api::SwapOrdered swap(const api::SwapRequest& request);
  api::ServedSwap call_off(std::uint32_t number);
  api::SwapOrdered set_property(const api::SetPropertyRequest& request);
  api::EditMade edit(const api::EditRequest& request);
  api::Status wake(const std::string& body);
  api::InjectOrdered inject(const std::string& fault);
  // Ends early, with what there is, when `interrupted` says so.
  api::Captured capture(
      const api::CaptureRequest& request, const std::function<bool()>& interrupted = [] { return false; });
  query::v1::Answers query(const query::v1::Batch& batch);
  instrumentation::v1::Frame instrumentation(const api::InstrumentationRequest& request);
  api::Reactions reactions();
  api::Joints joints();
  // `begun` is called when it listens, then `show` for each event until it returns false, or the server ends.
  void watch_events(const api::EventsRequest& request, const std::function<void()>& begun,
                    const std::function<bool(const events::v1::Event&)>& show);
  // Decides about pairs (DecidePairs) until `decide` returns nothing, or the server ends: `begun` is called when it
  // listens. `deadline` (s) as in PairDecisions.
  void decide_pairs(double deadline, const std::function<void()>& begun,
                    const std::function<std::optional<api::PairDecisions>(const api::PairQuestions&)>& decide);
  // Until `show` returns false, or the server ends.
  void watch(std::uint32_t interval_ms, const std::function<bool(const api::Status&)>& show);

 private:
  struct Connection;
  std::unique_ptr<Connection> connection_;
};

// Reads `SLOT=PLUGIN[@step=N][,hosting=MODE]`, a relative path of a library made absolute, and
// `Slot.Property=VALUE`. Throw BadInput; names of plugins and properties are for the server to judge.
api::SwapRequest parse_swap_request(const std::string& text, bool compares = false);
api::SetPropertyRequest parse_set_request(const std::string& text);

// Waits, while the run goes on, until the swap of that number is committed, rolled back or refused, and returns it as
// it stands then. Nothing if it is not known any more.
// `on_wait` as ControlClient::on_wait().
std::optional<api::ServedSwap> wait_for_swap(ControlClient* client, std::uint32_t number, api::Status* last,
                                             const std::function<void(const api::Status&)>& on_wait = {});

}  // namespace gravitas::control
