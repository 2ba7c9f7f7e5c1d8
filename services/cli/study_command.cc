// `gravitas study`.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/scene_options.h"
#include "services/cli/terminal.h"
#include "services/recorder/json.h"
#include "services/recorder/output_file.h"
#include "services/run/session.h"
#include "services/study/study.h"
#include "services/study/tables.h"

namespace gravitas::cli {
namespace {

struct StudyLine {
  study::Options options;
  std::string out;
  bool json = false, lists = false;
};

void write_file(const std::string& folder, const std::string& name, const std::string& text) {
  OutputFile file("study", (std::filesystem::path(folder) / name).string());
  file.write(text);
  file.close();
}

int run_study(StudyLine* line) {
  listen_to_interrupts();
  let_writes_fail();
  study::v1::Study result;
  {
    StatusLine progress;
    result = study::run(line->options, interrupted, [&](const study::Progress& now) {
      progress.show([&] { return fmt::format("{} of {} ladders; {}, {}", now.done, now.all, now.problem, now.method); });
    });
  }
  std::filesystem::create_directories(line->out);
  write_file(line->out, "study.csv", study::csv(result));
  return kDone;
}

}  // namespace

void add_study(CLI::App* app, Action* action) {
  const auto line = std::make_shared<StudyLine>();
  CLI::App* command = app->add_subcommand("study", "Error against run time of methods on problems");
  study::Options& options = line->options;
  command->add_option("--problems", options.problems, "")->delimiter(',')->allow_extra_args(false);
  command->add_option("--methods", options.methods, "")->delimiter(',')->allow_extra_args(false);
  add_list(command, "--scene", &options.scenes, "");
  command->add_flag("--short", options.is_short, "");
  command->add_option("--out", line->out, "")->required();
  command->callback([=] { *action = [=] { return run_study(line.get()); }; });
}

}  // namespace gravitas::cli
