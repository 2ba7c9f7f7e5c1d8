#include <signal.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <thread>

#include "plugin_sdk/host/mailbox_loop.h"

namespace gravitas::host {
namespace {

channel::Mailbox* reporter_mailbox = nullptr;
const channel::Mailbox* reporter_kernel = nullptr;
std::uint64_t reporter_epoch = 0;
std::atomic<bool> crash_reported{false}, second_has_asked{false};
alignas(16) std::array<char, 65536> reporter_stack;

// Runs on its own stack (the signal may be a stack overflow) and calls nothing that takes a lock.
void report_crash(int signal_number) {
  if (!crash_reported.exchange(true)) {
    gravitas_frame_header header{};
    header.magic = GRAVITAS_MAGIC;
    header.kind = GRAVITAS_FRAME_CRASH;
    header.epoch = reporter_epoch;
    header.status = signal_number;
    std::memcpy(&reporter_mailbox->header, &header, sizeof header);
    channel::post(reporter_mailbox, reporter_kernel);
    // let the kernel have this core before the process is torn down
    const timespec pause = {0, 500'000};
    nanosleep(&pause, nullptr);
  }
  signal(signal_number, SIG_DFL);
  raise(signal_number);
}

// Linux writes kEnded and wakes the kernel when the calling thread ends.
void write_end_of_this_thread(channel::Mailbox* mine) { syscall(SYS_set_tid_address, &mine->signal); }

}  // namespace

bool is_crashing() { return crash_reported; }

void install_crash_reporter(channel::Mailbox* mine, const channel::Mailbox* kernel, std::uint64_t epoch) {
  reporter_mailbox = mine;
  reporter_kernel = kernel;
  reporter_epoch = epoch;
  stack_t stack{};
  stack.ss_sp = reporter_stack.data();
  stack.ss_size = reporter_stack.size();
  sigaltstack(&stack, nullptr);
  struct sigaction action {};
  action.sa_handler = report_crash;
  action.sa_flags = SA_ONSTACK | SA_NODEFER;
  sigemptyset(&action.sa_mask);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) sigaction(number, &action, nullptr);
  // Linux does it for no process's last thread, which is one of the two at most
  write_end_of_this_thread(mine);
  std::thread([mine] {
    write_end_of_this_thread(mine);
    second_has_asked = true;
    second_has_asked.notify_one();
    for (;;) pause();
  }).detach();
  // an end before that could leave this thread for the last
  second_has_asked.wait(false);
}

}  // namespace gravitas::host
