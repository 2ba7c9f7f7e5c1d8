#include "services/control/client.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>

#include <charconv>
#include <chrono>
#include <filesystem>

#include "gravitas/control_api/v1/control_api.grpc.pb.h"
#include "services/run/session.h"

namespace gravitas::control {
namespace {

constexpr std::chrono::seconds kConnect{3};
constexpr std::uint32_t kSwapIntervalMs = 20;

grpc::ChannelArguments channel_arguments() {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  return arguments;
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

  template <typename Request, typename Reply>
  Reply call(grpc::Status (api::Control::Stub::*method)(grpc::ClientContext*, const Request&, Reply*),
             const Request& request) {
    grpc::ClientContext context;
    Reply reply;
    require((stub.get()->*method)(&context, request, &reply));
    return reply;
  }
};

ControlClient::ControlClient(const std::string& socket) : connection_(std::make_unique<Connection>()) {
  connection_->channel =
      grpc::CreateCustomChannel("unix:" + socket, grpc::InsecureChannelCredentials(), channel_arguments());
  if (!connection_->channel->WaitForConnected(std::chrono::system_clock::now() + kConnect))
    throw ControlError(ControlError::Kind::kNoServer, fmt::format("no server answers at {}", socket));
  connection_->stub = api::Control::NewStub(connection_->channel);
}

ControlClient::~ControlClient() = default;

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

api::SwapOrdered ControlClient::set_property(const api::SetPropertyRequest& request) {
  return connection_->call(&api::Control::Stub::SetProperty, request);
}

api::InjectOrdered ControlClient::inject(const std::string& fault) {
  api::InjectRequest request;
  request.set_fault(fault);
  return connection_->call(&api::Control::Stub::Inject, request);
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
  const grpc::Status end = reader->Finish();
  const bool is_over =
      end.error_code() == grpc::StatusCode::CANCELLED || end.error_code() == grpc::StatusCode::UNAVAILABLE;
  if (!is_over) require(end);
}

// ---- what a person writes

api::SwapRequest parse_swap_request(const std::string& text) {
  const auto refuse = [&](const std::string& why) {
    throw BadInput(fmt::format("swap {}: {}; allowed: SLOT=PLUGIN[@step=N][,hosting=direct|shm|grpc]", text, why));
  };
  api::SwapRequest request;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) refuse("no SLOT=");
  request.set_slot(text.substr(0, equals));
  const std::size_t step_at = text.find("@step=", equals), hosting_at = text.find(",hosting=", equals);
  const std::size_t end = std::min({step_at, hosting_at, text.size()});
  std::string plugin = text.substr(equals + 1, end - equals - 1);
  if (plugin.empty()) refuse("no PLUGIN");
  if (plugin.find_first_of("@,") != std::string::npos) refuse(fmt::format("'{}' is no plugin", plugin));
  if (plugin.find('/') != std::string::npos || plugin.ends_with(".so"))
    plugin = std::filesystem::absolute(plugin).lexically_normal().string();
  request.set_plugin(plugin);
  const auto word_at = [&](std::size_t at, std::size_t name) {
    const std::size_t begin = at + name;
    return text.substr(begin, text.find_first_of("@,", begin) - begin);
  };
  std::size_t length = end;
  if (step_at != std::string::npos) {
    const std::string word = word_at(step_at, 6);
    std::uint32_t step = 0;
    const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), step);
    if (error != std::errc() || rest != word.data() + word.size()) refuse(fmt::format("'{}' is no step", word));
    request.set_step(step);
    length += 6 + word.size();
  }
  if (hosting_at != std::string::npos) {
    request.set_hosting(word_at(hosting_at, 9));
    length += 9 + request.hosting().size();
  }
  if (length != text.size()) refuse("there is more than that");
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

std::optional<api::ServedSwap> wait_for_swap(ControlClient* client, std::uint32_t number, api::Status* last) {
  std::optional<api::ServedSwap> found;
  client->watch(kSwapIntervalMs, [&](const api::Status& status) {
    *last = status;
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
