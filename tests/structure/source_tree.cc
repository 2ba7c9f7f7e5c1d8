#include "tests/structure/source_tree.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "plugin_sdk/shell_word.h"

namespace gravitas::structure {
namespace {

// what a command prints, cut at zero bytes; empty when it fails
std::vector<std::string> output_of(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return {};
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  if (pclose(pipe) != 0) return {};

  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, '\0');) parts.push_back(part);
  return parts;
}

// Blanks comments, and literals if asked, line by line; remembers what is still open at the end of
// a line.
class Scanner {
 public:
  explicit Scanner(Literals literals) : literals_(literals) {}

  std::string scan_line(const std::string& line) {
    line_ = line;
    std::size_t i = 0;
    while (i < line_.size()) {
      switch (state_) {
        case State::kCode:
          i = scan_code(i);
          break;
        case State::kBlockComment:
          i = blank_up_to("*/", i);
          break;
        case State::kRawString:
          i = blank_up_to(raw_string_close_, i);
          break;
      }
    }
    return line_;
  }

 private:
  enum class State { kCode, kBlockComment, kRawString };

  [[nodiscard]] bool at(std::size_t i, std::string_view what) const {
    return std::string_view(line_).substr(i).starts_with(what);
  }

  // blanks [begin, end) and answers end
  std::size_t blank(std::size_t begin, std::size_t end) {
    std::fill(line_.begin() + static_cast<std::ptrdiff_t>(begin), line_.begin() + static_cast<std::ptrdiff_t>(end),
              ' ');
    return end;
  }

  // the inside of a comment or raw string and, where it stands on this line, its end
  std::size_t blank_up_to(std::string_view close, std::size_t i) {
    const std::size_t found = line_.find(close, i);
    if (found == std::string::npos) return blank(i, line_.size());
    state_ = State::kCode;
    return blank(i, found + close.size());
  }

  // one character of code, an opening mark or a whole literal; answers where to go on
  std::size_t scan_code(std::size_t i) {
    if (at(i, "//")) return blank(i, line_.size());
    if (at(i, "/*")) {
      state_ = State::kBlockComment;
      return blank(i, i + 2);
    }
    if (at(i, "R\"") && line_.find('(', i) != std::string::npos) {
      const std::size_t open = line_.find('(', i);
      raw_string_close_ = ")" + line_.substr(i + 2, open - i - 2) + "\"";
      state_ = State::kRawString;
      return blank(i, open + 1);
    }
    // an apostrophe after a letter or digit separates digits
    const char c = line_[i];
    const bool separator = c == '\'' && i > 0 && std::isalnum(static_cast<unsigned char>(line_[i - 1])) != 0;
    if ((c != '"' && c != '\'') || separator) return i + 1;

    std::size_t end = i + 1;
    while (end < line_.size() && line_[end] != c) end += line_[end] == '\\' ? 2 : 1;
    end = std::min(end, line_.size());
    if (literals_ == Literals::kBlank) blank(i + 1, end);
    return std::min(end + 1, line_.size());
  }

  Literals literals_;
  State state_ = State::kCode;
  std::string line_;
  std::string raw_string_close_;
};

}  // namespace

SourceTree tree_of_folder(const std::filesystem::path& root) {
  SourceTree tree{root, {}};
  auto entry = std::filesystem::recursive_directory_iterator(root);
  for (; entry != std::filesystem::end(entry); ++entry) {
    const std::string name = entry->path().lexically_relative(root).generic_string();
    if (name == "build" || name == ".git") {
      entry.disable_recursion_pending();
    } else if (!entry->is_directory()) {
      tree.files.push_back(name);
    }
  }
  std::sort(tree.files.begin(), tree.files.end());
  return tree;
}

SourceTree tree_of_repository(const std::filesystem::path& root) {
  SourceTree tree{root, {}};
  for (std::string& file : output_of("git -C " + shell_word(root.string()) + " ls-files -z 2>/dev/null")) {
    if (std::filesystem::is_regular_file(root / file)) tree.files.push_back(std::move(file));
  }
  if (tree.files.empty()) return tree_of_folder(root);
  std::sort(tree.files.begin(), tree.files.end());
  return tree;
}

std::vector<std::string> lines_of(const SourceTree& tree, const std::string& path) {
  std::ifstream file(tree.root / path);
  if (!file) throw std::runtime_error("cannot read " + (tree.root / path).string());
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> without_comments(const std::vector<std::string>& lines, Literals literals) {
  Scanner scanner(literals);
  std::vector<std::string> result;
  result.reserve(lines.size());
  for (const std::string& line : lines) result.push_back(scanner.scan_line(line));
  return result;
}

std::string room_of(std::string_view path) { return std::string(path.substr(0, path.find('/'))); }

bool is_cpp(std::string_view path) { return path.ends_with(".cc") || path.ends_with(".h"); }

std::string report(const std::vector<Finding>& findings) {
  std::ostringstream text;
  for (const Finding& finding : findings) {
    text << finding.path;
    if (finding.line > 0) text << ':' << finding.line;
    text << ": " << finding.reason << '\n';
  }
  return text.str();
}

}  // namespace gravitas::structure
