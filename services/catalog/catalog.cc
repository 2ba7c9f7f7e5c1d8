#include "services/catalog/catalog.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include "plugin_sdk/declaration_check.h"
#include "plugin_sdk/host/description_message.h"
#include "services/catalog/describe_process.h"

namespace gravitas {
namespace {

namespace files = std::filesystem;

// The worker gives up on a library by itself after five seconds.
constexpr std::chrono::milliseconds kTimeout{10000}, kTimeoutPerLibrary{6000};
constexpr std::size_t kShownBroken = 3;

// *.so of the folder by name. False with the reason if it cannot be read.
bool list_libraries(const std::string& folder, std::vector<std::string>* libraries, std::string* problem) {
  std::error_code error;
  for (files::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().extension() == ".so") libraries->push_back(files::absolute(entry->path()).string());
  std::sort(libraries->begin(), libraries->end());
  if (error) *problem = "the folder cannot be read: " + error.message();
  return !error;
}

// Which bytes files hold, by what their folders say of them; empty where one may still change unseen, since stamps of time
// are some milliseconds apart.
std::string print_of(const std::vector<std::string>& paths) {
  constexpr std::int64_t kSettled = 2;  // s
  std::string print;
  for (const std::string& path : paths) {
    struct stat status;
    if (::stat(path.c_str(), &status) != 0 || std::time(nullptr) - status.st_ctim.tv_sec < kSettled) return "";
    print += fmt::format("{} {} {} {} {}.{}\n", path, status.st_dev, status.st_ino, status.st_size,
                         status.st_ctim.tv_sec, status.st_ctim.tv_nsec);
  }
  return print;
}

// describe_libraries, but for what this process was told of the same files before: each of its scenes has the same.
bool describe_once(const std::string& worker_path, const std::vector<std::string>& libraries,
                   std::chrono::milliseconds timeout, plugin::v1::Catalog* answer, std::string* problem) {
  static std::mutex mutex;
  static std::string remembered_print;
  static plugin::v1::Catalog remembered;
  const std::lock_guard lock(mutex);
  std::vector<std::string> files = libraries;
  files.push_back(worker_path);
  const std::string print = print_of(files);
  if (!print.empty() && print == remembered_print) {
    *answer = remembered;
    return true;
  }
  if (!describe_libraries(worker_path, libraries, timeout, answer, problem)) return false;
  // what failed may not do so again
  if (std::ranges::all_of(answer->entries(), [](const auto& entry) { return entry.problem().empty(); })) {
    remembered_print = print;
    remembered = *answer;
  }
  return true;
}

// Why a described plugin cannot be used, or empty.
std::string usability(const plugin::v1::Catalog::Entry& entry, const PluginDeclaration& declaration) {
  return entry.problem().empty() ? check_declaration(declaration) : entry.problem();
}

}  // namespace

Catalog::Catalog(std::vector<InstalledPlugin> plugins)
    : plugins_(std::make_move_iterator(plugins.begin()), std::make_move_iterator(plugins.end())),
      of_folder_(plugins_.size()) {}

Catalog Catalog::installed(const std::string& worker_path, const std::string& plugin_dir) {
  Catalog catalog;
  catalog.worker_path_ = worker_path;
  std::vector<std::string> libraries;
  std::string problem;
  if (!list_libraries(plugin_dir, &libraries, &problem)) {
    catalog.broken_.push_back({plugin_dir, problem});
    return catalog;
  }
  if (libraries.empty()) return catalog;
  plugin::v1::Catalog answer;
  if (!describe_once(worker_path, libraries, kTimeout + libraries.size() * kTimeoutPerLibrary, &answer, &problem)) {
    catalog.broken_.push_back({plugin_dir, problem});
    return catalog;
  }
  for (std::size_t i = 0; i < libraries.size(); ++i) {
    const plugin::v1::Catalog::Entry& entry = answer.entries(static_cast<int>(i));
    PluginDeclaration declaration = host::from_message(entry.description());
    const std::string why = usability(entry, declaration);
    catalog.add(libraries[i], why, std::move(declaration));
  }
  catalog.of_folder_ = catalog.plugins_.size();
  return catalog;
}

void Catalog::add(const std::string& library, const std::string& problem, PluginDeclaration declaration) {
  if (problem.empty()) {
    plugins_.push_back({library, std::move(declaration)});
  } else {
    broken_.push_back({library, problem});
  }
}

const InstalledPlugin* Catalog::add_library(const std::string& path, std::string* problem) {
  if (worker_path_.empty()) {
    *problem = "there is no worker program to ask about it";
    return nullptr;
  }
  const std::string library = files::absolute(path).lexically_normal().string();
  std::error_code error;
  if (!files::is_regular_file(library, error)) {
    *problem = error ? "it cannot be read: " + error.message() : "it is no file";
    return nullptr;
  }
  plugin::v1::Catalog answer;
  if (!describe_libraries(worker_path_, {library}, kTimeout + kTimeoutPerLibrary, &answer, problem)) return nullptr;
  PluginDeclaration declaration = host::from_message(answer.entries(0).description());
  *problem = usability(answer.entries(0), declaration);
  if (!problem->empty()) return nullptr;
  add(library, "", std::move(declaration));
  return &plugins_.back();
}

const InstalledPlugin* Catalog::add_command(const std::string& command, std::string* problem) {
  // a catalogue that asks nobody runs nobody's commands
  if (worker_path_.empty()) {
    *problem = "this catalogue starts no commands";
    return nullptr;
  }
  plugin::v1::Catalog answer;
  if (!describe_command(command, kTimeout, &answer, problem)) return nullptr;
  PluginDeclaration declaration = host::from_message(answer.entries(0).description());
  *problem = usability(answer.entries(0), declaration);
  if (!problem->empty()) return nullptr;
  plugins_.push_back({"", std::move(declaration), command});
  return &plugins_.back();
}

const InstalledPlugin* Catalog::find_plugin(Slot slot, const std::string& name) const {
  for (auto plugin = plugins_.rbegin(); plugin != plugins_.rend(); ++plugin)
    if (plugin->declaration.slot == slot && plugin->declaration.name == name) return &*plugin;
  return nullptr;
}

const InstalledPlugin* Catalog::find_type(Slot slot, const std::string& type) const {
  for (auto plugin = plugins_.rbegin(); plugin != plugins_.rend(); ++plugin)
    if (plugin->declaration.slot == slot && gravitas::find_type(plugin->declaration, type) != nullptr) return &*plugin;
  return nullptr;
}

std::vector<const InstalledPlugin*> Catalog::installed_for(Slot slot, const std::string& type) const {
  std::vector<const InstalledPlugin*> found;
  for (std::size_t i = 0; i < of_folder_; ++i)
    if (plugins_[i].declaration.slot == slot && gravitas::find_type(plugins_[i].declaration, type) != nullptr)
      found.push_back(&plugins_[i]);
  return found;
}

std::vector<const InstalledPlugin*> Catalog::installed_as(Slot slot, const std::string& name) const {
  std::vector<const InstalledPlugin*> found;
  for (std::size_t i = 0; i < of_folder_; ++i)
    if (plugins_[i].declaration.slot == slot && plugins_[i].declaration.name == name) found.push_back(&plugins_[i]);
  return found;
}

bool Catalog::is_of_folder(const InstalledPlugin* plugin) const {
  return std::any_of(plugins_.begin(), plugins_.begin() + static_cast<std::ptrdiff_t>(of_folder_),
                     [&](const InstalledPlugin& one) { return &one == plugin; });
}

bool Catalog::knows_library(const std::string& library) const {
  return std::ranges::find(plugins_, library, &InstalledPlugin::library) != plugins_.end();
}

const InstalledPlugin* Catalog::find(const std::string& name) const {
  for (auto plugin = plugins_.rbegin(); plugin != plugins_.rend(); ++plugin)
    if (plugin->declaration.name == name) return &*plugin;
  return nullptr;
}

std::vector<std::string> Catalog::plugin_names(Slot slot) const {
  std::set<std::string> names;
  for (const InstalledPlugin& plugin : plugins_)
    if (plugin.declaration.slot == slot) names.insert(plugin.declaration.name);
  return {names.begin(), names.end()};
}

std::vector<std::string> Catalog::type_names(Slot slot) const {
  std::set<std::string> names;
  for (const InstalledPlugin& plugin : plugins_)
    if (plugin.declaration.slot == slot)
      for (const TypeDeclaration& type : plugin.declaration.types) names.insert(type.name);
  return {names.begin(), names.end()};
}

std::string Catalog::broken_text() const {
  std::string text;
  for (std::size_t i = 0; i < std::min(broken_.size(), kShownBroken); ++i)
    text += (i == 0 ? "" : ", ") + broken_[i].library + " (" + broken_[i].problem + ')';
  if (broken_.size() > kShownBroken) text += ", … (" + std::to_string(broken_.size()) + " in all)";
  return text.empty() ? "" : "; not usable: " + text;
}

const TypeDeclaration* find_type(const PluginDeclaration& declaration, const std::string& type) {
  for (const TypeDeclaration& candidate : declaration.types)
    if (candidate.name == type) return &candidate;
  return nullptr;
}

}  // namespace gravitas
