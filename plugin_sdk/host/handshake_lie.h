// A worker that lies in its handshake, on order (`gravitas-worker --lie WHAT`): to test who starts it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gravitas/control/v1/control.pb.h"

namespace gravitas::host {

// "magic", "protocol", "schema", "epoch", "nonce", "arithmetic", "c_library", "processor", "count", "name": a kernel has to
// refuse a worker that says so; "build": it may take it, and has to say so.
std::vector<std::string> handshake_lies();

// Says otherwise in the welcome. An unknown or empty word changes nothing.
void tell_lie(std::string_view what, control::v1::Welcome* welcome);

}  // namespace gravitas::host
