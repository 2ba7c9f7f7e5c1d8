#include "tests/structure/include_arrows.h"

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <regex>
#include <string>
#include <string_view>

namespace gravitas::structure {
namespace {

constexpr std::string_view kStageFrames = "schemas/stage_frames.h";
constexpr std::string_view kWorkerHost = "plugin_sdk/host/";
constexpr std::string_view kTemplates = "services/scaffold/templates/";

bool starts_with_room(std::string_view include) {
  return include.find('/') != std::string_view::npos &&
         std::find(std::begin(kRooms), std::end(kRooms), room_of(include)) != std::end(kRooms);
}

// generated from the protos
bool is_message_header(std::string_view include) { return include.starts_with("gravitas/"); }

// the plugin that a worker's file belongs to: workers/hello/ or workers/<slot>/<name>/
std::string plugin_folder(std::string_view path) {
  constexpr std::string_view kHello = "workers/hello/";
  if (path.starts_with(kHello)) return std::string(kHello);
  const std::size_t slot_end = path.find('/', path.find('/') + 1);
  const std::size_t name_end = slot_end == std::string_view::npos ? slot_end : path.find('/', slot_end + 1);
  return std::string(path.substr(0, name_end == std::string_view::npos ? path.rfind('/') + 1 : name_end + 1));
}

// True for a header that will stand beside the file in the project that it is a template of.
bool is_of_project(const SourceTree& tree, const std::string& path, const std::string& include) {
  if (!path.starts_with(kTemplates) || include.find('/') != std::string::npos) return false;
  const std::string own = path.substr(0, path.rfind('/') + 1), shared = std::string(kTemplates) + "every_kind/";
  return std::ranges::any_of(
      tree.files, [&](const std::string& file) { return file == own + include || file == shared + include; });
}

// why a file of `path` must not include `include`, a header of ours; empty when it may
std::string objection(const std::string& path, std::string_view include) {
  const std::string from = room_of(path);
  const std::string to = is_message_header(include) ? "schemas" : room_of(include);
  const auto only = [&](std::initializer_list<std::string_view> rooms) {
    return std::find(rooms.begin(), rooms.end(), to) != rooms.end();
  };

  if (from == "schemas" && !only({"schemas"})) return "schemas includes nothing of ours";
  if (from == "plugin_sdk" && !only({"schemas", "plugin_sdk"})) {
    return "plugin_sdk may include schemas only";
  }
  if (from == "kernel") {
    if (!only({"schemas", "plugin_sdk", "kernel"})) {
      return "kernel may include schemas and plugin_sdk only";
    }
    if (include.starts_with(kWorkerHost)) return "the worker host is not the kernel's";
  }
  if (from == "workers") {
    const bool sdk = to == "plugin_sdk" && !include.starts_with(kWorkerHost);
    if (!sdk && include != kStageFrames && !include.starts_with(plugin_folder(path))) {
      return "a worker may include plugin_sdk (without host/), schemas/stage_frames.h and its own "
             "folder only";
    }
  }
  if (path.starts_with(kTemplates)) {
    const bool sdk = to == "plugin_sdk" && !include.starts_with(kWorkerHost);
    return sdk || include == kStageFrames
               ? ""
               : "a new project may include plugin_sdk (without host/) and schemas/stage_frames.h only";
  }
  if (from == "services" && !only({"schemas", "plugin_sdk", "kernel", "services"})) {
    return "services may include schemas, plugin_sdk and kernel only";
  }
  return "";
}

}  // namespace

std::vector<Finding> find_wrong_includes(const SourceTree& tree) {
  static const std::regex kInclude("^\\s*#\\s*include\\s*([<\"])([^>\"]+)[>\"]");
  std::vector<Finding> findings;
  for (const std::string& path : tree.files) {
    if (!is_cpp(path)) continue;
    const std::vector<std::string> lines = without_comments(lines_of(tree, path), Literals::kKeep);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      std::smatch match;
      if (!std::regex_search(lines[i], match, kInclude)) continue;
      const std::string include = match[2];
      const bool ours = starts_with_room(include) || is_message_header(include);

      std::string reason;
      if (include.starts_with("../") || include.find("/../") != std::string::npos) {
        reason = "includes are spelt from the root, without ../";
      } else if (ours) {
        reason = objection(path, include);
      } else if (match[1] == "\"" && !is_of_project(tree, path, include)) {
        reason = "quotes are for headers of ours, spelt from the root";
      }
      if (!reason.empty()) {
        findings.push_back({path, static_cast<int>(i) + 1, include + ": " + reason});
      }
    }
  }
  return findings;
}

}  // namespace gravitas::structure
