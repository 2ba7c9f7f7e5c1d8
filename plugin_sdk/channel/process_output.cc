#include "plugin_sdk/channel/process_output.h"

#include <algorithm>
#include <utility>

#include "plugin_sdk/counted.h"
#include "plugin_sdk/printable.h"

namespace gravitas::channel {
namespace {

constexpr std::array<const char*, 2> kPrefix = {"stdout: ", "stderr: "};
constexpr std::size_t kPrefixSize = 8;
constexpr std::size_t kMostIndented = 3;

bool is_blank(std::string_view text) { return text.find_first_not_of(" \t\r") == std::string_view::npos; }

}  // namespace

void ProcessOutput::add(OutputStream stream, std::string_view bytes) {
  std::string& begun = streams_[static_cast<std::size_t>(stream)].begun;
  while (!bytes.empty()) {
    const std::string_view part = bytes.substr(0, std::min(bytes.find('\n'), kLongestLine - begun.size()));
    begun += part;
    bytes.remove_prefix(part.size());
    const bool is_whole = !bytes.empty() && bytes.front() == '\n';
    if (is_whole) bytes.remove_prefix(1);
    if (is_whole || begun.size() == kLongestLine) add_line(stream);
  }
}

void ProcessOutput::end(OutputStream stream) {
  if (!streams_[static_cast<std::size_t>(stream)].begun.empty()) add_line(stream);
}

void ProcessOutput::add_line(OutputStream stream) {
  const auto which = static_cast<std::size_t>(stream);
  auto& [text, held, dropped] = streams_[which];
  if (stream == OutputStream::kStderr && !is_blank(text)) note_last_words(text);
  const std::size_t cost = text.size() + kPrefixSize + sizeof(std::string);
  if (dropped > 0 || held + cost > kMostBytes / streams_.size()) {
    dropped += text.size() + 1;
  } else {
    held += cost;
    lines_.push_back(kPrefix[which] + printable(text));
  }
  text.clear();
}

void ProcessOutput::note_last_words(const std::string& line) {
  if (last_words_.starts_with("SUMMARY: ")) return;
  // what was indented before leads to this line or to nothing
  const bool was_indented = !last_words_.empty() && is_blank(last_words_.substr(0, 1));
  if (was_indented) indented_.push_back(std::move(last_words_));
  if (!was_indented) indented_.clear();
  if (indented_.size() > kMostIndented) indented_.pop_front();
  last_words_ = line;
}

std::string ProcessOutput::last_words() const {
  const auto trimmed = [](const std::string& line) {
    const std::size_t begin = line.find_first_not_of(" \t"), end = line.find_last_not_of(" \t\r");
    return line.substr(begin, end + 1 - begin);
  };
  if (last_words_.empty()) return {};
  std::string words;
  if (!last_words_.starts_with("SUMMARY: "))
    for (const std::string& line : indented_) words += trimmed(line) + " / ";
  return printable(words + (words.empty() ? last_words_ : trimmed(last_words_)));
}

std::vector<std::string> ProcessOutput::take() {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    streams_[i].held = 0;
    if (const std::uint64_t dropped = std::exchange(streams_[i].dropped, 0); dropped > 0)
      lines_.push_back(kPrefix[i] + ("... and " + counted(dropped, "more byte") + " dropped"));
  }
  return std::exchange(lines_, {});
}

}  // namespace gravitas::channel
