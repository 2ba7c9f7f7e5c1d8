// The status of a served run for a person.
#pragma once

#include <string>

#include "gravitas/control_api/v1/control_api.pb.h"

namespace gravitas::control {

// "step 301 of 500, t = 3.01 of 5 s, running, 100 steps/s".
std::string status_line(const control_api::v1::Status& status);
// A page: the line, hashes, who serves which slot with which settings, the last swaps and faults.
std::string status_page(const control_api::v1::Status& status);
// "step 12 has taken 1.3 s so far".
std::string waiting_line(const control_api::v1::Status& status);
// "committed: solver Sequential -> Sequential (direct), before step 301; pause 12.3 us, wait 8.1 ms", or
// "comparing: solver Newton beside Sequential, from step 12 on: 3 of 100 answers differ; Sequential 12.3 us, Newton 45.6 us a call".
std::string swap_line(const control_api::v1::ServedSwap& swap);

}  // namespace gravitas::control
