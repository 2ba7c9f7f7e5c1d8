#include "services/study/tables.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "plugin_sdk/counted.h"
#include "services/recorder/csv.h"
#include "services/study/analysis.h"
#include "services/study/gate.h"

namespace gravitas::study {
namespace {

constexpr const char* kNone = "–";
constexpr std::array<double, 4> kFactors = {1.0, 2.0, 4.0, 16.0};

// What is better than the reference nobody can say.
std::string best_text(const v1::Ladder& ladder, double uncertainty) {
  const double best = best_error(ladder);
  if (std::isinf(best)) return "none";
  return best < uncertainty ? fmt::format("<{:.0e}", uncertainty) : fmt::format("{:.1e}", best);
}

// Milliseconds per simulated second to each of kWantedErrors.
std::vector<std::string> times_to(const v1::Ladder& ladder) {
  std::vector<std::string> all;
  for (const double wanted : kWantedErrors) {
    const auto found = std::ranges::find(ladder.reached(), wanted, &v1::Reached::error);
    all.push_back(found == ladder.reached().end() ? kNone : fmt::format("{:.3g}", 1e3 * found->cost()));
  }
  return all;
}

std::string order_text(const v1::Ladder& ladder) {
  return ladder.has_observed_order() ? fmt::format("{:.2f}", ladder.observed_order()) : kNone;
}

std::string achieved_text(const v1::Ladder& ladder) {
  return ladder.has_achieved_to_requested() ? fmt::format("{:.2g}", ladder.achieved_to_requested()) : kNone;
}

// A file's name as Markdown's links have it: in percent code, but for letters, digits and "-._~".
std::string in_link(const std::string& name) {
  std::string text;
  for (const char letter : name) {
    const auto byte = static_cast<unsigned char>(letter);
    const bool is_plain = std::isalnum(byte) != 0 || std::strchr("-._~", letter) != nullptr;
    text += is_plain ? std::string(1, letter) : fmt::format("%{:02X}", byte);
  }
  return text;
}

bool fails(const v1::Rung& rung) { return !rung.failed().empty() && !rung.too_long(); }

auto failed_rungs(const v1::Ladder& ladder) { return std::ranges::count_if(ladder.rungs(), fails); }
auto long_rungs(const v1::Ladder& ladder) { return std::ranges::count_if(ladder.rungs(), &v1::Rung::too_long); }

std::string problem_section(const v1::Problem& problem) {
  std::string text = fmt::format(
      "\n## {0}\n\n{1}; {2:g} s. Error against: {3}, good to {4:.1g}.\n\n![error against work]({5}.svg)\n\n"
      "| method | 1e-3 | 1e-6 | 1e-9 | best error | order, theory | observed | achieved / requested | rungs | failed | "
      "too long |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
      problem.name(), problem.family(), problem.duration(), problem.reference(), problem.uncertainty(),
      in_link(problem.name()));
  for (const v1::Ladder& ladder : problem.ladders())
    text += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", ladder.method(),
                        fmt::join(times_to(ladder), " | "), best_text(ladder, problem.uncertainty()),
                        ladder.order() > 0.0 ? fmt::format("{:g}", ladder.order()) : kNone, order_text(ladder),
                        achieved_text(ladder), ladder.rungs_size(), failed_rungs(ladder), long_rungs(ladder));
  return text;
}

// What each ladder's failures were, once a reason.
std::string failure_section(const v1::Study& study) {
  std::string text;
  for (const v1::Problem& problem : study.problems())
    for (const v1::Ladder& ladder : problem.ladders()) {
      std::vector<std::string> reasons;
      for (const v1::Rung& rung : ladder.rungs())
        if (fails(rung) && std::ranges::find(reasons, rung.failed()) == reasons.end()) reasons.push_back(rung.failed());
      if (!reasons.empty())
        text += fmt::format("- {}, {}: {}\n", problem.name(), ladder.method(), fmt::join(reasons, "; "));
    }
  return text.empty() ? text : "\n## What failed\n\n" + text;
}

std::string profile_section(const v1::Study& study) {
  std::string text;
  for (const bool has_contacts : {false, true})
    for (const double error : kWantedErrors) {
      std::size_t problems = 0;
      const std::vector<Profile> all = profiles(study, has_contacts, error, &problems);
      if (all.empty()) continue;
      text += fmt::format(
          "\n{} problems {} contacts, to {:g}:\n\n| method | fastest | within 2 | within 4 | within 16 | at all |\n"
          "| --- | --- | --- | --- | --- | --- |\n",
          problems, has_contacts ? "with" : "without", error);
      for (const Profile& profile : all) {
        text += "| " + profile.method;
        for (const double factor : kFactors)
          text += fmt::format(" | {:.0f} %", 100.0 * share_within(profile, factor, problems));
        const double infinite = std::numeric_limits<double>::infinity();
        text += fmt::format(" | {:.0f} % |\n", 100.0 * share_within(profile, infinite, problems));
      }
    }
  if (text.empty()) return text;
  return "\n## Over all problems\n\nShare of the problems on which a method costs at most so many times the CPU of the "
         "cheapest one (profiles of Dolan\nand More); problems that no method solves so well are left out.\n" +
         std::string(has_profiles(study) ? "\n![profiles](profile.svg)\n" : "") + text;
}

std::string limit_text(const v1::Limit& limit) {
  return limit.has_theory() ? fmt::format("{:.4g}", limit.theory()) : "none";
}

std::string stability_section(const v1::Study& study) {
  if (study.limits().empty()) return {};
  std::vector<double> zetas;
  for (const v1::Limit& limit : study.limits())
    if (std::ranges::find(zetas, limit.zeta()) == zetas.end()) zetas.push_back(limit.zeta());
  std::string text =
      "\n## Where integrators are stable\n\n![map of stability](stability.svg)\n\n"
      "A spring k with damper c on 1 kg, step h: k h^2 at which the theory's growth first exceeds 1, for zeta =\n"
      "c / (2 sqrt(k)); 0: at once. Beside it how many cells the engine, measured, agrees on; all stand in\n"
      "`stability.csv`. Adaptive integrators: of one whole step, which their error control would shorten.\n\n"
      "| integrator |";
  for (const double zeta : zetas) text += zeta == 0.0 ? " undamped |" : fmt::format(" zeta {:g} |", zeta);
  text += " cells that agree |\n| --- | --- |";
  for (std::size_t i = 0; i < zetas.size(); ++i) text += " --- |";
  text += "\n";
  for (int i = 0; i < study.limits_size();) {
    const std::string& name = study.limits(i).integrator();
    text += "| " + name;
    std::size_t cells = 0, agreeing = 0;
    for (; i < study.limits_size() && study.limits(i).integrator() == name; ++i) {
      text += " | " + limit_text(study.limits(i));
      cells += static_cast<std::size_t>(study.limits(i).cells_size());
      agreeing += study.limits(i).agreeing();
    }
    text += fmt::format(" | {} of {} |\n", agreeing, cells);
  }
  return text;
}

// What is not direct has processes of its own.
std::string hosting_text(const v1::Study& study) {
  std::vector<std::string> ways;
  for (const v1::Problem& problem : study.problems())
    for (const v1::Ladder& ladder : problem.ladders())
      for (const v1::Rung& rung : ladder.rungs())
        if (!rung.hosting().empty() && std::ranges::find(ways, rung.hosting()) == ways.end())
          ways.push_back(rung.hosting());
  return ways.empty() ? "direct" : fmt::format("{}", fmt::join(ways, " or "));
}

std::string gate_text(const v1::Study& study) {
  std::string text;
  if (!is_passed(study))  // what has no reference fails, too
    text = fmt::format("the gate {}, of {}:\n", study.failures().empty() ? "is not passed" : "failed",
                       counted(study.demands(), "demand"));
  else if (study.demands() == 0)
    text = "the gate demands nothing of what was run\n";
  else
    text = "the gate is passed: " + counted(study.demands(), "demand") +
           (study.undecided().empty() ? "" : fmt::format(", {} of them undecided", study.undecided_size())) + "\n";
  for (const std::string& failure : study.failures()) text += "  " + failure + "\n";
  for (const std::string& missing : study.not_shown()) text += "  not shown: " + missing + "\n";
  for (const std::string& open : study.undecided()) text += "  undecided: " + open + "\n";
  if (study.is_interrupted()) text += "  not shown: what comes after the interruption\n";
  return text;
}

}  // namespace

std::string csv(const v1::Study& study) {
  std::string text =
      "problem,family,method,climbs,setting,error,energy_drift,joint_error_m,penetration_m,cpu_min_s,cpu_median_s,runs,"
      "simulated_s,steps,derivatives,iterations,evaluations,failed,hosting,build,processor\n";
  for (const v1::Problem& problem : study.problems())
    for (const v1::Ladder& ladder : problem.ladders())
      for (const v1::Rung& rung : ladder.rungs()) {
        // of a run that did not come to its end there is none
        const std::string error = std::isfinite(rung.error()) ? fmt::format("{:.17g}", rung.error()) : "";
        text += fmt::format("{},{},{},{},{:.17g},{},{:.17g},{:.17g},{:.17g},{:.4g},{:.4g},{},{:.17g},",
                            csv_quoted(problem.name()), problem.family(), ladder.method(), ladder.climbs(),
                            rung.setting(), error, rung.energy_drift(), rung.joint_error(), rung.penetration(),
                            rung.cpu_min(), rung.cpu_median(), rung.runs(), problem.duration());
        text += fmt::format("{},{},{},{:.0f},{},{},{},{}\n", rung.steps(), rung.derivatives(), rung.iterations(),
                            evaluations(rung), csv_quoted(rung.failed()), csv_quoted(rung.hosting()),
                            csv_quoted(study.build()), csv_quoted(study.processor()));
      }
  return text;
}

std::string stability_csv(const v1::Study& study) {
  std::string text = "integrator,zeta,stiffness_kh2,measured,theory\n";
  for (const v1::Limit& limit : study.limits())
    for (const v1::Cell& cell : limit.cells())
      text += fmt::format("{},{:g},{:.6g},{:.9g},{:.9g}\n", limit.integrator(), limit.zeta(), cell.stiffness(),
                          cell.measured(), cell.theory());
  return text;
}

std::string page(const v1::Study& study) {
  std::string text = fmt::format(
      "# Error against run time\n\nWritten by `gravitas study`{}; build {}, {}.\n\n"
      "Each method climbs a ladder of settings, from useless to rounding: a time step that halves, or an accuracy.\n"
      "Errors are dimensionless: the largest of distances as shares of the problem's size, and of angles in rad.\n"
      "Columns 1e-3, 1e-6, 1e-9: CPU of the cheapest rung that is at least as good, in ms per simulated second;\n"
      "{} : none is. Order: the median slope of error against step. Achieved / requested: geometric mean over the\n"
      "rungs of an accuracy. Hosting: {}; one thread. Every run stands in `study.csv`, what failed included.\n"
      "Diagrams: curves lead from the coarsest setting to the finest; hollow marks failed; in the grey band the\n"
      "reference itself is no better; dashed: slopes of the orders 1, 2, 4.\n\n",
      study.is_interrupted() ? ", which was interrupted" : "", study.build(), study.processor(), kNone,
      hosting_text(study));
  text += "Gate: " + gate_text(study);
  for (const v1::Problem& problem : study.problems()) text += problem_section(problem);
  return text + profile_section(study) + stability_section(study) + failure_section(study);
}

std::string summary(const v1::Study& study) {
  std::string text = "ms of CPU per simulated second to an error; - : no rung reaches it\n";
  for (const v1::Problem& problem : study.problems()) {
    text +=
        fmt::format("\n{} ({}), against {}, good to {:.1g}\n  {:<40} {:>8} {:>8} {:>8} {:>9} {:>6} {:>6} {:>6} {:>8}\n",
                    problem.name(), problem.family(), problem.reference(), problem.uncertainty(), "method", "1e-3",
                    "1e-6", "1e-9", "best", "order", "rungs", "failed", "too long");
    for (const v1::Ladder& ladder : problem.ladders()) {
      std::vector<std::string> cells = times_to(ladder);
      cells.push_back(best_text(ladder, problem.uncertainty()));
      cells.push_back(order_text(ladder));
      for (std::string& cell : cells)
        if (cell == kNone) cell = "-";
      text +=
          fmt::format("  {:<40} {:>8} {:>8} {:>8} {:>9} {:>6} {:>6} {:>6} {:>8}\n", ladder.method(), cells[0], cells[1],
                      cells[2], cells[3], cells[4], ladder.rungs_size(), failed_rungs(ladder), long_rungs(ladder));
    }
  }
  return text + "\n" + gate_text(study);
}

}  // namespace gravitas::study
