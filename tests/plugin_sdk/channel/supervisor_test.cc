#include "plugin_sdk/channel/supervisor.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <system_error>
#include <vector>

namespace gravitas::channel {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

constexpr int kLongMs = 60'000;

std::shared_ptr<WorkerProcess> shell(const std::string& command, const std::vector<int>& descriptors = {},
                                     std::function<void()> on_end = {}) {
  return Supervisor::instance().spawn({"/bin/sh", "-c", command}, descriptors, std::move(on_end));
}

// Waits until the supervisor has reaped the process.
void wait_for_end(const WorkerProcess& process) {
  ASSERT_TRUE(process.wait(kLongMs));
  while (!process.has_ended()) {
  }
}

TEST(Supervisor, SaysHowAProcessEnded) {
  const auto exits = shell("exit 7");
  wait_for_end(*exits);
  EXPECT_EQ(exits->ending(), "ended by itself with exit code 7");
  const auto killed = shell("kill -9 $$");
  wait_for_end(*killed);
  EXPECT_EQ(killed->ending(), "killed by signal 9 (Killed)");
}

TEST(Supervisor, KillsAndTellsItsListener) {
  std::atomic<int> ended{0};
  const auto process = shell("while :; do :; done", {}, [&] { ++ended; });
  EXPECT_FALSE(process->has_ended());
  process->kill();
  wait_for_end(*process);
  while (ended == 0) {
  }
  EXPECT_EQ(ended, 1);
}

TEST(Supervisor, AWorkerInheritsItsOwnDescriptorsAndNoOthers) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const int leaked = open("/dev/null", O_RDONLY);  // inheritable by accident
  // the shell's own listing shows 0 1 2 3 and the descriptor of the folder
  const auto process = shell("ls /proc/self/fd | tr '\\n' ' ' >&3", {ends[1]});
  wait_for_end(*process);
  close(ends[1]);
  close(leaked);
  char text[256] = {};
  ASSERT_GT(read(ends[0], text, sizeof text - 1), 0);
  close(ends[0]);
  EXPECT_EQ(std::string(text), "0 1 2 3 4 ");
}

TEST(Supervisor, AProgramThatDoesNotExistIsAnError) {
  EXPECT_THROW(Supervisor::instance().spawn({"/nonexistent/program"}, {}, {}), std::system_error);
}

TEST(Supervisor, ReadsWhatAProcessWritesAndTellsTheStreamsApart) {
  const auto process = shell("echo result; echo trouble >&2; printf 'no line end'");
  wait_for_end(*process);
  EXPECT_THAT(process->take_output(), UnorderedElementsAre("stdout: result", "stdout: no line end", "stderr: trouble"));
  EXPECT_THAT(process->take_output(), IsEmpty());
  EXPECT_EQ(process->last_words(), "trouble");
}

TEST(Supervisor, OutputIsThereWhileTheProcessRuns) {
  const auto process = shell("echo ready; while :; do :; done");
  std::vector<std::string> lines;
  while (lines.empty()) lines = process->take_output();
  EXPECT_THAT(lines, ElementsAre("stdout: ready"));
  EXPECT_FALSE(process->has_ended());
  process->kill();
  wait_for_end(*process);
}

TEST(Supervisor, AllOutputIsReadBeforeTheListenerHearsOfTheEnd) {
  for (int i = 0; i < 20; ++i) {
    std::shared_ptr<WorkerProcess> process;
    std::atomic<bool> known{false}, heard{false};
    std::vector<std::string> lines;
    process = shell("echo last words >&2; kill -9 $$", {}, [&] {
      while (!known) {
      }
      lines = process->take_output();
      heard = true;
    });
    known = true;
    while (!heard) {
    }
    EXPECT_THAT(lines, ElementsAre("stderr: last words"));
  }
}

// 300 MB without a line end, and as much in lines: it must neither wait for us nor be kept.
TEST(Supervisor, AFloodIsReadAndCountedAndNotKept) {
  constexpr std::uint64_t kFlood = 300'000'000;
  for (const std::string command : {"head -c 300000000 /dev/zero", "yes 0123456789 | head -c 300000000"}) {
    const auto process = shell(command + "; echo survived >&2");
    wait_for_end(*process);
    EXPECT_EQ(process->ending(), "ended by itself with exit code 0");
    std::uint64_t held = 0;
    const std::vector<std::string> lines = process->take_output();
    for (const std::string& line : lines) held += line.size();
    EXPECT_LT(held, 2 * ProcessOutput::kMostBytes);
    EXPECT_EQ(process->last_words(), "survived");
    // what was kept and what was dropped is all of it, but for line ends and prefixes
    ASSERT_FALSE(lines.empty());
    const std::string note = lines.back();
    ASSERT_TRUE(note.starts_with("stdout: ... and ") && note.ends_with(" more bytes dropped")) << note;
    const std::uint64_t dropped = std::stoull(note.substr(16));
    EXPECT_GT(dropped, kFlood - 2 * ProcessOutput::kMostBytes);
  }
}

TEST(Supervisor, OutputThatNobodyTookIsNotLost) {
  ::testing::internal::CaptureStderr();
  const int forgotten = [] {
    const auto process = shell("echo forgotten");
    wait_for_end(*process);
    return process->process_id();
  }();
  // the supervisor's thread, which may have held it last, is past it once another has ended
  wait_for_end(*shell(":"));
  wait_for_end(*shell(":"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "process " + std::to_string(forgotten) + ", stdout: forgotten\n");
}

TEST(Supervisor, AChildThatKeepsWritingDoesNotHoldUpTheEnd) {
  const auto process = shell("yes & exit 3");
  wait_for_end(*process);
  EXPECT_EQ(process->ending(), "ended by itself with exit code 3");
  process->take_output();
}

TEST(Supervisor, ADyingProcessInAFloodIsNoticed) {
  const auto process = shell("yes");
  while (process->take_output().empty()) {
  }
  process->kill();
  wait_for_end(*process);
  EXPECT_EQ(process->ending(), "killed by signal 9 (Killed)");
  process->take_output();
}

}  // namespace
}  // namespace gravitas::channel
