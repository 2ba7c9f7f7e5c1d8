// What a process takes of the machine.
#pragma once

#include <cstdint>

namespace gravitas::check {

struct ProcessUse {
  std::uint64_t resident_bytes = 0;
  std::uint32_t descriptors = 0;
  std::uint32_t threads = 0;
};

// Of a process of ours. Throws std::runtime_error if there is none of that number.
ProcessUse use_of(int process_id);

}  // namespace gravitas::check
