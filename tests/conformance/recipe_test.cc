// The command line of plugin_sdk/README.md makes a plugin that conforms, out of this tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::HasSubstr;

// What stands between ```sh and ``` of the guide, for this build.
std::string recipe() {
  std::string guide = harness::read_file(in_source("/plugin_sdk/README.md"));
  const std::string begin = "```sh\n", there = "$GRAVITAS/build/release";
  guide = guide.substr(guide.find(begin) + begin.size());
  std::string command = guide.substr(0, guide.find("```"));
  for (std::size_t at = command.find(there); at != std::string::npos; at = command.find(there))
    command.replace(at, there.size(), in_build(""));
  return command;
}

TEST(Recipe, OfTheGuideMakesAPluginThatConforms) {
  if (std::system("command -v clang++ >/dev/null") != 0) GTEST_SKIP() << "there is no clang++";
  const ScratchFolder folder;
  std::filesystem::copy_file(in_source("/workers/hello/plugin.cc"), folder.path("my_plugin.cc"));
  const std::string script =
      folder.write("recipe.sh", "set -eu\ncd '" + folder.path("") + "'\nGRAVITAS='" + in_source("") + "'\n" + recipe());
  ASSERT_EQ(std::system(("sh '" + script + "'").c_str()), 0) << recipe();
  const ProgramResult result = run_program({"check", folder.path("my_plugin.so"), "--level", "C0"}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("no finding in what was asked for: C0"));
}

}  // namespace
}  // namespace gravitas
