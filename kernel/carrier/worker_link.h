// A worker and its control stream: what the carriers that leave this process share. The worker is a process that we
// start over inherited sockets, a command of somebody's own that listens where we say, or a server at an address.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/control_session.h"
#include "kernel/description.h"
#include "kernel/fault.h"
#include "plugin_sdk/channel/mailboxes.h"
#include "plugin_sdk/channel/supervisor.h"

namespace gravitas::kernel {

// How long a worker that was asked to end may take.
inline constexpr int kDrainMilliseconds = 1000;
// A call ends at this many deadlines, whatever its marks of progress.
inline constexpr std::uint64_t kDeadlineCap = 10;

// A command of somebody's own, started with `--listen unix:PATH` on a socket in a folder that only we can enter and
// that is gone afterwards; it ends with us. Waits until it listens. Throws StageFault.
struct ListeningCommand {
  std::shared_ptr<channel::WorkerProcess> process;
  int descriptor;  // connected
};
ListeningCommand start_listening_command(const std::string& command, std::chrono::milliseconds limit,
                                         std::function<void()> on_end, const std::stop_token& stop = {});

// The gRPC channel to a worker over a connected socket, which it closes.
std::shared_ptr<grpc::Channel> worker_channel(int descriptor);

class WorkerLink {
 public:
  // Starts `gravitas-worker` with the plugins of the slot, or what the slot names instead. `with_descriptors`: with
  // a second socket pair, for shared memory; else the end of the process shuts the channel's socket at once. `on_end`
  // runs in the supervisor's thread when a process of ours has ended. Whoever asks `stop` to stop ends the waiting for
  // it here and in finish(). Throws StageFault.
  WorkerLink(const SlotDescription& slot, std::uint32_t threads, bool with_descriptors, std::function<void()> on_end,
             std::stop_token stop = {});
  ~WorkerLink();
  WorkerLink(const WorkerLink&) = delete;
  WorkerLink& operator=(const WorkerLink&) = delete;

  // Waits for the handshake. Throws StageFault.
  void finish();

  // Asks it to end; the destructor waits for it.
  void drain() { control_->drain(); }
  // Ends it, unless it is dying already; the destructor waits for it.
  void kill();

  // Incarnation; unique in this process, so an answer of another one can never be taken for one of this.
  std::uint64_t epoch() const { return epoch_; }
  // Of the handshake for a worker that is no process of ours.
  int process_id() const;
  // A process of ours is gone, or, without shared memory, has said that it ends.
  bool has_ended() const { return is_ending() || (process_ && process_->has_ended()); }
  // Of a process of ours without shared memory.
  std::uint64_t requests_taken() const { return watch_ ? watch_->requests_taken() : 0; }
  // It dies of what it did; an end of our making would hide of what.
  bool is_dying() const { return is_dying_; }
  bool is_alive() const { return !has_ended() && control_->answers_heartbeats(); }
  // Each ends the worker, whatever it would say next, and throws the fault that says how it failed. `is_certain`: it is
  // dying already, which is not waited for.
  [[noreturn]] void report_death(bool is_unread = false, bool is_certain = false);
  [[noreturn]] void report_overdue(bool at_cap, std::uint64_t deadline_ns);
  [[noreturn]] void report_bad_frame(const std::string& what);

  int descriptor_socket() const { return descriptor_socket_; }
  const std::shared_ptr<grpc::Channel>& channel() const { return channel_; }
  // What it said went wrong, and the lines it wrote (process_output.h); taken out.
  std::vector<std::string> take_complaints();
  // Of the handshake.
  std::vector<std::string> sandbox() const;
  bool keeps_columns() const { return control_->welcome().keeps_columns(); }

 private:
  bool is_ending() const { return watch_ && watch_->has_ended(); }
  void start_program(const SlotDescription& slot, std::uint32_t threads, bool with_descriptors,
                     std::function<void()> on_end);

  std::stop_token stop_;
  std::uint64_t epoch_;
  std::vector<std::string> plugins_;  // names
  std::string address_;               // of a worker that is no process of ours
  int descriptor_socket_ = -1;
  bool is_dying_ = false;
  std::shared_ptr<channel::EndWatch> watch_;
  std::shared_ptr<channel::WorkerProcess> process_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<ControlSession> control_;
};

}  // namespace gravitas::kernel
