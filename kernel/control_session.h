// The kernel's end of the control stream to one worker incarnation: handshake, heartbeat, drain.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "gravitas/control/v1/control.grpc.pb.h"

namespace gravitas::kernel {

class ControlSession {
 public:
  // Greets the worker at the other end of the channel in a thread of its own.
  ControlSession(const std::shared_ptr<grpc::Channel>& channel, control::v1::Hello hello);
  ~ControlSession();

  // Waits for the worker's answer to the greeting. Empty text: it serves; else why it does not.
  std::string wait_until_ready(std::chrono::milliseconds time);

  const control::v1::Welcome& welcome() const { return welcome_; }
  // It did not answer the greeting. Valid once it has been waited for.
  bool closed_early() const { return closed_early_; }

  // False when the last heartbeat has been waiting for its answer for long, or the stream has ended.
  bool answers_heartbeats() const;

  // Ends the stream, and whoever waits for it.
  void cancel();

  // Asks the worker to finish and exit.
  void drain();

  // What the worker said went wrong, in its words; taken out.
  std::vector<std::string> take_faults();

 private:
  void run(control::v1::Hello hello);
  std::string greet(const control::v1::Hello& hello);
  std::string judge(const control::v1::Hello& hello);
  void beat();

  static constexpr std::int64_t kAnswered = 0, kEnded = 1;
  std::unique_ptr<control::v1::WorkerControl::Stub> stub_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<control::v1::KernelMessage, control::v1::WorkerMessage>> stream_;
  control::v1::Welcome welcome_;

  std::atomic<std::int64_t> unanswered_since_{kAnswered};  // steady clock, ns
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool closed_early_ = false, greeted_ = false;
  bool draining_ = false;
  bool stopping_ = false;
  std::vector<std::string> faults_;
  std::string problem_;
  std::thread thread_;
};

// The kernel's greeting without what is the worker's own (epoch, nonce, plugins).
control::v1::Hello hello_of_this_kernel();

}  // namespace gravitas::kernel
