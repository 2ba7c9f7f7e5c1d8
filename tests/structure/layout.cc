#include "tests/structure/layout.h"

#include <algorithm>
#include <iterator>
#include <regex>
#include <set>
#include <string>
#include <string_view>

namespace gravitas::structure {
namespace {

constexpr std::string_view kTopFiles[] = {"CMakeLists.txt", "CMakePresets.json", "README.md",
                                          "CHANGELOG.md",   "CONTRIBUTING.md",   "LICENSE"};

template <typename Range>
bool contains(const Range& range, std::string_view what) {
  return std::find(std::begin(range), std::end(range), what) != std::end(range);
}

int line_count(const SourceTree& tree, const std::string& path) {
  return static_cast<int>(lines_of(tree, path).size());
}

std::string too_long(int lines, int limit) {
  return std::to_string(lines) + " lines, at most " + std::to_string(limit) + " are meant";
}

}  // namespace

std::vector<Finding> find_strays_at_the_top(const SourceTree& tree) {
  std::set<std::string> strays;
  for (const std::string& path : tree.files) {
    const std::string top = room_of(path);
    const bool known = top == path ? contains(kTopFiles, top) : contains(kRooms, top);
    if (!known && !top.starts_with('.')) strays.insert(top);
  }
  std::vector<Finding> findings;
  for (const std::string& stray : strays) {
    findings.push_back({stray, 0, "the top level holds the rooms and a few known files only"});
  }
  return findings;
}

std::vector<Finding> find_rooms_without_guide(const SourceTree& tree) {
  std::vector<Finding> findings;
  for (const std::string_view room : kRooms) {
    const std::string readme = std::string(room) + "/README.md";
    if (!contains(tree.files, readme)) {
      findings.push_back({readme, 0, "each room has a README.md"});
    } else if (const int lines = line_count(tree, readme); lines > kLongestReadme) {
      findings.push_back({readme, 0, too_long(lines, kLongestReadme)});
    }
  }
  return findings;
}

std::vector<Finding> find_overlong_sources(const SourceTree& tree) {
  constexpr std::string_view kEndings[] = {".cc", ".h", ".proto", ".py", ".ts"};
  std::vector<Finding> findings;
  int kernel = 0;
  for (const std::string& path : tree.files) {
    if (std::none_of(std::begin(kEndings), std::end(kEndings),
                     [&](std::string_view ending) { return path.ends_with(ending); })) {
      continue;
    }
    const int lines = line_count(tree, path);
    const bool is_simulator = path.starts_with("kernel/simulators/");
    const int longest = is_simulator ? kLongestSimulator : kLongestFile;
    if (lines > longest) findings.push_back({path, 0, too_long(lines, longest)});
    if (room_of(path) == "kernel" && is_cpp(path) && !is_simulator) kernel += lines;
  }
  if (kernel > kLongestKernel) findings.push_back({"kernel", 0, too_long(kernel, kLongestKernel)});
  return findings;
}

std::vector<Finding> find_vague_names(const SourceTree& tree) {
  static const std::regex kVague("(^|[/_-])(utils?|utilit(y|ies)|helpers?|common|misc|managers?)([/_.-]|$)",
                                 std::regex::icase);
  std::vector<Finding> findings;
  for (const std::string& path : tree.files) {
    std::smatch match;
    if (std::regex_search(path, match, kVague)) {
      findings.push_back({path, 0, "'" + match[2].str() + "' does not say what is inside"});
    }
  }
  return findings;
}

}  // namespace gravitas::structure
