#include "plugin_sdk/host/control_service.h"

#include <grpcpp/server_posix.h>
#include <unistd.h>

#include <functional>
#include <string>
#include <utility>

#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/host/handshake_lie.h"
#include "plugin_sdk/printable.h"

namespace gravitas::host {

using control::v1::Hello;
using control::v1::KernelMessage;
using control::v1::Refusal;
using control::v1::WorkerMessage;

namespace {

// Complaints between two heartbeats beyond this number are dropped.
constexpr std::size_t kMostComplaints = 16;

template <typename Plugins, typename Name>
std::string names_of(const Plugins& plugins, Name name) {
  std::string names;
  for (const auto& one : plugins) names += (names.empty() ? "'" : ", '") + std::invoke(name, one) + "'";
  return names.empty() ? "no plugin" : names;
}

}  // namespace

ControlService::ControlService(std::vector<plugin::v1::Description> plugins, std::uint32_t mxcsr,
                               std::function<Admission(const Hello&)> admit)
    : plugins_(std::move(plugins)), mxcsr_(mxcsr), admit_(std::move(admit)) {}

Admission ControlService::judge(const Hello& hello) const {
  if (hello.magic() != GRAVITAS_MAGIC) return {Refusal::REASON_MAGIC, "the other side is no Gravitas kernel"};
  if (hello.protocol_minimum() > kProtocolMaximum || hello.protocol_maximum() < kProtocolMinimum) {
    return {Refusal::REASON_PROTOCOL, "the kernel speaks control protocol " + std::to_string(hello.protocol_minimum()) +
                                          " to " + std::to_string(hello.protocol_maximum()) + ", this worker " +
                                          std::to_string(kProtocolMinimum) + " to " + std::to_string(kProtocolMaximum)};
  }
  if (hello.schema_hash() != stage::kSchemaHash)
    return {Refusal::REASON_SCHEMA, "the kernel was built for another schema of the stage contracts"};
  if (hello.floating_point().mxcsr() != mxcsr_)
    return {Refusal::REASON_FLOATING_POINT, "floating-point arithmetic is set differently in kernel and worker"};
  if (hello.plugins_size() != static_cast<int>(plugins_.size()))
    return {Refusal::REASON_SETTINGS, "this worker serves " + names_of(plugins_, &plugin::v1::Description::name) +
                                          ", the kernel expects all plugins of the slot, in this order: " +
                                          names_of(hello.plugins(), &control::v1::PluginSettings::plugin)};
  // a library that could not be loaded has no name: `admit` says what is wrong with it
  for (int i = 0; i < hello.plugins_size(); ++i) {
    const std::string& name = plugins_[static_cast<std::size_t>(i)].name();
    if (!name.empty() && hello.plugins(i).plugin() != name)
      return {Refusal::REASON_LIBRARY,
              "this worker serves plugin '" + name + "', not '" + hello.plugins(i).plugin() + "'"};
  }
  return admit_(hello);
}

WorkerMessage ControlService::welcome(const Hello& hello) const {
  WorkerMessage message;
  control::v1::Welcome* welcome = message.mutable_welcome();
  welcome->set_magic(GRAVITAS_MAGIC);
  welcome->set_protocol(kProtocolMaximum);
  welcome->set_schema_hash(stage::kSchemaHash);
  welcome->set_epoch(hello.epoch());
  welcome->set_nonce(hello.nonce());
  welcome->set_build_id(GRAVITAS_BUILD_ID);
  welcome->mutable_floating_point()->set_mxcsr(mxcsr_);
  welcome->mutable_floating_point()->set_c_library(c_library());
  for (const std::string& feature : cpu_features()) welcome->mutable_floating_point()->add_cpu_features(feature);
  welcome->set_process_id(getpid());
  welcome->set_keeps_columns(true);
  for (const plugin::v1::Description& description : plugins_) *welcome->add_plugins() = description;
  for (const std::string& measure : sandbox) welcome->add_sandbox(measure);
  if (const HandshakeLie* told = find_handshake_lie(lie)) told->tell(welcome);
  return message;
}

void ControlService::complain(std::string text) {
  const std::lock_guard lock(mutex_);
  if (complaints_.size() < kMostComplaints) complaints_.push_back(std::move(text));
}

std::vector<std::string> ControlService::take_complaints() {
  const std::lock_guard lock(mutex_);
  return std::exchange(complaints_, {});
}

grpc::Status ControlService::Session(grpc::ServerContext*,
                                     grpc::ServerReaderWriter<WorkerMessage, KernelMessage>* stream) {
  // who says nothing keeps nobody away
  KernelMessage message;
  if (!stream->Read(&message) || !message.has_hello())
    return {grpc::StatusCode::INVALID_ARGUMENT, "the first message must be Hello"};
  if (taken_.exchange(true)) return {grpc::StatusCode::ALREADY_EXISTS, "this worker has its kernel"};
  grpc::Status status = serve_kernel(message.hello(), stream);
  taken_ = false;
  return status;
}

grpc::Status ControlService::serve_kernel(const Hello& hello,
                                          grpc::ServerReaderWriter<WorkerMessage, KernelMessage>* stream) {
  KernelMessage message;
  const Admission admission = judge(hello);
  if (!admission.text.empty()) {
    WorkerMessage answer;
    answer.mutable_refusal()->set_reason(admission.reason);
    answer.mutable_refusal()->set_text(printable(admission.text));
    stream->Write(answer);
    // the process may end with the session: not before the kernel, which cancels then, has read why
    while (stream->Read(&message)) {
    }
    on_end(false);
    return grpc::Status::OK;
  }
  stream->Write(welcome(hello));
  WorkerMessage ready;
  ready.mutable_ready();
  stream->Write(ready);

  while (stream->Read(&message)) {
    if (message.has_drain()) {
      on_end(false);
      return grpc::Status::OK;
    }
    if (message.has_ping()) {
      WorkerMessage answer;
      for (std::string& text : take_complaints()) {
        answer.mutable_fault()->set_text(std::move(text));
        stream->Write(answer);
      }
      answer.mutable_pong()->set_sequence(message.ping().sequence());
      answer.mutable_pong()->set_calls(calls.load());
      stream->Write(answer);
    }
  }
  on_end(true);
  return grpc::Status::OK;
}

std::unique_ptr<grpc::ServerBuilder> server_builder(grpc::Service* service) {
  auto builder = std::make_unique<grpc::ServerBuilder>();
  builder->RegisterService(service);
  builder->SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 1);
  builder->SetMaxReceiveMessageSize(-1);
  builder->SetMaxSendMessageSize(-1);
  // as in the kernel: large messages in large parts
  builder->AddChannelArgument(GRPC_ARG_HTTP2_MAX_FRAME_SIZE, 1 << 20);
  builder->AddChannelArgument(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1 << 24);
  return builder;
}

std::unique_ptr<grpc::Server> serve_descriptor(grpc::ServerBuilder* builder, int descriptor) {
  channel::prepare_for_grpc(descriptor);
  std::unique_ptr<grpc::Server> server = builder->BuildAndStart();
  if (server) grpc::AddInsecureChannelFromFd(server.get(), descriptor);
  return server;
}

}  // namespace gravitas::host
