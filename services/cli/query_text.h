// Questions as a person writes them, and their answers as one reads them.
#pragma once

#include <string>
#include <vector>

#include "gravitas/query/v1/query.pb.h"

namespace gravitas::cli {

struct QueryText {
  std::string batch;                                 // JSON, or @FILE
  std::vector<std::string> rays, overlaps, closest;  // as `gravitas ctl query --help` says
  bool all = false;                                  // hits of the rays
};

// All questions in one batch. Throws BadInput with what is allowed.
query::v1::Batch parse_query(const QueryText& text);

// A line per hit.
std::string answers_text(const query::v1::Answers& answers);

}  // namespace gravitas::cli
