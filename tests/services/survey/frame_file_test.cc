// --instrumentation of the real program.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <sstream>

#include "gravitas/instrumentation/v1/instrumentation.pb.h"
#include "tests/services/cli/program.h"

namespace gravitas::harness {
namespace {

namespace v1 = instrumentation::v1;
using ::testing::HasSubstr;
using ::testing::Not;

std::vector<std::string> short_run(const ScratchFolder& folder) {
  return {"run",      shipped_scene("stack"), "--steps", "20", "--quiet", "--hosting", "direct",
          "--report", folder.path("report")};
}

std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

TEST(FrameFile, HasAFramePerSampleAndLeavesTheRunAsItIs) {
  const ScratchFolder folder;
  ASSERT_EQ(run_program(short_run(folder), folder).exit_code, 0);
  const std::string chain = read_report(read_file(folder.path("report"))).chain_hash();
  for (const char* hosting : {"direct", "shm"}) {
    const ProgramResult result =
        run_program(with(short_run(folder), {"--hosting", hosting, "--instrumentation", folder.path("frames"),
                                             "--instrumentation-kinds", "contact,bounds", "--sample-every", "0.04"}),
                    folder);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(read_report(read_file(folder.path("report"))).chain_hash(), chain);
    std::istringstream lines(read_file(folder.path("frames")));
    std::vector<v1::Frame> frames;
    for (std::string line; std::getline(lines, line);)
      ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(line, &frames.emplace_back()).ok()) << line;
    // the first, every fifth of 1/120 s, and the last
    ASSERT_EQ(frames.size(), 5U);
    EXPECT_EQ(frames[0].step(), 0U);
    EXPECT_EQ(frames[1].step(), 5U);
    EXPECT_EQ(frames[4].step(), 20U);
    EXPECT_GT(frames[4].arrows_size(), 0);
    EXPECT_GT(frames[4].boxes_size(), 0);
    for (const v1::Arrow& arrow : frames[4].arrows()) EXPECT_EQ(arrow.kind(), v1::KIND_CONTACT);
    for (const v1::Box& box : frames[4].boxes()) EXPECT_EQ(box.kind(), v1::KIND_BOUNDS);
    for (const v1::Line& line : frames[4].lines()) EXPECT_EQ(line.kind(), v1::KIND_CONTACT);
  }
}

TEST(FrameFile, IsAPictureIfItsNameSaysSo) {
  const ScratchFolder folder;
  const ProgramResult result = run_program(
      with(short_run(folder),
           {"--instrumentation", folder.path("now.svg"), "--instrumentation-kinds", "contact,shape,trajectory"}),
      folder);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string picture = read_file(folder.path("now.svg"));
  EXPECT_THAT(picture, HasSubstr("<svg"));
  EXPECT_THAT(picture, HasSubstr("step 20"));
  EXPECT_THAT(picture, HasSubstr("class=\"shape\""));
  EXPECT_THAT(picture, HasSubstr("class=\"contact\""));
  EXPECT_THAT(picture, Not(HasSubstr("class=\"bounds\"")));
}

TEST(FrameFile, MistakesAreNamed) {
  const ScratchFolder folder;
  ProgramResult result = run_program(
      with(short_run(folder), {"--instrumentation", folder.path("frames"), "--instrumentation-kinds", "bound"}),
      folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("did you mean \"bounds\"?"));
  result = run_program(with(short_run(folder), {"--instrumentation", folder.path("nowhere/frames")}), folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("nowhere/frames"));
  result = run_program(with(short_run(folder), {"--instrumentation-kinds", "bounds"}), folder);
  EXPECT_EQ(result.exit_code, 2);
}

}  // namespace
}  // namespace gravitas::harness
