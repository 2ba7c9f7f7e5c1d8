#include "kernel/fault.h"

#include "kernel/description.h"

namespace gravitas::kernel {

const char* fault_kind_name(FaultKind kind) {
  static constexpr const char* kNames[] = {"death",         "deadline",    "refusal",     "failure",      "bad_frame",
                                           "bad_structure", "bad_numbers", "bad_physics", "disagreement", "handshake"};
  return kNames[static_cast<std::size_t>(kind)];
}

bool is_off(const Defences& defences, FaultKind kind) {
  return (kind == FaultKind::kBadStructure && !defences.structure) ||
         (kind == FaultKind::kBadNumbers && !defences.numbers) || (kind == FaultKind::kBadPhysics && !defences.physics);
}

}  // namespace gravitas::kernel
