// What the commands share of a person's terminal: Ctrl-C and other signals, and a line that tells how far the work is.
#pragma once

#include <chrono>
#include <string>

namespace gravitas::cli {

// From now on a SIGINT, SIGTERM or SIGHUP ends the program at once, with a word and exit code 130: it may wait for a file
// that is a pipe. From the first interrupted() on the first one is noted, and the second ends the program.
void listen_to_interrupts();
// The first has come.
bool interrupted();

// A file beyond the limit of its size, and a pipe that nobody reads any more, are errors of that write, as a full disk is.
void let_writes_fail();

// A line on standard error for work longer than two seconds, rewritten in place and gone at the end. Where that is no
// terminal: nothing, or a line a second if it `is_wanted`, from the start.
class StatusLine {
 public:
  explicit StatusLine(bool is_wanted = false);
  ~StatusLine();
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  // text() is called only when it is shown.
  template <typename Text>
  void show(Text&& text) {
    if (is_due()) print(text());
  }

 private:
  using Clock = std::chrono::steady_clock;
  bool is_due();
  void print(const std::string& text);

  bool is_terminal_, is_wanted_, is_shown_ = false;
  Clock::time_point start_ = Clock::now(), last_{};
};

}  // namespace gravitas::cli
