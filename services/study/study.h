// A study: methods climb ladders of settings on problems, from useless to rounding, and every run says how far off it was
// and what it cost. Errors and counts are the same wherever and whenever it runs; times are those of this machine.
//
//   Options options{…};  v1::Study study = run(options, interrupted, progress);   // then tables.h, diagram.h
//
// Steps halve from rung to rung, accuracies go down by sqrt(10). Where a rung takes more CPU than one may, the finer ones
// are not run, and say so.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

struct Options {
  std::vector<std::string> problems;  // names or families; all of those that are shipped if neither these nor scenes
  std::vector<std::string> methods;   // names or parts of them (method.h); what suits each problem if empty
  std::vector<std::string> scenes;    // of the user's own, each measured against itself (self_reference.h)
  // Less work: accuracies by 10 instead of sqrt(10), shorter runs.
  bool is_short = false;
  double run_seconds = 0.0;  // CPU that one run may take, s; 0: kLongRun, or kShortRun
  std::uint32_t rungs = 0;   // of a ladder, at most; 0: kRungs of steps, accuracies down to 1e-13
};

inline constexpr double kLongRun = 4.0, kShortRun = 0.25;  // s
inline constexpr std::uint32_t kRungs = 12;

// What a scene of the user's is called: its file's name without folder and ending.
std::string problem_name(const std::string& scene);

// The problems that are shipped, each with the ladders that are offered for it, and nothing measured.
v1::Study list();

struct Progress {
  std::size_t done, all;  // ladders
  std::string problem, method;
};

// The map of stability is measured where nothing is left out: neither problems nor methods are named, nor scenes given.
// What was measured until `interrupted` says so; then with is_interrupted. Throws BadInput for names that are none, scenes
// that cannot be read, and a method that suits no problem.
v1::Study run(const Options& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress);

}  // namespace gravitas::study
