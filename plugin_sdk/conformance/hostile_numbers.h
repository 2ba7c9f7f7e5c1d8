// Hostile numbers, one at a time, in every column of a good request: what a plugin must refuse with a reason or
// answer with finite numbers, and never die of.
#pragma once

#include <functional>
#include <string>

#include "plugin_sdk/conformance/conformance.h"

namespace gravitas::conformance {

// NaN, infinities, huge, tiny, zero and negative numbers in some elements of every f64 column. `scene` says what the
// request is without them; `finish` puts right what depends on the numbers (hashes of content).
void expect_hostile_numbers_survived(Subject& subject, const std::string& scene, stage::Method method,
                                     const MessageColumns& request, const DerivativeFunction& derivative = {},
                                     const std::function<void(MessageColumns*)>& finish = {});

// An index far outside in every column of indices: must be refused. The request must use all of its rows.
void expect_foreign_indices_refused(Subject& subject, const std::string& scene, stage::Method method,
                                    const MessageColumns& request);

}  // namespace gravitas::conformance
