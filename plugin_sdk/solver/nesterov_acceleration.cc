#include "plugin_sdk/solver/nesterov_acceleration.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gravitas {

void NesterovAcceleration::go_ahead(SweptState* swept) {
  if (sweeps_ < plain_) return;
  if (sweeps_ == plain_) {
    swept->read_responses(&response_);
    swept->read(&now_);
    before_ = ahead_ = now_;
    t_ = 1.0;
    least_ = HUGE_VAL;
    return;
  }
  const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t_ * t_)), share = (t_ - 1.0) / next;
  t_ = next;
  for (std::size_t i = 0; i < now_.size(); ++i) ahead_[i] = now_[i] + share * (now_[i] - before_[i]);
  if (share != 0.0) swept->write(ahead_);
}

void NesterovAcceleration::note(const SweptState& swept, double change) {
  if (sweeps_++ < plain_) return;
  std::swap(before_, now_);
  swept.read(&now_);
  double turned = 0.0;
  for (std::size_t i = 0; i < response_.size(); ++i)
    turned += response_[i] * (ahead_[i] - now_[i]) * (now_[i] - before_[i]);
  if (turned > 0.0) t_ = 1.0, least_ = change;
  least_ = std::min(least_, change);
  if (change > growth_ * least_) sweeps_ = 0, plain_ *= 2;
}

}  // namespace gravitas
