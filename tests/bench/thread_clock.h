// The clock of benchmarks that compare.
#pragma once

#include <ctime>

namespace gravitas {

// Of this thread: what else the machine does falls out of a comparison.
inline double thread_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace gravitas
