// `gravitas run` and `gravitas plan`.
#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>

#include "plugin_sdk/counted.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/scene_options.h"
#include "services/cli/terminal.h"
#include "services/recorder/json.h"
#include "services/run/fault_spec.h"
#include "services/run/report.h"
#include "services/run/resume_command.h"
#include "services/run/session.h"
#include "services/survey/instrumentation.h"

namespace gravitas::cli {
namespace {

struct RunLine {
  RunOptions options;
  SceneOptions scene{&options};
  bool progress = false, quiet = false, json = false;
};

std::string text_of(const Progress& progress) {
  return fmt::format("t = {:.2f} of {:.6g} s, step {} of {} ({:.0f} %)", progress.time, progress.duration,
                     progress.step, progress.steps, 100.0 * progress.step / progress.steps);
}

void print_checkpoint(const RunLine& line, const RunResult& result) {
  // it may have gone with its folder, whatever was put into it
  if (std::error_code none; !std::filesystem::is_regular_file(result.checkpoint, none)) return;
  std::cerr << fmt::format("gravitas: checkpoint '{}' holds step {}; to go on: {}\n", result.checkpoint,
                           result.checkpoint_step,
                           resume_command(line.options, line.scene.hosting_words(), result.checkpoint));
}

void print_warnings(const google::protobuf::RepeatedPtrField<std::string>& warnings) {
  for (const std::string& warning : warnings) std::cerr << warning << '\n';
}

int run_scene(RunLine* line) {
  line->scene.apply();
  listen_to_interrupts();
  let_writes_fail();
  RunResult result;
  {
    StatusLine progress(line->progress && !line->quiet);
    result = run(line->options, interrupted, [&](const Progress& now) {
      if (!line->quiet) progress.show([&] { return text_of(now); });
    });
  }
  if (!line->quiet) print_warnings(result.report.warnings());
  if (line->json) {
    std::cout << to_json(result.report, JsonForm::kPage);
  } else if (!line->quiet) {
    std::cout << result.summary;
  }
  switch (result.outcome) {
    case RunOutcome::kCompleted:
      return kDone;
    case RunOutcome::kPaused:
      std::cerr << "gravitas: " << result.fault << "\n";
      print_checkpoint(*line, result);
      return kPaused;
    case RunOutcome::kInterrupted:
      std::cerr << fmt::format("gravitas: interrupted after step {}; what was computed is kept\n",
                               result.report.steps());
      print_checkpoint(*line, result);
      return kInterrupted;
    case RunOutcome::kFailed:
      break;
  }
  std::cerr << fmt::format("gravitas: stopped after step {}: {}\n", result.report.steps(), result.fault);
  print_checkpoint(*line, result);
  return result.is_bad_input ? kBadInput : kOurFault;
}

std::string process_of(const report::v1::PlannedSlot& slot) {
  if (slot.process() == 0) return "this one";
  const std::string standby = slot.standby() > 0 ? " and " + counted(slot.standby(), "standby", "standbys") : "";
  return fmt::format("worker {}{}", slot.process(), standby);
}

int plan_scene(RunLine* line) {
  line->scene.apply();
  std::vector<std::string> warnings;
  scene::v1::Scene scene;
  const kernel::EnvironmentDescription description = load(line->options, &warnings, nullptr, &scene);
  for (const std::string& warning : warnings) std::cerr << warning << '\n';
  report::v1::Plan plan = plan_message(*start(description, kernel::start_host, &scene), description);
  // the workers that were started to find out are gone again
  for (report::v1::PlannedSlot& slot : *plan.mutable_slots()) slot.set_pid(0);
  if (line->json) {
    std::cout << to_json(plan, JsonForm::kPage);
    return kDone;
  }
  std::cout << fmt::format("{:<21} {:<20} {:<8} {}\n", "slot", "plugin", "hosting", "process");
  for (const report::v1::PlannedSlot& slot : plan.slots())
    std::cout << fmt::format("{:<21} {:<20} {:<8} {}\n", slot.slot(), slot.plugin(), slot.hosting(), process_of(slot));
  for (const report::v1::LeftOut& out : plan.left_out())
    std::cout << fmt::format("{:<21} left out: {}\n", out.what(), out.why());
  return kDone;
}

}  // namespace

void add_run(CLI::App* app, Action* action) {
  const auto line = std::make_shared<RunLine>();
  CLI::App* command = app->add_subcommand("run", "Simulate a scene");
  command->footer(
      "Example: gravitas run deploy/scenes/two_spheres_motor.gravitas --report report.json\n"
      "         gravitas run deploy/scenes/two_spheres_motor.gravitas --edit 'remove "
      "Constraint.MyAngularMotor@step=200' --event-kinds all --events events.jsonl\n\nFaults:\n" +
      fault_help());
  line->scene.add_to(command);
  RunOptions& options = line->options;
  command->add_option("--trajectory", options.trajectory, "Write the trajectory to this file (CSV)");
  command
      ->add_option(
          "--sample-every", options.sample_every,
          "Interval of the samples of trajectory, instrumentation, reactions and joints, s: of each multiple the "
          "first end of a step "
          "at or after it, and the last; every step if absent")
      ->check(any_number("a finite number of seconds > 0"));
  command->add_option("--report", options.report, "Write the report to this file (JSON)");
  command->add_option(
      "--reactions", options.reactions,
      "Write the force of each joint and contact that is awake, and joints' torque, to this file (JSON "
      "lines, the mean over "
      "the step that ends with the sample, with Smooth at its end); the report then has those of the last step");
  command->add_option("--joints", options.joints,
                      "Write the coordinates of each joint that holds, and their rates, to this file (CSV, "
                      "time,joint,coordinate,value,rate in m or rad), sampled like the trajectory; `gravitas describe` "
                      "tells which there are: the angle of a hinge, zero and sign as its limits have them");
  command->add_option("--events", options.events, "Write the events to this file (JSON lines)");
  add_event_options(command, "--event-kinds", &options.event_kinds, &options.ongoing_rate);
  CLI::Option* instrumentation = command->add_option(
      "--instrumentation", options.instrumentation,
      "Write debug geometry to this file: JSON lines, a frame per sample; NAME.svg: a picture of the last state");
  std::string kinds;
  for (const survey::Kind kind : survey::all_kinds()) kinds += (kinds.empty() ? "" : ", ") + survey::kind_name(kind);
  command
      ->add_option("--instrumentation-kinds", options.instrumentation_kinds,
                   "What it shows, separated by commas: " + kinds + "; all if absent")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->needs(instrumentation);
  CLI::Option* checkpoint = command->add_option(
      "--checkpoint", options.checkpoint,
      "Keep a checkpoint in this file (replaced as a whole) and a journal in FILE.journal: at the start, where the run "
      "ends, and as --checkpoint-every says");
  command->add_option("--checkpoint-every", options.checkpoint_every, "Steps between checkpoints, counted from t = 0")
      ->check(whole_number(1))
      ->needs(checkpoint);
  command->add_option("--resume", options.resume,
                      "Go on from this checkpoint; --steps and --duration count from t = 0. Files of output hold what "
                      "follows it");
  add_despite_journal(command, &options);
  add_list(command, "--swap", &options.swaps,
           "Exchange a plugin while the simulation runs: SLOT=PLUGIN@step=N[,hosting=MODE], before step N (from 1, so "
           "at (N - 1) TimeStep); repeatable");
  add_list(
      command, "--edit", &options.edits,
      "Change the scene while the simulation runs, before step N (from 1, so at (N - 1) TimeStep): \"add "
      "FILE@step=N\", \"remove Body.Ball@step=N\", \"set Body.Ball.Position={0,1,0}@step=N\"; FILE "
      "holds Geometries, Materials, Forces, Bodies, Constraints; changes before the same step are one; repeatable");
  add_comparisons(command, &options.comparisons);
  add_list(command, "--rerun", &options.reruns,
           "Ask another process the same in every N-th step and take the majority's bytes: SLOT=N; repeatable");
  add_list(command, "--fault", &options.faults, "Inject a fault: SLOT:KIND@step=N[,arg=...]; repeatable");
  command->add_flag("--json", line->json, "Print the report instead of the summary");
  command->add_flag("--progress", line->progress, "Show progress from the start");
  command->add_flag("--quiet", line->quiet, "Print nothing but errors");
  command->callback([=] { *action = [=] { return run_scene(line.get()); }; });
}

void add_plan(CLI::App* app, Action* action) {
  const auto line = std::make_shared<RunLine>();
  CLI::App* command =
      app->add_subcommand("plan", "Print the pipeline that a scene needs, and what is left out and why");
  command->footer("Example: gravitas plan deploy/scenes/two_spheres_motor.gravitas");
  line->scene.add_to(command);
  command->add_flag("--json", line->json, "Print JSON");
  command->callback([=] { *action = [=] { return plan_scene(line.get()); }; });
}

}  // namespace gravitas::cli
