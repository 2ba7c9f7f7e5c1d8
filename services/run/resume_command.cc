#include "services/run/resume_command.h"

#include <fmt/format.h>

#include "plugin_sdk/shell_word.h"

namespace gravitas {

std::string resume_command(const RunOptions& options, const std::vector<std::string>& hosting_words,
                           const std::string& checkpoint) {
  std::string command = "gravitas run";
  for (const std::string& scene : options.scenes) command += " " + shell_word(scene);
  if (options.duration) command += fmt::format(" --duration {}", *options.duration);
  if (options.steps) command += fmt::format(" --steps {}", *options.steps);
  if (options.time_step) command += fmt::format(" --dt {}", *options.time_step);
  for (const std::string& one : options.overrides) command += " --set " + shell_word(one);
  for (const std::string& word : hosting_words) command += " " + shell_word(word);
  // those that were made are known there
  for (const std::string& one : options.edits) command += " --edit " + shell_word(one);
  for (const std::string& one : options.swaps) command += " --swap " + shell_word(one);
  for (const std::string& one : options.comparisons) command += " --compare " + shell_word(one);
  for (const std::string& one : options.reruns) command += " --rerun " + shell_word(one);
  return command + " --resume " + shell_word(checkpoint);
}

}  // namespace gravitas
