#include "workers/solver/sequential/nesterov_acceleration.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace gravitas {

void NesterovAcceleration::read(const Parts& parts, const BodyMotion& x, std::vector<double>* state) const {
  state->clear();
  for (const RelaxationBlocks* part : parts) part->append_multipliers(state);
  for (const Twist& twist : x) {
    state->insert(state->end(), twist.linear.begin(), twist.linear.end());
    state->insert(state->end(), twist.angular.begin(), twist.angular.end());
  }
}

void NesterovAcceleration::go_ahead(const Parts& parts, BodyMotion& x) {
  if (sweeps_ < plain_) return;
  if (sweeps_ == plain_) {
    response_.clear();
    for (const RelaxationBlocks* part : parts) part->append_responses(&response_);
    read(parts, x, &now_);
    before_ = ahead_ = now_;
    t_ = 1.0;
    least_ = HUGE_VAL;
    return;
  }
  const double next = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * t_ * t_)), share = (t_ - 1.0) / next;
  t_ = next;
  for (std::size_t i = 0; i < now_.size(); ++i) ahead_[i] = now_[i] + share * (now_[i] - before_[i]);
  if (share == 0.0) return;
  const double* from = ahead_.data();
  for (RelaxationBlocks* part : parts) from = part->take_multipliers(from);
  for (Twist& twist : x) {
    twist.linear = Vector3::Map(from), twist.angular = Vector3::Map(from + 3);
    from += 6;
  }
}

void NesterovAcceleration::note(const Parts& parts, const BodyMotion& x, double change) {
  if (sweeps_++ < plain_) return;
  std::swap(before_, now_);
  read(parts, x, &now_);
  double turned = 0.0;
  for (std::size_t i = 0; i < response_.size(); ++i)
    turned += response_[i] * (ahead_[i] - now_[i]) * (now_[i] - before_[i]);
  if (turned > 0.0) t_ = 1.0, least_ = change;
  least_ = std::min(least_, change);
  if (change > kGrowth * least_) sweeps_ = 0, plain_ *= 2;
}

}  // namespace gravitas
