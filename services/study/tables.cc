#include "services/study/tables.h"

#include <fmt/format.h>

#include "services/recorder/csv.h"
#include "services/study/analysis.h"

namespace gravitas::study {

std::string csv(const v1::Study& study) {
  std::string text =
      "problem,family,method,climbs,setting,error,energy_drift,joint_error_m,penetration_m,cpu_min_s,cpu_median_s,runs,"
      "simulated_s,steps,derivatives,iterations,evaluations,failed,build,processor\n";
  for (const v1::Problem& problem : study.problems())
    for (const v1::Ladder& ladder : problem.ladders())
      for (const v1::Rung& rung : ladder.rungs())
        text += fmt::format("{},{},{},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.4g},{:.4g},{},{:.17g},{},{},{},{},{},{},{}\n",
                            csv_quoted(problem.name()), problem.family(), ladder.method(), ladder.climbs(),
                            rung.setting(), rung.error(), rung.energy_drift(), rung.joint_error(), rung.penetration(),
                            rung.cpu_min(), rung.cpu_median(), rung.runs(), problem.duration(), rung.steps(),
                            rung.derivatives(), rung.iterations(), evaluations(rung), csv_quoted(rung.failed()),
                            csv_quoted(study.build()), csv_quoted(study.processor()));
  return text;
}

}  // namespace gravitas::study
