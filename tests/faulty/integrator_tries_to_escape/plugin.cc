// Tries, while it is loaded, what a plugin has no business with (harmlessly: it wants to know whether it could), and
// says in the third call what of it nobody prevented.
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/faulty/faulty_integrator.h"

namespace {

bool is_refused(long result, int error) { return result < 0 && errno == error; }

bool is_fork_refused() {
  const pid_t child = fork();
  if (child == 0) _exit(0);
  if (child < 0) return errno == EPERM;
  waitpid(child, nullptr, 0);
  return false;
}

bool has_1000_descriptors() {
  std::vector<int> copies;
  bool refused = false;
  while (!refused && copies.size() < 1000) {
    copies.push_back(dup(STDERR_FILENO));
    refused = copies.back() < 0;
  }
  for (const int copy : copies) close(copy);
  return !refused;
}

// All acts fail differently, or not at all, where nothing prevents them.
std::string not_prevented() {
  constexpr std::size_t kTerabyte = std::size_t{1} << 40;
  const pid_t parent = getppid();
  char program[] = "/nonexistent";
  char* const arguments[] = {program, nullptr};
  std::string list;
  const auto note = [&](const char* act, bool refused) {
    list += refused ? "" : std::string(list.empty() ? "" : ", ") + act;
  };
  note("reading", is_refused(open("/etc/passwd", O_RDONLY | O_CLOEXEC), EACCES));
  note("writing", is_refused(open("/dev/zero", O_WRONLY | O_CLOEXEC), EACCES));
  note("socket", is_refused(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), EPERM));
  note("connect", is_refused(connect(-1, nullptr, 0), EPERM));
  note("fork", is_fork_refused());
  note("exec", is_refused(execve(program, arguments, nullptr), EPERM));
  note("signal", is_refused(kill(parent, 0), EPERM));
  note("ptrace", is_refused(ptrace(PTRACE_PEEKDATA, parent, nullptr, nullptr), EPERM));
  note("peeking", is_refused(process_vm_readv(parent, nullptr, 0, nullptr, 0, 1), EPERM));
  note("1000 descriptors", !has_1000_descriptors());
  void* memory = mmap(nullptr, kTerabyte, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  note("1 TB", memory == MAP_FAILED && errno == ENOMEM);
  if (memory != MAP_FAILED) munmap(memory, kTerabyte);
  return list;
}

const std::string kNotPrevented = not_prevented();

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) {
  throw std::runtime_error("not prevented: " + (kNotPrevented.empty() ? "nothing" : kNotPrevented));
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
