// However a worker ends, it says so in its mailbox.
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

#include "plugin_sdk/channel/mailboxes.h"
#include "plugin_sdk/channel/segment.h"
#include "plugin_sdk/host/mailbox_loop.h"
#include "tests/sanitized.h"

namespace gravitas::host {
namespace {

using channel::Mailbox;
using channel::Segment;
using channel::Sharing;

constexpr std::uint64_t kReporterEpoch = 7;

// The mailbox of a process that ends like that.
Segment mailbox_after(const std::function<void()>& end) {
  Segment segment = Segment::create("mailbox", sizeof(Mailbox), Sharing::kWriters);
  auto* mailbox = reinterpret_cast<Mailbox*>(segment.data());
  mailbox->signal = 1;
  const pid_t child = fork();
  if (child == 0) {
    const Mailbox kernel{};
    install_crash_reporter(mailbox, &kernel, kReporterEpoch);
    end();
    _exit(1);
  }
  EXPECT_EQ(waitpid(child, nullptr, 0), child);
  return segment;
}

const Mailbox& of(const Segment& segment) { return *reinterpret_cast<const Mailbox*>(segment.data()); }

// of the process's threads any may be the last
TEST(CrashReporter, AnEndThatNobodyReportsIsWritten) {
  for (int i = 0; i < harness::unless_sanitized(100); ++i) {
    EXPECT_EQ(of(mailbox_after([] { kill(getpid(), SIGKILL); })).signal.load(), channel::kEnded);
    EXPECT_EQ(of(mailbox_after([] { _exit(0); })).signal.load(), channel::kEnded);
  }
}

TEST(CrashReporter, ACrashIsReportedAndThenItsEnd) {
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) {
    const Segment segment = mailbox_after([&] { raise(number); });
    EXPECT_EQ(of(segment).header.kind, GRAVITAS_FRAME_CRASH);
    EXPECT_EQ(of(segment).header.status, number);
    EXPECT_EQ(of(segment).header.epoch, kReporterEpoch);
    EXPECT_EQ(of(segment).signal.load(), channel::kEnded);
  }
}

// Its socket stays open here: what closes it as the process ends is the watch alone.
TEST(CrashReporter, TheSocketOfAProcessThatEndsIsShut) {
  using End = void (*)();
  for (const End end : {End{[] { kill(getpid(), SIGKILL); }}, End{[] { raise(SIGSEGV); }}, End{[] { _exit(0); }}}) {
    int sockets[2];
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets), 0);
    channel::EndWatch watch;
    const pid_t child = fork();
    if (child == 0) {
      auto* mailbox = reinterpret_cast<Mailbox*>(
          mmap(nullptr, sizeof(Mailbox), PROT_READ | PROT_WRITE, MAP_SHARED, watch.descriptor(), 0));
      install_crash_reporter(mailbox, nullptr, kReporterEpoch);
      mailbox->progress = 3;
      char go = 0;
      if (read(sockets[1], &go, 1) == 1) end();
      _exit(1);
    }
    watch.shut_at_end(sockets[0]);
    EXPECT_FALSE(watch.has_ended());
    ASSERT_EQ(write(sockets[0], "x", 1), 1);
    pollfd shut = {sockets[0], 0, 0};
    EXPECT_EQ(poll(&shut, 1, 60'000), 1);
    EXPECT_NE(shut.revents & POLLHUP, 0);
    EXPECT_TRUE(watch.has_ended());
    EXPECT_EQ(watch.requests_taken(), 3U);
    EXPECT_EQ(waitpid(child, nullptr, 0), child);
    for (const int socket : sockets) close(socket);
  }
}

// Of one that ended before it could have asked Linux for anything, whoever reaps it tells.
TEST(CrashReporter, TheSocketOfAProcessThatIsSaidToHaveEndedIsShut) {
  int sockets[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, sockets), 0);
  channel::EndWatch watch;
  watch.shut_at_end(sockets[0]);
  watch.say_ended();
  char nothing = 0;
  EXPECT_EQ(read(sockets[0], &nothing, 1), 0);
  for (const int socket : sockets) close(socket);
}

}  // namespace
}  // namespace gravitas::host
