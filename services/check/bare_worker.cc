#include "services/check/bare_worker.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grpcpp/create_channel_posix.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "gravitas/control/v1/control.grpc.pb.h"
#include "kernel/carrier/carrier.h"

namespace gravitas::check {
namespace {

// How long a process may take to have ended once its stream has.
constexpr int kReapMilliseconds = 200;

int connect_to(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0 || connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return descriptor;
  close(descriptor);
  return -1;
}

// A folder of its own for a socket, gone with this object.
class SocketFolder {
 public:
  SocketFolder() : path_((std::filesystem::temp_directory_path() / "gravitas-XXXXXX").string()) {
    if (mkdtemp(path_.data()) == nullptr) throw std::system_error(errno, std::generic_category(), path_);
  }
  ~SocketFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  SocketFolder(const SocketFolder&) = delete;
  SocketFolder& operator=(const SocketFolder&) = delete;
  std::string socket() const { return path_ + "/worker"; }

 private:
  std::string path_;
};

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
      kernel::Supervisor::instance().spawn({kernel::worker_program(), "--control-fd", "3", library}, {ends[1]}, {});
  close(ends[1]);
  use_socket(ends[0]);
}

void BareWorker::start_command(const std::string& command, double seconds) {
  const SocketFolder folder;
  process_ = kernel::Supervisor::instance().spawn(
      {"/bin/sh", "-c", "exec " + command + " --listen unix:" + folder.socket()}, {}, {});
  const auto until = std::chrono::steady_clock::now() + duration(seconds);
  int descriptor = -1;
  while ((descriptor = connect_to(folder.socket())) < 0) {
    const bool has_ended = process_->has_ended();
    if (!has_ended && std::chrono::steady_clock::now() < until) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    process_->kill();
    process_->wait(kReapMilliseconds);
    throw std::runtime_error(has_ended
                                 ? fmt::format("it was {} before it listened", process_->ending())
                                 : fmt::format("it did not listen at its --listen address within {:g} s", seconds));
  }
  use_socket(descriptor);
}

void BareWorker::use_socket(int descriptor) {
  fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  channel_ = grpc::CreateInsecureChannelFromFd("worker", descriptor);
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
    if (!answer.has_welcome()) return {Greeted::kRefused, "it answers with something else than Welcome or Refusal", {}};
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
