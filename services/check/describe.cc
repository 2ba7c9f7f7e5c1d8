#include "services/check/describe.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "kernel/carrier/carrier.h"
#include "plugin_sdk/conformance/sample_values.h"
#include "plugin_sdk/declaration_check.h"
#include "plugin_sdk/host/description_message.h"
#include "plugin_sdk/shell_word.h"
#include "services/catalog/catalog.h"
#include "services/catalog/describe_process.h"
#include "services/check/examination.h"
#include "services/check/plugin_file.h"
#include "services/run/session.h"

namespace gravitas::check {
namespace {

constexpr const char* kAllowed =
    "allowed: a plugin library, a command that starts a worker of one plugin and knows --describe and --listen, or the "
    "name of an installed plugin";

Examinee find_installed(const std::string& name) {
  const Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  std::vector<InstalledPlugin> found;
  for (const InstalledPlugin& plugin : catalog.plugins())
    if (plugin.declaration.name == name || find_type(plugin.declaration, name) != nullptr) found.push_back(plugin);
  if (found.empty()) {
    std::string names;
    for (const InstalledPlugin& plugin : catalog.plugins()) names += " " + plugin.declaration.name;
    throw BadInput(fmt::format("there is no file and no plugin '{}'; {}; installed:{}", name, kAllowed, names));
  }
  if (found.size() > 1) {
    std::string libraries;
    for (const InstalledPlugin& plugin : found) libraries += " " + plugin.library;
    throw BadInput(fmt::format("several plugins are called '{}'; allowed: one of{}", name, libraries));
  }
  Examinee examinee;
  examinee.argument = name;
  examinee.library = found[0].library;
  return examinee;
}

}  // namespace

Examinee find_examinee(const std::string& argument) {
  if (argument.empty()) throw BadInput(fmt::format("'' is no plugin; {}", kAllowed));
  Examinee examinee;
  examinee.argument = argument;
  const std::string path = std::filesystem::absolute(argument).lexically_normal().string();
  switch (kind_of_file(argument)) {
    case FileKind::kPlugin:
      examinee.library = path;
      return examinee;
    case FileKind::kProgram:
      // `env`, which starts it, takes a word with '=' for a setting
      examinee.command =
          (path.find('=') == std::string::npos ? "" : "/bin/sh -c 'exec \"$0\" \"$@\"' ") + shell_word(path);
      return examinee;
    case FileKind::kLibrary:
      throw BadInput(fmt::format("'{}' is no plugin: a shared library without the function gravitas_plugin; {}",
                                 argument, kAllowed));
    case FileKind::kOther:
      throw BadInput(fmt::format("'{}' is no plugin: neither a shared library nor a program; {}", argument, kAllowed));
    case FileKind::kMissing:
      break;
  }
  if (argument.find(' ') != std::string::npos) {
    examinee.command = argument;
    return examinee;
  }
  if (argument.find('/') != std::string::npos || argument.ends_with(".so"))
    throw BadInput(fmt::format("'{}' is no file that can be read; {}", argument, kAllowed));
  return find_installed(argument);
}

std::string describe(const Examinee& examinee, double seconds, plugin::v1::Description* description) {
  const std::chrono::milliseconds time(static_cast<std::int64_t>(seconds * 1e3));
  plugin::v1::Catalog answer;
  std::string problem;
  const bool is_described =
      examinee.is_command() ? describe_command(examinee.command, time, &answer, &problem)
                            : describe_libraries(kernel::worker_program(), {examinee.library}, time, &answer, &problem);
  if (!is_described) return problem;
  if (!answer.entries(0).problem().empty()) return answer.entries(0).problem();
  *description = answer.entries(0).description();
  return {};
}

void complete(Examinee* examinee, bool is_quick) {
  const std::string problem = describe(*examinee, patience_of(*examinee, is_quick).start, &examinee->description);
  if (!problem.empty() && examinee->is_command())
    throw BadInput(fmt::format("'{}' is no plugin: {}; {}", examinee->argument, problem, kAllowed));
  examinee->problem = problem;
  if (!problem.empty()) return;
  examinee->declaration = host::from_message(examinee->description);
  if (check_declaration(examinee->declaration).empty())
    examinee->settings = conformance::default_settings(examinee->declaration);
}

}  // namespace gravitas::check
