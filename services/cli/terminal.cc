#include "services/cli/terminal.h"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <iostream>

#include "services/cli/commands.h"

namespace gravitas::cli {
namespace {

constexpr std::chrono::milliseconds kPatience{2000}, kOnTerminal{100}, kElsewhere{1000};
// Of a narrow terminal; a longer line would not be rewritten in place.
constexpr std::size_t kWidth = 78;

volatile std::sig_atomic_t interrupt_requested = 0, has_begun = 0;

void request_interrupt(int number) {
  if (has_begun == 0) {
    constexpr char kText[] = "gravitas: interrupted before it began\n";
    [[maybe_unused]] const ssize_t said = write(STDERR_FILENO, kText, sizeof kText - 1);
    _exit(kInterrupted);
  }
  interrupt_requested = 1;
  std::signal(number, SIG_DFL);
}

}  // namespace

void listen_to_interrupts() {
  std::signal(SIGINT, request_interrupt);
  std::signal(SIGTERM, request_interrupt);
  // a terminal that is gone; ignored under nohup
  if (std::signal(SIGHUP, request_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

bool interrupted() {
  has_begun = 1;
  return interrupt_requested != 0;
}

void let_writes_fail() {
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

StatusLine::StatusLine(bool is_wanted) : is_terminal_(isatty(STDERR_FILENO) == 1), is_wanted_(is_wanted) {}

StatusLine::~StatusLine() {
  if (is_shown_ && is_terminal_) std::cerr << fmt::format("\r{:<{}}\r", "", kWidth) << std::flush;
}

bool StatusLine::is_due() {
  if (!is_terminal_ && !is_wanted_) return false;
  const Clock::time_point now = Clock::now();
  if (!is_wanted_ && now - start_ < kPatience) return false;
  if (now - last_ < (is_terminal_ ? kOnTerminal : kElsewhere)) return false;
  last_ = now;
  return true;
}

void StatusLine::print(const std::string& text) {
  is_shown_ = true;
  std::cerr << (is_terminal_ ? fmt::format("\r{:<{}.{}}", text, kWidth, kWidth) : text + "\n") << std::flush;
}

}  // namespace gravitas::cli
