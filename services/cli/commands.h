// The sub-commands of `gravitas`. Each adds itself to the parser; what it does when chosen returns the exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace gravitas::cli {

// Exit codes (the same for every sub-command).
enum ExitCode : int { kDone = 0, kOurFault = 1, kBadInput = 2, kPaused = 3, kExaminedFailed = 4, kInterrupted = 130 };

// What the chosen sub-command does.
using Action = std::function<int()>;

void add_run(CLI::App* app, Action* action);
void add_plan(CLI::App* app, Action* action);
void add_plugins(CLI::App* app, Action* action);
void add_describe(CLI::App* app, Action* action);
void add_new(CLI::App* app, Action* action);
void add_check(CLI::App* app, Action* action);
void add_capture(CLI::App* app, Action* action);
void add_replay(CLI::App* app, Action* action);
void add_bisect(CLI::App* app, Action* action);
void add_campaign(CLI::App* app, Action* action);
void add_study(CLI::App* app, Action* action);
void add_serve(CLI::App* app, Action* action);
void add_ctl(CLI::App* app, Action* action);

}  // namespace gravitas::cli
