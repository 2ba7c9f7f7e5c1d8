// Requests that no kernel sends: made from an ordinary one, the same for every carrier.
#pragma once

#include <string>
#include <vector>

#include "plugin_sdk/conformance/conformance.h"

namespace gravitas::check {

struct AbusedRequest {
  std::string what;
  MessageColumns request;
  // True if a plugin may answer it: it is odd, not wrong.
  bool may_be_answered = false;
};

// Columns of the same rows with different numbers of rows, and numbers that are no whole rows.
std::vector<AbusedRequest> with_uneven_rows(const conformance::Question& question);
// Every index of a column points beyond all rows.
std::vector<AbusedRequest> with_wild_indices(const conformance::Question& question);
// Resizes one column, and leaves the others.
void set_count(MessageColumns* columns, std::size_t column, std::uint64_t count);

// No row of anything.
AbusedRequest with_no_rows(const conformance::Question& question);

}  // namespace gravitas::check
