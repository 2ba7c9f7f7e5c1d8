#include "kernel/control_session.h"

#include <grpcpp/grpcpp.h>

#include <utility>

#include "plugin_sdk/floating_point.h"
#include "schemas/stage_frames.h"

namespace gravitas::kernel {

using control::v1::Hello;
using control::v1::KernelMessage;
using control::v1::WorkerMessage;

namespace {

constexpr std::chrono::milliseconds kHeartbeat{500};
// A worker that leaves a heartbeat unanswered for this long hangs as a whole: its threads answer during a call, too.
constexpr std::chrono::seconds kSilence{2};
constexpr std::uint32_t kProtocol = 2;

}  // namespace

Hello hello_of_this_kernel() {
  Hello hello;
  hello.set_magic(GRAVITAS_MAGIC);
  hello.set_protocol_minimum(kProtocol);
  hello.set_protocol_maximum(kProtocol);
  hello.set_schema_hash(stage::kSchemaHash);
  hello.set_build_id(GRAVITAS_BUILD_ID);
  hello.mutable_floating_point()->set_mxcsr(floating_point_control());
  hello.mutable_floating_point()->set_c_library(c_library());
  for (const std::string& feature : cpu_features()) hello.mutable_floating_point()->add_cpu_features(feature);
  hello.set_heartbeat_milliseconds(static_cast<std::uint32_t>(kHeartbeat.count()));
  return hello;
}

ControlSession::ControlSession(const std::shared_ptr<grpc::Channel>& channel, Hello hello)
    : stub_(control::v1::WorkerControl::NewStub(channel)) {
  thread_ = std::thread([this, hello = std::move(hello)]() mutable { run(std::move(hello)); });
}

ControlSession::~ControlSession() {
  cancel();
  thread_.join();
}

void ControlSession::cancel() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  context_.TryCancel();
}

std::string ControlSession::wait_until_ready(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  if (!changed_.wait_for(lock, time, [&] { return greeted_ || stopping_; })) return "it did not answer the handshake";
  return greeted_ ? problem_ : "it ended before it answered the handshake";
}

void ControlSession::run(Hello hello) {
  std::string problem = greet(hello);
  {
    const std::lock_guard lock(mutex_);
    problem_ = std::move(problem);
    greeted_ = true;
  }
  changed_.notify_all();
  if (problem_.empty()) beat();
  if (stream_) context_.TryCancel();
}

std::string ControlSession::greet(const Hello& hello) {
  stream_ = stub_->Session(&context_);
  KernelMessage greeting;
  *greeting.mutable_hello() = hello;
  WorkerMessage answer;
  closed_early_ = !stream_->Write(greeting) || !stream_->Read(&answer);
  if (closed_early_) return "it closed the control stream during the handshake: it ended, or serves another run";
  if (answer.has_refusal()) return answer.refusal().text();
  if (!answer.has_welcome()) return "it answered the greeting with something else";
  welcome_ = answer.welcome();
  std::string problem = judge(hello);
  if (!problem.empty()) return problem;
  if (!stream_->Read(&answer) || !answer.has_ready()) return "it did not get ready after the handshake";
  return {};
}

// What differs would make the worker compute other bits, or not be the worker that was started. A worker that cannot
// know its floating-point environment leaves it out: its bits are its own, and the report says so.
std::string ControlSession::judge(const Hello& hello) {
  const auto& ours = hello.floating_point();
  const auto& theirs = welcome_.floating_point();
  if (welcome_.magic() != GRAVITAS_MAGIC) return "it is no Gravitas worker";
  if (welcome_.protocol() != kProtocol) return "it speaks another version of the control protocol";
  if (welcome_.schema_hash() != hello.schema_hash()) return "it was built for another schema of the stage contracts";
  if (welcome_.epoch() != hello.epoch() || welcome_.nonce() != hello.nonce()) return "it answers to another greeting";
  if (!welcome_.has_floating_point()) {
    const std::lock_guard lock(mutex_);
    faults_.emplace_back("it does not say how its floating-point arithmetic is set: its bits may differ elsewhere");
    return {};
  }
  if (theirs.mxcsr() != ours.mxcsr()) return "its floating-point control register differs from the kernel's";
  if (theirs.c_library() != ours.c_library()) return "it runs on another C library, " + theirs.c_library();
  if (!std::equal(ours.cpu_features().begin(), ours.cpu_features().end(), theirs.cpu_features().begin(),
                  theirs.cpu_features().end()))
    return "it runs on a processor with other features";
  const std::lock_guard lock(mutex_);
  if (welcome_.build_id() != hello.build_id())
    faults_.push_back("it is of another build, " + welcome_.build_id() + ": its bits may differ");
  return {};
}

// A ping every half second, the next only after the answer, so that a hanging worker piles up nothing. The worker's
// complaints come before its answer.
void ControlSession::beat() {
  std::unique_lock lock(mutex_);
  for (std::uint64_t sequence = 1; !changed_.wait_for(lock, kHeartbeat, [&] { return stopping_ || draining_; });
       ++sequence) {
    lock.unlock();
    KernelMessage ping;
    ping.mutable_ping()->set_sequence(sequence);
    unanswered_since_ = std::chrono::steady_clock::now().time_since_epoch().count();
    bool alive = stream_->Write(ping);
    WorkerMessage answer;
    while (alive && !answer.has_pong()) {
      alive = stream_->Read(&answer);
      if (alive && answer.has_fault()) {
        const std::lock_guard faults_lock(mutex_);
        faults_.push_back(answer.fault().text());
      }
    }
    unanswered_since_ = alive ? kAnswered : kEnded;
    lock.lock();
    if (!alive) return;
  }
  if (stopping_) return;
  lock.unlock();
  KernelMessage drain;
  drain.mutable_drain();
  stream_->Write(drain);
}

bool ControlSession::answers_heartbeats() const {
  const std::int64_t since = unanswered_since_;
  if (since == kAnswered || since == kEnded) return since == kAnswered;
  return std::chrono::steady_clock::now().time_since_epoch() - std::chrono::nanoseconds(since) < kSilence;
}

void ControlSession::drain() {
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
  }
  changed_.notify_all();
}

std::vector<std::string> ControlSession::take_faults() {
  const std::lock_guard lock(mutex_);
  return std::exchange(faults_, {});
}

}  // namespace gravitas::kernel
