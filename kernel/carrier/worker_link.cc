#include "kernel/carrier/worker_link.h"

#include <fcntl.h>
#include <grpcpp/create_channel_posix.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>

#include "kernel/carrier/carrier.h"
#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/channel/private_folder.h"
#include "plugin_sdk/shell_word.h"

namespace gravitas::kernel {
namespace {

constexpr std::chrono::seconds kStartLimit{10};

std::string program = [] {
  char path[4096];
  const ssize_t size = readlink("/proc/self/exe", path, sizeof path);
  std::string self(path, size > 0 ? static_cast<std::size_t>(size) : 0);
  return self.substr(0, self.rfind('/') + 1) + "gravitas-worker";
}();

bool sandboxed = true;

// What a worker may take of address space, as `gravitas-worker` has it; more with threads in hundreds, for their stacks.
constexpr std::uint64_t kWorkerMemory = std::uint64_t{4} << 30;
constexpr std::uint64_t kThreadMemory = std::uint64_t{16} << 20;

// The beginning of a worker's command line.
std::vector<std::string> worker_words() {
  std::vector<std::string> words = {program};
  if (!sandboxed) words.emplace_back("--no-sandbox");
  return words;
}

// How long a worker that failed to start may take to have ended, so that its last words can be told.
constexpr int kLastWordsMilliseconds = 100;

std::string last_words(const channel::WorkerProcess& process) {
  const std::string words = process.last_words();
  return words.empty() ? words : "; its last words: " + words;
}

std::atomic<std::uint64_t> last_epoch{0};

[[noreturn]] void fail_start(const std::string& why) { throw StageFault(FaultKind::kHandshake, "handshake", why); }

std::shared_ptr<channel::WorkerProcess> spawn(const std::vector<std::string>& arguments,
                                              const std::vector<int>& descriptors, std::function<void()> on_end) {
  try {
    return channel::Supervisor::instance().spawn(arguments, descriptors, std::move(on_end));
  } catch (const std::system_error& error) {
    fail_start("cannot start '" + arguments[0] + "': " + error.what());
  }
}

}  // namespace

void set_worker_program(std::string path) { program = std::move(path); }

const std::string& worker_program() { return program; }

void set_worker_sandbox(bool on) { sandboxed = on; }

std::unique_ptr<Carrier> start_host(const SlotDescription& slot, std::uint32_t threads, std::stop_token stop) {
  if (slot.hosting == Hosting::kDirect) return make_direct_carrier(slot.plugins, threads);
  const auto start = slot.hosting == Hosting::kSharedMemory ? &start_shared_memory_carrier : &start_grpc_carrier;
  return start(slot, threads, std::move(stop));
}

ListeningCommand start_listening_command(const std::string& command, std::chrono::milliseconds limit,
                                         std::function<void()> on_end, const std::stop_token& stop) {
  const channel::PrivateFolder folder;
  if (folder.path().empty()) fail_start("no folder for its socket: " + std::string(std::strerror(errno)));
  const std::string socket = folder.path() + "/worker";
  std::vector<std::string> words = worker_words();
  words.insert(words.end(),
               {"--exec", "/bin/sh", "-c", "exec env " + command + " --listen " + shell_word("unix:" + socket)});
  ListeningCommand started{spawn(words, {}, std::move(on_end)), -1};
  const auto until = std::chrono::steady_clock::now() + limit;
  while ((started.descriptor = channel::connect_to("unix:" + socket)) < 0) {
    if (started.process->has_ended())
      fail_start("'" + command + "' was " + started.process->ending() + " before it listened" +
                 last_words(*started.process));
    if (std::chrono::steady_clock::now() > until || stop.stop_requested()) {
      started.process->kill();
      started.process->wait(kDrainMilliseconds);
      fail_start("'" + command + "' did not listen at the socket it was given with --listen" +
                 last_words(*started.process));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return started;
}

std::shared_ptr<grpc::Channel> worker_channel(int descriptor) {
  channel::prepare_for_grpc(descriptor);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // a large message should not wait for its receiver's leave every 64 KiB, nor come in parts of 16 KiB
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_FRAME_SIZE, 1 << 20);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1 << 24);
  return grpc::CreateCustomInsecureChannelFromFd("worker", descriptor, arguments);
}

WorkerLink::WorkerLink(const SlotDescription& slot, std::uint32_t threads, bool with_descriptors,
                       std::function<void()> on_end, std::stop_token stop)
    : stop_(std::move(stop)), epoch_(++last_epoch), address_(slot.plugins[0].address) {
  control::v1::Hello hello = hello_of_this_kernel();
  hello.set_epoch(epoch_);
  hello.set_nonce(channel::now_ns() ^ (static_cast<std::uint64_t>(getpid()) << 32));
  hello.set_threads(threads);
  if (const std::string why = why_apart(slot.plugins); !why.empty()) fail_start(why);
  for (const PluginChoice& plugin : slot.plugins) {
    control::v1::PluginSettings* settings = hello.add_plugins();
    settings->set_plugin(plugin.declaration.name);
    plugins_.push_back(plugin.declaration.name);
    for (const double number : plugin.settings) settings->add_numbers(number);
  }
  try {
    if (!address_.empty()) {
      if (!channel::is_local_address(address_)) fail_start("'" + address_ + "' is no address of this machine");
      const int descriptor = channel::connect_to(address_);
      if (descriptor < 0) fail_start("no worker answers at " + address_ + ": " + std::strerror(errno));
      channel_ = worker_channel(descriptor);
    } else if (!slot.plugins[0].command.empty()) {
      const ListeningCommand started =
          start_listening_command(slot.plugins[0].command, kStartLimit, std::move(on_end), stop_);
      process_ = started.process;
      channel_ = worker_channel(started.descriptor);
    } else {
      start_program(slot, threads, with_descriptors, std::move(on_end));
    }
    control_ = std::make_unique<ControlSession>(channel_, std::move(hello));
  } catch (...) {
    // nobody else would end what was started
    kill();
    if (descriptor_socket_ >= 0) close(descriptor_socket_);
    throw;
  }
}

void WorkerLink::start_program(const SlotDescription& slot, std::uint32_t threads, bool with_descriptors,
                               std::function<void()> on_end) {
  if (!with_descriptors) watch_ = std::make_shared<channel::EndWatch>();
  int control[2] = {-1, -1}, descriptors[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, control) != 0 ||
      (with_descriptors && socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, descriptors) != 0)) {
    const int problem = errno;
    for (const int end : control)
      if (end >= 0) close(end);
    fail_start(std::string("no sockets: ") + std::strerror(problem));
  }
  descriptor_socket_ = descriptors[0];
  channel_ = worker_channel(control[0]);

  std::vector<std::string> arguments = worker_words();
  arguments.insert(arguments.end(), {"--control-fd", "3"});
  std::vector<int> inherited = {control[1]};
  if (with_descriptors) {
    arguments.insert(arguments.end(), {"--descriptor-fd", "4"});
    inherited.push_back(descriptors[1]);
  }
  const auto close_all = [&] {
    for (const int descriptor : inherited) close(descriptor);
  };
  try {
    if (!with_descriptors) {
      watch_->shut_at_end(control[0]);
      on_end = [watch = watch_] { watch->say_ended(); };
      arguments.insert(arguments.end(), {"--mailbox-fd", "4"});
      inherited.push_back(fcntl(watch_->descriptor(), F_DUPFD_CLOEXEC, 0));
    }
    if (const std::uint64_t memory = kWorkerMemory / 2 + threads * kThreadMemory; memory > kWorkerMemory)
      arguments.insert(arguments.end(), {"--memory-limit", std::to_string(memory)});
    for (const PluginChoice& plugin : slot.plugins) arguments.push_back(plugin.library);
    process_ = spawn(arguments, inherited, std::move(on_end));
  } catch (...) {
    close_all();
    throw;
  }
  close_all();
}

WorkerLink::~WorkerLink() {
  if (control_ && !is_dying_) drain();
  if (descriptor_socket_ >= 0) close(descriptor_socket_);
  if (!process_ || process_->wait(kDrainMilliseconds)) return;
  process_->kill();
  process_->wait(kDrainMilliseconds);
}

void WorkerLink::finish() {
  const std::stop_callback give_up(stop_, [this] { process_ ? kill() : control_->cancel(); });
  std::string problem = control_->wait_until_ready(kStartLimit);
  const auto& served = control_->welcome().plugins();
  if (problem.empty() && served.size() != static_cast<int>(plugins_.size()))
    problem = "it serves another number of plugins than asked for";
  for (int i = 0; problem.empty() && i < served.size(); ++i)
    if (const std::string& name = plugins_[static_cast<std::size_t>(i)]; served[i].name() != name)
      problem = "it serves plugin '" + served[i].name() + "', not '" + name + "'";
  if (problem.empty()) return;
  const bool has_ended = process_ && process_->wait(kLastWordsMilliseconds);
  if (has_ended && control_->closed_early()) problem += "; it was " + process_->ending();
  kill();
  fail_start(process_ ? problem + last_words(*process_) : problem);
}

void WorkerLink::kill() {
  if (process_ && !is_dying_) process_->kill();
}

std::vector<std::string> WorkerLink::take_complaints() {
  std::vector<std::string> all = control_->take_faults();
  if (process_)
    for (std::string& line : process_->take_output()) all.push_back(std::move(line));
  return all;
}

std::vector<std::string> WorkerLink::sandbox() const {
  const auto& list = control_->welcome().sandbox();
  return {list.begin(), list.end()};
}

int WorkerLink::process_id() const { return process_ ? process_->process_id() : control_->welcome().process_id(); }

void WorkerLink::report_death(bool is_unread, bool is_certain) {
  if (!process_) throw StageFault(FaultKind::kDeath, "stream", "the worker at " + address_ + " is gone");
  const std::string who = "its worker process " + std::to_string(process_id());
  is_certain = is_certain || is_ending();
  // the end may be known to the socket before it is to the watcher
  const bool has_died = is_certain || process_->wait(kDrainMilliseconds);
  is_dying_ = is_certain;
  process_->catch_up();
  kill();
  const auto rest = [process = process_, has_died] {
    if (has_died && !process->wait(kDrainMilliseconds)) {
      process->kill();
      process->wait(kDrainMilliseconds);
    }
    return (has_died && process->has_ended() ? process->ending() : "") + last_words(*process);
  };
  StageFault fault(has_died ? FaultKind::kDeath : FaultKind::kFailure, has_died ? "pidfd" : "stream",
                   who + (has_died ? " was " : " closed its stream"), rest);
  fault.is_unread = is_unread;
  throw StageFault(fault);
}

void WorkerLink::report_overdue(bool at_cap, std::uint64_t deadline_ns) {
  kill();
  throw StageFault(FaultKind::kDeadline, "deadline",
                   at_cap ? "the call took longer than ten times its deadline"
                          : "no answer and no mark of progress within its deadline of " +
                                std::to_string(deadline_ns / 1'000'000) + " ms");
}

void WorkerLink::report_bad_frame(const std::string& what) {
  kill();
  throw StageFault(FaultKind::kBadFrame, "wire", "its answer has " + what);
}

}  // namespace gravitas::kernel
