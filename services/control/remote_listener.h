// A client of the control API that decides about pairs: the run's question goes out in the thread of its call, and the answer
// comes back there.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "gravitas/control_api/v1/control_api.pb.h"
#include "services/listeners/pair_listener.h"

namespace gravitas::control {

namespace api = control_api::v1;

class RemoteListener final : public PairListener {
 public:
  // `hang_up` ends the call while it waits for its client; used until end().
  explicit RemoteListener(std::function<void()> hang_up) : hang_up_(std::move(hang_up)) {}

  // Of the run: waits for the answer; throws where the client has gone or answers something else.
  void on_pairs(std::span<PairQuestion> pairs) override;
  // Of the run: it is not asked any more.
  void dismiss(const std::string& why);

  // Of the call: the next question, or nothing if none comes in time. Throws NotNow when it is dismissed.
  std::optional<api::PairQuestions> next(std::chrono::milliseconds longest);
  void answer(const api::PairDecisions& decisions);
  // Of the call: nobody answers any more.
  void end();

 private:
  enum class State : std::uint32_t { kIdle, kAsked, kSent, kAnswered, kEnded };

  std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::kIdle;
  api::PairQuestions questions_;
  api::PairDecisions decisions_;
  std::string dismissal_;
  std::function<void()> hang_up_;
};

}  // namespace gravitas::control
