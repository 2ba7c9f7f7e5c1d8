#include "services/cli/scene_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "kernel/carrier/carrier.h"
#include "plugin_sdk/channel/address.h"
#include "services/cli/option_checks.h"
#include "services/run/exchange_spec.h"

namespace gravitas::cli {
namespace {

HostingChoice parse_mode(const std::string& word, std::optional<Slot> slot, const std::string& mode) {
  if (mode.starts_with("grpc:")) {
    const std::string address = mode.substr(5);
    if (!slot)
      throw BadInput(fmt::format("--hosting {}: a worker at an address serves one slot: SLOT=grpc:ADDRESS", word));
    if (!channel::is_local_address(address))
      throw BadInput(
          fmt::format("--hosting {}: '{}' is no address of this machine; allowed, since the connection is "
                      "not encrypted: 127.0.0.1:PORT, [::1]:PORT, unix:PATH",
                      word, address));
    return {slot, kernel::Hosting::kGrpc, address};
  }
  return {slot, parse_hosting_mode("--hosting", word, mode), ""};
}

}  // namespace

std::vector<HostingChoice> parse_hosting(const std::vector<std::string>& words,
                                         const std::vector<std::string>& attached) {
  std::vector<HostingChoice> choices;
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos) {
      choices.push_back(parse_mode(word, std::nullopt, word));
      continue;
    }
    choices.push_back(parse_mode(word, parse_slot("--hosting", word, word.substr(0, equals)), word.substr(equals + 1)));
  }
  // the later one counts: what is said of all slots comes before what is said of one
  std::stable_partition(choices.begin(), choices.end(), [](const HostingChoice& choice) { return !choice.slot; });
  for (const std::string& word : attached) {
    const std::size_t equals = word.find('=');
    const std::string address = equals == std::string::npos ? "" : word.substr(equals + 1);
    if (!channel::is_local_address(address))
      throw BadInput(
          fmt::format("--attach {}: allowed: SLOT=ADDRESS of a worker of this machine that listens: "
                      "127.0.0.1:PORT, [::1]:PORT or unix:PATH",
                      word));
    choices.push_back({parse_slot("--attach", word, word.substr(0, equals)), kernel::Hosting::kGrpc, address, true});
  }
  return choices;
}

void add_list(CLI::App* command, const char* name, std::vector<std::string>* values, const char* text) {
  command->add_option(name, *values, text)->take_all()->allow_extra_args(false);
}

void add_despite_journal(CLI::App* command, RunOptions* options) {
  command
      ->add_flag(
          "--despite-journal", options->despite_journal,
          "Go on from a checkpoint whose journal is missing or damaged, with what can be read of it: edits, swaps "
          "and steps that it alone knew are lost")
      ->needs(command->get_option("--resume"));
}

void add_comparisons(CLI::App* command, std::vector<std::string>* values) {
  add_list(command, "--compare", values,
           "Ask a second plugin the same in every step and report how the answers differ: SLOT=PLUGIN; repeatable");
}

void add_event_options(CLI::App* command, const char* name, std::optional<std::vector<std::string>>* kinds,
                       std::optional<double>* ongoing_rate) {
  command
      ->add_option(name, *kinds,
                   "Kinds of events to look for, separated by commas: collision_start, collision_ongoing, "
                   "collision_end, limit_start, break, wake, sleep, fault, swap, edit, listener; all; none. If absent: "
                   "collision_start, collision_end, break, wake, sleep. What is not looked for costs nothing")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--ongoing-rate", *ongoing_rate, "How often collision_ongoing is told, Hz [10]")
      ->check(any_number("a finite number of Hz > 0"));
}

void SceneOptions::add_to(CLI::App* command) {
  command->add_option("SCENE", run_->scenes, "Scene files; several are read as one scene")->required();
  command->add_option("--duration", run_->duration, "Simulated time, s")
      ->check(any_number("a finite number of seconds >= 0"));
  command->add_option("--steps", run_->steps, "Number of steps")->check(whole_number(0));
  command->add_option("--dt", run_->time_step, "Time step, s")->check(any_number("a finite number of seconds > 0"));
  add_list(command, "--set", &run_->overrides, "Override anything: PATH=VALUE, such as Solver.Iterations=50");
  add_list(command, "--hosting", &hosting_,
           "direct, shm or grpc, for all slots, or for one, which counts more: solver=direct; SLOT=grpc:ADDRESS: a "
           "worker of this machine "
           "that listens");
  add_list(
      command, "--attach", &attached_,
      "A worker that you started (under a debugger, a sanitizer) answers in a slot, without deadlines: "
      "SLOT=ADDRESS, where `gravitas-worker --listen ADDRESS LIBRARY...` listens, with all plugins of the slot in the "
      "order of `gravitas plan`");
  command->add_option("--threads", run_->threads, "Threads of each host")->check(whole_number(1, 1024));
  command->add_flag("--no-sandbox", no_sandbox_, "Let worker processes do what they like: for debuggers");
}

void SceneOptions::apply() const {
  run_->hosting = parse_hosting(hosting_, attached_);
  kernel::set_worker_sandbox(!no_sandbox_);
}

std::vector<std::string> SceneOptions::hosting_words() const {
  std::vector<std::string> words;
  for (const std::string& one : hosting_) words.insert(words.end(), {"--hosting", one});
  if (run_->threads != RunOptions{}.threads) words.insert(words.end(), {"--threads", std::to_string(run_->threads)});
  if (no_sandbox_) words.emplace_back("--no-sandbox");
  return words;
}

}  // namespace gravitas::cli
