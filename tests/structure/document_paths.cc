#include "tests/structure/document_paths.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <regex>
#include <sstream>
#include <string>
#include <string_view>

namespace gravitas::structure {
namespace {

using Path = std::filesystem::path;

bool is_pattern(const std::string& text) {
  if (text.find_first_of("*<>{}$") != std::string::npos) return true;
  return text.find("…") != std::string::npos || text.find("...") != std::string::npos;
}

// without "./" in front, without punctuation and line number at the end
std::string trimmed(std::string word) {
  if (word.starts_with("./")) word.erase(0, 2);
  static const std::regex kTail("(:[0-9]+)?[.,;:!?()\"']*$");
  return std::regex_replace(word, kTail, "", std::regex_constants::format_first_only);
}

class PathCheck {
 public:
  PathCheck(const SourceTree& tree, const Path& generated, std::vector<Finding>* findings)
      : tree_(tree), generated_(generated), findings_(findings) {}

  void check_line(const std::string& document, int line, const std::string& text) {
    static const std::regex kBackticks("`([^`]+)`");
    static const std::regex kLink("\\]\\(([^)\\s]+)[^)]*\\)");
    for (auto match = std::sregex_iterator(text.begin(), text.end(), kBackticks); match != std::sregex_iterator();
         ++match) {
      check_words(document, line, (*match)[1]);
    }
    // links are not read inside backticks
    const std::string prose = std::regex_replace(text, kBackticks, "``");
    for (auto match = std::sregex_iterator(prose.begin(), prose.end(), kLink); match != std::sregex_iterator();
         ++match) {
      check_link(document, line, (*match)[1]);
    }
  }

 private:
  [[nodiscard]] bool exists(const std::string& path) const {
    return std::filesystem::exists(tree_.root / path) || std::filesystem::exists(generated_ / path);
  }

  void check_words(const std::string& document, int line, const std::string& words) {
    std::istringstream stream(words);
    for (std::string word; stream >> word;) {
      if (is_pattern(word)) continue;
      word = trimmed(word);
      const std::string room = room_of(word);
      const bool in_a_room = room != word && std::find(std::begin(kRooms), std::end(kRooms), room) != std::end(kRooms);
      if (in_a_room && !exists(word)) findings_->push_back({document, line, word + " does not exist"});
    }
  }

  void check_link(const std::string& document, int line, const std::string& target) {
    const bool elsewhere = target.find("://") != std::string::npos || target.starts_with("mailto:");
    const std::string file = target.substr(0, target.find('#'));
    if (elsewhere || file.empty() || is_pattern(file)) return;
    const Path path = (Path(document).parent_path() / file).lexically_normal();
    if (room_of(path.generic_string()) != "build" && !exists(path.generic_string())) {
      findings_->push_back({document, line, "the link to " + target + " leads nowhere"});
    }
  }

  const SourceTree& tree_;
  const Path& generated_;
  std::vector<Finding>* findings_;
};

}  // namespace

std::vector<Finding> find_dead_paths(const SourceTree& tree, const Path& generated) {
  std::vector<Finding> findings;
  PathCheck check(tree, generated, &findings);
  for (const std::string& document : tree.files) {
    if (!document.ends_with(".md")) continue;
    bool fenced = false;
    int number = 0;
    for (const std::string& line : lines_of(tree, document)) {
      ++number;
      const std::size_t text = line.find_first_not_of(' ');
      const bool fence = text != std::string::npos && line.compare(text, 3, "```") == 0;
      if (fence) fenced = !fenced;
      if (!fence && !fenced) check.check_line(document, number, line);
    }
  }
  return findings;
}

}  // namespace gravitas::structure
