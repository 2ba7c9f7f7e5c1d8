#include "services/campaign/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "plugin_sdk/counted.h"
#include "services/recorder/svg.h"

namespace gravitas::campaign {
namespace {

std::string cell(std::uint64_t count, const char* colour) {
  return count == 0 ? "<td>0</td>" : fmt::format("<td style=\"background:{}\">{}</td>", colour, count);
}

// Bars on a logarithmic axis of time, ten to a decade from 10 us to 100 s.
std::string histogram(const std::vector<double>& standby, const std::vector<double>& cold_start) {
  constexpr int kPerDecade = 10, kDecades = 7, kBars = kPerDecade * kDecades, kWidth = 10, kHeight = 160;
  const auto count = [](const std::vector<double>& values) {
    std::array<std::uint64_t, kBars> bars{};
    for (const double value : values) {
      const double place = kPerDecade * (std::log10(std::max(value, 10.0)) - 1.0);
      ++bars[static_cast<std::size_t>(std::min(place, kBars - 1.0))];
    }
    return bars;
  };
  const auto warm = count(standby), cold = count(cold_start);
  std::uint64_t largest = 1;
  for (std::size_t i = 0; i < kBars; ++i) largest = std::max(largest, warm[i] + cold[i]);
  std::string svg = fmt::format("<svg width=\"{}\" height=\"{}\">", kBars * kWidth, kHeight + 20);
  for (std::size_t i = 0; i < kBars; ++i) {
    const double scale = static_cast<double>(kHeight) / static_cast<double>(largest);
    const double low = scale * static_cast<double>(warm[i]), high = scale * static_cast<double>(cold[i]);
    const auto bar = [&](double from, double height, const char* colour) {
      if (height <= 0.0) return;
      svg += fmt::format("<rect x=\"{}\" y=\"{:.1f}\" width=\"{}\" height=\"{:.1f}\" fill=\"{}\"/>", i * kWidth,
                         kHeight - from - height, kWidth - 1, height, colour);
    };
    bar(0.0, low, "#2a7");
    bar(low, high, "#27a");
  }
  constexpr std::array<const char*, kDecades> kNames = {"10 us", "100 us", "1 ms", "10 ms", "100 ms", "1 s", "10 s"};
  for (std::size_t i = 0; i < kDecades; ++i)
    svg += fmt::format("<text x=\"{}\" y=\"{}\">{}</text>", i * kPerDecade * kWidth, kHeight + 15, kNames[i]);
  return svg + "</svg>";
}

}  // namespace

std::string page(const v1::Table& table, const Tally& tally) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"/><title>Fault campaign</title>\n<style>"
      "body{{font:15px sans-serif;margin:2em}} table{{border-collapse:collapse}} "
      "td,th{{border:1px solid #ccc;padding:4px 10px;text-align:right}} th:first-child,td:first-child"
      "{{text-align:left}} text{{font:11px sans-serif}}</style></head><body>\n"
      "<h1>Fault campaign: {}</h1>\n<p>{} injected, {} manifested, in {}; {} tier, seed {}, {:.1f} s. {}"
      "</p>\n",
      table.forbidden() == 0 ? "nothing forbidden happened" : "something forbidden happened",
      counted(table.injected(), "fault"), table.manifested(), counted(table.trials(), "trial"), table.tier(),
      table.seed(), table.seconds(),
      table.forbidden() == 0
          ? fmt::format("With 95 % confidence at most {:.2g} of faults end so.", table.forbidden_bound())
          : counted(table.forbidden(), "trial") + " with a forbidden end.");
  html +=
      "<table><tr><th>group</th><th>injected</th><th>masked</th><th>recovered, bit for bit</th><th>fallback</th>"
      "<th>paused, resumable</th><th>needs re-run</th><th>not caught</th><th>forbidden</th></tr>\n";
  for (const v1::Row& row : table.rows())
    html +=
        fmt::format("<tr><td>{}</td><td>{}</td>{}{}{}{}{}{}{}</tr>\n", in_markup(row.group()), row.injected(),
                    cell(row.masked(), "#e6f4ea"), cell(row.recovered(), "#b7e1c0"), cell(row.fallback(), "#fff2b3"),
                    cell(row.paused(), "#ffe0a3"), cell(row.needs_rerun(), "#d9e2f3"),
                    cell(row.not_caught(), "#f6cf9b"), cell(row.forbidden(), "#f28b82"));
  html += "</table>\n";
  if (table.tier() == "real") {
    html += fmt::format(
        "<h2>From noticing a failure to the good answer</h2>\n<p>Green: a standby answered, median {:.0f} us, p99 "
        "{:.0f} us, {}. Blue: a cold start, median {:.0f} us, p99 {:.0f} us, {}. Swaps paused the "
        "simulation for {:.0f} us (median of {}).</p>\n",
        table.standby().median(), table.standby().p99(), counted(table.standby().count(), "time"),
        table.cold_start().median(), table.cold_start().p99(), counted(table.cold_start().count(), "time"),
        table.swap_pause().median(), table.swap_pause().count());
    html += histogram(tally.standby(), tally.cold_start());
  }
  if (!table.failures().empty()) html += "<h2>To see each again</h2>\n<pre>";
  for (const std::string& failure : table.failures()) html += in_markup(failure) + "\n";
  if (!table.failures().empty()) html += "</pre>\n";
  return html + "</body></html>\n";
}

}  // namespace gravitas::campaign
