#include "kernel/supervisor.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <system_error>

namespace gravitas::kernel {
namespace {

constexpr int kLongMs = 10'000;

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

}  // namespace
}  // namespace gravitas::kernel
