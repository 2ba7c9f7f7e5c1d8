// A worker and its control stream: what the carriers that leave this process share. The worker is a process that we
// start over inherited sockets, a command of somebody's own that listens where we say, or a server at an address.
#pragma once

#include <grpcpp/grpcpp.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "kernel/control_session.h"
#include "kernel/description.h"
#include "kernel/fault.h"
#include "kernel/supervisor.h"

namespace gravitas::kernel {

// How long a worker that was asked to end may take.
inline constexpr int kDrainMilliseconds = 1000;
// A call ends at this many deadlines, whatever its marks of progress.
inline constexpr std::uint64_t kDeadlineCap = 10;

class WorkerLink {
 public:
  // Starts `gravitas-worker` with the plugins of the slot, or what the slot names instead. `with_descriptors`: with
  // a second socket pair, for shared memory. `on_end` runs in the supervisor's thread when a process of ours has
  // ended. Throws StageFault.
  WorkerLink(const SlotDescription& slot, std::uint32_t threads, bool with_descriptors, std::function<void()> on_end);
  ~WorkerLink();
  WorkerLink(const WorkerLink&) = delete;
  WorkerLink& operator=(const WorkerLink&) = delete;

  // Waits for the handshake. Throws StageFault.
  void finish();

  // Asks it to end; the destructor waits for it.
  void drain() { control_->drain(); }
  void kill();

  // Incarnation; unique in this process, so an answer of another one can never be taken for one of this.
  std::uint64_t epoch() const { return epoch_; }
  // Of the handshake for a worker that is no process of ours.
  int process_id() const;
  bool has_ended() const { return process_ && process_->has_ended(); }
  // Throws the fault that says how it ended.
  [[noreturn]] void report_death();

  int descriptor_socket() const { return descriptor_socket_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  std::vector<std::string> take_faults() { return control_->take_faults(); }

 private:
  void start_program(const SlotDescription& slot, bool with_descriptors, std::function<void()> on_end);
  void start_command(const std::string& command, std::function<void()> on_end);
  void spawn(const std::vector<std::string>& arguments, const std::vector<int>& descriptors,
             std::function<void()> on_end);
  void use_socket(int descriptor);

  std::uint64_t epoch_;
  std::vector<std::string> plugins_;  // names
  std::string address_;               // of a worker that is no process of ours
  int descriptor_socket_ = -1;
  std::shared_ptr<WorkerProcess> process_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<ControlSession> control_;
};

}  // namespace gravitas::kernel
