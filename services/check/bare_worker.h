// A worker process that nobody has greeted yet: what C0 talks to.
#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "gravitas/control/v1/control.pb.h"
#include "plugin_sdk/channel/supervisor.h"
#include "services/check/examinee.h"

namespace gravitas::check {

// What a worker made of a greeting.
struct Greeted {
  enum Outcome {
    kReady,    // Welcome and Ready
    kRefused,  // Refusal, or a stream that was ended with a status
    kSilent,   // nothing in time, or nothing that is an answer
    kDied
  };
  Outcome outcome = kSilent;
  std::string text;
  control::v1::Welcome welcome;
};

class BareWorker {
 public:
  // Throws std::runtime_error if it cannot be started or does not listen in time.
  BareWorker(const Examinee& examinee, double seconds);
  ~BareWorker();
  BareWorker(const BareWorker&) = delete;
  BareWorker& operator=(const BareWorker&) = delete;

  Greeted greet(const control::v1::Hello& hello, double seconds);

 private:
  void start_library(const std::string& library);
  void start_command(const std::string& command, double seconds);

  std::shared_ptr<channel::WorkerProcess> process_;
  std::shared_ptr<grpc::Channel> channel_;
};

}  // namespace gravitas::check
