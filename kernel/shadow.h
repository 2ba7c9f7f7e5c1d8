// A second host that is asked what the first one has answered: its answers are checked, compared and not used. What a
// swap cuts over to runs so for some steps; two plugins compared in lock-step run so for as long as the run lasts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "kernel/arena.h"
#include "kernel/carrier/carrier.h"
#include "plugin_sdk/column_comparison.h"

namespace gravitas::kernel {

class Shadow {
 public:
  // The answer of the first host, which stands in the call's reply columns, is put aside; then run() writes the
  // second's there and may throw; whatever happens, the first answer is back at the end.
  template <typename Run>
  void compare(const StageCall& call, Arena* arena, Run&& run) {
    keep(call, *arena);
    try {
      run();
      note(call, *arena);
    } catch (...) {
      put_back(call, arena);
      throw;
    }
    put_back(call, arena);
  }

  void add_times(std::uint64_t first_ns, std::uint64_t second_ns) {
    result_.first_ns += first_ns, result_.second_ns += second_ns;
  }
  void add_refusal(const std::string& why) { result_.add_refusal(why); }

  // From here on, be it while answers are compared.
  void count_anew() { result_ = {}; }

  bool last_differed() const { return last_differed_; }
  const Comparison& result() const { return result_; }

 private:
  void keep(const StageCall& call, const Arena& arena);
  void put_back(const StageCall& call, Arena* arena) const;
  void note(const StageCall& call, const Arena& arena);

  std::vector<std::vector<std::byte>> kept_;  // per reply column
  bool last_differed_ = false;
  Comparison result_;
};

}  // namespace gravitas::kernel
