// Worker processes: starting them, and knowing at once when one ends.
//
// One thread of the process does both, for as long as the process lives: the parent-death signal of a worker
// follows the *thread* that started it. A process is known by its pidfd, never by its number alone.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace gravitas::kernel {

class WorkerProcess {
 public:
  ~WorkerProcess();

  int process_id() const { return process_id_; }
  bool has_ended() const { return ended_.load(std::memory_order_acquire); }
  // How it ended, in words ("killed by signal 9 (Killed)"); valid once has_ended().
  const std::string& ending() const { return ending_; }

  // Waits up to `milliseconds` for the process to have ended and been reaped; whether it has.
  bool wait(int milliseconds) const;
  void kill() const;

 private:
  friend class Supervisor;

  int process_id_ = -1;
  int pidfd_ = -1;
  mutable std::mutex mutex_;
  mutable std::condition_variable reaped_;
  std::atomic<bool> ended_{false};
  std::string ending_;
  std::function<void()> on_end_;
};

class Supervisor {
 public:
  // The one of this process.
  static Supervisor& instance();

  // Starts `arguments[0]` with its descriptors 3, 4, … being `descriptors` (which stay open here) and no others
  // but the standard ones; its standard output goes to our standard error. `on_end` runs in the supervisor's
  // thread when the process has ended. Throws std::system_error.
  std::shared_ptr<WorkerProcess> spawn(const std::vector<std::string>& arguments, const std::vector<int>& descriptors,
                                       std::function<void()> on_end);

 private:
  struct Order;

  Supervisor();
  void run();
  void execute(Order* order);
  void reap(int pidfd);

  int epoll_ = -1;
  int doorbell_ = -1;
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

}  // namespace gravitas::kernel
