#include "services/run/edit_spec.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <map>

#include "services/run/session.h"
#include "services/scene/input_file.h"

namespace gravitas {
namespace {

constexpr const char* kAllowedChanges =
    "allowed: add FILE, remove PATH, set PATH=VALUE, such as set Body.Ball.Position={0,1,0}";

}  // namespace

edit::v1::Change parse_change(const std::string& text) {
  const std::size_t blank = text.find(' ');
  const std::string verb = text.substr(0, blank);
  const std::size_t begin = text.find_first_not_of(' ', blank);
  if (blank == std::string::npos || begin == std::string::npos)
    throw BadInput(fmt::format("edit \"{}\": {}", text, kAllowedChanges));
  const std::string rest = text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
  edit::v1::Change change;
  if (verb == "remove") {
    change.set_remove(rest);
  } else if (verb == "set") {
    change.set_set(rest);
  } else if (verb == "add") {
    std::string why;
    if (!scene::read_input_file(rest, change.mutable_add()->mutable_text(), &why))
      throw BadInput(
          fmt::format("edit \"{}\": '{}' cannot be read: {}; a scene is a readable text file", text, rest, why));
    change.mutable_add()->set_name(std::filesystem::absolute(rest).lexically_normal().string());
  } else {
    throw BadInput(fmt::format("edit \"{}\": {}", text, kAllowedChanges));
  }
  return change;
}

std::vector<edit::v1::Edit> parse_edits(const std::vector<std::string>& words) {
  constexpr std::string_view kMark = "@step=";
  std::map<std::uint32_t, edit::v1::Edit> by_step;
  for (const std::string& word : words) {
    const std::size_t mark = word.rfind(kMark);
    std::uint32_t step = 0;
    const char* const end = word.data() + word.size();
    const auto read = mark == std::string::npos ? std::from_chars_result{nullptr, std::errc::invalid_argument}
                                                : std::from_chars(word.data() + mark + kMark.size(), end, step);
    if (read.ec != std::errc() || read.ptr != end || step == 0)
      throw BadInput(
          fmt::format("--edit \"{}\": allowed: CHANGE@step=N, before step N from 1; {}", word, kAllowedChanges));
    edit::v1::Edit& edit = by_step[step];
    edit.set_step(step);
    *edit.add_changes() = parse_change(word.substr(0, mark));
  }
  std::vector<edit::v1::Edit> edits;
  for (auto& [step, edit] : by_step) edits.push_back(std::move(edit));
  return edits;
}

}  // namespace gravitas
