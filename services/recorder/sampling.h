// Which states of a run are written: the first step boundary at or after each multiple of an interval, and the last.
#pragma once

#include <cstdint>

#include "kernel/environment.h"

namespace gravitas {

class Sampling {
 public:
  // s; 0: every state.
  explicit Sampling(double interval) : interval_(interval) {}

  // Whether the committed state is one of them; true once for each. `last` makes it one.
  bool takes(const kernel::Environment& environment, bool last) {
    const double time = environment.time();
    const double tolerance = kTimeTolerance * environment.time_step();
    const bool due = interval_ <= 0.0 || time >= static_cast<double>(next_) * interval_ - tolerance;
    if ((!due && !last) || last_taken_ == environment.step_count()) return false;
    while (interval_ > 0.0 && static_cast<double>(next_) * interval_ - tolerance <= time) ++next_;
    last_taken_ = environment.step_count();
    return true;
  }

 private:
  // A boundary counts as "at k * interval" within this share of a time step.
  static constexpr double kTimeTolerance = 1e-9;

  double interval_;
  std::uint64_t next_ = 0;
  std::int64_t last_taken_ = -1;
};

}  // namespace gravitas
