// A worker that lies in its handshake, on order (`gravitas-worker --lie WHAT`): to test who starts it.
#pragma once

#include <span>
#include <string_view>

#include "gravitas/control/v1/control.pb.h"

namespace gravitas::host {

struct HandshakeLie {
  std::string_view what;
  // In the reason with which a kernel has to refuse it; empty: it may take it, and has to say so.
  std::string_view refusal;
  void (*tell)(control::v1::Welcome* welcome);
};

std::span<const HandshakeLie> handshake_lies();

// Null if there is none of this name.
const HandshakeLie* find_handshake_lie(std::string_view what);

}  // namespace gravitas::host
