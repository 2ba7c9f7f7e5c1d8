// Each forbidden act twice, in a process of its own: inside the sandbox, where it fails as it should, and outside,
// where it does not fail so. The acts are harmless where they succeed.
#include "plugin_sdk/host/sandbox.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "plugin_sdk/library.h"
#include "tests/paths.h"
#include "tests/sanitized.h"

extern char** environ;

namespace gravitas::host {
namespace {

using harness::kSanitized;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::StartsWith;

const std::string kPlugin = in_build("/lib/gravitas/solver_sequential.so");
constexpr std::uint64_t kTerabyte = std::uint64_t{1} << 40;
constexpr int kAnything = -1;

// The exit code of a process of its own that runs `body`, or 1000 and the signal that ended it.
int in_child(const std::function<int()>& body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  int status = 0;
  EXPECT_EQ(waitpid(child, &status, 0), child);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

int inside(const std::function<int()>& body, std::uint64_t memory = kDefaultMemoryLimit) {
  return in_child([&] {
    enter_sandbox({kPlugin}, memory);
    return body();
  });
}

int error_of(long result) { return result == -1 ? errno : 0; }

int opens(const std::string& path, int flags) { return error_of(open(path.c_str(), flags | O_CLOEXEC, 0600)); }

int waits_for(pid_t child) {
  const int problem = error_of(child);
  if (child == 0) _exit(0);
  if (child > 0) waitpid(child, nullptr, 0);
  return problem;
}

std::string scratch() { return ::testing::TempDir() + "/gravitas_sandbox_" + std::to_string(getppid()); }

// A file that the test makes.
std::string victim(pid_t test) { return ::testing::TempDir() + "/gravitas_sandbox_victim_" + std::to_string(test); }

struct Act {
  const char* name;
  int (*act)();  // 0, or its errno
  int inside;
  int outside;  // may depend on who runs the test: kAnything
  bool by_landlock = false;
};
void PrintTo(const Act& act, std::ostream* out) { *out << act.name; }

const Act kActs[] = {
    // files
    {"WriteANewFile",
     [] {
       const std::string path = scratch();
       const int problem = opens(path, O_WRONLY | O_CREAT);
       if (problem == 0) unlink(path.c_str());
       return problem;
     },
     EACCES, 0, true},
    {"WriteTheLibrary", [] { return opens(kPlugin, O_RDWR); }, EACCES, kAnything, true},
    {"ReadAFileOfTheSystem", [] { return opens("/etc/passwd", O_RDONLY); }, EACCES, 0, true},
    {"ListAFolder", [] { return opens("/etc", O_RDONLY | O_DIRECTORY); }, EACCES, 0, true},
    {"ReadTheParentsMemory", [] { return opens("/proc/" + std::to_string(getppid()) + "/mem", O_RDONLY); }, EACCES,
     kAnything, true},
    {"ReadTheParentsStatus", [] { return opens("/proc/" + std::to_string(getppid()) + "/status", O_RDONLY); }, EACCES,
     0, true},
    {"ChangeAMode", [] { return error_of(chmod("/nonexistent", 0600)); }, EPERM, ENOENT},
    {"ChangeAModeByAnOpenFile", [] { return error_of(fchmod(-1, 0600)); }, EPERM, EBADF},
    {"ChangeAModeTheNewWay", [] { return error_of(syscall(452, AT_FDCWD, "/nonexistent", 0600, 0)); }, EPERM,
     kAnything},
    {"RemoveAFile", [] { return error_of(unlink(victim(getppid()).c_str())); }, EACCES, 0, true},
    {"MakeAFolder",
     [] {
       const std::string path = scratch() + "_folder";
       const int problem = error_of(mkdir(path.c_str(), 0700));
       rmdir(path.c_str());
       return problem;
     },
     EACCES, 0, true},
    {"OpenByHandle", [] { return error_of(syscall(SYS_open_by_handle_at, -1, nullptr, 0)); }, EPERM, kAnything},
    // sockets
    {"Socket", [] { return error_of(socket(AF_INET, SOCK_STREAM, 0)); }, EPERM, 0},
    {"UnixSocket", [] { return error_of(socket(AF_UNIX, SOCK_DGRAM, 0)); }, EPERM, 0},
    {"Connect", [] { return error_of(connect(-1, nullptr, 0)); }, EPERM, EBADF},
    {"Bind", [] { return error_of(bind(-1, nullptr, 0)); }, EPERM, EBADF},
    {"Listen", [] { return error_of(listen(-1, 1)); }, EPERM, EBADF},
    // processes
    {"Fork", [] { return waits_for(fork()); }, EPERM, 0},
    {"ForkByItsNumber", [] { return waits_for(static_cast<pid_t>(syscall(SYS_fork))); }, EPERM, 0},
    {"CloneAProcess",
     [] { return waits_for(static_cast<pid_t>(syscall(SYS_clone, SIGCHLD, nullptr, nullptr, nullptr, nullptr))); },
     EPERM, 0},
    {"Clone3", [] { return error_of(syscall(SYS_clone3, nullptr, 0)); }, ENOSYS, EINVAL},
    {"Execve",
     [] {
       char name[] = "/nonexistent";
       char* const arguments[] = {name, nullptr};
       return error_of(execve(name, arguments, environ));
     },
     EPERM, ENOENT},
    {"Spawn",
     [] {
       char name[] = "/bin/true";
       char* const arguments[] = {name, nullptr};
       pid_t child = 0;
       const int problem = posix_spawn(&child, name, nullptr, nullptr, arguments, environ);
       if (problem == 0) waitpid(child, nullptr, 0);
       return problem;
     },
     EPERM, 0},
    {"SignalItsParent", [] { return error_of(kill(getppid(), 0)); }, EPERM, 0},
    {"SignalItsGroup", [] { return error_of(kill(0, 0)); }, EPERM, 0},
    {"SignalAThreadOfItsParent", [] { return error_of(syscall(SYS_tgkill, getppid(), getppid(), 0)); }, EPERM, 0},
    {"SignalByDescriptor", [] { return error_of(syscall(SYS_pidfd_send_signal, -1, 0, nullptr, 0)); }, EPERM, EBADF},
    {"HaveADescriptorSignalItsParent",
     [] {
       int ends[2];
       if (pipe(ends) != 0) return 1;
       return error_of(fcntl(ends[0], F_SETOWN, getppid()));
     },
     EPERM, 0},
    {"PtraceItsParent", [] { return error_of(ptrace(PTRACE_PEEKDATA, getppid(), nullptr, nullptr)); }, EPERM, ESRCH},
    {"ReadItsParent", [] { return error_of(process_vm_readv(getppid(), nullptr, 0, nullptr, 0, 1)); }, EPERM, EINVAL},
    {"WriteItsParent", [] { return error_of(process_vm_writev(getppid(), nullptr, 0, nullptr, 0, 1)); }, EPERM, EINVAL},
    {"OutliveItsParent", [] { return error_of(prctl(PR_SET_PDEATHSIG, 0)); }, EPERM, 0},
    {"LeaveItsGroup", [] { return error_of(setpgid(0, getpgrp())); }, EPERM, 0},
    {"SharedMemoryThatStays", [] { return error_of(shmget(0x47524156, 0, 0)); }, EPERM, ENOENT},
    // limits
    {"MapATerabyte",
     [] {
       return error_of(reinterpret_cast<long>(
           mmap(nullptr, kTerabyte, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0)));
     },
     ENOMEM, 0},
    {"UseUpDescriptors",
     [] {
       for (std::uint64_t i = 0; i < kDescriptorLimit; ++i)
         if (dup(STDIN_FILENO) < 0) return errno;
       return 0;
     },
     EMFILE, 0},
    {"ChangeALimit",
     [] {
       rlimit now{};
       getrlimit(RLIMIT_AS, &now);
       return error_of(setrlimit(RLIMIT_AS, &now));
     },
     EPERM, 0},
    // the system
    {"Unshare", [] { return error_of(syscall(SYS_unshare, 0)); }, EPERM, 0},
    {"Setns", [] { return error_of(syscall(SYS_setns, -1, 0)); }, EPERM, EBADF},
    {"Mount", [] { return error_of(mount("none", "/", "no-such-type", 0, nullptr)); }, EPERM, kAnything},
    {"NameTheHost", [] { return error_of(syscall(SYS_sethostname, "", -1)); }, EPERM, kAnything},
    {"ChangeTheRoot", [] { return error_of(chroot("/")); }, EPERM, kAnything},
    {"Reboot", [] { return error_of(syscall(SYS_reboot, 0, 0, 0, nullptr)); }, EPERM, kAnything},
    {"IoUring", [] { return error_of(syscall(SYS_io_uring_setup, 1, nullptr)); }, EPERM, kAnything},
    {"Bpf", [] { return error_of(syscall(SYS_bpf, 0, nullptr, 0)); }, EPERM, kAnything},
    {"PerfEvents", [] { return error_of(syscall(SYS_perf_event_open, nullptr, 0, -1, -1, 0)); }, EPERM, kAnything},
    {"UserFaults", [] { return error_of(syscall(SYS_userfaultfd, -1)); }, EPERM, kAnything},
    {"Keys", [] { return error_of(syscall(SYS_keyctl, 0, 0, 0, 0, 0)); }, EPERM, kAnything},
};

std::string name_of(const ::testing::TestParamInfo<Act>& one) { return one.param.name; }

class Forbidden : public ::testing::TestWithParam<Act> {
 protected:
  void SetUp() override { std::ofstream(victim(getpid())) << "text"; }
  void TearDown() override { unlink(victim(getpid()).c_str()); }
};

TEST_P(Forbidden, FailsInsideAlone) {
  const Act& act = GetParam();
  if (act.inside == ENOMEM && kSanitized) GTEST_SKIP() << "a sanitizer needs the address space";
  if (act.by_landlock && syscall(SYS_landlock_create_ruleset, nullptr, 0, 1) < 1)
    GTEST_SKIP() << "this system's kernel has no Landlock";
  EXPECT_EQ(inside(act.act), act.inside);
  if (act.outside == kAnything) return;
  EXPECT_EQ(in_child(act.act), act.outside);
}

INSTANTIATE_TEST_SUITE_P(Acts, Forbidden, ::testing::ValuesIn(kActs), name_of);

const Act kAllowed[] = {
    {"SignalItself", [] { return error_of(kill(getpid(), 0)); }, 0, 0},
    {"ReadTheSystemsFolders", [] { return opens("/usr/lib", O_RDONLY | O_DIRECTORY); }, 0, 0},
    {"ReadTheLibrary", [] { return opens(kPlugin, O_RDONLY); }, 0, 0},
    {"ReadItsMaps", [] { return opens("/proc/self/maps", O_RDONLY); }, 0, 0},
    {"ReadTheCores", [] { return opens("/sys/devices/system/cpu/online", O_RDONLY); }, 0, 0},
    {"WriteToNowhere", [] { return opens("/dev/null", O_WRONLY | O_TRUNC); }, 0, 0},
    {"ReadRandomNumbers", [] { return opens("/dev/urandom", O_RDONLY); }, 0, 0},
    {"AnonymousFile", [] { return error_of(memfd_create("test", MFD_CLOEXEC)); }, 0, 0},
    {"EventDescriptor", [] { return error_of(eventfd(0, EFD_CLOEXEC)); }, 0, 0},
    {"Pipe",
     [] {
       int ends[2];
       return error_of(pipe(ends));
     },
     0, 0},
    {"ChooseACore",
     [] {
       cpu_set_t cores;
       sched_getaffinity(0, sizeof cores, &cores);
       return error_of(sched_setaffinity(0, sizeof cores, &cores));
     },
     0, 0},
    {"Allocate256MiB",
     [] {
       constexpr std::size_t kSize = std::size_t{256} << 20;
       char* memory = static_cast<char*>(std::malloc(kSize));
       if (memory == nullptr) return ENOMEM;
       for (std::size_t i = 0; i < kSize; i += 4096) static_cast<volatile char*>(memory)[i] = 1;
       std::free(memory);
       return 0;
     },
     0, 0},
    {"Threads",
     [] {
       std::atomic<int> count{0};
       std::vector<std::thread> threads;
       for (int i = 0; i < 32; ++i) threads.emplace_back([&] { ++count; });
       for (std::thread& thread : threads) thread.join();
       return count == 32 ? 0 : 1;
     },
     0, 0},
    {"LoadAPlugin",
     [] {
       std::string problem;
       return load_plugin_library(kPlugin, &problem).table != nullptr ? 0 : 1;
     },
     0, 0},
};

class Allowed : public ::testing::TestWithParam<Act> {};
TEST_P(Allowed, WorksInside) { EXPECT_EQ(inside(GetParam().act), 0); }
INSTANTIATE_TEST_SUITE_P(Acts, Allowed, ::testing::ValuesIn(kAllowed), name_of);

TEST(Sandbox, AbortStillDiesOfItsSignal) {
  EXPECT_EQ(inside([]() -> int {
              signal(SIGABRT, SIG_DFL);
              std::abort();
            }),
            1000 + SIGABRT);
}

TEST(Sandbox, TheFilterHoldsInThreadsThatWereThereBefore) {
  EXPECT_EQ(in_child([] {
              std::atomic<bool> entered{false};
              int problem = 0;
              std::thread before([&] {
                while (!entered.load()) std::this_thread::yield();
                problem = error_of(socket(AF_INET, SOCK_STREAM, 0));
              });
              enter_sandbox({}, kDefaultMemoryLimit);
              entered = true;
              before.join();
              return problem;
            }),
            EPERM);
}

TEST(Sandbox, ItsMemoryIsAsLargeAsAskedFor) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer needs the address space";
  const auto map_two_gib = [] {
    void* memory = mmap(nullptr, std::uint64_t{2} << 30, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return memory == MAP_FAILED ? errno : 0;
  };
  EXPECT_EQ(inside(map_two_gib, std::uint64_t{1} << 30), ENOMEM);
  EXPECT_EQ(inside(map_two_gib, std::uint64_t{8} << 30), 0);
}

// What enter_sandbox() says in a child that did `before`.
std::vector<std::string> said(const std::function<void()>& before, bool bare) {
  const std::string path = ::testing::TempDir() + "/gravitas_sandbox_said_" + std::to_string(getpid());
  std::ofstream out(path);
  EXPECT_EQ(
      in_child([&] {
        before();
        for (const std::string& measure : bare ? enter_bare_sandbox() : enter_sandbox({kPlugin}, kDefaultMemoryLimit))
          out << measure << std::endl;
        return 0;
      }),
      0);
  std::vector<std::string> lines;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  unlink(path.c_str());
  return lines;
}

TEST(Sandbox, SaysWhatIsEnforced) {
  const std::vector<std::string> all = said([] {}, false);
  ASSERT_EQ(all.size(), 7U);
  EXPECT_EQ(all[0], "no_new_privs");
  EXPECT_EQ(all[1], "core files 0");
  EXPECT_EQ(all[2], "descriptors 256");
  EXPECT_EQ(all[3], "capabilities dropped");
  if (all[4] != "no landlock: this system's kernel has none") {
    EXPECT_THAT(all[4], StartsWith("landlock "));
  }
  EXPECT_EQ(all[5], kSanitized ? "no limit of memory: a sanitizer needs the address space" : "memory 4096 MiB");
  EXPECT_EQ(all[6], "seccomp");
}

TEST(Sandbox, ALowerLimitStays) {
  const auto lower = [] {
    const rlimit few = {100, 100};
    setrlimit(RLIMIT_NOFILE, &few);
  };
  EXPECT_THAT(said(lower, false), Contains("descriptors 100"));
  // one that may be raised, too
  const auto lower_for_now = [] {
    const rlimit few = {100, 4096};
    setrlimit(RLIMIT_NOFILE, &few);
  };
  EXPECT_THAT(said(lower_for_now, false), Contains("descriptors 100"));
}

TEST(Sandbox, ForUnknownProgramsThereAreLimitsAlone) {
  EXPECT_THAT(said([] {}, true), ElementsAre("no_new_privs", "core files 0", "descriptors 256"));
  EXPECT_EQ(in_child([] {
              enter_bare_sandbox();
              return prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1 ? waits_for(fork()) : 1;
            }),
            0);
}

TEST(Sandbox, ClosesWhatWasInherited) {
  EXPECT_EQ(in_child([] {
              const auto is_open = [](int descriptor) { return fcntl(descriptor, F_GETFD) >= 0; };
              for (const int target : {20, 21, 22, 200}) dup2(STDERR_FILENO, target);
              close_inherited({22, 20});
              return is_open(0) && is_open(2) && is_open(20) && !is_open(21) && is_open(22) && !is_open(200) ? 0 : 1;
            }),
            0);
}

}  // namespace
}  // namespace gravitas::host
