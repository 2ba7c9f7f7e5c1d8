// What Linux lets this process have, told before workers are started: gRPC hangs or aborts where it gets less.
#pragma once

#include <string>

namespace gravitas {

// Why workers cannot be started; empty: nothing is in the way that can be seen from here.
std::string too_little_for_workers();

}  // namespace gravitas
