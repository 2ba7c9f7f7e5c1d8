#include "plugin_sdk/channel/supervisor.h"

#include <signal.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <map>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "plugin_sdk/channel/spawn.h"

namespace gravitas::channel {
namespace {

// Read at a time: what a pipe holds.
constexpr std::size_t kPipeSize = 65536;
// Pipes' worth that are read once a process has ended: a child that it left behind may write on for ever.
constexpr int kLastReads = 16;

}  // namespace

WorkerProcess::~WorkerProcess() {
  for (const std::string& line : output_.take()) std::fprintf(stderr, "process %d, %s\n", process_id_, line.c_str());
  for (const int pipe : output_pipes_)
    if (pipe >= 0) close(pipe);
  if (pidfd_ >= 0) close(pidfd_);
}

bool WorkerProcess::wait(int milliseconds) const {
  std::unique_lock lock(mutex_);
  return reaped_.wait_for(lock, std::chrono::milliseconds(milliseconds), [this] { return has_ended(); });
}

void WorkerProcess::kill() const {
  const std::lock_guard lock(mutex_);
  if (pidfd_ >= 0) syscall(SYS_pidfd_send_signal, pidfd_, SIGKILL, nullptr, 0);
}

ssize_t WorkerProcess::read_output(std::size_t stream) {
  static thread_local std::array<char, kPipeSize> bytes;
  const std::lock_guard lock(mutex_);
  const ssize_t got = read(output_pipes_[stream], bytes.data(), bytes.size());
  if (got > 0) output_.add(static_cast<OutputStream>(stream), {bytes.data(), static_cast<std::size_t>(got)});
  return got;
}

void WorkerProcess::catch_up() {
  for (std::size_t stream = 0; stream < output_pipes_.size(); ++stream) {
    read_output(stream);
    const std::lock_guard lock(mutex_);
    output_.end(static_cast<OutputStream>(stream));
  }
}

std::vector<std::string> WorkerProcess::take_output() {
  const std::lock_guard lock(mutex_);
  return output_.take();
}

std::string WorkerProcess::last_words() const {
  const std::lock_guard lock(mutex_);
  return output_.last_words();
}

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
  // by pidfd and by output pipe; of the supervisor's thread alone
  std::map<int, std::shared_ptr<WorkerProcess>> watched;
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
  const std::uint64_t one = 1;
  if (write(doorbell_, &one, sizeof one) < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  shared_->orders.push_back(&order);
  shared_->done.wait(lock, [&] { return order.done; });
  if (order.problem != 0) throw std::system_error(order.problem, std::generic_category(), arguments[0]);
  return order.process;
}

void Supervisor::run() {
  for (;;) {
    epoll_event events[16];
    const int count = epoll_wait(epoll_, events, 16, -1);
    for (int i = 0; i < count; ++i) {
      const int descriptor = events[i].data.fd;
      if (descriptor != doorbell_) {
        // what was closed since the events were fetched is not watched any more
        const auto found = shared_->watched.find(descriptor);
        if (found == shared_->watched.end()) continue;
        const std::shared_ptr<WorkerProcess> process = found->second;
        if (descriptor == process->pidfd_) {
          reap(process);
        } else {
          read_output(process.get(), descriptor == process->output_pipes_[0] ? 0 : 1);
        }
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

void Supervisor::watch(int descriptor, const std::shared_ptr<WorkerProcess>& process) {
  shared_->watched[descriptor] = process;
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = descriptor;
  epoll_ctl(epoll_, EPOLL_CTL_ADD, descriptor, &event);
}

void Supervisor::forget(int descriptor) {
  epoll_ctl(epoll_, EPOLL_CTL_DEL, descriptor, nullptr);
  shared_->watched.erase(descriptor);
}

void Supervisor::execute(Order* order) {
  const std::shared_ptr<WorkerProcess>& process = order->process;
  order->done = true;
  std::array<int, 2> theirs = {-1, -1};
  for (std::size_t i = 0; i < 2 && order->problem == 0; ++i)
    if (!make_output_pipe(&process->output_pipes_[i], &theirs[i])) order->problem = errno;
  if (order->problem == 0) {
    std::vector<int> descriptors = {theirs[0], theirs[1]};
    descriptors.insert(descriptors.end(), order->descriptors.begin(), order->descriptors.end());
    order->problem = spawn_process(order->arguments, descriptors, &process->process_id_);
  }
  for (const int end : theirs)
    if (end >= 0) close(end);
  if (order->problem != 0) return;

  // nobody else reaps our children, so the number is still that process
  process->pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, process->process_id_, 0));
  if (process->pidfd_ < 0) {
    order->problem = errno;
    ::kill(process->process_id_, SIGKILL);
    waitpid(process->process_id_, nullptr, 0);
    return;
  }
  watch(process->pidfd_, process);
  for (const int pipe : process->output_pipes_) watch(pipe, process);
}

bool Supervisor::read_output(WorkerProcess* process, std::size_t stream) {
  if (process->output_pipes_[stream] < 0) return false;
  const ssize_t got = process->read_output(stream);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return errno == EINTR;
  if (got <= 0) close_output(process, stream);
  return got > 0;
}

void Supervisor::close_output(WorkerProcess* process, std::size_t stream) {
  int& pipe = process->output_pipes_[stream];
  if (pipe < 0) return;
  forget(pipe);
  const std::lock_guard lock(process->mutex_);
  close(std::exchange(pipe, -1));
  process->output_.end(static_cast<OutputStream>(stream));
}

void Supervisor::reap(const std::shared_ptr<WorkerProcess>& process) {
  std::string ending = take_ending(process->pidfd_);
  if (ending.empty()) return;
  forget(process->pidfd_);
  for (std::size_t stream = 0; stream < process->output_pipes_.size(); ++stream) {
    for (int i = 0; i < kLastReads && read_output(process.get(), stream); ++i) {
    }
    close_output(process.get(), stream);
  }
  {
    const std::lock_guard lock(process->mutex_);
    close(std::exchange(process->pidfd_, -1));  // whoever asks how it ended may keep the rest for long
    process->ending_ = std::move(ending);
    process->ended_.store(true, std::memory_order_release);
  }
  process->reaped_.notify_all();
  // called once; what it holds may hold the process
  const std::function<void()> on_end = std::move(process->on_end_);
  process->on_end_ = nullptr;
  if (on_end) on_end();
}

}  // namespace gravitas::channel
