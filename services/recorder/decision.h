// Who answers instead of a scene's own plugins: swaps, rollbacks and fallbacks, as a checkpoint and a journal keep them.
#pragma once

#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "kernel/environment.h"
#include "services/catalog/catalog.h"

namespace gravitas {

recorder::v1::Decision message_of(const kernel::Decision& decision);

// The last decision about a plugin's place is the one in force.
void put_in_force(const recorder::v1::Decision& decision, std::vector<recorder::v1::Decision>* in_force);

// The order that makes the decision again. The bytes may come from anywhere: a plugin that the catalogue does not have
// is not looked for. Throws std::runtime_error with the reason.
kernel::SwapOrder order_of(const recorder::v1::Decision& decision, const Catalog& catalog);

}  // namespace gravitas
