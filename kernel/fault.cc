#include "kernel/fault.h"

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

}  // namespace gravitas::kernel
