// `gravitas capture`, `gravitas replay` and `gravitas bisect`: a plugin's calls, kept and asked again.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "plugin_sdk/counted.h"
#include "services/capsule/capsule.h"
#include "services/capsule/recording_host.h"
#include "services/capsule/replay.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/scene_options.h"
#include "services/cli/terminal.h"
#include "services/recorder/json.h"
#include "services/run/exchange_spec.h"
#include "services/run/report.h"
#include "services/run/session.h"

namespace gravitas::cli {
namespace {

struct CaptureLine {
  RunOptions options;
  SceneOptions scene{&options};
  std::shared_ptr<capsule::Tape> tape = std::make_shared<capsule::Tape>();
  std::string slot;
};

int capture(CaptureLine* line) {
  line->scene.apply();
  capsule::Tape& tape = *line->tape;
  tape.slot = parse_slot("--slot", line->slot, line->slot);
  listen_to_interrupts();
  let_writes_fail();
  std::shared_ptr<capsule::Writer> writer;
  try {
    tape.writer = writer =
        std::make_shared<capsule::Writer>(line->options.capsule, capsule_header(line->options, tape.slot));
  } catch (const std::runtime_error& problem) {
    throw BadInput(problem.what());
  }
  line->options.starter = capsule::recording(line->tape);
  const auto is_enough = [&] { return writer->calls() >= tape.most_calls; };
  RunResult result;
  {
    StatusLine count;
    result = run(
        line->options, [&] { return interrupted() || is_enough() || !tape.problem.empty(); },
        [&](const Progress& now) {
          tape.step = now.step + 1;
          count.show([&] { return fmt::format("step {} of {}, {} calls", now.step, now.steps, writer->calls()); });
        });
  }
  for (const std::string& warning : result.report.warnings()) std::cerr << warning << '\n';
  if (!tape.problem.empty()) {
    std::cerr << fmt::format("gravitas: {}\n", tape.problem);
    return kOurFault;
  }
  writer->close();
  std::cout << fmt::format("{}: {} of slot {} in {}\n", line->options.capsule, counted(writer->calls(), "call"),
                           line->slot, counted(result.report.steps(), "step"));
  if (writer->calls() == 0 && tape.first_step > result.report.steps()) {
    std::cerr << fmt::format("gravitas: --from-step {}: the run ended after step {}\n", tape.first_step,
                             result.report.steps());
    return kBadInput;
  }
  if (writer->calls() == 0) {
    std::cerr << fmt::format(
        "gravitas: slot {} was not asked: `gravitas plan` says why; and hosted direct, a slot is not asked about "
        "nothing\n",
        line->slot);
    return kBadInput;
  }
  if (result.outcome == RunOutcome::kCompleted || is_enough()) return kDone;
  if (result.outcome == RunOutcome::kInterrupted) return kInterrupted;
  std::cerr << fmt::format("gravitas: {}\n", result.fault);
  return result.outcome == RunOutcome::kPaused ? kPaused : kOurFault;
}

struct ReplayLine {
  capsule::ReplayOptions options;
  std::string hosting = "shm", plugin, other;
  bool json = false;
};

// " to within 1e-09", or nothing: bit for bit.
std::string closeness(const report::v1::ReplayReport& report) {
  return report.tolerance() == 0.0 ? std::string() : fmt::format(" to within {:g}", report.tolerance());
}

// Of those that are the same.
std::string refused_text(const report::v1::ReplayReport& report) {
  if (report.refused() == 0) return {};
  return fmt::format(" ({} refused, by which the run asked for less of the step)", report.refused());
}

// The first call that differs, and how far all answers are apart.
void print_findings(const report::v1::ReplayReport& report) {
  if (!report.note().empty()) std::cerr << fmt::format("capsule '{}': {}\n", report.capsule(), report.note());
  if (report.left_out() > 0)
    std::cout << fmt::format("{} left out, as {}\n", counted(report.left_out(), "call"),
                             fmt::join(report.left_out_because(), "; "));
  if (!report.remark().empty()) std::cout << report.remark() << '\n';
  if (report.has_first())
    std::cout << fmt::format("first: call {} ({}, step {}): {}\n", report.first().call(), report.first().method(),
                             report.first().step(), report.first().text());
  for (const report::v1::Disagreement& one : report.disagreements())
    std::cout << fmt::format("  {}\n", disagreement_text(one));
}

std::function<bool(std::uint32_t)> progress_of(StatusLine* line) {
  return [line](std::uint32_t number) {
    line->show([&] { return fmt::format("call {}", number); });
    return !interrupted();
  };
}

void print_solutions(const report::v1::ReplayReport& report) {
  if (report.solutions().empty()) return;
  std::cout << fmt::format("{:>6} {:>6} {:>6} {:>13} {:>8} {:>10} {:>12}  {}\n", "call", "step", "bodies",
                           "discrepancies", "contacts", "iterations", "residual m/s", "stopped");
  for (const report::v1::SolverOutcome& one : report.solutions())
    std::cout << fmt::format("{:>6} {:>6} {:>6} {:>13} {:>8} {:>10} {:>12.3g}  {}\n", one.call(), one.step(),
                             one.bodies(), one.discrepancies(), one.contacts(), one.iterations(), one.residual(),
                             one.stop_reason());
}

// A damaged capsule shows nothing of the calls that cannot be read.
int verdict(const report::v1::ReplayReport& report, std::uint64_t failures) {
  if (failures > 0) return kExaminedFailed;
  if (report.calls() == 0) std::cerr << fmt::format("capsule '{}': it holds no calls\n", report.capsule());
  if (report.calls() == 0) return kBadInput;
  return report.note().empty() ? kDone : kBadInput;
}

int replay(ReplayLine* line) {
  line->options.hosting = parse_hosting_mode("--hosting", line->hosting, line->hosting);
  if (!line->plugin.empty()) line->options.plugin = line->plugin;
  listen_to_interrupts();
  report::v1::ReplayReport report;
  {
    StatusLine count;
    report = capsule::replay(line->options, progress_of(&count));
  }
  if (line->json) {
    std::cout << to_json(report, JsonForm::kPage);
  } else {
    for (const std::string& plugin : report.plugins()) std::cout << plugin << '\n';
    print_solutions(report);
    std::cout << fmt::format("{}: {} same{}{}, {} different", counted(report.calls(), "call"), report.same(),
                             closeness(report), refused_text(report), report.different());
    if (report.failed_again() > 0) std::cout << fmt::format(", {} failed again", report.failed_again());
    if (report.answered_now() > 0)
      std::cout << fmt::format(", {} failed then and are answered now", report.answered_now());
    if (report.not_judged() > 0)
      std::cout << fmt::format(", {} broke a law of physics then, which is not judged now", report.not_judged());
    std::cout << '\n';
    print_findings(report);
  }
  if (interrupted()) return kInterrupted;
  const int code = verdict(report, report.different() + report.failed_again());
  return code == kDone && report.not_judged() > 0 ? kBadInput : code;
}

int bisect(ReplayLine* line) {
  line->options.hosting = parse_hosting_mode("--hosting", line->hosting, line->hosting);
  line->options.plugin = line->plugin;
  listen_to_interrupts();
  report::v1::ReplayReport report;
  {
    StatusLine count;
    report = capsule::bisect(line->options, line->other, progress_of(&count));
  }
  if (line->json) {
    std::cout << to_json(report, JsonForm::kPage);
  } else {
    std::cout << fmt::format("{} answered alike{}{}", counted(report.same(), "call"), closeness(report),
                             refused_text(report));
    if (report.failed_again() > 0) std::cout << fmt::format(", {} failed alike", report.failed_again());
    std::cout << (report.different() == 0 ? "\n" : ", then a difference\n");
    print_findings(report);
  }
  if (interrupted()) return kInterrupted;
  return verdict(report, report.different() + report.failed_again());
}

void add_replay_options(CLI::App* command, ReplayLine* line) {
  command->add_option("FILE", line->options.file, "A capsule")->required();
  command->add_option(
      "--hosting", line->hosting,
      "Where the plugin is asked: shm, grpc, or direct: in this process, for a debugger, a sanitizer or "
      "a profiler [shm]");
  command->add_option("--deadline", line->options.deadline, "Of a call, s [2]")->check(positive_seconds());
  command->add_option("--call", line->options.only, "That call alone, counted from 1")->check(whole_number(1));
  command
      ->add_option("--tolerance", line->options.tolerance,
                   "Answers so close are the same: each real number to that part of the largest magnitude of its "
                   "column in the capsule, integers to the bit; what solvers and integrators say of their work "
                   "(iterations, residual) is no difference then. 0: bit for bit [0]")
      ->check(number_from_zero());
  command->add_flag(
      "--physics", line->options.with_physics,
      "Hold answers against laws of physics, too, as a run with CheckPhysicsEvery does; a request that was "
      "kept because its answer broke one is without that");
  command->add_flag("--json", line->json, "Print JSON");
}

}  // namespace

void add_capture(CLI::App* app, Action* action) {
  const auto line = std::make_shared<CaptureLine>();
  CLI::App* command = app->add_subcommand("capture", "Record the calls of a slot in a run");
  command->footer(
      "Example: gravitas capture deploy/scenes/two_spheres_motor.gravitas --slot solver --out solver.capsule\n"
      "         gravitas replay solver.capsule");
  line->scene.add_to(command);
  command->add_option("--slot", line->slot, "space, collision, constraint, force, solver or integrator")->required();
  command->add_option("--out", line->options.capsule, "The capsule's file")->required();
  command->add_option("--from-step", line->tape->first_step, "First step whose calls are kept [1]")
      ->check(whole_number(1));
  command->add_option("--calls", line->tape->most_calls, "Stop after so many calls")->check(whole_number(1));
  command->callback([=] { *action = [=] { return capture(line.get()); }; });
}

void add_replay(CLI::App* app, Action* action) {
  const auto line = std::make_shared<ReplayLine>();
  CLI::App* command = app->add_subcommand("replay", "Ask a plugin alone what a capsule holds, and compare the answers");
  command->footer(
      "Example: gravitas replay solver.capsule --plugin build/mine/solver_mine.so\n"
      "         gdb --args gravitas replay solver.capsule --hosting direct --call 17\n"
      "         gravitas replay solver.capsule --plugin Newton --tolerance 1e-6\n"
      "Of each column that is not the same bytes everywhere it tells how far the answers are apart at most, and in "
      "which row. "
      "Of a solver it says how each problem ended: iterations, residual, why it stopped. The file is described in "
      "schemas/gravitas/recorder/v1/capsule.proto.\n"
      "Answers are checked as in a run: what it would not use has failed. "
      "Exits with 4 if an answer differs from the run's, is one that a run would not use, or if there is none; else "
      "with "
      "2 if the file is damaged, or does not hold what it takes to judge the answer.");
  add_replay_options(command, line.get());
  command->add_option("--plugin", line->plugin,
                      "A library, a command or the name of an installed plugin, instead of the one that answered");
  command->add_option("--times", line->options.times, "Ask each call so often, for a profiler [1]")
      ->check(whole_number(1));
  command->callback([=] { *action = [=] { return replay(line.get()); }; });
}

void add_bisect(CLI::App* app, Action* action) {
  const auto line = std::make_shared<ReplayLine>();
  CLI::App* command =
      app->add_subcommand("bisect", "Find the first call of a capsule that two plugins answer differently");
  command->footer(
      "Example: gravitas bisect solver.capsule before/solver_mine.so after/solver_mine.so\n"
      "         gravitas bisect solver.capsule before/solver_mine.so after/solver_mine.so --tolerance 1e-12\n"
      "Exits with 4 if there is one, or if both fail at a call alike: a run would not use their answer.");
  add_replay_options(command, line.get());
  command->add_option("A", line->plugin, "A library, a command or the name of an installed plugin")->required();
  command->add_option("B", line->other, "Another")->required();
  command->callback([=] { *action = [=] { return bisect(line.get()); }; });
}

}  // namespace gravitas::cli
