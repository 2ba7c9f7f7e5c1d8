#include "services/control/remote_listener.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "plugin_sdk/counted.h"
#include "services/control/served_run.h"

namespace gravitas::control {

void RemoteListener::on_pairs(std::span<PairQuestion> pairs) {
  std::unique_lock lock(mutex_);
  questions_.Clear();
  for (const PairQuestion& pair : pairs) {
    api::PairQuestion* question = questions_.add_pairs();
    question->set_body1(pair.id_a);
    question->set_body2(pair.id_b);
    question->mutable_material()->Add(pair.material.begin(), pair.material.end());
  }
  if (state_ != State::kEnded) state_ = State::kAsked;
  changed_.notify_all();
  changed_.wait(lock, [&] { return state_ == State::kAnswered || state_ == State::kEnded; });
  if (state_ == State::kEnded) throw std::runtime_error("its client has gone");
  state_ = State::kIdle;
  if (static_cast<std::size_t>(decisions_.pairs_size()) != pairs.size())
    throw std::runtime_error(
        fmt::format("it decided about {} of {}", decisions_.pairs_size(), counted(pairs.size(), "pair")));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const api::PairDecision& decision = decisions_.pairs(static_cast<int>(i));
    pairs[i].may_collide = !decision.forbidden();
    if (decision.material_size() == 0) continue;
    if (decision.material_size() != kMaterialColumns)
      throw std::runtime_error(fmt::format("its material of '{}' and '{}' has {}; allowed: none or {}", pairs[i].id_a,
                                           pairs[i].id_b, counted(decision.material_size(), "number"),
                                           +kMaterialColumns));
    std::ranges::copy(decision.material(), pairs[i].material.begin());
  }
}

void RemoteListener::dismiss(const std::string& why) {
  const std::lock_guard lock(mutex_);
  dismissal_ = why;
  if (state_ == State::kSent && hang_up_) hang_up_();
  state_ = State::kEnded;
  changed_.notify_all();
}

std::optional<api::PairQuestions> RemoteListener::next(std::chrono::milliseconds longest) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, longest, [&] { return state_ == State::kAsked || state_ == State::kEnded; }))
    return std::nullopt;
  if (state_ == State::kEnded) throw NotNow(dismissal_);
  state_ = State::kSent;
  return questions_;
}

void RemoteListener::answer(const api::PairDecisions& decisions) {
  const std::lock_guard lock(mutex_);
  if (state_ != State::kSent) return;
  decisions_ = decisions;
  state_ = State::kAnswered;
  changed_.notify_all();
}

void RemoteListener::end() {
  const std::lock_guard lock(mutex_);
  hang_up_ = nullptr;
  state_ = State::kEnded;
  changed_.notify_all();
}

}  // namespace gravitas::control
