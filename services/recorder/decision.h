// Who answers instead of a scene's own plugins: swaps, rollbacks and fallbacks, as a checkpoint and a journal keep them.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "kernel/environment.h"
#include "services/catalog/catalog.h"

namespace gravitas {

recorder::v1::Decision message_of(const kernel::Decision& decision);

// True of one by a swap that may still be taken back.
bool is_swap(const recorder::v1::Decision& decision);

// A swap becomes one that is not taken back any more; false if it was none.
bool settle(recorder::v1::Decision* decision);

// The last decision about a plugin's place is the one in force; a swap knows the one before.
void put_in_force(const recorder::v1::Decision& decision, std::vector<recorder::v1::Decision>* in_force);

// The order that makes the decision again. The bytes may come from anywhere: a plugin that the catalogue does not have
// is not looked for. Throws std::runtime_error with the reason.
kernel::SwapOrder order_of(const recorder::v1::Decision& decision, const Catalog& catalog);

// An order of a swap that is to come, as a journal keeps it, and back. Throws std::runtime_error with the reason.
recorder::v1::Decision message_of(const kernel::SwapOrder& order, const std::string& why);
kernel::SwapOrder ordered_swap(recorder::v1::Decision order, const Catalog& catalog);

// Those of the decisions in force answer in `begun`. Throws std::runtime_error as order_of(), or where a slot has no such place.
void put_in_place(std::span<const recorder::v1::Decision> decisions, const Catalog& catalog,
                  kernel::EnvironmentDescription* begun);

// A run that goes on begins with who answered before each swap, in `begun`, and orders the swaps again before it is restored: it
// knows then what a failure goes back to. `scene`: who answers where nothing was decided.
void take_back_swaps(std::span<const recorder::v1::Decision> decisions, const Catalog& catalog,
                     const kernel::EnvironmentDescription& scene, kernel::EnvironmentDescription* begun);
std::vector<kernel::SwapOrder> past_swaps(std::span<const recorder::v1::Decision> decisions, const Catalog& catalog,
                                          const kernel::EnvironmentDescription& answering);

}  // namespace gravitas
