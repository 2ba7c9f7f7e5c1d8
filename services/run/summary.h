// The lines a person reads at the end of a run.
#pragma once

#include <string>
#include <vector>

#include "gravitas/report/v1/report.pb.h"
#include "services/recorder/event_log.h"

namespace gravitas {

// What happened, how fast, how exact, on which processes; a few lines with a line break at the end.
std::string summarize(const report::v1::Report& report, const std::vector<EventLog::Meeting>& meetings);

}  // namespace gravitas
