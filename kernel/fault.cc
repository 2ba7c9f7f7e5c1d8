#include "kernel/fault.h"

#include "kernel/description.h"

namespace gravitas::kernel {

const char* fault_kind_name(FaultKind kind) {
  switch (kind) {
    case FaultKind::kDeath:
      return "death";
    case FaultKind::kDeadline:
      return "deadline";
    case FaultKind::kRefusal:
      return "refusal";
    case FaultKind::kFailure:
      return "failure";
    case FaultKind::kBadFrame:
      return "bad_frame";
    case FaultKind::kBadStructure:
      return "bad_structure";
    case FaultKind::kBadNumbers:
      return "bad_numbers";
    case FaultKind::kBadPhysics:
      return "bad_physics";
    case FaultKind::kDisagreement:
      return "disagreement";
    case FaultKind::kHandshake:
      return "handshake";
  }
  return "unknown";
}

bool is_off(const Defences& defences, FaultKind kind) {
  return (kind == FaultKind::kBadStructure && !defences.structure) ||
         (kind == FaultKind::kBadNumbers && !defences.numbers) || (kind == FaultKind::kBadPhysics && !defences.physics);
}

}  // namespace gravitas::kernel
