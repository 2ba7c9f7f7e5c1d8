#include "services/check/check_text.h"

#include <fmt/format.h>

namespace gravitas::check {

std::string check_text(const report::v1::CheckReport& report) {
  const std::string place = report.library().empty() ? report.command() : report.library();
  std::string text = report.name().empty()
                         ? place + "\n"
                         : fmt::format("{} {}, slot {}: {}\n", report.name(), report.version(), report.slot(), place);
  for (const report::v1::CheckLevel& level : report.levels()) {
    const std::string passed =
        level.cases() == 0 ? "" : fmt::format("{} of {}", level.cases() - level.failed(), level.cases());
    std::string why = level.why();
    if (level.left_out() > 0) why = fmt::format("; {} not judged: {}", level.left_out(), why);
    text += fmt::format("{}  {:<10}  {:>8}  {:>8.2f} s  {}{}\n", level.level(), level.verdict(), passed,
                        level.seconds(), level.meaning(), level.left_out() > 0 ? why : "");
  }
  for (const report::v1::CheckFinding& finding : report.findings()) {
    text += fmt::format("\n{} {}: {}\n  {}\n", finding.level(), finding.case_(), finding.claim(), finding.text());
    if (!finding.call().empty()) text += fmt::format("  call   {}\n", finding.call());
    text += fmt::format("  again  {}\n", finding.again());
  }
  return text + (report.findings_size() > 0 ? "\n" : "") + report.badge() + '\n';
}

}  // namespace gravitas::check
