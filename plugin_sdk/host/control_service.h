// The worker's end of the control stream (schemas/gravitas/control/v1/control.proto): handshake, heartbeat, drain.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "gravitas/control/v1/control.grpc.pb.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::host {

// Versions of the control protocol that this build speaks.
inline constexpr std::uint32_t kProtocolMinimum = 2;
inline constexpr std::uint32_t kProtocolMaximum = 2;

// What the worker does with an accepted Hello: create the plugins. Empty text: ready; else the reason why not.
struct Admission {
  control::v1::Refusal::Reason reason = control::v1::Refusal::REASON_UNSPECIFIED;
  std::string text;
};

class ControlService final : public control::v1::WorkerControl::Service {
 public:
  // `plugins` describes what this worker serves; `mxcsr` is the floating-point control of the thread that will
  // run them; `admit` is called once per session, in the stream's thread. There is one session at a time.
  ControlService(std::vector<plugin::v1::Description> plugins, std::uint32_t mxcsr,
                 std::function<Admission(const control::v1::Hello&)> admit);

  // Called (from a thread of gRPC) when the kernel asks the worker to end, or is gone.
  std::function<void(bool kernel_is_gone)> on_end;
  std::atomic<std::uint64_t> calls{0};
  // What the Welcome says of the sandbox (sandbox.h); set before the first session.
  std::vector<std::string> sandbox;
  // What it lies about in the Welcome (handshake_lie.h); empty: nothing. Set before the first session.
  std::string lie;

  // Something the kernel should hear of besides the answers of calls; goes out with the next heartbeat.
  void complain(std::string text);

  // Whether this worker can serve the kernel that says so of itself: empty text, or why not. `admit` has the last word.
  Admission judge(const control::v1::Hello& hello) const;

  grpc::Status Session(
      grpc::ServerContext* context,
      grpc::ServerReaderWriter<control::v1::WorkerMessage, control::v1::KernelMessage>* stream) override;

 private:
  grpc::Status serve_kernel(const control::v1::Hello& hello,
                            grpc::ServerReaderWriter<control::v1::WorkerMessage, control::v1::KernelMessage>* stream);
  std::vector<std::string> take_complaints();
  control::v1::WorkerMessage welcome(const control::v1::Hello& hello) const;

  std::vector<plugin::v1::Description> plugins_;
  std::uint32_t mxcsr_;
  std::function<Admission(const control::v1::Hello&)> admit_;
  std::atomic<bool> taken_{false};
  std::mutex mutex_;
  std::vector<std::string> complaints_;
};

// A server being built, for messages of any size.
std::unique_ptr<grpc::ServerBuilder> server_builder(grpc::Service* service);

// Serves one inherited socket and listens nowhere.
std::unique_ptr<grpc::Server> serve_descriptor(grpc::ServerBuilder* builder, int descriptor);

}  // namespace gravitas::host
