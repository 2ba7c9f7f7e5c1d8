#include "plugin_sdk/host/fault_acts.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fenv.h>
#include <netinet/in.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

#include "plugin_sdk/counted.h"

namespace gravitas::host {
namespace {

constexpr std::size_t kPage = 4096;

// Endless: `depth` is never 0, which the compiler cannot know.
std::size_t overflow_stack(const volatile std::size_t* depth) {
  volatile char page[kPage];
  page[0] = static_cast<char>(*depth);
  if (*depth == 0) return static_cast<std::size_t>(page[0]);
  return overflow_stack(depth) + static_cast<std::size_t>(page[0]);
}

void write_where_nothing_may_be_written() {
  void* guarded = mmap(nullptr, kPage, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (guarded != MAP_FAILED) *static_cast<volatile char*>(guarded) = 1;
}

void divide_by_zero() {
  feenableexcept(FE_DIVBYZERO);
  volatile double number = 0.0;
  number = 1.0 / number;
}

std::string outcome(const std::string& what, bool done) { return what + ": " + (done ? "done" : std::strerror(errno)); }

// A new file, which goes again at once.
std::string try_open() {
  char path[] = "/tmp/gravitas-fault-XXXXXX";
  const int descriptor = mkostemp(path, O_CLOEXEC);
  std::string text = outcome("open of a new file in /tmp", descriptor >= 0);
  if (descriptor < 0) return text;
  close(descriptor);
  unlink(path);
  return text;
}

// The discard port, where nobody listens: to be told so is to have got through.
std::string try_connect() {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return outcome("socket", false);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(9);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool done = connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  std::string text = outcome("connect to 127.0.0.1:9", done);
  close(descriptor);
  return text;
}

std::string try_fork() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  std::string text = outcome("fork", child > 0);
  while (child > 0 && waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
  return text;
}

std::string try_exec() {
  char path[] = "/nonexistent/program";
  char* const arguments[] = {path, nullptr};
  char* const environment[] = {nullptr};
  execve(path, arguments, environment);
  return outcome("exec of a program that does not exist", false);
}

std::string try_ptrace() {
  const pid_t parent = getppid();
  const std::string what = "ptrace of its parent";
  if (ptrace(PTRACE_SEIZE, parent, nullptr, nullptr) != 0) return outcome(what, false);
  // it must stand still to be let go
  if (ptrace(PTRACE_INTERRUPT, parent, nullptr, nullptr) == 0)
    while (waitpid(parent, nullptr, __WALL) < 0 && errno == EINTR) {
    }
  return outcome(what, ptrace(PTRACE_DETACH, parent, nullptr, nullptr) == 0);
}

std::string try_map() {
  constexpr std::size_t kTerabyte = std::size_t{1} << 40;
  void* memory = mmap(nullptr, kTerabyte, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  std::string text = outcome("map of 1 TB", memory != MAP_FAILED);
  if (memory != MAP_FAILED) munmap(memory, kTerabyte);
  return text;
}

}  // namespace

void end_process(InjectedFault how, int exit_code) {
  volatile std::size_t depth = 1;
  switch (how) {
    case InjectedFault::kSegv:
      write_where_nothing_may_be_written();
      break;
    case InjectedFault::kAbort:
      std::abort();
    case InjectedFault::kFpe:
      divide_by_zero();
      break;
    case InjectedFault::kStack:
      depth = overflow_stack(&depth);
      break;
    case InjectedFault::kThrow:
      std::thread([] { throw std::runtime_error("an exception that was ordered"); }).join();
      break;
    case InjectedFault::kExit:
      std::_Exit(exit_code);
    default:
      break;
  }
  for (;;) kill(getpid(), SIGKILL);
}

void hang(InjectedFault how) {
  if (how == InjectedFault::kStop) {
    raise(SIGSTOP);
    return;
  }
  if (how == InjectedFault::kDeadlock) {
    pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&mutex);
    pthread_mutex_lock(&mutex);
  }
  for (volatile bool forever = true; forever;) {
  }
}

bool leak(std::size_t bytes) {
  static std::vector<std::unique_ptr<std::byte[]>> kept;
  constexpr std::size_t kPiece = std::size_t{1} << 20;
  for (std::size_t taken = 0; taken < bytes; taken += kPiece) {
    const std::size_t size = std::min(kPiece, bytes - taken);
    std::byte* memory = new (std::nothrow) std::byte[size];
    if (memory == nullptr) return false;
    std::memset(memory, 1, size);
    kept.emplace_back(memory);
  }
  return true;
}

std::string use_up_descriptors() {
  constexpr rlim_t kMost = 65536;
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur > kMost) {
    limit.rlim_cur = kMost;
    setrlimit(RLIMIT_NOFILE, &limit);
  }
  std::size_t count = 0;
  while (dup(STDERR_FILENO) >= 0) ++count;
  return "opened " + counted(count, "descriptor") + ": " + std::strerror(errno);
}

std::string flood(std::size_t bytes) {
  constexpr std::size_t kLine = 80;
  std::string lines;
  while (lines.size() < 1000 * kLine) lines += std::string(kLine - 1, '.') + '\n';
  std::size_t written = 0;
  while (written < bytes) {
    const ssize_t taken = write(STDOUT_FILENO, lines.data(), std::min(lines.size(), bytes - written));
    if (taken < 0 && errno == EINTR) continue;
    if (taken < 0) break;
    written += static_cast<std::size_t>(taken);
  }
  const std::string text = "wrote " + counted(written, "byte");
  return written < bytes ? outcome(text, false) : text;
}

std::string try_forbidden(InjectedFault what) {
  switch (what) {
    case InjectedFault::kOpen:
      return try_open();
    case InjectedFault::kConnect:
      return try_connect();
    case InjectedFault::kFork:
      return try_fork();
    case InjectedFault::kExec:
      return try_exec();
    case InjectedFault::kPtrace:
      return try_ptrace();
    case InjectedFault::kSignal:
      return outcome("signal to its parent", kill(getppid(), SIGURG) == 0);
    default:
      return try_map();
  }
}

}  // namespace gravitas::host
