// `gravitas new`.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "plugin_sdk/shell_word.h"
#include "services/catalog/catalog.h"
#include "services/cli/commands.h"
#include "services/run/session.h"
#include "services/scaffold/new_project.h"

namespace gravitas::cli {
namespace {

int write_new_project(const scaffold::ProjectOptions& options) {
  const Catalog installed = Catalog::installed(installed_worker(), installed_plugins());
  const scaffold::Project project = scaffold::write_project(options, installed);
  const bool is_python = options.language == "python";
  const std::string file = scaffold::file_style(options.name);
  const std::string folder = shell_word(project.folder.string());
  std::cout << fmt::format("{}: plugin {} of slot {}: {}\n\nnext:\n  cd {}\n", folder, options.name, options.kind,
                           fmt::join(project.files, " "), folder);
  if (is_python) {
    const std::string build = std::filesystem::path(installed_worker()).parent_path().parent_path().string();
    std::cout << fmt::format("  /usr/bin/python3 -B {}_test.py\n  PYTHONPATH={} {} run {}.gravitas\n", file,
                             shell_word(build + "/lib/python"), shell_word(build + "/bin/gravitas"), file);
  } else {
    std::cout << "  cmake -B build -G Ninja && cmake --build build\n  ctest --test-dir build --output-on-failure\n";
  }
  return kDone;
}

}  // namespace

void add_new(CLI::App* app, Action* action) {
  const auto options = std::make_shared<scaffold::ProjectOptions>();
  CLI::App* command =
      app->add_subcommand("new", "A new plugin project, outside of this tree: it builds, conforms, and has a test");
  command->footer(
      "Example: gravitas new force MyWind\n"
      "         gravitas new solver MySolver --out ~/plugins/my_solver\n"
      "         gravitas new force MyWind --language python\n"
      "What is written is a small plugin that works, commented as a tutorial, with a scene that uses it, a test of "
      "both, and "
      "a README with the commands to build, check, run, replay, debug and compare it, in C++ also to swap it.");
  command->add_option("KIND", options->kind, "space, collision, constraint, force, solver or integrator")->required();
  command
      ->add_option("NAME", options->name,
                   "Name of the plugin, and of the type that a force or joint is in scenes: letters, digits and '_'")
      ->required();
  command->add_option("--out", options->folder,
                      "Folder to write, which is empty or not there; if absent NAME as files are named: my_wind");
  command->add_option("--language", options->language, "c++, or python but for a solver")
      ->check(CLI::IsMember({"c++", "python"}))
      ->default_val("c++");
  command->callback([=] { *action = [=] { return write_new_project(*options); }; });
}

}  // namespace gravitas::cli
