// The program that libFuzzer drives: its target is named by the environment variable GRAVITAS_FUZZ_TARGET.
#include <cstdlib>
#include <string>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const gravitas::fuzz::Target target = [] {
    const char* name = std::getenv("GRAVITAS_FUZZ_TARGET");
    for (const gravitas::fuzz::NamedTarget& one : gravitas::fuzz::kTargets)
      if (name != nullptr && std::string(name) == one.name) return one.run;
    std::cerr << "GRAVITAS_FUZZ_TARGET names none of:";
    for (const gravitas::fuzz::NamedTarget& one : gravitas::fuzz::kTargets) std::cerr << ' ' << one.name;
    std::cerr << '\n';
    std::exit(2);
  }();
  target(std::as_bytes(std::span(data, size)));
  return 0;
}
