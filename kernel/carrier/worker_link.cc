#include "kernel/carrier/worker_link.h"

#include <fcntl.h>
#include <grpcpp/create_channel_posix.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include "kernel/carrier/carrier.h"
#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/channel/mailbox.h"

namespace gravitas::kernel {
namespace {

constexpr std::chrono::seconds kStartLimit{10};

std::string program = [] {
  char path[4096];
  const ssize_t size = readlink("/proc/self/exe", path, sizeof path);
  std::string self(path, size > 0 ? static_cast<std::size_t>(size) : 0);
  return self.substr(0, self.rfind('/') + 1) + "gravitas-worker";
}();

std::uint64_t next_epoch() {
  static std::atomic<std::uint64_t> epoch{0};
  return ++epoch;
}

[[noreturn]] void fail_start(const std::string& why) { throw StageFault(FaultKind::kHandshake, "handshake", why); }

// Connects to a "unix:PATH"; -1 with errno.
int connect_unix(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    return -1;
  }
  path.copy(address.sun_path, path.size());
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor >= 0 && connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0)
    return descriptor;
  const int problem = errno;
  if (descriptor >= 0) close(descriptor);
  errno = problem;
  return -1;
}

// Connects to a "HOST:PORT" of this machine; -1 with errno.
int connect_tcp(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  std::string host = address.substr(0, colon);
  if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (getaddrinfo(host.c_str(), address.substr(colon + 1).c_str(), &hints, &found) != 0) {
    errno = EADDRNOTAVAIL;
    return -1;
  }
  int descriptor = -1, problem = EADDRNOTAVAIL;
  for (const addrinfo* one = found; one != nullptr && descriptor < 0; one = one->ai_next) {
    descriptor = socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC, one->ai_protocol);
    if (descriptor >= 0 && connect(descriptor, one->ai_addr, one->ai_addrlen) != 0) {
      problem = errno;
      close(descriptor);
      descriptor = -1;
    }
  }
  freeaddrinfo(found);
  const int yes = 1;
  if (descriptor >= 0) setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  errno = problem;
  return descriptor;
}

// A folder that only we can enter, for the socket of a command; gone with this object.
class PrivateFolder {
 public:
  PrivateFolder() {
    path_ = (std::filesystem::temp_directory_path() / "gravitas-XXXXXX").string();
    if (mkdtemp(path_.data()) == nullptr) fail_start("no folder for its socket: " + std::string(std::strerror(errno)));
  }
  ~PrivateFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  std::string socket() const { return path_ + "/worker"; }

 private:
  std::string path_;
};

}  // namespace

void set_worker_program(std::string path) { program = std::move(path); }

const std::string& worker_program() { return program; }

WorkerLink::WorkerLink(const SlotDescription& slot, std::uint32_t threads, bool with_descriptors,
                       std::function<void()> on_end)
    : epoch_(next_epoch()), address_(slot.plugins[0].address) {
  control::v1::Hello hello = hello_of_this_kernel();
  hello.set_epoch(epoch_);
  hello.set_nonce(channel::now_ns() ^ (static_cast<std::uint64_t>(getpid()) << 32));
  hello.set_threads(threads);
  for (const PluginChoice& plugin : slot.plugins) {
    control::v1::PluginSettings* settings = hello.add_plugins();
    settings->set_plugin(plugin.declaration.name);
    plugins_.push_back(plugin.declaration.name);
    for (const double number : plugin.settings) settings->add_numbers(number);
  }
  if (!address_.empty()) {
    if (!channel::is_local_address(address_)) fail_start("'" + address_ + "' is no address of this machine");
    const int descriptor = address_.starts_with("unix:") ? connect_unix(address_.substr(5)) : connect_tcp(address_);
    if (descriptor < 0) fail_start("no worker answers at " + address_ + ": " + std::strerror(errno));
    use_socket(descriptor);
  } else if (!slot.plugins[0].command.empty()) {
    start_command(slot.plugins[0].command, std::move(on_end));
  } else {
    start_program(slot, with_descriptors, std::move(on_end));
  }
  control_ = std::make_unique<ControlSession>(channel_, std::move(hello));
}

void WorkerLink::start_program(const SlotDescription& slot, bool with_descriptors, std::function<void()> on_end) {
  int control[2], descriptors[2] = {-1, -1};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, control) != 0 ||
      (with_descriptors && socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, descriptors) != 0))
    fail_start(std::string("no sockets: ") + std::strerror(errno));
  descriptor_socket_ = descriptors[0];
  use_socket(control[0]);

  std::vector<std::string> arguments = {program, "--control-fd", "3"};
  std::vector<int> inherited = {control[1]};
  if (with_descriptors) {
    arguments.insert(arguments.end(), {"--descriptor-fd", "4"});
    inherited.push_back(descriptors[1]);
  }
  for (const PluginChoice& plugin : slot.plugins) arguments.push_back(plugin.library);
  try {
    spawn(arguments, inherited, std::move(on_end));
  } catch (...) {
    for (const int descriptor : inherited) close(descriptor);
    if (descriptor_socket_ >= 0) close(descriptor_socket_);
    throw;
  }
  for (const int descriptor : inherited) close(descriptor);
}

// Its socket is connected as soon as it is there, and has no name any more afterwards.
void WorkerLink::start_command(const std::string& command, std::function<void()> on_end) {
  const PrivateFolder folder;
  spawn({program, "--exec", "/bin/sh", "-c", "exec " + command + " --listen unix:" + folder.socket()}, {},
        std::move(on_end));
  const auto until = std::chrono::steady_clock::now() + kStartLimit;
  int descriptor = -1;
  while ((descriptor = connect_unix(folder.socket())) < 0) {
    if (process_->has_ended()) fail_start("'" + command + "' was " + process_->ending() + " before it listened");
    if (std::chrono::steady_clock::now() > until) {
      kill();
      fail_start("'" + command + "' did not listen at the socket it was given with --listen");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  use_socket(descriptor);
}

void WorkerLink::spawn(const std::vector<std::string>& arguments, const std::vector<int>& descriptors,
                       std::function<void()> on_end) {
  try {
    process_ = Supervisor::instance().spawn(arguments, descriptors, std::move(on_end));
  } catch (const std::system_error& error) {
    fail_start("cannot start '" + arguments[0] + "': " + error.what());
  }
}

void WorkerLink::use_socket(int descriptor) {
  fcntl(descriptor, F_SETFL, fcntl(descriptor, F_GETFL) | O_NONBLOCK);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  arguments.SetMaxSendMessageSize(-1);
  // a large message should not wait for its receiver's leave every 64 KiB, nor come in parts of 16 KiB
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_FRAME_SIZE, 1 << 20);
  arguments.SetInt(GRPC_ARG_HTTP2_STREAM_LOOKAHEAD_BYTES, 1 << 24);
  channel_ = grpc::CreateCustomInsecureChannelFromFd("worker", descriptor, arguments);
}

WorkerLink::~WorkerLink() {
  if (control_) drain();
  if (descriptor_socket_ >= 0) close(descriptor_socket_);
  if (process_ && !process_->wait(kDrainMilliseconds)) kill();
}

void WorkerLink::finish() {
  const std::string problem = control_->wait_until_ready(kStartLimit);
  if (!problem.empty()) fail_start(problem);
  const auto& served = control_->welcome().plugins();
  if (served.size() != static_cast<int>(plugins_.size()))
    fail_start("it serves another number of plugins than asked for");
  for (int i = 0; i < served.size(); ++i)
    if (served[i].name() != plugins_[static_cast<std::size_t>(i)])
      fail_start("it serves plugin '" + served[i].name() + "', not '" + plugins_[static_cast<std::size_t>(i)] + "'");
}

void WorkerLink::kill() {
  if (!process_) return;
  process_->kill();
  process_->wait(kDrainMilliseconds);
}

int WorkerLink::process_id() const { return process_ ? process_->process_id() : control_->welcome().process_id(); }

void WorkerLink::report_death() {
  if (!process_) throw StageFault(FaultKind::kDeath, "stream", "the worker at " + address_ + " is gone");
  // the end may be known to the socket before it is to the watcher
  process_->wait(kDrainMilliseconds);
  throw StageFault(FaultKind::kDeath, "pidfd",
                   "its worker process " + std::to_string(process_id()) + " " +
                       (process_->has_ended() ? "was " + process_->ending() : "is gone"));
}

}  // namespace gravitas::kernel
