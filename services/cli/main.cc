// gravitas: one program, sub-commands. Results go to standard output, everything else to standard error.
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "plugin_sdk/exit_guard.h"
#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/near_miss.h"
#include "services/cli/commands.h"
#include "services/cli/option_checks.h"
#include "services/run/session.h"

namespace {

// What is wrong with the words that should name sub-commands; empty: nothing.
std::string unknown_subcommand(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    std::vector<std::string> names;
    for (const CLI::App* one : command->get_subcommands(nullptr)) names.push_back(one->get_name());
    if (names.empty() || word.starts_with('-')) return {};
    if (std::ranges::find(names, word) == names.end())
      return "there is no sub-command \"" + word + "\"; " + gravitas::allowed_names(word, names);
    command = command->get_subcommand(word);
  }
  return {};
}

// What nothing takes: an option, or what stands instead of the sub-command that is missing; empty: nothing.
std::string unexpected_word(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands()[0];
  const std::vector<std::string> words = app.remaining(true);
  if (words.empty()) return {};
  if (!words[0].starts_with('-')) return unknown_subcommand(*command, words);
  const std::string option = words[0].substr(0, words[0].find('='));
  std::vector<std::string> names;
  for (const CLI::Option* one : command->get_options())
    for (const std::string& name : one->get_lnames()) names.push_back("--" + name);
  const std::string nearest = gravitas::nearest_name(option, names);
  return "there is no option \"" + option + "\"; " + (nearest.empty() ? "" : "did you mean \"" + nearest + "\"? ") +
         "--help names those that there are";
}

// Workers of many slots, with their standbys, take more files than shells allow at first.
void raise_descriptor_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

// Threads get stacks of the soft limit that stood when their program began, and so do workers: where it is too low it is
// raised, and this program begun again. Why that cannot be; empty: it is high enough.
std::string too_small_stack(char** argv) {
  constexpr rlim_t kNeeded = rlim_t{512} << 10, kUsual = rlim_t{8} << 20;
  rlimit limit{};
  if (getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= kNeeded) return {};
  const rlim_t before = limit.rlim_cur;
  limit.rlim_cur = std::min(kUsual, limit.rlim_max);
  if (limit.rlim_cur >= kNeeded && setrlimit(RLIMIT_STACK, &limit) == 0) execv("/proc/self/exe", argv);
  return "it needs a stack of at least " + std::to_string(kNeeded >> 10) + " KB, and Linux allows this program " +
         std::to_string(before >> 10) + " (ulimit -s)";
}

// `code`, unless what was printed is lost.
int exit_code(int code) {
  if (std::cout.flush() && std::fflush(stdout) == 0) return code;
  std::cerr << "gravitas: standard output cannot be written\n";
  return gravitas::cli::kOurFault;
}

// `--name=`, whose value would be taken from the next word; empty: there is none.
std::string option_without_value(const std::vector<std::string>& words) {
  for (const std::string& word : words)
    if (word.starts_with("--") && word.find('=') == word.size() - 1)
      return word + ": \"\"; allowed: a value that is not empty, or leave the option out";
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  using namespace gravitas;
  const ExitGuard guard(nullptr);
  for (const std::string& missing : {missing_cpu_features(), too_small_stack(argv)}) {
    if (missing.empty()) continue;
    std::cerr << "gravitas: " << missing << '\n';
    return cli::kOurFault;
  }

  // a parent that ignores it would make Linux forget how workers ended
  std::signal(SIGCHLD, SIG_DFL);
  CLI::App app{"Gravitas: a rigid-body physics engine whose parts are plugins in worker processes."};
  app.require_subcommand(1);
  app.set_version_flag("--version", GRAVITAS_BUILD_ID);
  cli::Action action;
  cli::add_run(&app, &action);
  cli::add_plan(&app, &action);
  cli::add_plugins(&app, &action);
  cli::add_describe(&app, &action);
  cli::add_new(&app, &action);
  cli::add_check(&app, &action);
  cli::add_capture(&app, &action);
  cli::add_replay(&app, &action);
  cli::add_bisect(&app, &action);
  cli::add_campaign(&app, &action);
  cli::add_study(&app, &action);
  cli::add_serve(&app, &action);
  cli::add_ctl(&app, &action);
  cli::refuse_meaningless_values(&app);
  const std::vector<std::string> words(argv + 1, argv + argc);
  for (const std::string& problem : {unknown_subcommand(app, words), option_without_value(words)}) {
    if (problem.empty()) continue;
    std::cerr << "gravitas: " << problem << '\n';
    return cli::kBadInput;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool may_be_unexpected = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr ||
                                   dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr;
    if (const std::string word = may_be_unexpected ? unexpected_word(app) : ""; !word.empty()) {
      std::cerr << "gravitas: " << word << '\n';
      return cli::kBadInput;
    }
    const int code = app.exit(error, std::cout, std::cerr);
    return exit_code(code == 0 ? cli::kDone : cli::kBadInput);
  }
  raise_descriptor_limit();
  setenv("GRPC_VERBOSITY", "NONE", 0);  // what fails is told in words of our own
  try {
    return exit_code(action());
  } catch (const BadInput& problem) {
    std::cerr << problem.what() << '\n';
    return cli::kBadInput;
  } catch (const std::exception& problem) {
    std::cerr << "gravitas: " << problem.what() << '\n';
    return cli::kOurFault;
  }
}
