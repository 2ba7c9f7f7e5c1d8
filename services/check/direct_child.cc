#include "services/check/direct_child.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <exception>
#include <vector>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/host/sandbox.h"
#include "services/check/answer_text.h"

namespace gravitas::check {

using conformance::Answer;
using conformance::Question;

namespace {

// The child writes one for each answer that does not differ, and then what it found behind the other.
constexpr char kSame = '.', kFound = '!';
constexpr int kLookMilliseconds = 50;
// The address space of this program is the child's, too.
constexpr std::uint64_t kMemoryLimit = 4 * host::kDefaultMemoryLimit;

void write_text(int out, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(out, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::string first_difference(Examination& examination, const std::vector<Answer>& expected, int out) {
  Patience patience = examination.patience;
  patience.ends = {};
  std::uint32_t faults = 0;
  CarrierSubject subject(examination.examinee, kernel::Hosting::kDirect, patience, 1, &faults);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const Question& question = examination.questions()[i];
    const std::string differs = difference(question.method, expected[i], subject.ask(question));
    if (!differs.empty()) return differs;
    write_text(out, {&kSame, 1});
  }
  return {};
}

[[noreturn]] void ask_in_child(Examination& examination, const std::vector<Answer>& expected, int out) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) signal(number, SIG_DFL);
  // what a plugin prints must not mix with the report
  dup2(STDERR_FILENO, STDOUT_FILENO);
  host::close_inherited({out});
  host::enter_sandbox({examination.examinee.library}, kMemoryLimit);
  std::string found;
  try {
    found = first_difference(examination, expected, out);
  } catch (const std::exception& problem) {
    found = problem.what();
  }
  if (!found.empty()) write_text(out, kFound + found);
  _exit(0);
}

// Reads until the child has closed its end. False if it is silent for too long.
bool listen(int in, const Patience& patience, std::string* text) {
  std::uint64_t heard = channel::now_ns();
  std::array<char, 4096> buffer;
  while (true) {
    if (patience.ends && patience.ends()) throw Interrupted();
    pollfd end = {in, POLLIN, 0};
    if (::poll(&end, 1, kLookMilliseconds) <= 0) {
      if (static_cast<double>(channel::now_ns() - heard) > (patience.start + patience.cap) * 1e9) return false;
      continue;
    }
    const ssize_t got = ::read(in, buffer.data(), buffer.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return true;
    text->append(buffer.data(), static_cast<std::size_t>(got));
    heard = channel::now_ns();
  }
}

// Ends with the scope.
struct Child {
  pid_t process;
  int in;
  ~Child() {
    if (process > 0) end();
    ::close(in);
  }
  // Its status.
  int end() {
    ::kill(process, SIGKILL);
    int status = 0;
    while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {
    }
    process = -1;
    return status;
  }
};

}  // namespace

std::string compare_direct(Examination& examination) {
  const std::vector<Answer>& expected = examination.answers();
  std::array<int, 2> ends = {-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::string("no pipe could be made: ") + std::strerror(errno);
  Child child{::fork(), ends[0]};
  if (child.process == 0) ask_in_child(examination, expected, ends[1]);
  ::close(ends[1]);
  if (child.process < 0) return std::string("no process could be made: ") + std::strerror(errno);

  std::string text;
  const bool is_in_time = listen(ends[0], examination.patience, &text);
  const int status = child.end();
  const std::size_t answered = text.find(kFound), same = std::min(answered, text.size());
  std::string found = answered == std::string::npos ? "" : text.substr(answered + 1);
  const bool is_late = found.empty() && !is_in_time;
  if (is_late) found = "no answer in time";
  if (found.empty() && same < expected.size())
    found = WIFSIGNALED(status) ? fmt::format("its process ended with signal {}", strsignal(WTERMSIG(status)))
                                : fmt::format("its process ended with exit code {}", WEXITSTATUS(status));
  if (found.empty()) return {};
  const Question& question = examination.questions()[std::min(same, expected.size() - 1)];
  examination.blamed_call = call_text(question.method, question.request);
  if (is_late) ++examination.late_answers;
  return fmt::format("{}'{}' hosted direct: {}", is_late ? "too slow to be judged: " : "", question.name, found);
}

}  // namespace gravitas::check
