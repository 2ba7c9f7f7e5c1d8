// The campaign as a page: one file that needs nothing else.
#pragma once

#include <string>

#include "services/campaign/table.h"

namespace gravitas::campaign {

// HTML with the table of outcomes and a histogram of recovery times.
std::string page(const v1::Table& table, const Tally& tally);

}  // namespace gravitas::campaign
