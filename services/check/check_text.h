// The report of an examination for people.
#pragma once

#include <string>

#include "gravitas/report/v1/check.pb.h"

namespace gravitas::check {

// A line per level, the findings, and the badge as the last line.
std::string check_text(const report::v1::CheckReport& report);

}  // namespace gravitas::check
