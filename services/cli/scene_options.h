// The options of every sub-command that reads a scene: which files, how far, and where its plugins live.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "services/run/session.h"

namespace gravitas::cli {

class SceneOptions {
 public:
  explicit SceneOptions(RunOptions* run) : run_(run) {}
  SceneOptions(const SceneOptions&) = delete;
  SceneOptions& operator=(const SceneOptions&) = delete;

  void add_to(CLI::App* command);
  // What stands for itself is in the RunOptions already; this does the rest. Throws BadInput, naming what is allowed.
  void apply() const;
  // What of the line says where plugins live, but for workers that were attached.
  std::vector<std::string> hosting_words() const;

 private:
  RunOptions* run_;
  std::vector<std::string> hosting_, attached_;
  bool no_sandbox_ = false;
};

// An option that may be repeated, with one value each time.
void add_list(CLI::App* command, const char* name, std::vector<std::string>* values, const char* text);

// --despite-journal, after --resume.
void add_despite_journal(CLI::App* command, RunOptions* options);

// --compare.
void add_comparisons(CLI::App* command, std::vector<std::string>* values);

// Kinds of events under `name`, and --ongoing-rate.
void add_event_options(CLI::App* command, const char* name, std::optional<std::vector<std::string>>* kinds,
                       std::optional<double>* ongoing_rate);

// The words of --hosting and --attach. Throws BadInput, naming what is allowed.
std::vector<HostingChoice> parse_hosting(const std::vector<std::string>& words,
                                         const std::vector<std::string>& attached = {});

}  // namespace gravitas::cli
