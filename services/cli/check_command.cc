// `gravitas check`.
#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "services/check/check_text.h"
#include "services/check/describe.h"
#include "services/check/examination.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/terminal.h"
#include "services/recorder/json.h"
#include "services/run/session.h"

namespace gravitas::cli {
namespace {

std::string text_of(const check::Progress& progress) {
  std::string text = fmt::format("{} {}", progress.level, progress.name);
  if (progress.all > 0) text += fmt::format(", call {} of {}", progress.done, progress.all);
  return text;
}

struct CheckArguments {
  std::string plugin;
  check::Options options;
  bool json = false;
};

// A level or case that does not exist would leave nothing to fail.
void demand_known(const check::Options& options, const PluginDeclaration& declaration) {
  if (options.only_case.empty()) return;
  std::string names;
  for (const check::CheckCase& one : check::all_cases(declaration)) {
    if (one.name == options.only_case) return;
    names += "\n  " + one.name;
  }
  throw BadInput(fmt::format("--case {}: this plugin has no such case; allowed:{}", options.only_case, names));
}

int check_plugin(const CheckArguments& arguments) {
  listen_to_interrupts();
  check::Examinee examinee = check::find_examinee(arguments.plugin);
  check::complete(&examinee, arguments.options.quick);
  if (examinee.problem.empty()) demand_known(arguments.options, examinee.declaration);
  report::v1::CheckReport report;
  {
    StatusLine line;
    report = check::examine(
        examinee, arguments.options, [&](const check::Progress& now) { line.show([&] { return text_of(now); }); },
        interrupted);
  }
  std::cout << (arguments.json ? to_json(report, JsonForm::kPage) : check::check_text(report));
  if (interrupted()) return kInterrupted;
  return report.conforms() ? kDone : kExaminedFailed;
}

}  // namespace

void add_check(CLI::App* app, Action* action) {
  const auto arguments = std::make_shared<CheckArguments>();
  CLI::App* command = app->add_subcommand("check", "Judge a plugin by the contract that every plugin keeps");
  command->footer(
      "Levels: C0 handshake, C1 wire, C2 purity, C3 state, C4 limits, C5 numbers. Exit code 0: it conforms, 4: it does "
      "not, or that is not decided, 2: it is no plugin.\n"
      "Example: gravitas check build/release/lib/gravitas/hello.so --quick\n"
      "         gravitas check 'python3 my_worker.py'");
  command
      ->add_option("PLUGIN", arguments->plugin,
                   "A plugin library, a command that starts a worker, or the name of an installed plugin")
      ->required();
  CLI::Option* quick = command->add_flag(
      "--quick", arguments->options.quick,
      "Few calls, and the short cases only: some two seconds. Of a plugin whose calls are slow what 20 s (a "
      "command: 60 s) do not suffice for is not judged");
  command
      ->add_option("--quick-limit", arguments->options.quick_limit,
                   "With --quick: these seconds instead of 20 or 60; each call has as much longer, up to what it has "
                   "without --quick")
      ->check(seconds_between(1e-3, 1e6))
      ->needs(quick);
  CLI::Option* level = command->add_option("--level", arguments->options.level, "Judge this level only: C0 to C5")
                           ->check(CLI::IsMember({"C0", "C1", "C2", "C3", "C4", "C5"}));
  command->add_option("--case", arguments->options.only_case, "Judge this case only, as a finding names it")
      ->excludes(level);
  command->add_option("--calls", arguments->options.calls, "Calls of level C4")
      ->check(whole_number(300, 1'000'000'000))
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([=] { *action = [=] { return check_plugin(*arguments); }; });
}

}  // namespace gravitas::cli
