// deploy/build_preset asked for what is no preset: a folder of that name was left in build/, with a log that nobody was
// pointed to.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "plugin_sdk/channel/private_folder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

using ::testing::HasSubstr;

// A checkout with the script, its presets and nothing to build.
class Checkout {
 public:
  Checkout() {
    fs::create_directory(path("deploy"));
    for (const std::string file : {"deploy/build_preset", "CMakePresets.json"})
      fs::copy(in_source("/" + file), path(file));
  }

  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  int build(const std::string& arguments) const {
    const std::string command = in_shell(path("deploy/build_preset")) + " " + arguments + " >" + path("out") + " 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));
  }
  std::string words() const {
    std::ostringstream text;
    text << std::ifstream(path("out")).rdbuf();
    return text.str();
  }

 private:
  const channel::PrivateFolder folder_;
};

TEST(BuildPreset, AnUnknownPresetIsRefusedWithThoseThatAreBeforeAnythingIsMade) {
  const Checkout checkout;
  for (const std::string name : {"nope", "base", "''", "'a\"b'", "../release"}) {
    EXPECT_EQ(checkout.build(name), 2) << name;
    EXPECT_THAT(checkout.words(), HasSubstr("is no preset; allowed:\n  \"release\" - Optimised")) << name;
    EXPECT_FALSE(fs::exists(checkout.path("build"))) << name;
  }
  EXPECT_EQ(checkout.build(""), 2);
  EXPECT_THAT(checkout.words(), HasSubstr("usage: deploy/build_preset PRESET"));
}

TEST(BuildPreset, HelpSaysWhatItTakes) {
  const Checkout checkout;
  for (const std::string option : {"-h", "--help"}) {
    EXPECT_EQ(checkout.build(option), 0) << checkout.words();
    EXPECT_THAT(checkout.words(), HasSubstr("  deploy/build_preset PRESET [ninja arguments: targets, -k0, ...]\n"));
    EXPECT_THAT(checkout.words(), HasSubstr("  \"tsan\"    - ThreadSanitizer\n"));
    EXPECT_FALSE(fs::exists(checkout.path("build")));
  }
}

}  // namespace
}  // namespace gravitas
