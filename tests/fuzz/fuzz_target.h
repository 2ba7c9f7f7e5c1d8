// A fuzz target: feeds bytes from anywhere to one of the places where bytes from anywhere come in. It must neither
// crash nor hang nor break a rule that it states with `require`.
//
// The same function is run by libFuzzer (deploy/fuzz) and, over the committed corpus and what is made of it, by the
// test suite (corpus_test.cc).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <span>

namespace gravitas::fuzz {

using Target = void (*)(std::span<const std::byte> bytes);

// The targets by name, in the order of their files.
void scene(std::span<const std::byte> bytes);       // text of the scene language, and --set overrides
void columns(std::span<const std::byte> bytes);     // stage messages on a gRPC stream
void frame(std::span<const std::byte> bytes);       // a worker's mailbox and response segment
void control(std::span<const std::byte> bytes);     // messages of the control stream
void checkpoint(std::span<const std::byte> bytes);  // checkpoints and journals

struct NamedTarget {
  const char* name;
  Target run;
};
inline constexpr NamedTarget kTargets[] = {
    {"scene", scene}, {"columns", columns}, {"frame", frame}, {"control", control}, {"checkpoint", checkpoint}};

// Ends the process when a rule is broken, for the fuzzer to see.
inline void require(bool rule, const char* what) {
  if (rule) return;
  std::cerr << "broken rule: " << what << '\n';
  std::abort();
}

}  // namespace gravitas::fuzz
