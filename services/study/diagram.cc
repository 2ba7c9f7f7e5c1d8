#include "services/study/diagram.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>
#include <vector>

#include "services/recorder/svg.h"
#include "services/study/analysis.h"
#include "services/study/chart.h"
#include "services/study/method.h"

namespace gravitas::study {
namespace {

constexpr double kLeast = 1e-16;  // no error is shown smaller
constexpr double kTop = 76.0, kLeft = 62.0, kGap = 66.0, kMargin = 14.0;

// The same of a method in all diagrams.
std::size_t style_of(const std::string& method) {
  const std::span<const Method> offered = offered_methods();
  const auto found = std::ranges::find(offered, method, &Method::name);
  if (found != offered.end()) return static_cast<std::size_t>(found - offered.begin());
  // others come after, by what they are called
  std::size_t sum = 0;
  for (const char letter : method) sum += static_cast<unsigned char>(letter);
  return offered.size() + sum % 13;
}

using Work = std::function<double(const v1::Rung&)>;

Curve curve_of(const v1::Ladder& ladder, const Work& work) {
  Curve curve{ladder.method(), style_of(ladder.method()), {}};
  int failed = 0, too_long = 0;
  for (const v1::Rung& rung : ladder.rungs()) {
    const double y = work(rung);
    if (rung.failed().empty()) {
      curve.marks.push_back({std::max(rung.error(), kLeast), y});
    } else {
      ++(rung.too_long() ? too_long : failed);
      // of what was not run nothing is known but that
      if (rung.runs() > 0) curve.failed.push_back(y);
    }
  }
  const auto label = [&](std::size_t at) {
    const char* unit = ladder.climbs() == "TimeStep" ? " s" : "";
    std::size_t good = 0;
    for (const v1::Rung& rung : ladder.rungs())
      if (rung.failed().empty() && good++ == at) curve.marks[at].label = fmt::format("{:.2g}{}", rung.setting(), unit);
  };
  if (!curve.marks.empty()) label(0), label(curve.marks.size() - 1);
  if (failed > 0) curve.note = fmt::format("{} failed", failed);
  if (too_long > 0) curve.note += fmt::format("{}{} too long", failed > 0 ? ", " : "", too_long);
  return curve;
}

Chart chart_of(const v1::Problem& problem, const std::string& title, const Work& work) {
  Chart chart;
  std::vector<double> errors = {1.0, std::max(problem.uncertainty(), kLeast)}, costs;
  for (const v1::Ladder& ladder : problem.ladders()) {
    chart.curves.push_back(curve_of(ladder, work));
    for (const Mark& mark : chart.curves.back().marks) errors.push_back(mark.x), costs.push_back(mark.y);
    for (const double cost : chart.curves.back().failed) costs.push_back(cost);
  }
  chart.x = decades("error (hollow, at the edge: failed, or took too long)", errors);
  chart.y = decades(title, costs);
  chart.band = problem.uncertainty();
  chart.slopes = {1, 2, 4};
  chart.top = kTop;
  return chart;
}

}  // namespace

std::string diagram(const v1::Problem& problem) {
  const double duration = problem.duration();
  Chart time =
      chart_of(problem, "CPU s per simulated s", [&](const v1::Rung& rung) { return rung.cpu_median() / duration; });
  Chart work = chart_of(problem, "evaluations per simulated s (derivatives and iterations of solvers)",
                        [&](const v1::Rung& rung) { return evaluations(rung) / duration; });
  time.left = kLeft;
  work.left = kLeft + time.width + kGap;
  const double legend_left = work.left + work.width + 24.0;
  std::string parts = svg_text(14.0, 26.0, problem.name(), "font-size=\"17\"");
  parts += svg_text(
      14.0, 44.0,
      fmt::format("{:g} s; error against: {}, good to {:.1g}", duration, problem.reference(), problem.uncertainty()),
      "fill=\"#555\"");
  parts += draw(time) + draw(work) + legend(time.curves, legend_left, kTop + 10.0);
  return svg_page(legend_left + legend_width(time.curves) + kMargin, kTop + time.height + 46.0, parts);
}

std::string profile_diagram(const v1::Study& study, double error) {
  std::string parts = svg_text(14.0, 26.0, fmt::format("Share of problems solved to {:g}", error), "font-size=\"17\"");
  double left = kLeft;
  for (const bool has_contacts : {false, true}) {
    std::size_t problems = 0;
    const std::vector<Profile> all = profiles(study, has_contacts, error, &problems);
    if (problems == 0) continue;
    Chart chart;
    double largest = 10.0;
    for (const Profile& profile : all) {
      Curve curve{profile.method, style_of(profile.method), {}};
      curve.has_steps = true;
      for (const double ratio : profile.ratios) {
        largest = std::max(largest, ratio);
        curve.marks.push_back({ratio, share_within(profile, ratio, problems)});
      }
      if (curve.marks.empty()) curve.note = "none";
      chart.curves.push_back(curve);
    }
    chart.x = decades("CPU, as multiple of the cheapest method's", {2.0, largest});
    chart.y = {"", 0.0, 1.0, false};
    chart.title = fmt::format("{} problems {} contacts", problems, has_contacts ? "with" : "without");
    chart.left = left, chart.top = kTop - 16.0, chart.width = 360.0, chart.height = 300.0;
    parts += draw(chart) + legend(chart.curves, left + chart.width + 16.0, chart.top + 8.0);
    left += chart.width + 16.0 + legend_width(chart.curves) + kGap;
  }
  return svg_page(left, kTop + 330.0, parts);
}

}  // namespace gravitas::study
