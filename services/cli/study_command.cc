// `gravitas study`.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/scene_options.h"
#include "services/cli/terminal.h"
#include "services/recorder/json.h"
#include "services/recorder/output_file.h"
#include "services/run/session.h"
#include "services/study/analysis.h"
#include "services/study/diagram.h"
#include "services/study/gate.h"
#include "services/study/method.h"
#include "services/study/stability_diagram.h"
#include "services/study/study.h"
#include "services/study/tables.h"

namespace gravitas::cli {
namespace {

struct StudyLine {
  study::Options options;
  std::string out, gate;
  bool json = false, lists = false;
};

// Its files, which are there before anything is computed, so that nothing is computed for a folder that cannot be written.
class StudyFolder {
 public:
  explicit StudyFolder(const std::string& path) : path_(path) {
    std::error_code problem;
    is_new_ = std::filesystem::create_directories(path, problem);
    try {
      table_.emplace("study", (path_ / "study.csv").string(), OutputFile::Allowed::kOrdinary);
    } catch (const std::exception& error) {
      throw BadInput(error.what());
    }
  }

  // What was made for nothing goes again.
  ~StudyFolder() {
    table_->discard();
    table_.reset();
    std::error_code problem;
    if (is_new_) std::filesystem::remove(path_, problem);
  }
  StudyFolder(const StudyFolder&) = delete;
  StudyFolder& operator=(const StudyFolder&) = delete;

  void write(const study::v1::Study& study) {
    table_->write(study::csv(study));
    table_->close();
    if (study.limits_size() > 0) {
      write("stability.csv", study::stability_csv(study));
      write("stability.svg", study::stability_diagram(study));
    }
    for (const study::v1::Problem& problem : study.problems())
      write(problem.name() + ".svg", study::diagram(study, problem));
    if (study::has_profiles(study)) write("profile.svg", study::profile_diagram(study));
    write("STUDY.md", study::page(study));
  }

 private:
  void write(const std::string& name, const std::string& text) {
    OutputFile file("study", (path_ / name).string(), OutputFile::Allowed::kOrdinary);
    file.write(text);
    file.close();
  }

  std::filesystem::path path_;
  bool is_new_ = false;
  std::optional<OutputFile> table_;
};

int list_study(bool json) {
  const study::v1::Study all = study::list();
  if (json) {
    std::cout << to_json(all, JsonForm::kPage);
    return kDone;
  }
  std::cout << fmt::format("{:<20} {:<9} {}\n", "problem", "family", "error against");
  for (const study::v1::Problem& problem : all.problems())
    std::cout << fmt::format("{:<20} {:<9} {}\n", problem.name(), problem.family(), problem.reference());
  std::cout << fmt::format("\n{:<40} {:<10} {:<7} {}\n", "method", "climbs", "order", "problems");
  for (const study::Method& method : study::offered_methods()) {
    std::string tasks;
    for (const auto& [task, word] : {std::pair{study::kMotion, "motion"}, std::pair{study::kStiff, "stiff"},
                                     std::pair{study::kContacts, "contacts"}})
      if ((method.tasks & task) != 0) tasks += (tasks.empty() ? "" : ", ") + std::string(word);
    std::cout << fmt::format("{:<40} {:<10} {:<7} {}\n", method.name(),
                             method.climbs_accuracy() ? "Accuracy" : "TimeStep",
                             method.order > 0.0 ? fmt::format("{:g}", method.order) : "-", tasks);
  }
  return kDone;
}

// The demands of --gate, or the built-in ones, which are of whole ladders.
std::vector<study::Demand> demands_of(const StudyLine& line) {
  if (line.gate.empty()) return line.options.rungs == 0 ? study::built_in_demands() : std::vector<study::Demand>();
  std::vector<std::string> problems;
  for (const std::string& scene : line.options.scenes) problems.push_back(study::problem_name(scene));
  // a part of a name is no name; whole ones may be of plugins that scenes bring along
  const Catalog installed = Catalog::installed(installed_worker(), installed_plugins());
  std::vector<std::string> methods;
  for (const std::string& word : line.options.methods) {
    if (std::ranges::count(word, '/') >= 2) {
      methods.push_back(word);
      continue;
    }
    for (const study::Method& method : study::named_methods({word}, installed)) methods.push_back(method.name());
  }
  return study::read_demands(line.gate, problems, methods);
}

int run_study(StudyLine* line) {
  if (line->lists) return list_study(line->json);
  listen_to_interrupts();
  let_writes_fail();
  const std::vector<study::Demand> demands = demands_of(*line);
  study::v1::Study result;
  {
    StatusLine progress;
    StudyFolder folder(line->out);
    result = study::run(line->options, interrupted, [&](const study::Progress& now) {
      progress.show(
          [&] { return fmt::format("{} of {} ladders; {}, {}", now.done, now.all, now.problem, now.method); });
    });
    study::apply_gate(demands, &result);
    folder.write(result);
  }
  std::cout << (line->json ? to_json(result, JsonForm::kPage) : study::summary(result));
  if (result.is_interrupted()) {
    std::cerr << "gravitas: interrupted; what was computed is kept\n";
    return kInterrupted;
  }
  return study::is_passed(result) ? kDone : kExaminedFailed;
}

}  // namespace

void add_study(CLI::App* app, Action* action) {
  const auto line = std::make_shared<StudyLine>();
  CLI::App* command = app->add_subcommand("study",
                                          "Error against run time: methods climb ladders of settings on problems with "
                                          "known answers, or on a scene of your own");
  command->footer(
      "Writes DIR/STUDY.md (tables, what was observed against theory), DIR/study.csv (every run), a diagram a problem "
      "and "
      "profile.svg, stability.csv and stability.svg.\n"
      "Errors and evaluations are the same on every machine, times are not. Exit code 4: the gate is not "
      "passed, as by an observed order more than 0.2 off the theory, an error above its bound, or what was demanded "
      "and "
      "not run; times are not judged.\n"
      "A file of --gate holds a line a demand: error PROBLEM METHOD LARGEST; order PROBLEM METHOD LOWEST HIGHEST; "
      "evaluations PROBLEM METHOD ERROR LARGEST.\n"
      "Example: gravitas study --short --out study\n"
      "         gravitas study --scene my_robot.gravitas --out study\n"
      "         gravitas study --problems heavy_top,stiff --methods RK4,Smooth/Radau/Direct --out study");
  study::Options& options = line->options;
  command
      ->add_option("--problems", options.problems,
                   "Names or families (smooth, contact, stiff, extreme), separated by commas; all that are shipped if "
                   "neither these nor --scene is given; --list names them")
      ->delimiter(',')
      ->allow_extra_args(false);
  command
      ->add_option("--methods", options.methods,
                   "Names or parts of them, separated by commas: RK4, Smooth/RK4, Continuous/Verlet/Newton; or "
                   "SIMULATOR/INTEGRATOR/SOLVER of any installed plugins; what suits each problem if absent")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_list(
      command, "--scene", &options.scenes,
      "Study a scene of your own, over its Duration and from four times its TimeStep down: its errors are measured "
      "against itself by a far finer method, so that what all its settings share stays unseen; repeatable");
  command->add_flag("--short", options.is_short,
                    "At most three minutes of CPU, which a busy machine takes longer for: runs of at most 0.25 s, "
                    "accuracies by 10 instead of sqrt(10)");
  command->add_option("--run-seconds", options.run_seconds, "CPU that one run may take, s; 4, or 0.25 if --short")
      ->check(seconds_between(1e-3, 1e6));
  command
      ->add_option("--rungs", options.rungs, "Settings of a ladder, at most; 12 time steps and 23 accuracies if absent")
      ->check(whole_number(3, 20));
  command->add_option("--gate", line->gate,
                      "File of demands instead of the built-in ones, which are of whole ladders: none with --rungs");
  CLI::Option* out = command->add_option("--out", line->out, "Folder for what is written");
  command->add_flag("--list", line->lists, "Print problems and methods instead");
  command->add_flag("--json", line->json, "Print JSON");
  command->callback([=] {
    if (out->empty() && !line->lists) throw CLI::RequiredError("--out or --list");
    *action = [=] { return run_study(line.get()); };
  });
}

}  // namespace gravitas::cli
