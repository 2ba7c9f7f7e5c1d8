#include "services/control/client.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <filesystem>
#include <future>
#include <utility>

#include "gravitas/control_api/v1/control_api.grpc.pb.h"
#include "services/run/exchange_spec.h"
#include "services/run/session.h"

namespace gravitas::control {
namespace {

constexpr std::chrono::seconds kConnect{3};
// How long a call waits before it says for what.
constexpr std::chrono::seconds kPatience{1};
constexpr double kLongStep = 0.5;  // s
constexpr std::uint32_t kSwapIntervalMs = 20;
// How soon a call that waits notices that it was interrupted.
constexpr std::chrono::milliseconds kInterruptGlance{20};

grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  // a frame of debug geometry may be large
  arguments.SetMaxReceiveMessageSize(-1);
  return arguments;
}

// Of a stream that the server, or this end, may end at any time.
bool is_over(const grpc::Status& end) {
  return end.error_code() == grpc::StatusCode::CANCELLED || end.error_code() == grpc::StatusCode::UNAVAILABLE;
}

void require(const grpc::Status& status) {
  using Kind = ControlError::Kind;
  switch (status.error_code()) {
    case grpc::StatusCode::OK:
      return;
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::FAILED_PRECONDITION:
      throw ControlError(Kind::kRefused, status.error_message());
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::CANCELLED:
      throw ControlError(Kind::kNoServer, "the server has ended");
    default:
      throw ControlError(Kind::kOther, "the server failed: " + status.error_message());
  }
}

}  // namespace

struct ControlClient::Connection {
  std::shared_ptr<grpc::Channel> channel;
  std::unique_ptr<api::Control::Stub> stub;
  std::function<void(const api::Status&)> on_wait;

  template <typename Request, typename Reply>
  Reply call(grpc::Status (api::Control::Stub::*method)(grpc::ClientContext*, const Request&, Reply*),
             const Request& request) {
    grpc::ClientContext context;
    Reply reply;
    const auto answer = [&] { return (stub.get()->*method)(&context, request, &reply); };
    if (!on_wait) {
      require(answer());
      return reply;
    }
    std::future<grpc::Status> end = std::async(std::launch::async, answer);
    for (bool is_told = false; !is_told && end.wait_for(kPatience) == std::future_status::timeout;) is_told = tell();
    require(end.get());
    return reply;
  }

  // False if there is nothing to tell: it is not a step that takes so long.
  bool tell() {
    grpc::ClientContext context;
    api::Status status;
    if (!stub->GetStatus(&context, api::StatusRequest(), &status).ok()) return false;
    if (status.waited() < kLongStep) return false;
    on_wait(status);
    return true;
  }
};

ControlClient::ControlClient(const std::string& place) : connection_(std::make_unique<Connection>()) {
  const std::size_t colon = place.rfind(':');
  const bool is_address = colon != std::string::npos && place.find('/') == std::string::npos &&
                          place.find_first_not_of("0123456789", colon + 1) == std::string::npos;
  connection_->channel = grpc::CreateCustomChannel(is_address ? place : "unix:" + place,
                                                   grpc::InsecureChannelCredentials(), channel_arguments());
  if (!connection_->channel->WaitForConnected(std::chrono::system_clock::now() + kConnect))
    throw ControlError(ControlError::Kind::kNoServer, fmt::format("no server answers at {}", place));
  connection_->stub = api::Control::NewStub(connection_->channel);
}

ControlClient::~ControlClient() = default;

void ControlClient::on_wait(std::function<void(const api::Status&)> tell) { connection_->on_wait = std::move(tell); }

api::Status ControlClient::status() { return connection_->call(&api::Control::Stub::GetStatus, api::StatusRequest()); }

api::Status ControlClient::pause() { return connection_->call(&api::Control::Stub::Pause, api::PauseRequest()); }

api::Status ControlClient::resume() { return connection_->call(&api::Control::Stub::Resume, api::ResumeRequest()); }

api::Status ControlClient::step(std::uint32_t steps) {
  api::StepRequest request;
  request.set_steps(steps);
  return connection_->call(&api::Control::Stub::Step, request);
}

api::Status ControlClient::reset() { return connection_->call(&api::Control::Stub::Reset, api::ResetRequest()); }

api::SwapOrdered ControlClient::swap(const api::SwapRequest& request) {
  return connection_->call(&api::Control::Stub::Swap, request);
}

api::ServedSwap ControlClient::call_off(std::uint32_t number) {
  api::CallOffRequest request;
  request.set_number(number);
  return connection_->call(&api::Control::Stub::CallOff, request);
}

api::SwapOrdered ControlClient::set_property(const api::SetPropertyRequest& request) {
  return connection_->call(&api::Control::Stub::SetProperty, request);
}

api::EditMade ControlClient::edit(const api::EditRequest& request) {
  return connection_->call(&api::Control::Stub::EditScene, request);
}

api::Status ControlClient::wake(const std::string& body) {
  api::WakeRequest request;
  request.set_body(body);
  return connection_->call(&api::Control::Stub::Wake, request);
}

api::InjectOrdered ControlClient::inject(const std::string& fault) {
  api::InjectRequest request;
  request.set_fault(fault);
  return connection_->call(&api::Control::Stub::Inject, request);
}

api::Captured ControlClient::capture(const api::CaptureRequest& request, const std::function<bool()>& interrupted) {
  std::future<api::Captured> captured =
      std::async(std::launch::async, [&] { return connection_->call(&api::Control::Stub::Capture, request); });
  // again and again: it may not have begun
  while (captured.wait_for(kInterruptGlance) == std::future_status::timeout)
    if (interrupted()) connection_->call(&api::Control::Stub::EndCapture, api::EndCaptureRequest());
  return captured.get();
}

query::v1::Answers ControlClient::query(const query::v1::Batch& batch) {
  return connection_->call(&api::Control::Stub::Query, batch);
}

instrumentation::v1::Frame ControlClient::instrumentation(const api::InstrumentationRequest& request) {
  return connection_->call(&api::Control::Stub::GetInstrumentation, request);
}

api::Joints ControlClient::joints() { return connection_->call(&api::Control::Stub::GetJoints, api::JointsRequest()); }

api::Reactions ControlClient::reactions() {
  return connection_->call(&api::Control::Stub::GetReactions, api::ReactionsRequest());
}

void ControlClient::watch(std::uint32_t interval_ms, const std::function<bool(const api::Status&)>& show) {
  grpc::ClientContext context;
  api::WatchRequest request;
  request.set_interval_ms(interval_ms);
  const auto reader = connection_->stub->Watch(&context, request);
  api::Status status;
  bool goes_on = true;
  while (goes_on && reader->Read(&status)) goes_on = show(status);
  if (!goes_on) context.TryCancel();
  if (const grpc::Status end = reader->Finish(); !is_over(end)) require(end);
}

void ControlClient::watch_events(const api::EventsRequest& request, const std::function<void()>& begun,
                                 const std::function<bool(const events::v1::Event&)>& show) {
  grpc::ClientContext context;
  const auto reader = connection_->stub->WatchEvents(&context, request);
  reader->WaitForInitialMetadata();
  begun();
  events::v1::Event event;
  bool goes_on = true;
  while (goes_on && reader->Read(&event)) goes_on = show(event);
  if (!goes_on) context.TryCancel();
  if (const grpc::Status end = reader->Finish(); !is_over(end)) require(end);
}

void ControlClient::decide_pairs(
    double deadline, const std::function<void()>& begun,
    const std::function<std::optional<api::PairDecisions>(const api::PairQuestions&)>& decide) {
  grpc::ClientContext context;
  const auto stream = connection_->stub->DecidePairs(&context);
  api::PairDecisions first;
  first.set_deadline(deadline);
  stream->Write(first);
  stream->WaitForInitialMetadata();
  begun();
  api::PairQuestions questions;
  while (stream->Read(&questions)) {
    const std::optional<api::PairDecisions> decisions = decide(questions);
    if (!decisions) context.TryCancel();
    if (!decisions || !stream->Write(*decisions)) break;
  }
  // what is still on its way is of no use
  while (stream->Read(&questions)) continue;
  if (const grpc::Status end = stream->Finish(); !is_over(end)) require(end);
}

// ---- what a person writes

api::SwapRequest parse_swap_request(const std::string& text, bool compares) {
  const SwapSpec spec = compares ? parse_compare("compare", text) : parse_swap_order(text);
  const bool is_path = spec.plugin.find('/') != std::string::npos || spec.plugin.ends_with(".so");
  api::SwapRequest request;
  request.set_slot(slot_name(spec.slot));
  request.set_plugin(is_path ? std::filesystem::absolute(spec.plugin).lexically_normal().string() : spec.plugin);
  request.set_step(spec.step);
  request.set_compares(compares);
  if (spec.hosting) request.set_hosting(kernel::hosting_name(*spec.hosting));
  return request;
}

api::SetPropertyRequest parse_set_request(const std::string& text) {
  const std::size_t equals = text.find('='), dot = text.find('.');
  if (equals == std::string::npos || dot == std::string::npos || dot > equals || dot == 0 || dot + 1 == equals ||
      equals + 1 == text.size())
    throw BadInput(fmt::format("set {}: allowed: Slot.Property=VALUE, such as Solver.Iterations=50", text));
  api::SetPropertyRequest request;
  request.set_slot(text.substr(0, dot));
  request.set_property(text.substr(dot + 1, equals - dot - 1));
  request.set_value(text.substr(equals + 1));
  return request;
}

std::optional<api::ServedSwap> wait_for_swap(ControlClient* client, std::uint32_t number, api::Status* last,
                                             const std::function<void(const api::Status&)>& on_wait) {
  std::optional<api::ServedSwap> found;
  bool is_told = false;
  client->watch(kSwapIntervalMs, [&](const api::Status& status) {
    *last = status;
    if (on_wait && !is_told && status.waited() >= std::chrono::duration<double>(kPatience).count()) {
      is_told = true;
      on_wait(status);
    }
    found.reset();
    for (const api::ServedSwap& swap : status.swaps())
      if (swap.number() == number) found = swap;
    const bool is_decided = found && (found->outcome() == "committed" || found->outcome() == "rolled back" ||
                                      found->outcome() == "refused");
    return found && !is_decided && status.state() == "running";
  });
  return found;
}

}  // namespace gravitas::control
