// Calls that take far longer than the calls before them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "plugin_sdk/counted.h"

namespace gravitas {

class SlowCalls {
 public:
  void note(std::uint64_t nanoseconds) {
    longest_ = std::max(longest_, nanoseconds);
    if (nanoseconds > kSlow && nanoseconds > kFactor * usual_ && usual_ > 0) {
      ++count_;
      slowest_ = std::max(slowest_, nanoseconds);
      return;
    }
    usual_ = usual_ == 0 ? nanoseconds : (15 * usual_ + nanoseconds) / 16;
  }

  // Of all, ns.
  std::uint64_t longest() const { return longest_; }

  // What is to be said of the slow ones since the last time; empty: there were none.
  std::string take_complaint() {
    if (count_ == 0) return {};
    return "it was slow " + counted(std::exchange(count_, 0), "time") + ": up to " +
           std::to_string(std::exchange(slowest_, 0) / 1'000'000) + " ms, over " + std::to_string(kFactor) +
           " times as long as it usually takes";
  }

 private:
  static constexpr std::uint64_t kSlow = 20'000'000, kFactor = 10;  // ns, and of the usual
  std::uint64_t longest_ = 0, usual_ = 0, count_ = 0, slowest_ = 0;
};

}  // namespace gravitas
