// System calls, by libseccomp.
#include <fcntl.h>
#include <linux/sockios.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <initializer_list>

#include "plugin_sdk/host/sandbox.h"

namespace gravitas::host {
namespace {

// Refused whatever the arguments. What needs a capability (mounts, modules, clocks, reboot) fails without one.
constexpr int kRefused[] = {
    // another program or process
    SCMP_SYS(fork), SCMP_SYS(vfork), SCMP_SYS(execve), SCMP_SYS(execveat), SCMP_SYS(setsid), SCMP_SYS(setpgid),
    // other processes: their memory, descriptors, signals, priorities
    SCMP_SYS(ptrace), SCMP_SYS(process_vm_readv), SCMP_SYS(process_vm_writev), SCMP_SYS(process_madvise),
    SCMP_SYS(process_mrelease), SCMP_SYS(kcmp), SCMP_SYS(pidfd_open), SCMP_SYS(pidfd_getfd),
    SCMP_SYS(pidfd_send_signal), SCMP_SYS(tkill), SCMP_SYS(migrate_pages), SCMP_SYS(move_pages), SCMP_SYS(setpriority),
    SCMP_SYS(ioprio_set), SCMP_SYS(sched_setscheduler), SCMP_SYS(sched_setparam), SCMP_SYS(sched_setattr),
    // sockets: those that it needs are there
    SCMP_SYS(socket), SCMP_SYS(socketpair), SCMP_SYS(connect), SCMP_SYS(bind), SCMP_SYS(listen),
    // memory and messages that outlive it
    SCMP_SYS(shmget), SCMP_SYS(shmat), SCMP_SYS(shmctl), SCMP_SYS(semget), SCMP_SYS(semctl), SCMP_SYS(msgget),
    SCMP_SYS(msgctl), SCMP_SYS(mq_open), SCMP_SYS(mq_unlink),
    // changes of files that Landlock knows nothing of, or (truncate) not always
    SCMP_SYS(chmod), SCMP_SYS(fchmod), SCMP_SYS(fchmodat), SCMP_SYS(utime), SCMP_SYS(utimes), SCMP_SYS(futimesat),
    SCMP_SYS(utimensat), SCMP_SYS(setxattr), SCMP_SYS(lsetxattr), SCMP_SYS(fsetxattr), SCMP_SYS(removexattr),
    SCMP_SYS(lremovexattr), SCMP_SYS(fremovexattr), SCMP_SYS(truncate), SCMP_SYS(open_by_handle_at),
    SCMP_SYS(fanotify_init),
    // the kernel's own workings, where its mistakes are found
    SCMP_SYS(unshare), SCMP_SYS(setns), SCMP_SYS(io_uring_setup), SCMP_SYS(io_uring_enter), SCMP_SYS(io_uring_register),
    SCMP_SYS(bpf), SCMP_SYS(perf_event_open), SCMP_SYS(userfaultfd), SCMP_SYS(keyctl), SCMP_SYS(add_key),
    SCMP_SYS(request_key), SCMP_SYS(modify_ldt), SCMP_SYS(personality), SCMP_SYS(syslog),
    // limits
    SCMP_SYS(setrlimit)};

// Newer than Debian 12's libseccomp, which has no names for them: fchmodat2, setxattrat, removexattrat, file_setattr.
constexpr int kRefusedNumbers[] = {452, 463, 466, 469};

// An argument whose lower 32 bits, which are all that the kernel reads of it, are this.
constexpr scmp_arg_cmp is(unsigned argument, std::uint64_t value) {
  return {argument, SCMP_CMP_MASKED_EQ, 0xffffffff, value};
}
constexpr scmp_arg_cmp is_not(unsigned argument, std::uint64_t value) { return {argument, SCMP_CMP_NE, value, 0}; }
constexpr scmp_arg_cmp lacks(unsigned argument, std::uint64_t bit) { return {argument, SCMP_CMP_MASKED_EQ, bit, 0}; }

class Filter {
 public:
  Filter() : filter_(seccomp_init(SCMP_ACT_ALLOW)) {
    if (filter_ == nullptr) {
      problem_ = ENOMEM;
      return;
    }
    keep(seccomp_attr_set(filter_, SCMP_FLTATR_CTL_TSYNC, 1));
    // a tree of comparisons, quicker to put into force and to pass than a chain
    keep(seccomp_attr_set(filter_, SCMP_FLTATR_CTL_OPTIMIZE, 2));
    // calls in the manner of another architecture, 32 bits, pass by every number below
    keep(seccomp_attr_set(filter_, SCMP_FLTATR_ACT_BADARCH, SCMP_ACT_ERRNO(EPERM)));
  }
  ~Filter() {
    if (filter_ != nullptr) seccomp_release(filter_);
  }
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;

  // Fails the call with `error` if its arguments are so.
  void refuse(int call, std::initializer_list<scmp_arg_cmp> when = {}, int error = EPERM) {
    if (problem_ == 0)
      keep(seccomp_rule_add_array(filter_, SCMP_ACT_ERRNO(static_cast<unsigned>(error)), call,
                                  static_cast<unsigned>(when.size()), when.begin()));
  }
  // Puts it into force; 0 or the error of the first thing that failed.
  int load() {
    if (problem_ == 0) keep(seccomp_load(filter_));
    return problem_;
  }

 private:
  void keep(int result) {
    if (result < 0 && problem_ == 0) problem_ = -result;
  }

  scmp_filter_ctx filter_;
  int problem_ = 0;
};

}  // namespace

std::string restrict_calls() {
  Filter filter;
  for (const int call : kRefused) filter.refuse(call);
  for (const int call : kRefusedNumbers) filter.refuse(call);

  // threads, no processes
  filter.refuse(SCMP_SYS(clone3), {}, ENOSYS);
  filter.refuse(SCMP_SYS(clone), {lacks(0, CLONE_THREAD)});
  // signals to itself, as abort sends one
  const auto self = static_cast<std::uint64_t>(getpid());
  for (const int call : {SCMP_SYS(kill), SCMP_SYS(tgkill), SCMP_SYS(rt_sigqueueinfo), SCMP_SYS(rt_tgsigqueueinfo)})
    filter.refuse(call, {is_not(0, self)});
  // signals that a descriptor sends, and input for somebody else's terminal
  for (const int command : {F_SETOWN, F_SETOWN_EX, F_SETSIG})
    filter.refuse(SCMP_SYS(fcntl), {is(1, static_cast<std::uint64_t>(command))});
  for (const std::uint64_t request : {FIOSETOWN, SIOCSPGRP, TIOCSTI, TIOCLINUX})
    filter.refuse(SCMP_SYS(ioctl), {is(1, request)});
  // limits are read only, and it dies with its kernel
  filter.refuse(SCMP_SYS(prlimit64), {is_not(2, 0)});
  filter.refuse(SCMP_SYS(prctl), {is(0, PR_SET_PDEATHSIG)});

  const int problem = filter.load();
  return problem == 0 ? "seccomp" : std::string("no seccomp: ") + std::strerror(problem);
}

}  // namespace gravitas::host
