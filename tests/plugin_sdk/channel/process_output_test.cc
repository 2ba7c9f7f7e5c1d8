#include "plugin_sdk/channel/process_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace gravitas::channel {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr OutputStream kOut = OutputStream::kStdout, kErr = OutputStream::kStderr;

TEST(ProcessOutput, MakesLinesOfWhateverPiecesCome) {
  ProcessOutput output;
  output.add(kOut, "one\ntw");
  output.add(kErr, "err");
  output.add(kOut, "o\n\n");
  EXPECT_THAT(output.take(), ElementsAre("stdout: one", "stdout: two", "stdout: "));
  output.add(kErr, "or\n");
  EXPECT_THAT(output.take(), ElementsAre("stderr: error"));
  output.add(kOut, "rest");
  EXPECT_THAT(output.take(), IsEmpty());
  output.end(kOut);
  output.end(kErr);
  EXPECT_THAT(output.take(), ElementsAre("stdout: rest"));
}

TEST(ProcessOutput, CutsALongLine) {
  ProcessOutput output;
  const std::string line(ProcessOutput::kLongestLine, 'x');
  output.add(kOut, line + line + "y\n");
  EXPECT_THAT(output.take(), ElementsAre("stdout: " + line, "stdout: " + line, "stdout: y"));
}

TEST(ProcessOutput, KeepsItsBoundAndCountsTheRest) {
  ProcessOutput output;
  const std::string line(99, 'x');
  for (int i = 0; i < 10'000; ++i) output.add(kErr, line + "\n");
  output.add(kErr, "the end\n");
  std::vector<std::string> lines = output.take();
  ASSERT_FALSE(lines.empty());
  const std::size_t kept = lines.size() - 1;
  EXPECT_LT(kept * 100, ProcessOutput::kMostBytes / 2);
  EXPECT_GT(kept * 150, ProcessOutput::kMostBytes / 2);
  EXPECT_EQ(lines.back(), "stderr: ... and " + std::to_string((10'000 - kept) * 100 + 8) + " more bytes dropped");
  EXPECT_EQ(output.last_words(), "the end");
  // there is room again
  output.add(kErr, "more\n");
  EXPECT_THAT(output.take(), ElementsAre("stderr: more"));
}

TEST(ProcessOutput, OneStreamsFloodLeavesTheOtherItsRoom) {
  ProcessOutput output;
  output.add(kOut, std::string(1'000'000, 'x'));
  output.add(kErr, "careful\n");
  EXPECT_THAT(output.take(), ::testing::Contains("stderr: careful"));
}

TEST(ProcessOutput, EmptyLinesCostTooAndAreBounded) {
  ProcessOutput output;
  output.add(kOut, std::string(1'000'000, '\n'));
  EXPECT_LT(output.take().size(), 2000U);
}

TEST(ProcessOutput, WhatCannotBeShownIsAQuestionMark) {
  ProcessOutput output;
  output.add(kOut, "a\033[1mb\tc\r\n");
  output.add(kOut, "\xc2\xb5m \xe2\x82\xac \xf0\x9f\x98\x80\n");                     // valid
  output.add(kOut, "\xb5 \xc2x \xc0\x80 \xed\xa0\x80 \xf4\x90\x80\x80 \xe2\x82\n");  // not
  EXPECT_THAT(output.take(), ElementsAre("stdout: a?[1mb\tc?", "stdout: \xc2\xb5m \xe2\x82\xac \xf0\x9f\x98\x80",
                                         "stdout: ? ?x ?? ??? ???? ??"));
}

TEST(ProcessOutput, LastWordsAreTheLastOfStandardErrorThatSaysSomething) {
  ProcessOutput output;
  EXPECT_EQ(output.last_words(), "");
  output.add(kErr, "terminate called\n  what():  x\n  \n\n");
  output.add(kOut, "later\n");
  output.take();
  EXPECT_EQ(output.last_words(), "  what():  x");
  output.add(kErr, "SUMMARY: AddressSanitizer: SEGV\n==1==ABORTING\n");
  EXPECT_EQ(output.last_words(), "SUMMARY: AddressSanitizer: SEGV");
}

// Of a Python worker that does not compile, where; but nothing of what was said before.
TEST(ProcessOutput, LastWordsSayWhere) {
  ProcessOutput output;
  output.add(kErr,
             "  a remark\nTraceback\n  File \"w.py\", line 1\n  File \"w.py\", line 3\n    f(\n     ^\nSyntaxError: "
             "'(' was never closed\n");
  EXPECT_EQ(output.last_words(), "File \"w.py\", line 3 / f( / ^ / SyntaxError: '(' was never closed");
  output.add(kErr, "done\n");
  EXPECT_EQ(output.last_words(), "done");
}

}  // namespace
}  // namespace gravitas::channel
