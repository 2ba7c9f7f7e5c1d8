// Whether a run would use an answer: what the kernel demands of every one (kernel/validate.h), of one that came alone.
#pragma once

#include <string>

#include "plugin_sdk/conformance/conformance.h"
#include "plugin_sdk/message_columns.h"
#include "plugin_sdk/physics_checks.h"

namespace gravitas::capsule {

// Why a run would not go on with the answer, in the kernel's words, but for bodies: it names them by their rows. Empty: it
// would. `told`: the wrenches that an integrator was told while it was asked. Physics is looked at where `with_physics`.
std::string verdict_on(stage::Method method, const MessageColumns& request, const conformance::Answer& answer,
                       const WrenchRange& told, bool with_physics);

}  // namespace gravitas::capsule
