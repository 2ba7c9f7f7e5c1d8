#include "kernel/supervisor.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

extern char** environ;

#ifndef P_PIDFD
#define P_PIDFD 3
#endif

namespace gravitas::kernel {
namespace {

// First descriptor that a worker inherits.
constexpr int kFirstInherited = 3;

std::string describe_ending(const siginfo_t& info) {
  if (info.si_code == CLD_EXITED) return "ended by itself with exit code " + std::to_string(info.si_status);
  return "killed by signal " + std::to_string(info.si_status) + " (" + strsignal(info.si_status) + ")";
}

// Runs posix_spawn with the descriptors in place; returns errno.
int spawn_process(const std::vector<std::string>& arguments, const std::vector<int>& descriptors, pid_t* pid) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, 2, 1);
  // copies above all targets, so that no dup2 overwrites a source
  std::vector<int> copies;
  for (const int descriptor : descriptors)
    copies.push_back(fcntl(descriptor, F_DUPFD_CLOEXEC, kFirstInherited + static_cast<int>(descriptors.size())));
  for (std::size_t i = 0; i < copies.size(); ++i)
    posix_spawn_file_actions_adddup2(&actions, copies[i], kFirstInherited + static_cast<int>(i));
  posix_spawn_file_actions_addclosefrom_np(&actions, kFirstInherited + static_cast<int>(descriptors.size()));

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

  const int problem = posix_spawn(pid, argv[0], &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  for (const int copy : copies) close(copy);
  return problem;
}

}  // namespace

WorkerProcess::~WorkerProcess() {
  if (pidfd_ >= 0) close(pidfd_);
}

bool WorkerProcess::wait(int milliseconds) const {
  std::unique_lock lock(mutex_);
  return reaped_.wait_for(lock, std::chrono::milliseconds(milliseconds), [this] { return has_ended(); });
}

void WorkerProcess::kill() const { syscall(SYS_pidfd_send_signal, pidfd_, SIGKILL, nullptr, 0); }

struct Supervisor::Order {
  const std::vector<std::string>& arguments;
  const std::vector<int>& descriptors;
  std::shared_ptr<WorkerProcess> process;
  int problem = 0;
  bool done = false;
};

struct Supervisor::Shared {
  std::mutex mutex;
  std::condition_variable done;
  std::deque<Order*> orders;
  std::map<int, std::shared_ptr<WorkerProcess>> processes;  // by pidfd
};

Supervisor& Supervisor::instance() {
  // never destroyed: its thread must live as long as any worker
  static Supervisor& supervisor = *new Supervisor;
  return supervisor;
}

Supervisor::Supervisor() : shared_(std::make_unique<Shared>()) {
  epoll_ = epoll_create1(EPOLL_CLOEXEC);
  doorbell_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (epoll_ < 0 || doorbell_ < 0) throw std::system_error(errno, std::generic_category(), "supervisor");
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = doorbell_;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, doorbell_, &event);
  std::thread([this] { run(); }).detach();
}

std::shared_ptr<WorkerProcess> Supervisor::spawn(const std::vector<std::string>& arguments,
                                                 const std::vector<int>& descriptors, std::function<void()> on_end) {
  Order order{arguments, descriptors, std::make_shared<WorkerProcess>(), 0, false};
  order.process->on_end_ = std::move(on_end);
  std::unique_lock lock(shared_->mutex);
  shared_->orders.push_back(&order);
  const std::uint64_t one = 1;
  if (write(doorbell_, &one, sizeof one) < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  shared_->done.wait(lock, [&] { return order.done; });
  if (order.problem != 0) throw std::system_error(order.problem, std::generic_category(), arguments[0]);
  return order.process;
}

void Supervisor::run() {
  for (;;) {
    epoll_event events[16];
    const int count = epoll_wait(epoll_, events, 16, -1);
    for (int i = 0; i < count; ++i) {
      if (events[i].data.fd != doorbell_) {
        reap(events[i].data.fd);
        continue;
      }
      std::uint64_t rings = 0;
      if (read(doorbell_, &rings, sizeof rings) < 0) continue;
      const std::lock_guard lock(shared_->mutex);
      for (Order* order : shared_->orders) execute(order);
      shared_->orders.clear();
      shared_->done.notify_all();
    }
  }
}

void Supervisor::execute(Order* order) {
  WorkerProcess& process = *order->process;
  order->done = true;
  order->problem = spawn_process(order->arguments, order->descriptors, &process.process_id_);
  if (order->problem != 0) return;
  // nobody else reaps our children, so the number is still that process
  process.pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, process.process_id_, 0));
  if (process.pidfd_ < 0) {
    order->problem = errno;
    return;
  }
  shared_->processes[process.pidfd_] = order->process;
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = process.pidfd_;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, process.pidfd_, &event);
}

void Supervisor::reap(int pidfd) {
  siginfo_t info{};
  if (waitid(static_cast<idtype_t>(P_PIDFD), static_cast<id_t>(pidfd), &info, WEXITED | WNOHANG) != 0 ||
      info.si_pid == 0)
    return;
  epoll_ctl(epoll_, EPOLL_CTL_DEL, pidfd, nullptr);
  std::shared_ptr<WorkerProcess> process;
  {
    const std::lock_guard lock(shared_->mutex);
    process = std::move(shared_->processes[pidfd]);
    shared_->processes.erase(pidfd);
  }
  {
    const std::lock_guard lock(process->mutex_);
    process->ending_ = describe_ending(info);
    process->ended_.store(true, std::memory_order_release);
  }
  process->reaped_.notify_all();
  // called once; what it holds may hold the process
  const std::function<void()> on_end = std::move(process->on_end_);
  process->on_end_ = nullptr;
  if (on_end) on_end();
}

}  // namespace gravitas::kernel
