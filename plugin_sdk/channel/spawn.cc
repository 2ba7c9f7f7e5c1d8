#include "plugin_sdk/channel/spawn.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

extern char** environ;

#ifndef P_PIDFD
#define P_PIDFD 3
#endif

namespace gravitas::channel {

int spawn_process(const std::vector<std::string>& arguments, const std::vector<int>& descriptors, pid_t* pid) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  // copies above all targets, so that no dup2 overwrites a source
  const int end = 1 + static_cast<int>(descriptors.size());
  std::vector<int> copies;
  int problem = 0;
  for (const int descriptor : descriptors) {
    copies.push_back(fcntl(descriptor, F_DUPFD_CLOEXEC, end));
    if (copies.back() < 0 && problem == 0) problem = errno;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  for (std::size_t i = 0; i < copies.size(); ++i)
    posix_spawn_file_actions_adddup2(&actions, copies[i], static_cast<int>(i) + 1);
  posix_spawn_file_actions_addclosefrom_np(&actions, end);

  // signals as a fresh program expects them
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none, all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);

  if (problem == 0) problem = posix_spawn(pid, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  for (const int copy : copies)
    if (copy >= 0) close(copy);
  return problem;
}

bool make_output_pipe(int* ours, int* theirs) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return false;
  fcntl(ends[0], F_SETFL, O_NONBLOCK);
  *ours = ends[0];
  *theirs = ends[1];
  return true;
}

std::string take_ending(int pidfd) {
  siginfo_t info{};
  if (waitid(static_cast<idtype_t>(P_PIDFD), static_cast<id_t>(pidfd), &info, WEXITED | WNOHANG) != 0)
    return errno == ECHILD ? "ended" : "";  // where SIGCHLD is ignored nobody is told how
  if (info.si_pid == 0) return {};
  if (info.si_code == CLD_EXITED) return "ended by itself with exit code " + std::to_string(info.si_status);
  return "killed by signal " + std::to_string(info.si_status) + " (" + strsignal(info.si_status) + ")";
}

}  // namespace gravitas::channel
