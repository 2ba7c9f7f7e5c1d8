#include "services/campaign/leftovers.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace gravitas::campaign {

std::vector<int> child_processes() {
  std::vector<int> children;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
    std::ifstream list(task.path() / "children");
    for (int process = 0; list >> process;) children.push_back(process);
  }
  std::ranges::sort(children);
  return children;
}

std::vector<std::string> find_leftovers() {
  std::vector<std::string> found;
  for (const int process : child_processes()) found.push_back(fmt::format("process {} is left over", process));
  // plugin libraries stay loaded
  const auto is_segment = [](const std::string& line) {
    return line.find("/memfd:gravitas") != std::string::npos &&
           line.find("/memfd:gravitas plugin") == std::string::npos;
  };
  std::ifstream maps("/proc/self/maps");
  std::size_t mappings = 0;
  for (std::string line; std::getline(maps, line);) mappings += is_segment(line) ? 1 : 0;
  if (mappings > 0) found.push_back(fmt::format("{} mappings of segments are left over", mappings));
  std::size_t segments = 0;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    std::error_code gone;
    segments += is_segment(std::filesystem::read_symlink(entry.path(), gone).string()) ? 1 : 0;
  }
  if (segments > 0) found.push_back(fmt::format("{} descriptors of segments are left over", segments));
  return found;
}

std::size_t open_descriptors() {
  const std::filesystem::directory_iterator all("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

}  // namespace gravitas::campaign
