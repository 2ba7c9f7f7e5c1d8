// A folder that is gone with its object, and none where there is no place for it.
#include "plugin_sdk/channel/private_folder.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

namespace gravitas::channel {
namespace {

TEST(PrivateFolder, IsThereAsLongAsItsObject) {
  std::optional<PrivateFolder> folder(std::in_place);
  const std::string path = folder->path();
  ASSERT_TRUE(std::filesystem::is_directory(path));
  std::ofstream(path + "/file") << "content";
  folder.reset();
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(PrivateFolder, SaysWhyThereIsNone) {
  const char* const before = std::getenv("TMPDIR");
  const std::optional<std::string> old = before == nullptr ? std::nullopt : std::optional<std::string>(before);
  setenv("TMPDIR", "/no/such/folder", 1);
  errno = 0;
  const PrivateFolder folder;
  const int problem = errno;
  if (old) {
    setenv("TMPDIR", old->c_str(), 1);
  } else {
    unsetenv("TMPDIR");
  }
  EXPECT_EQ(folder.path(), "");
  EXPECT_NE(problem, 0);
}

}  // namespace
}  // namespace gravitas::channel
