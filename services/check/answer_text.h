// Calls and answers in words, for findings.
#pragma once

#include <string>

#include "plugin_sdk/column_comparison.h"
#include "plugin_sdk/conformance/conformance.h"

namespace gravitas::check {

// "Solver.Solve with 12 body, 3 contact": method and number of rows of each kind.
std::string call_text(stage::Method method, const MessageColumns& request);

// "OK", "REFUSED (negative mass)", or why there is no answer.
std::string outcome_text(const conformance::Answer& answer);

// Where the second answer differs from the first, or empty if they are the same to the byte.
std::string difference(stage::Method method, const conformance::Answer& first, const conformance::Answer& second);
// The same, or empty if they are alike (Comparison::tolerance); answers that came are counted in.
std::string difference(stage::Method method, const conformance::Answer& first, const conformance::Answer& second,
                       Comparison* comparison);

}  // namespace gravitas::check
