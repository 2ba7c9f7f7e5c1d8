// The ordinary questions to a plugin that is hosted direct, whose process is the kernel's. Here that is a child of this one,
// in the sandbox of a worker, so that a plugin which crashes, hangs or exits hurts nobody.
#pragma once

#include <string>

#include "services/check/examination.h"

namespace gravitas::check {

// Empty, or how the first answer differs from that of a worker. Throws Interrupted.
// Precondition: the plugin is a library.
std::string compare_direct(Examination& examination);

}  // namespace gravitas::check
