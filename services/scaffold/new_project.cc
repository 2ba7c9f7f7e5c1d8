#include "services/scaffold/new_project.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <map>
#include <system_error>
#include <utility>

#include "plugin_sdk/near_miss.h"
#include "services/run/session.h"

namespace gravitas::scaffold {
namespace {

namespace fs = std::filesystem;

// What projects of a slot differ in beside their own templates.
struct Kind {
  const char* slot;
  const char* method;  // where a debugger stops
  const char* peer;    // a shipped plugin that answers the same questions; none where types differ
};
constexpr Kind kKinds[] = {{"space", "pairs", "DynamicBVH"},    {"collision", "manifolds", "Standard"},
                           {"constraint", "discrepancies", ""}, {"force", "wrenches", ""},
                           {"solver", "solve", "Newton"},       {"integrator", "integrate", "Verlet"}};
constexpr std::size_t kLongestName = 64;

bool is_lower(char c) { return c >= 'a' && c <= 'z'; }
bool is_upper(char c) { return c >= 'A' && c <= 'Z'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

const Kind& kind_of(const std::string& slot) {
  const auto found = std::ranges::find(kKinds, slot, &Kind::slot);
  if (found != std::end(kKinds)) return *found;
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.push_back(kind.slot);
  throw BadInput(fmt::format("gravitas new: KIND \"{}\": there is no such slot; {}", slot, allowed_names(slot, names)));
}

void demand_name(const std::string& name, const Catalog& installed) {
  const bool is_word =
      std::ranges::all_of(name, [](char c) { return is_lower(c) || is_upper(c) || is_digit(c) || c == '_'; });
  if (name.empty() || !is_word || !(is_lower(name[0]) || is_upper(name[0])) || name.size() > kLongestName)
    throw BadInput(fmt::format(
        "gravitas new: NAME \"{}\"; allowed: letters, digits and '_', a letter first, {} at most", name, kLongestName));
  // bases and files of projects have such names
  if (std::ranges::find(kKinds, file_style(name), &Kind::slot) != std::end(kKinds) ||
      file_style(name) == "known_result")
    throw BadInput(fmt::format("gravitas new: NAME \"{}\" is one that every project has; allowed: another", name));
  for (const InstalledPlugin& plugin : installed.plugins()) {
    const bool is_type = find_type(plugin.declaration, name) != nullptr;
    if (!is_type && plugin.declaration.name != name) continue;
    throw BadInput(
        fmt::format("gravitas new: NAME \"{}\" is taken: the installed plugin {} (slot {}) {}; allowed: another", name,
                    plugin.declaration.name, slot_name(plugin.declaration.slot),
                    is_type ? "serves a type of that name" : "has it"));
  }
}

constexpr const char* kTemplates = "services/scaffold/templates";

// The tree that this program was built in.
fs::path tree_of(const fs::path& build) {
  fs::path tree = folder_above_with(kTemplates);
  if (!tree.empty()) return tree;
  throw BadInput(
      fmt::format("gravitas new: no folder above '{}' holds {}; required: the program in the checkout that it was "
                  "built in, which the project's build needs, too",
                  build.string(), kTemplates));
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  if (!stream) throw std::system_error(EIO, std::generic_category(), "'" + file.string() + "'");
  return text;
}

// Every word that is a key becomes its value; values are not looked at again.
using Words = std::map<std::string, std::string>;
std::string filled(const std::string& text, const Words& words) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const auto word = std::ranges::find_if(
        words, [&](const auto& one) { return text.compare(at, one.first.size(), one.first) == 0; });
    out += word == words.end() ? std::string(1, text[at]) : word->second;
    at += word == words.end() ? 1 : word->first.size();
  }
  return out;
}

// Texts of the project's files by their names.
using Texts = std::map<std::string, std::string>;
void add_templates(const fs::path& folder, const Words& words, Texts* texts) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    // what interpreters and editors leave
    if (!entry.is_regular_file() || name.ends_with('~')) continue;
    // of these one becomes a part of the README
    if (name.starts_with("compare_")) continue;
    // under its own name it would hide files of the tree from git
    const std::string becomes = name == "gitignore" ? ".gitignore" : filled(name, words);
    (*texts)[becomes] = filled(text_of(entry.path()), words);
  }
}

// True if it had to be made.
bool make_folder(const fs::path& folder) {
  std::error_code problem;
  if (fs::create_directory(folder, problem)) return true;
  if (problem || !fs::is_directory(folder))
    throw BadInput(
        fmt::format("gravitas new: folder '{}' cannot be made: {}; allowed: a name in a folder that is there",
                    folder.string(), problem ? problem.message() : "a file has that name"));
  if (!fs::is_empty(folder, problem))
    throw BadInput(fmt::format("gravitas new: folder '{}' is not empty; allowed: one that is, or is not there (--out)",
                               folder.string()));
  return false;
}

void write_all(const fs::path& folder, const Texts& texts) {
  const bool is_new = make_folder(folder);
  std::vector<fs::path> written;
  try {
    for (const auto& [name, text] : texts) {
      errno = 0;
      std::ofstream file(folder / name, std::ios::binary);
      written.push_back(folder / name);
      file << text;
      file.close();
      if (!file)
        throw BadInput(
            fmt::format("gravitas new: '{}' cannot be written: {}; allowed: a folder that takes files (--out)",
                        (folder / name).string(), std::generic_category().message(errno)));
    }
  } catch (...) {
    std::error_code ignored;
    for (const fs::path& file : written) fs::remove(file, ignored);
    if (is_new) fs::remove(folder, ignored);
    throw;
  }
}

}  // namespace

std::string file_style(const std::string& name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool begins_word = is_upper(name[i]) && i > 0 && name[i - 1] != '_' &&
                             (!is_upper(name[i - 1]) || (i + 1 < name.size() && is_lower(name[i + 1])));
    if (begins_word) out += '_';
    out += is_upper(name[i]) ? static_cast<char>(name[i] - 'A' + 'a') : name[i];
  }
  return out;
}

Project write_project(const ProjectOptions& options, const Catalog& installed) {
  const Kind& kind = kind_of(options.kind);
  demand_name(options.name, installed);
  const fs::path build = fs::path(installed_worker()).parent_path().parent_path();
  const fs::path tree = tree_of(build), templates = tree / kTemplates;
  // stands between quotes in CMake, a shell and Python
  if (build.string().find_first_of("\"\\$`;\n") != std::string::npos)
    throw BadInput(
        fmt::format("gravitas new: this program lies in '{}'; allowed: a path without \" \\ $ ` ;", build.string()));
  const bool is_python = options.language == "python";
  const std::string prefix = is_python ? "python_" : "";
  const fs::path own = templates / (prefix + kind.slot), shared = templates / (prefix + "every_kind");
  if (!fs::exists(own))
    throw BadInput(fmt::format(
        "gravitas new: --language python: there is no template of slot {} in Python; allowed: c++", kind.slot));

  const std::string file = file_style(options.name);
  Words words = {
      {"MyName", options.name},
      {"my_name", file},
      {"@SLOT@", kind.slot},
      {"@METHOD@", kind.method},
      {"@PEER@", kind.peer},
      {"@PLUGIN@", is_python ? "Command = \"/usr/bin/python3 -B plugin.py\"" : "Library = \"build/" + file + ".so\""},
      {"@TEST@", file + "_test." + (is_python ? "py" : "cc")},
      {"@GRAVITAS@", tree.string()},
      {"@BUILD@", build.lexically_relative(tree).string()},
      {"@GRAVITAS_BUILD@", build.string()}};
  Texts texts;
  const char* const compare = kind.peer[0] != '\0' ? "compare_peer.md" : "compare_builds.md";
  words["@COMPARE@"] = filled(text_of(shared / compare), words);
  add_templates(shared, words, &texts);
  add_templates(own, words, &texts);
  // the scene is the same in all languages
  texts[file + ".gravitas"] = filled(text_of(templates / kind.slot / "my_name.gravitas"), words);

  Project project{options.folder.empty() ? fs::path(file) : fs::path(options.folder), {}};
  write_all(project.folder, texts);
  for (const auto& [name, text] : texts) project.files.push_back(name);
  return project;
}

}  // namespace gravitas::scaffold
