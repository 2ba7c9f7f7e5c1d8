// The fault campaign: many trials in processes of their own, so that a kernel that crashes or hangs is one finding more
// and not the end.
//
//   parent (hands out trials, counts, writes) --"FIRST COUNT STRIDE"--> child: run_trial() after run_trial()
//                                             <--"begin N", Trial as a line of JSON, "done"--
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gravitas/campaign/v1/campaign.pb.h"
#include "services/campaign/trial.h"
#include "services/campaign/trial_plan.h"

namespace gravitas::campaign {

struct Options {
  std::vector<std::string> scenes;  // names or files; built-in ones if there is none
  std::uint64_t faults = 2000;      // at least so many, over all shards
  std::uint64_t seed = 1;
  std::uint32_t shard = 1, shards = 1;  // this one, of so many
  DrawOptions draw;
  std::string without;     // a defence, for the self-test
  double deadline = 0.25;  // s, of a call
  double patience = 60.0;  // s; a trial that takes longer has hung
  std::uint32_t jobs = 0;  // processes; 0: as many as cores
  std::string out;         // folder for trials.jsonl, table.txt, table.json, index.html; empty: none
};

struct Progress {
  std::uint64_t injected, wanted, forbidden;
  double seconds;
};

// Makes the campaign; gives up after 20 trials with something forbidden. Throws BadInput, and std::system_error if a file cannot be written.
v1::Table run(const Options& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress);

// What a child process of run() does: reads orders from standard input until that ends.
void serve_trials(const Options& options);

// One trial by its seed, in this process.
v1::Trial repeat_trial(const Options& options, std::uint64_t seed);

// The command line that shows a trial again.
std::string repeat_command(const Options& options, std::uint64_t seed);

}  // namespace gravitas::campaign
