// deploy/install_dependencies on machines of all kinds: dpkg and apt are stand-ins that say what they were asked.
#include <gtest/gtest.h>
#include <sys/stat.h>

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

class Machine {
 public:
  Machine() {
    put("apt-get", "echo \"$@\" >>" + path("apt"));
    put("sudo", "exec \"$@\"");
  }

  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  void put(const std::string& program, const std::string& script) const {
    std::ofstream(path(program)) << "#!/bin/bash\n" << script << '\n';
    chmod(path(program).c_str(), 0755);
  }
  int install(const std::string& what) const {
    const std::string command = "PATH=" + folder_.path() + ":$PATH " +
                                in_shell(in_source("/deploy/install_dependencies")) + " " + what + " >" + path("out") +
                                " 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));
  }
  std::string text(const std::string& name) const {
    std::ostringstream text;
    text << std::ifstream(path(name)).rdbuf();
    return text.str();
  }

 private:
  const channel::PrivateFolder folder_;
};

// dpkg-query fails as a whole where it knows one of the packages not at all.
TEST(InstallDependencies, InstallsWhatDpkgDoesNotKnow) {
  const Machine bare;
  bare.put("dpkg-query", "echo 'installed clang'; echo 'dpkg-query: no packages found matching ccache' >&2; exit 1");
  EXPECT_EQ(bare.install("run"), 0) << bare.text("out");
  EXPECT_NE(bare.text("out").find("Installing with apt: cmake"), std::string::npos) << bare.text("out");
  EXPECT_NE(bare.text("apt").find("install --yes --no-install-recommends cmake"), std::string::npos);
  EXPECT_EQ(bare.text("apt").find(" clang "), std::string::npos);
}

TEST(InstallDependencies, IsSilentWhereNothingIsMissing) {
  const Machine whole;
  whole.put("dpkg-query", "shift 3; for name in \"$@\"; do echo \"installed $name\"; done");
  EXPECT_EQ(whole.install("test"), 0);
  EXPECT_EQ(whole.text("out"), "");
  EXPECT_FALSE(fs::exists(whole.path("apt")));
}

TEST(InstallDependencies, SaysWhatAptSaidWhenItFails) {
  const Machine broken;
  broken.put("dpkg-query", "exit 1");
  broken.put("apt-get", "echo 'E: no network'; exit 100");
  EXPECT_EQ(broken.install("run"), 1);
  EXPECT_NE(broken.text("out").find("E: no network"), std::string::npos) << broken.text("out");
  EXPECT_NE(broken.text("out").find("apt could not install: clang"), std::string::npos) << broken.text("out");
}

}  // namespace
}  // namespace gravitas
