// An ordinary question many times over, side by side, as one: what a large scene asks.
#pragma once

#include <cstdint>

#include "plugin_sdk/conformance/conformance.h"

namespace gravitas::check {

conformance::Question repeated(const conformance::Question& question, std::uint32_t copies);

}  // namespace gravitas::check
