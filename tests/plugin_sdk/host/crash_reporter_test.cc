// However a worker ends, it says so in its mailbox.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

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

}  // namespace
}  // namespace gravitas::host
