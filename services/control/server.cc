#include "services/control/server.h"

#include <fmt/format.h>
#include <grpcpp/grpcpp.h>
#include <sys/stat.h>

#include <stdexcept>

#include "gravitas/control_api/v1/control_api.grpc.pb.h"

namespace gravitas::control {
namespace {

// How soon a call that waits notices that it was cancelled.
constexpr std::chrono::milliseconds kGlance{20};

template <typename Action>
grpc::Status answered(Action&& action) {
  try {
    action();
    return grpc::Status::OK;
  } catch (const BadInput& problem) {
    return {grpc::StatusCode::INVALID_ARGUMENT, problem.what()};
  } catch (const NotNow& problem) {
    return {grpc::StatusCode::FAILED_PRECONDITION, problem.what()};
  } catch (const std::exception& problem) {
    return {grpc::StatusCode::INTERNAL, problem.what()};
  }
}

}  // namespace

class ControlServer::Service final : public api::Control::Service {
 public:
  Service(ServedRun* run, const std::string& socket, const std::string& address) : run_(*run) {
    grpc::ServerBuilder builder;
    int bound = 0, port = 0;
    builder.AddListeningPort("unix:" + socket, grpc::InsecureServerCredentials(), &bound);
    if (!address.empty()) builder.AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
    // else two servers would share a port without a word
    builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
    builder.RegisterService(this);
    // batches of queries are as long as one likes
    builder.SetMaxReceiveMessageSize(-1);
    // nobody else may connect, wherever --socket puts it
    const mode_t before = umask(0177);
    server_ = builder.BuildAndStart();
    umask(before);
    if (!address.empty() && port == 0)
      throw BadInput(fmt::format("--listen {}: cannot listen there: is it a free address of this machine?", address));
    if (!address.empty()) address_ = fmt::format("{}:{}", address.substr(0, address.rfind(':')), port);
    if (server_ == nullptr || bound == 0) throw std::runtime_error(fmt::format("cannot listen on {}", socket));
  }

  const std::string& address() const { return address_; }

  void end() {
    server_->Shutdown(std::chrono::system_clock::now());
    server_->Wait();
  }

  grpc::Status GetStatus(grpc::ServerContext*, const api::StatusRequest*, api::Status* reply) override {
    return answered([&] { *reply = run_.status(); });
  }
  grpc::Status Pause(grpc::ServerContext*, const api::PauseRequest*, api::Status* reply) override {
    return then_status([&] { run_.pause(); }, reply);
  }
  grpc::Status Resume(grpc::ServerContext*, const api::ResumeRequest*, api::Status* reply) override {
    return then_status([&] { run_.resume(); }, reply);
  }
  grpc::Status Reset(grpc::ServerContext*, const api::ResetRequest*, api::Status* reply) override {
    return then_status([&] { run_.reset(); }, reply);
  }
  grpc::Status Step(grpc::ServerContext* context, const api::StepRequest* request, api::Status* reply) override {
    return answered([&] {
      const std::future<void> made = run_.step(request->steps());
      while (made.wait_for(kGlance) == std::future_status::timeout)
        if (context->IsCancelled()) run_.pause();
      // what the last step left may still be being written
      *reply = run_.status_between_steps();
    });
  }
  grpc::Status Swap(grpc::ServerContext*, const api::SwapRequest* request, api::SwapOrdered* reply) override {
    return answered([&] { *reply = run_.swap(*request); });
  }
  grpc::Status CallOff(grpc::ServerContext*, const api::CallOffRequest* request, api::ServedSwap* reply) override {
    return answered([&] { *reply = run_.call_off(*request); });
  }
  grpc::Status SetProperty(grpc::ServerContext*, const api::SetPropertyRequest* request,
                           api::SwapOrdered* reply) override {
    return answered([&] { *reply = run_.set_property(*request); });
  }
  grpc::Status EditScene(grpc::ServerContext*, const api::EditRequest* request, api::EditMade* reply) override {
    return answered([&] { *reply = run_.edit(*request); });
  }
  grpc::Status Wake(grpc::ServerContext*, const api::WakeRequest* request, api::Status* reply) override {
    return then_status([&] { run_.wake(*request); }, reply);
  }
  grpc::Status Inject(grpc::ServerContext*, const api::InjectRequest* request, api::InjectOrdered* reply) override {
    return answered([&] { *reply = run_.inject(*request); });
  }
  grpc::Status Capture(grpc::ServerContext* context, const api::CaptureRequest* request,
                       api::Captured* reply) override {
    return answered([&] {
      std::future<api::Captured> captured = run_.capture(*request);
      while (captured.wait_for(kGlance) == std::future_status::timeout)
        if (context->IsCancelled()) run_.end_capture();
      *reply = captured.get();
    });
  }
  grpc::Status EndCapture(grpc::ServerContext*, const api::EndCaptureRequest*, api::Status* reply) override {
    return then_status([&] { run_.end_capture(); }, reply);
  }
  grpc::Status Query(grpc::ServerContext*, const query::v1::Batch* request, query::v1::Answers* reply) override {
    return answered([&] { *reply = run_.query(*request); });
  }
  grpc::Status GetInstrumentation(grpc::ServerContext*, const api::InstrumentationRequest* request,
                                  instrumentation::v1::Frame* reply) override {
    return answered([&] { *reply = run_.instrumentation(*request); });
  }
  grpc::Status GetJoints(grpc::ServerContext*, const api::JointsRequest*, api::Joints* reply) override {
    return answered([&] { *reply = run_.joints(); });
  }
  grpc::Status GetReactions(grpc::ServerContext*, const api::ReactionsRequest*, api::Reactions* reply) override {
    return answered([&] { *reply = run_.reactions(); });
  }
  grpc::Status WatchEvents(grpc::ServerContext* context, const api::EventsRequest* request,
                           grpc::ServerWriter<events::v1::Event>* writer) override {
    return answered([&] {
      const std::shared_ptr<Subscription> subscription = run_.subscribe(*request);
      writer->SendInitialMetadata();
      for (bool goes_on = true; goes_on && !context->IsCancelled();)
        if (const auto event = subscription->next(kGlance)) goes_on = writer->Write(*event);
    });
  }
  grpc::Status DecidePairs(grpc::ServerContext* context,
                           grpc::ServerReaderWriter<api::PairQuestions, api::PairDecisions>* stream) override {
    return answered([&] {
      api::PairDecisions message;
      if (!stream->Read(&message)) return;
      const auto listener = std::make_shared<RemoteListener>([context] { context->TryCancel(); });
      run_.listen(listener, message.deadline());
      try {
        stream->SendInitialMetadata();
        for (bool goes_on = true; goes_on && !context->IsCancelled();) {
          const std::optional<api::PairQuestions> questions = listener->next(kGlance);
          if (!questions) continue;
          goes_on = stream->Write(*questions) && stream->Read(&message);
          if (goes_on) listener->answer(message);
        }
      } catch (const NotNow&) {
        listener->end();
        throw;
      }
      listener->end();
      run_.end_listening(listener);
    });
  }
  grpc::Status Watch(grpc::ServerContext* context, const api::WatchRequest* request,
                     grpc::ServerWriter<api::Status>* writer) override {
    return answered([&] {
      const std::uint32_t wanted = request->interval_ms() == 0 ? 1000 : request->interval_ms();
      if (wanted < 10 || wanted > 60000)
        throw BadInput(fmt::format("watch: an interval of {} ms; allowed: 10 to 60000, 0 for 1000", wanted));
      for (bool goes_on = true; goes_on && writer->Write(run_.status());) {
        const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(wanted);
        while (goes_on && std::chrono::steady_clock::now() < end) {
          std::this_thread::sleep_for(std::min<std::chrono::steady_clock::duration>(
              kGlance, std::max(end - std::chrono::steady_clock::now(), std::chrono::steady_clock::duration::zero())));
          goes_on = !context->IsCancelled();
        }
      }
    });
  }

 private:
  template <typename Action>
  grpc::Status then_status(Action&& action, api::Status* reply) {
    return answered([&] {
      action();
      *reply = run_.status();
    });
  }

  ServedRun& run_;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
};

ControlServer::ControlServer(ServedRun* run, const std::string& socket, const std::string& address)
    : service_(std::make_unique<Service>(run, socket, address)) {}

const std::string& ControlServer::address() const { return service_->address(); }

ControlServer::~ControlServer() { service_->end(); }

}  // namespace gravitas::control
