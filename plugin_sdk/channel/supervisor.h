// Worker processes: starting them, reading what they write, and knowing at once when one ends.
//
// One thread of the process does all of it, for as long as the process lives: the parent-death signal of a worker
// follows the *thread* that started it. A process is known by its pidfd, never by its number alone.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "plugin_sdk/channel/process_output.h"

namespace gravitas::channel {

class WorkerProcess {
 public:
  // Output that nobody has taken goes to our standard error, with the process's number.
  ~WorkerProcess();

  int process_id() const { return process_id_; }
  bool has_ended() const { return ended_.load(std::memory_order_acquire); }
  // How it ended, in words ("killed by signal 9 (Killed)"); valid once has_ended().
  const std::string& ending() const { return ending_; }

  // Waits up to `milliseconds` for the process to have ended and been reaped; whether it has.
  bool wait(int milliseconds) const;
  void kill() const;

  // Reads at once what a dying process has written, a pipe's content of it at most; a line that it began is whole.
  void catch_up();
  // What it wrote since the last time, and the last of it (process_output.h). Whole once has_ended().
  std::vector<std::string> take_output();
  std::string last_words() const;

 private:
  friend class Supervisor;

  // Reads once; what read(2) returns.
  ssize_t read_output(std::size_t stream);

  int process_id_ = -1;
  int pidfd_ = -1;
  std::array<int, 2> output_pipes_ = {-1, -1};  // standard output, standard error; closed by the supervisor
  mutable std::mutex mutex_;
  mutable std::condition_variable reaped_;
  std::atomic<bool> ended_{false};
  std::string ending_;
  ProcessOutput output_;
  std::function<void()> on_end_;
};

class Supervisor {
 public:
  // The one of this process.
  static Supervisor& instance();

  // Starts `arguments[0]` with its descriptors 3, 4, … being `descriptors` (which stay open here) and no others
  // but the standard ones: an empty input, and pipes that are read here whatever it writes. `on_end` runs in the
  // supervisor's thread, in which nothing can be spawned, when the process has ended and its output has been read.
  // Throws std::system_error.
  std::shared_ptr<WorkerProcess> spawn(const std::vector<std::string>& arguments, const std::vector<int>& descriptors,
                                       std::function<void()> on_end);

 private:
  struct Order;

  Supervisor();
  void run();
  void execute(Order* order);
  void watch(int descriptor, const std::shared_ptr<WorkerProcess>& process);
  void forget(int descriptor);
  // Reads once; false if there is nothing to be read now, or ever again.
  bool read_output(WorkerProcess* process, std::size_t stream);
  void close_output(WorkerProcess* process, std::size_t stream);
  void reap(const std::shared_ptr<WorkerProcess>& process);

  int epoll_ = -1;
  int doorbell_ = -1;
  struct Shared;
  std::unique_ptr<Shared> shared_;
};

}  // namespace gravitas::channel
