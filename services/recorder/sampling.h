// Which states of a run a file takes: the initial state, then the first step boundary at or after k * interval, and the
// last state.
#pragma once

#include <cstdint>

#include "kernel/environment.h"

namespace gravitas {

class Sampling {
 public:
  // `interval` in s; 0: every step.
  explicit Sampling(double interval) : interval_(interval) {}

  // Asked of the initial state and after every commit; `last` forces a sample. True at most once for a state.
  bool is_due(const kernel::Environment& environment, bool last);

 private:
  double interval_;
  std::uint64_t next_sample_ = 0;
  std::int64_t last_taken_ = -1;  // step
};

}  // namespace gravitas
