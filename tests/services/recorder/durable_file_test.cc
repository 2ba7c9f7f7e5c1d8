// Files that are whole or not there.
#include "services/recorder/durable_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ScratchFolder;
using ::testing::HasSubstr;

std::vector<std::byte> bytes_of(std::size_t count, unsigned char value) {
  return std::vector<std::byte>(count, std::byte{value});
}

TEST(DurableFile, IsReplacedAsAWhole) {
  const ScratchFolder folder;
  const std::string path = folder.path("file");
  replace_file(path, bytes_of(5000, 1));
  EXPECT_EQ(read_whole_file(path), bytes_of(5000, 1));
  replace_file(path, bytes_of(3, 2));
  EXPECT_EQ(read_whole_file(path), bytes_of(3, 2));
  EXPECT_FALSE(std::filesystem::exists(path + ".tmp"));
}

// A limit on the size of files stands for a disk without room: a write is short, then fails.
TEST(DurableFile, WithoutRoomKeepsWhatWasThereAndSaysWhy) {
  const ScratchFolder folder;
  const std::string path = folder.path("file");
  replace_file(path, bytes_of(5000, 1));
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const rlimit small = {10'000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  std::string reason;
  try {
    replace_file(path, bytes_of(20'000, 2));
  } catch (const std::system_error& problem) {
    reason = problem.what();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, handler);
  EXPECT_THAT(reason, HasSubstr(path));
  EXPECT_THAT(reason, HasSubstr("File too large"));
  EXPECT_EQ(read_whole_file(path), bytes_of(5000, 1));
  EXPECT_FALSE(std::filesystem::exists(path + ".tmp"));
}

TEST(DurableFile, AFolderThatIsNotThereIsSaid) {
  const ScratchFolder folder;
  EXPECT_THROW(replace_file(folder.path("none/file"), bytes_of(1, 1)), std::system_error);
  EXPECT_THROW(read_whole_file(folder.path("none")), std::system_error);
}

TEST(DurableFile, DevicesFoldersAndPipesAreNotRead) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {std::string("/dev/zero"), folder.path("."), pipe}) {
    try {
      read_whole_file(path);
      FAIL() << path;
    } catch (const std::runtime_error& problem) {
      EXPECT_THAT(problem.what(), HasSubstr("not an ordinary file")) << path;
    }
  }
}

}  // namespace
}  // namespace gravitas
