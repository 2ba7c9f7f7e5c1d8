// Files of a run that somebody takes away while they are written.
#include "services/recorder/output_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <string>
#include <system_error>

#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ScratchFolder;

// What is told where `trouble` comes between a file's lines and its end.
std::string told_after(const std::string& path, const std::function<void()>& trouble) {
  OutputFile file("trajectory", path);
  file.write("one line\n");
  trouble();
  try {
    file.close();
    return {};
  } catch (const std::system_error& error) {
    return error.what();
  }
}

TEST(OutputFile, WhatIsTakenAwayIsTold) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder.path("sub"));
  const std::string path = folder.path("sub/motion.csv"), elsewhere = folder.path("elsewhere");
  const auto is_told = ::testing::HasSubstr("trajectory '" + path + "' was removed or replaced");
  EXPECT_EQ(told_after(path, [] {}), "");
  EXPECT_THAT(told_after(path, [&] { std::filesystem::remove(path); }), is_told);
  EXPECT_THAT(told_after(path, [&] { std::filesystem::rename(path, elsewhere); }), is_told);
  EXPECT_THAT(told_after(path, [&] { std::filesystem::rename(elsewhere, path); }), is_told);
  EXPECT_THAT(told_after(path, [&] { std::filesystem::remove_all(folder.path("sub")); }), is_told);
}

TEST(OutputFile, ALinkThatStillLeadsThereIsWell) {
  const ScratchFolder folder;
  std::filesystem::create_symlink(folder.path("motion.csv"), folder.path("link"));
  EXPECT_EQ(told_after(folder.path("link"), [] {}), "");
  EXPECT_EQ(told_after("/dev/null", [] {}), "");
}

TEST(OutputFile, OnlyWhatIsNewAndHasNotBegunIsDiscarded) {
  const ScratchFolder folder;
  const std::string path = folder.path("x");
  OutputFile("capsule", path).discard();
  EXPECT_FALSE(std::filesystem::exists(path));
  folder.write("x", "what stands there");
  OutputFile("capsule", path).discard();
  EXPECT_EQ(harness::read_file(path), "what stands there");
  OutputFile begun("capsule", path);
  begun.write("more");
  begun.discard();
  begun.close();
  EXPECT_EQ(harness::read_file(path), "more");
}

}  // namespace
}  // namespace gravitas
