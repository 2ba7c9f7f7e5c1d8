#include "services/study/diagram.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "services/recorder/svg.h"
#include "services/study/analysis.h"
#include "services/study/chart.h"
#include "services/study/method.h"

namespace gravitas::study {
namespace {

constexpr double kLeast = 1e-16;  // no error is shown smaller
constexpr double kTop = 76.0, kLeft = 62.0, kGap = 66.0, kMargin = 14.0;

using Styles = std::map<std::string, std::size_t>;

// Of a method that is offered, as far as it is free: its place among those that are offered beside it.
std::optional<std::size_t> usual_style(const std::string& name) {
  std::size_t with_contacts = 0, without = 0;
  for (const Method& method : offered_methods()) {
    const bool is_of_motion = (method.tasks & (kMotion | kStiff)) != 0;
    if (method.name() == name) return is_of_motion ? without : with_contacts;
    if (is_of_motion) ++without;
    if ((method.tasks & kContacts) != 0) ++with_contacts;
  }
  return std::nullopt;
}

// The same of a method in all diagrams, another one than that of any method that stands beside it in one of them.
Styles styles_of(const v1::Study& study) {
  // diagrams of problems without contacts (1) and with (2)
  const auto bit = [](const v1::Problem& problem) { return problem.has_contacts() ? 2U : 1U; };
  std::map<std::string, unsigned> stands_in;
  for (const v1::Problem& problem : study.problems())
    for (const v1::Ladder& ladder : problem.ladders()) stands_in[ladder.method()] |= bit(problem);
  Styles styles;
  std::map<std::size_t, unsigned> taken;  // in which diagrams
  // what others are given, those that are offered do not miss
  for (const bool is_offered : {true, false})
    for (const v1::Problem& problem : study.problems())
      for (const v1::Ladder& ladder : problem.ladders()) {
        const std::string& method = ladder.method();
        const std::optional<std::size_t> usual = usual_style(method);
        if (usual.has_value() != is_offered || styles.contains(method)) continue;
        const auto is_taken = [&](std::size_t style) { return (taken[style] & stands_in[method]) != 0; };
        std::size_t style = usual.value_or(0);
        if (is_taken(style))
          for (style = 0; is_taken(style);) ++style;
        taken[style] |= stands_in[method];
        styles[method] = style;
      }
  return styles;
}

using Work = std::function<double(const v1::Rung&)>;

Curve curve_of(const v1::Ladder& ladder, const Styles& styles, const Work& work) {
  Curve curve{ladder.method(), styles.at(ladder.method()), {}};
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

Chart chart_of(const v1::Problem& problem, const Styles& styles, const std::string& title, const Work& work) {
  Chart chart;
  std::vector<double> errors = {1.0, std::max(problem.uncertainty(), kLeast)}, costs;
  for (const v1::Ladder& ladder : problem.ladders()) {
    chart.curves.push_back(curve_of(ladder, styles, work));
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

std::string diagram(const v1::Study& study, const v1::Problem& problem) {
  const double duration = problem.duration();
  const Styles styles = styles_of(study);
  Chart time = chart_of(problem, styles, "CPU s per simulated s",
                        [&](const v1::Rung& rung) { return rung.cpu_median() / duration; });
  Chart work = chart_of(problem, styles, "evaluations per simulated s (derivatives and iterations of solvers)",
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

std::string profile_diagram(const v1::Study& study) {
  std::string parts =
      svg_text(14.0, 26.0, fmt::format("Share of problems solved to {:g}", kProfileError), "font-size=\"17\"");
  const Styles styles = styles_of(study);
  double left = kLeft;
  for (const bool has_contacts : {false, true}) {
    std::size_t problems = 0;
    const std::vector<Profile> all = profiles(study, has_contacts, kProfileError, &problems);
    if (all.empty()) continue;
    Chart chart;
    double largest = 10.0;
    for (const Profile& profile : all) {
      Curve curve{profile.method, styles.at(profile.method), {}};
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
