#include "services/check/bare_worker.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <stdexcept>
#include <system_error>

#include "gravitas/control/v1/control.grpc.pb.h"
#include "kernel/carrier/carrier.h"
#include "kernel/carrier/worker_link.h"

namespace gravitas::check {
namespace {

// How long a process may take to have ended once its stream has.
constexpr int kReapMilliseconds = 200;

std::chrono::microseconds duration(double seconds) {
  return std::chrono::microseconds(static_cast<std::int64_t>(seconds * 1e6));
}

}  // namespace

BareWorker::BareWorker(const Examinee& examinee, double seconds) {
  if (examinee.is_command()) {
    start_command(examinee.command, seconds);
  } else {
    start_library(examinee.library);
  }
}

BareWorker::~BareWorker() {
  channel_.reset();
  process_->kill();
  process_->wait(kReapMilliseconds);
}

void BareWorker::start_library(const std::string& library) {
  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    throw std::system_error(errno, std::generic_category(), "socketpair");
  process_ =
      channel::Supervisor::instance().spawn({kernel::worker_program(), "--control-fd", "3", library}, {ends[1]}, {});
  close(ends[1]);
  channel_ = kernel::worker_channel(ends[0]);
}

void BareWorker::start_command(const std::string& command, double seconds) {
  try {
    const kernel::ListeningCommand started = kernel::start_listening_command(
        command, std::chrono::duration_cast<std::chrono::milliseconds>(duration(seconds)), {});
    process_ = started.process;
    channel_ = kernel::worker_channel(started.descriptor);
  } catch (const kernel::StageFault& fault) {
    throw std::runtime_error(fault.text());
  }
}

Greeted BareWorker::greet(const control::v1::Hello& hello, double seconds) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + duration(seconds));
  const auto stream = control::v1::WorkerControl::NewStub(channel_)->Session(&context);
  control::v1::KernelMessage greeting;
  *greeting.mutable_hello() = hello;
  control::v1::WorkerMessage answer;
  Greeted greeted;
  if (stream->Write(greeting) && stream->Read(&answer)) {
    if (answer.has_refusal()) return {Greeted::kRefused, answer.refusal().text(), {}};
    if (!answer.has_welcome()) return {Greeted::kSilent, "it answers with something else than Welcome or Refusal", {}};
    greeted.welcome = answer.welcome();
    if (stream->Read(&answer)) {
      if (answer.has_refusal()) return {Greeted::kRefused, answer.refusal().text(), {}};
      greeted.outcome = Greeted::kReady;
      if (!answer.has_ready()) greeted.text = "it answers with something else than Ready after its Welcome";
      context.TryCancel();
      return greeted;
    }
  }
  const grpc::Status status = stream->Finish();
  if (process_->wait(status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED ? 0 : kReapMilliseconds))
    return {Greeted::kDied, "its process was " + process_->ending(), {}};
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED)
    return {Greeted::kSilent, fmt::format("it did not answer the greeting within {:g} s", seconds), {}};
  return {Greeted::kRefused, status.error_message(), {}};
}

}  // namespace gravitas::check
