// gravitas-worker: hosts plugins in a process of their own.
//
//   gravitas-worker --describe LIBRARY...                             says what the libraries are, as a message on
//                                                                     standard output
//   gravitas-worker --control-fd N --descriptor-fd M LIBRARY...       serves a kernel over inherited sockets, data in
//                                                                     shared memory
//   gravitas-worker --control-fd N --mailbox-fd M LIBRARY...          the same, data as gRPC messages; its end is said
//                                                                     in the mailbox, if there is one
//   gravitas-worker --exec PROGRAM ARGUMENT...                        becomes that program, which dies with the kernel
//   gravitas-worker --listen ADDRESS LIBRARY...                       serves one kernel after the other at an address
//                                                                     of this machine, data as gRPC messages
//
// Before it loads a library or starts a program it restricts itself (sandbox.h). `--no-sandbox` as the first word
// leaves that out, for debuggers; `--memory-limit BYTES` (default 4 GiB) is what it may take of address space;
// `--lie WHAT` makes it a worker that its kernel must refuse (handshake_lie.h).
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/host/control_service.h"
#include "plugin_sdk/host/describe.h"
#include "plugin_sdk/host/description_message.h"
#include "plugin_sdk/host/handshake_lie.h"
#include "plugin_sdk/host/listener.h"
#include "plugin_sdk/host/mailbox_loop.h"
#include "plugin_sdk/host/sandbox.h"
#include "plugin_sdk/host/stream_loop.h"

namespace {

using namespace gravitas;

constexpr std::string_view kUnix = "unix:";

struct Arguments {
  bool sandbox = true;
  bool describe = false;
  int control = -1;
  int descriptors = -1;
  int mailbox = -1;
  std::uint64_t memory_limit = host::kDefaultMemoryLimit;
  std::string address, lie;
  std::vector<std::string> libraries;
};

int usage() {
  std::cerr
      << "usage: gravitas-worker --describe LIBRARY...\n"
      << "       gravitas-worker --listen ADDRESS LIBRARY...     127.0.0.1:PORT, [::1]:PORT or unix:PATH\n"
      << "       gravitas-worker --exec PROGRAM ARGUMENT...     as a kernel starts a command\n"
      << "       gravitas-worker --control-fd N [--descriptor-fd M | --mailbox-fd M] LIBRARY...     as a kernel starts "
         "it\n"
      << "       gravitas-worker --no-sandbox ...     for debuggers: the process does not restrict itself\n"
      << "--memory-limit BYTES, beside the libraries: address space that it may take, 4 GiB if absent\n"
      << "--lie WHAT, there too, to test who starts it: it says in the handshake that it is another, in its";
  for (const host::HandshakeLie& lie : host::handshake_lies()) std::cerr << ' ' << lie.what;
  std::cerr << '\n';
  return 2;
}

// A positive number of bytes.
bool parse_bytes(const char* text, std::uint64_t* bytes) {
  const char* end = text + std::strlen(text);
  const auto [rest, error] = std::from_chars(text, end, *bytes);
  return error == std::errc() && rest == end && *bytes > 0;
}

bool parse(int argc, char** argv, Arguments* arguments) {
  for (int i = 0; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--describe") {
      arguments->describe = true;
    } else if (word == "--control-fd" && i + 1 < argc) {
      arguments->control = std::atoi(argv[++i]);
    } else if (word == "--descriptor-fd" && i + 1 < argc) {
      arguments->descriptors = std::atoi(argv[++i]);
    } else if (word == "--mailbox-fd" && i + 1 < argc) {
      arguments->mailbox = std::atoi(argv[++i]);
    } else if (word == "--listen" && i + 1 < argc) {
      arguments->address = argv[++i];
    } else if (word == "--lie" && i + 1 < argc) {
      arguments->lie = argv[++i];
      if (host::find_handshake_lie(arguments->lie) == nullptr) return false;
    } else if (word == "--memory-limit" && i + 1 < argc) {
      if (!parse_bytes(argv[++i], &arguments->memory_limit)) return false;
    } else if (word.starts_with("--")) {
      return false;
    } else {
      arguments->libraries.push_back(word);
    }
  }
  const int ways =
      (arguments->describe ? 1 : 0) + (arguments->control >= 0 ? 1 : 0) + (arguments->address.empty() ? 0 : 1);
  const bool has_data = arguments->descriptors >= 0 || arguments->mailbox >= 0;
  const bool has_both = arguments->descriptors >= 0 && arguments->mailbox >= 0;
  return ways == 1 && (!has_data || arguments->control >= 0) && !has_both && !arguments->libraries.empty();
}

int describe(const std::vector<std::string>& libraries) {
  const plugin::v1::Catalog catalog = host::describe_libraries(libraries, 5.0);
  return catalog.SerializeToFileDescriptor(STDOUT_FILENO) ? 0 : 1;
}

// The kernel's Hello, handed from the control stream's thread to the first thread, and the answer back.
class Handshake {
 public:
  // In the stream's thread.
  host::Admission admit(const control::v1::Hello& hello) {
    std::unique_lock lock(mutex_);
    hello_ = &hello;
    changed_.notify_all();
    changed_.wait(lock, [&] { return admission_.has_value(); });
    hello_ = nullptr;
    return *std::exchange(admission_, std::nullopt);
  }
  void end() {
    const std::lock_guard lock(mutex_);
    stopping = true;
    changed_.notify_all();
  }

  // In the first thread: the greeting, or null if the session ended without one.
  const control::v1::Hello* wait() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return hello_ != nullptr || stopping.load(); });
    // the end of a kernel before that was refused without a greeting here
    if (hello_ != nullptr) stopping = false;
    return hello_;
  }
  void answer(host::Admission admission) {
    const std::lock_guard lock(mutex_);
    admission_ = std::move(admission);
    changed_.notify_all();
  }

  std::atomic<bool> stopping{false};

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  const control::v1::Hello* hello_ = nullptr;
  std::optional<host::Admission> admission_;
};

// Creates the plugins as the greeting says.
host::Admission create(const control::v1::Hello& hello, host::HostedPlugins* plugins) {
  std::vector<std::vector<double>> settings;
  for (const auto& plugin : hello.plugins()) settings.emplace_back(plugin.numbers().begin(), plugin.numbers().end());
  const std::string refusal = plugins->create(settings, hello.threads());
  if (!refusal.empty()) return {control::v1::Refusal::REASON_SETTINGS, refusal};
  return {};
}

// The signal of its parent's death comes never to a worker whose parent is dead already. Then the other end of what it
// inherited, a socket or pipe, is closed.
void die_with_kernel(int inherited) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  pollfd end = {inherited, 0, 0};
  if (poll(&end, 1, 0) > 0 && (end.revents & (POLLHUP | POLLERR)) != 0) std::_Exit(0);
}

// Restricts the process as the arguments say. Returns what is enforced.
std::vector<std::string> enter_sandbox(const Arguments& arguments, int socket) {
  if (!arguments.sandbox) return {};
  std::vector<int> kept = {socket};
  for (const int inherited : {arguments.descriptors, arguments.mailbox})
    if (inherited >= 0) kept.push_back(inherited);
  host::close_inherited(kept);
  return host::enter_sandbox(arguments.libraries, arguments.memory_limit);
}

// The mailbox that was inherited, for as long as the process lives; null if none was.
channel::Mailbox* map_mailbox(int descriptor) {
  if (descriptor < 0) return nullptr;
  static const channel::Segment segment =
      channel::Segment::map(descriptor, sizeof(channel::Mailbox), channel::Access::kReadWrite);
  return reinterpret_cast<channel::Mailbox*>(segment.data());
}

int serve(const Arguments& arguments) {
  const bool listens = !arguments.address.empty();
  if (!listens) die_with_kernel(arguments.control);
  signal(SIGPIPE, SIG_IGN);
  // a worker that dies of a signal must be seen to: nobody, such as a sanitizer, makes an exit code of it
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) signal(number, SIG_DFL);
  // a line that was printed is out, however the process ends
  std::setvbuf(stdout, nullptr, _IOLBF, 0);

  std::string problem;
  const int socket = listens ? host::listen_at(arguments.address, &problem) : arguments.control;
  if (socket < 0) {
    std::cerr << "gravitas-worker: " << problem << '\n';
    return 1;
  }
  std::vector<std::string> sandbox = enter_sandbox(arguments, socket);

  std::vector<PluginLibrary> libraries;
  std::vector<plugin::v1::Description> descriptions;
  for (const std::string& path : arguments.libraries) {
    PluginLibrary library = load_plugin_library(path, &problem);
    if (library.table == nullptr) break;
    descriptions.push_back(host::to_message(library.declaration));
    libraries.push_back(std::move(library));
  }
  if (!problem.empty()) {
    if (listens) {
      std::cerr << "gravitas-worker: " << problem << '\n';
      return 1;
    }
    descriptions.resize(arguments.libraries.size());
  }

  Handshake handshake;
  host::ControlService service(std::move(descriptions), floating_point_control(),
                               [&](const control::v1::Hello& hello) -> host::Admission {
                                 if (!problem.empty()) return {control::v1::Refusal::REASON_LIBRARY, problem};
                                 return handshake.admit(hello);
                               });
  service.sandbox = std::move(sandbox);
  service.lie = arguments.lie;
  service.on_end = [&](bool kernel_is_gone) {
    // a kernel that was told of a crash has gone, too
    while (host::is_crashing()) pause();
    if (kernel_is_gone && !listens) std::_Exit(0);
    handshake.end();
  };
  const std::unique_ptr<grpc::ServerBuilder> builder = host::server_builder(&service);
  const std::unique_ptr<host::StreamLoop> streams =
      arguments.descriptors < 0 ? std::make_unique<host::StreamLoop>(builder.get()) : nullptr;
  const std::unique_ptr<grpc::Server> server =
      listens ? builder->BuildAndStart() : host::serve_descriptor(builder.get(), socket);
  if (!server) std::_Exit(1);
  if (listens) {
    host::take_connections(socket, server.get());
    // so that a script that let the system choose the port knows it
    if (!arguments.address.starts_with(kUnix))
      std::cout << "listening at " << host::address_of(socket, arguments.address) << std::endl;
  }

  int code = 0;
  do {
    // a session: instances of its own
    host::HostedPlugins plugins(libraries);
    const control::v1::Hello* hello = handshake.wait();
    if (hello != nullptr) {
      const std::uint64_t epoch = hello->epoch();
      handshake.answer(create(*hello, &plugins));
      if (streams) {
        channel::Mailbox* mine = map_mailbox(arguments.mailbox);
        if (mine != nullptr) host::install_crash_reporter(mine, nullptr, epoch);
        streams->serve(&plugins, epoch, handshake.stopping, &service.calls,
                       mine != nullptr ? &mine->progress : nullptr);
      } else {
        host::MailboxLoop loop(&plugins, arguments.descriptors);
        code = loop.serve(epoch, handshake.stopping, &service.calls,
                          [&](std::string text) { service.complain(std::move(text)); });
      }
    }
    // of a socket whose name is gone nobody else can ask (schemas/WIRE.md)
    const bool is_named = arguments.address.starts_with(kUnix);
    const bool is_gone = is_named && access(arguments.address.c_str() + kUnix.size(), F_OK) != 0;
    // instances are gone with the process: a hanging destructor must not keep it
    if (!listens || is_gone) std::_Exit(code);
    handshake.stopping = false;
  } while (true);
}

// The signal of a parent's death stays asked for across the exec.
int become(char** argv, bool sandbox) {
  die_with_kernel(STDOUT_FILENO);
  if (sandbox)
    for (const std::string& measure : host::enter_bare_sandbox())
      if (measure.starts_with("no ")) std::cerr << "gravitas-worker: " << measure << '\n';
  execvp(argv[0], argv);
  std::cerr << "gravitas-worker: cannot start '" << argv[0] << "': " << std::strerror(errno) << '\n';
  return 127;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  ++argv, --argc;
  if (argc > 0 && std::string(argv[0]) == "--no-sandbox") {
    arguments.sandbox = false;
    ++argv, --argc;
  }
  if (argc > 1 && std::string(argv[0]) == "--exec") return become(argv + 1, arguments.sandbox);
  const std::string missing = missing_cpu_features();
  if (!missing.empty()) {
    std::cerr << "gravitas-worker: " << missing << '\n';
    return 1;
  }
  if (!parse(argc, argv, &arguments)) return usage();
  return arguments.describe ? describe(arguments.libraries) : serve(arguments);
}
