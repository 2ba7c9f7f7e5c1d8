#include "services/run/resume_command.h"

#include <fmt/format.h>

namespace gravitas {
namespace {

// A word as a shell reads it.
std::string quoted(const std::string& word) {
  const std::string plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./,:=+@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

std::string resume_command(const RunOptions& options, const std::vector<std::string>& hosting_words,
                           const std::string& checkpoint) {
  std::string command = "gravitas run";
  for (const std::string& scene : options.scenes) command += " " + quoted(scene);
  if (options.duration) command += fmt::format(" --duration {}", *options.duration);
  if (options.steps) command += fmt::format(" --steps {}", *options.steps);
  if (options.time_step) command += fmt::format(" --dt {}", *options.time_step);
  for (const std::string& one : options.overrides) command += " --set " + quoted(one);
  for (const std::string& word : hosting_words) command += " " + quoted(word);
  // those that were made are known there
  for (const std::string& one : options.edits) command += " --edit " + quoted(one);
  for (const std::string& one : options.swaps) command += " --swap " + quoted(one);
  for (const std::string& one : options.comparisons) command += " --compare " + quoted(one);
  for (const std::string& one : options.reruns) command += " --rerun " + quoted(one);
  return command + " --resume " + quoted(checkpoint);
}

}  // namespace gravitas
