// `gravitas campaign`.
#include <fmt/format.h>

#include <csignal>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>

#include "plugin_sdk/counted.h"
#include "services/campaign/campaign.h"
#include "services/campaign/endurance.h"
#include "services/campaign/table.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/cli/terminal.h"
#include "services/recorder/json.h"
#include "services/run/session.h"

namespace gravitas::cli {
namespace {

struct CampaignArguments {
  campaign::Options options;
  std::string tier = "real", hosting = "both", shard = "1/1";
  double endurance = 0.0;
  std::optional<std::uint64_t> trial;
  bool json = false, serve = false;
};

// I/K, 1 to K.
void read_shard(CampaignArguments* arguments) {
  unsigned first = 0, all = 0;
  char rest = 0;
  const bool is_read = std::sscanf(arguments->shard.c_str(), "%u/%u%c", &first, &all, &rest) == 2;
  if (!is_read || first < 1 || first > all)
    throw BadInput(fmt::format("--shard {}: allowed: I/K with I from 1 to K, such as 2/8", arguments->shard));
  arguments->options.shard = first;
  arguments->options.shards = all;
}

int endure(const CampaignArguments& arguments) {
  if (arguments.options.scenes.size() > 1)
    throw BadInput(fmt::format("--endurance: {} scenes; allowed: one, or none", arguments.options.scenes.size()));
  campaign::EnduranceResult result;
  {
    StatusLine line;
    result =
        campaign::endure(arguments.options.scenes.empty() ? "" : arguments.options.scenes[0], arguments.endurance,
                         interrupted, [&](double seconds) {
                           line.show([&] { return fmt::format("{:.0f} of {:.0f} s", seconds, arguments.endurance); });
                         });
  }
  if (arguments.json) {
    std::cout << fmt::format(
        "{{\"steps\": {}, \"kills\": {}, \"failures\": {}, \"seconds\": {:.3f}, \"median_step_us\": {:.1f}, "
        "\"p99_step_us\": {:.1f}, \"max_step_us\": {:.1f}, \"survived\": {}}}\n",
        result.steps, result.kills, result.failures, result.seconds, result.median_step_us, result.p99_step_us,
        result.max_step_us, result.problem.empty());
  } else {
    std::cout << fmt::format(
        "{} at 1 kHz with {} ({}) in {:.1f} s; a step: median {:.0f} us, p99 {:.0f} us, "
        "max {:.0f} us\n{}\n",
        counted(result.steps, "step"), counted(result.kills, "kill"), counted(result.failures, "failed call"),
        result.seconds, result.median_step_us, result.p99_step_us, result.max_step_us,
        result.problem.empty() ? "the chain of hashes is that of the quiet run" : "failed: " + result.problem);
  }
  if (!result.problem.empty()) return kExaminedFailed;
  return interrupted() ? kInterrupted : kDone;
}

int run_campaign(CampaignArguments* arguments) {
  campaign::Options& options = arguments->options;
  options.draw.tier = arguments->tier == "real" ? campaign::Tier::kReal : campaign::Tier::kSimulated;
  if (arguments->hosting == "shm" || options.draw.tier == campaign::Tier::kSimulated)
    options.draw.hostings = {kernel::Hosting::kSharedMemory};
  if (arguments->hosting == "grpc" && options.draw.tier == campaign::Tier::kReal)
    options.draw.hostings = {kernel::Hosting::kGrpc};
  read_shard(arguments);
  if (arguments->serve) {
    // the parent lets its processes end their trials, though the whole group is told to end
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_IGN);
    std::signal(SIGHUP, SIG_IGN);
    campaign::serve_trials(options);
    return kDone;
  }
  listen_to_interrupts();
  if (arguments->endurance > 0.0) return endure(*arguments);
  if (arguments->trial) {
    const campaign::v1::Trial trial = campaign::repeat_trial(options, *arguments->trial);
    std::cout << to_json(trial, JsonForm::kPage);
    return trial.forbidden().empty() ? kDone : kExaminedFailed;
  }
  campaign::v1::Table table;
  {
    StatusLine line;
    table = campaign::run(options, interrupted, [&](const campaign::Progress& now) {
      line.show([&] {
        return fmt::format("{} of {} faults, {:.0f} a second, {} forbidden", now.injected, now.wanted,
                           static_cast<double>(now.injected) / now.seconds, now.forbidden);
      });
    });
  }
  std::cout << (arguments->json ? to_json(table, JsonForm::kPage) : campaign::table_text(table));
  if (!campaign::is_passed(table)) return kExaminedFailed;
  return interrupted() ? kInterrupted : kDone;
}

}  // namespace

void add_campaign(CLI::App* app, Action* action) {
  const auto arguments = std::make_shared<CampaignArguments>();
  campaign::Options& options = arguments->options;
  CLI::App* command =
      app->add_subcommand("campaign", "Inject faults into many short runs and judge each by the bits of the quiet run");
  command->footer(
      "Outcomes: M masked, B recovered bit for bit, F declared fallback, Q paused with a state that resumes; all else "
      "is "
      "forbidden. Exit code 0: nothing forbidden happened, 4: something did; a line names the command that shows it "
      "again.\n"
      "Example: gravitas campaign --faults 2000 --seed 1 --out campaign\n"
      "         gravitas campaign --tier simulated --faults 1000000 --seed 1\n"
      "         gravitas campaign --endurance 600");
  command->add_option("SCENE", options.scenes,
                      "Scene files, or built-in scenes: contacts, joints, all, shared (these four if absent)");
  command->add_option("--faults", options.faults, "How many, at least, over all shards")
      ->check(whole_number(1, 1'000'000'000'000))
      ->capture_default_str();
  command->add_option("--seed", options.seed, "All that is drawn comes from it")
      ->check(whole_number(0, std::numeric_limits<std::uint64_t>::max()))
      ->capture_default_str();
  command->add_option("--shard", arguments->shard, "I/K: the I-th of K parts")->capture_default_str();
  command
      ->add_option("--tier", arguments->tier,
                   "real: worker processes; simulated: one process, virtual time, the same plugins and checks")
      ->check(CLI::IsMember({"real", "simulated"}))
      ->capture_default_str();
  command->add_option("--hosting", arguments->hosting, "Of the real tier: shm, grpc or both")
      ->check(CLI::IsMember({"shm", "grpc", "both"}))
      ->capture_default_str();
  command->add_option(
      "--out", options.out,
      "Folder for trials.jsonl, table.txt, table.json and index.html; of the simulated tier trials.jsonl holds the "
      "trials alone in which something was neither masked nor recovered bit for bit");
  command->add_option("--per-trial", options.draw.faults_per_trial, "Faults in one run, at most")
      ->check(whole_number(1, 24))
      ->capture_default_str();
  command->add_option("--jobs", options.jobs, "Processes that make trials; 0: one for each core")
      ->check(whole_number(0, 1024))
      ->capture_default_str();
  command->add_option("--deadline", options.deadline, "Of a call in the trials, s")
      ->check(seconds_between(0.01, 100.0))
      ->capture_default_str();
  command->add_option("--patience", options.patience, "A trial that is silent for longer has hung, s")
      ->check(seconds_between(1.0, 1e6))
      ->capture_default_str();
  command->add_option("--without", options.without,
                      "Switch a defence off, to see the campaign fail: structure, numbers, physics, confirmation, "
                      "replay, digest, epoch "
                      "or deadline");
  command->add_option("--trial", arguments->trial, "Only the trial with this seed, in this process; prints it")
      ->check(whole_number(0, std::numeric_limits<std::uint64_t>::max()));
  CLI::Option* endurance =
      command
          ->add_option("--endurance", arguments->endurance,
                       "Instead, of one scene: 1 kHz for so many seconds, a kill in every slot every second, s")
          ->check(seconds_between(0.1, 1e6));
  for (const char* of_trials : {"--faults", "--seed", "--shard", "--tier", "--hosting", "--out", "--per-trial",
                                "--jobs", "--deadline", "--patience", "--without", "--trial"})
    endurance->excludes(of_trials);
  command->add_flag("--json", arguments->json, "Print JSON");
  command->add_flag("--serve-trials", arguments->serve)->group("");
  command->callback([=] { *action = [=] { return run_campaign(arguments.get()); }; });
}

}  // namespace gravitas::cli
