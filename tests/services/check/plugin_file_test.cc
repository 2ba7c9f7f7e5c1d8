#include "services/check/plugin_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas::check {
namespace {

using harness::ScratchFolder;

const std::string kLibrary = in_build("/lib/gravitas/hello.so");

TEST(PluginFile, IsTellingPluginsFromOtherFiles) {
  const ScratchFolder folder;
  EXPECT_EQ(kind_of_file(kLibrary), FileKind::kPlugin);
  EXPECT_EQ(kind_of_file(in_build("/bin/gravitas-worker")), FileKind::kProgram);
  EXPECT_EQ(kind_of_file(folder.write("text", "a text about plugins")), FileKind::kOther);
  EXPECT_EQ(kind_of_file(folder.write("empty", "")), FileKind::kOther);
  EXPECT_EQ(kind_of_file(folder.path("missing")), FileKind::kMissing);
  EXPECT_EQ(kind_of_file(in_build()), FileKind::kMissing);

  // a script is a program only if it may be run
  const std::string script = folder.write("script", "#!/bin/sh\n");
  EXPECT_EQ(kind_of_file(script), FileKind::kOther);
  std::filesystem::permissions(script, std::filesystem::perms::owner_all);
  EXPECT_EQ(kind_of_file(script), FileKind::kProgram);
}

TEST(PluginFile, CutAnywhereIsReadWithoutHarm) {
  const ScratchFolder folder;
  const std::string whole = harness::read_file(kLibrary);
  for (const std::size_t size : {std::size_t{4}, std::size_t{63}, std::size_t{64}, whole.size() / 2}) {
    // its table of sections stands behind its middle
    EXPECT_NE(kind_of_file(folder.write("cut", whole.substr(0, size))), FileKind::kPlugin) << size;
  }
}

}  // namespace
}  // namespace gravitas::check
