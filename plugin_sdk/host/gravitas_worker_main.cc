// gravitas-worker: hosts plugins in a process of their own.
//
//   gravitas-worker --describe LIBRARY...                             says what the libraries are, as a message on
//                                                                     standard output
//   gravitas-worker --control-fd N --descriptor-fd M LIBRARY...       serves a kernel over inherited sockets, data in
//                                                                     shared memory
//   gravitas-worker --control-fd N LIBRARY...                         the same, data as gRPC messages
//   gravitas-worker --exec PROGRAM ARGUMENT...                        becomes that program, which dies with the kernel
//   gravitas-worker --listen ADDRESS LIBRARY...                       serves one kernel after the other at an address
//                                                                     of this machine, data as gRPC messages
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/host/control_service.h"
#include "plugin_sdk/host/describe.h"
#include "plugin_sdk/host/description_message.h"
#include "plugin_sdk/host/mailbox_loop.h"
#include "plugin_sdk/host/stream_loop.h"

namespace {

using namespace gravitas;

struct Arguments {
  bool describe = false;
  int control = -1;
  int descriptors = -1;
  std::string address;
  std::vector<std::string> libraries;
};

int usage() {
  std::cerr << "usage: gravitas-worker --describe LIBRARY...\n"
            << "       gravitas-worker --listen ADDRESS LIBRARY...     127.0.0.1:PORT, [::1]:PORT or unix:PATH\n"
            << "       gravitas-worker --exec PROGRAM ARGUMENT...     as a kernel starts a command\n"
            << "       gravitas-worker --control-fd N [--descriptor-fd M] LIBRARY...     as a kernel starts it\n";
  return 2;
}

bool parse(int argc, char** argv, Arguments* arguments) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--describe") {
      arguments->describe = true;
    } else if ((word == "--control-fd" || word == "--descriptor-fd") && i + 1 < argc) {
      (word == "--control-fd" ? arguments->control : arguments->descriptors) = std::atoi(argv[++i]);
    } else if (word == "--listen" && i + 1 < argc) {
      arguments->address = argv[++i];
    } else if (word.starts_with("--")) {
      return false;
    } else {
      arguments->libraries.push_back(word);
    }
  }
  const int ways =
      (arguments->describe ? 1 : 0) + (arguments->control >= 0 ? 1 : 0) + (arguments->address.empty() ? 0 : 1);
  return ways == 1 && (arguments->descriptors < 0 || arguments->control >= 0) && !arguments->libraries.empty();
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

// Starts to listen; says where on standard output, so that a script that let the system choose the port knows it.
std::unique_ptr<grpc::Server> listen(grpc::ServerBuilder* builder, const std::string& address) {
  if (!channel::is_local_address(address)) {
    std::cerr << "gravitas-worker: --listen " << address
              << ": the connection is not encrypted, so only this machine is allowed: 127.0.0.1:PORT, [::1]:PORT or "
                 "unix:PATH\n";
    return nullptr;
  }
  int port = 0;
  builder->AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  builder->AddListeningPort(address, grpc::InsecureServerCredentials(), &port);
  std::unique_ptr<grpc::Server> server = builder->BuildAndStart();
  if (!server || port == 0) {
    std::cerr << "gravitas-worker: cannot listen at " << address << ": is it a free address of this machine?\n";
    return nullptr;
  }
  if (!address.starts_with("unix:"))
    std::cout << "listening at " << address.substr(0, address.rfind(':') + 1) << port << std::endl;
  return server;
}

int serve(const Arguments& arguments) {
  const bool listens = !arguments.address.empty();
  if (!listens) prctl(PR_SET_PDEATHSIG, SIGKILL);
  signal(SIGPIPE, SIG_IGN);
  // a worker that dies of a signal must be seen to: nobody, such as a sanitizer, makes an exit code of it
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) signal(number, SIG_DFL);

  std::vector<PluginLibrary> libraries;
  std::vector<plugin::v1::Description> descriptions;
  std::string problem;
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
  service.on_end = [&](bool kernel_is_gone) {
    if (kernel_is_gone && !listens) std::_Exit(0);
    handshake.end();
  };
  const std::unique_ptr<grpc::ServerBuilder> builder = host::server_builder(&service);
  const std::unique_ptr<host::StreamLoop> streams =
      arguments.descriptors < 0 ? std::make_unique<host::StreamLoop>(builder.get()) : nullptr;
  const std::unique_ptr<grpc::Server> server =
      listens ? listen(builder.get(), arguments.address) : host::serve_descriptor(builder.get(), arguments.control);
  if (!server) std::_Exit(1);

  int code = 0;
  do {
    // a session: instances of its own
    host::HostedPlugins plugins(libraries);
    const control::v1::Hello* hello = handshake.wait();
    if (hello != nullptr) {
      const std::uint64_t epoch = hello->epoch();
      handshake.answer(create(*hello, &plugins));
      if (streams) {
        streams->serve(&plugins, epoch, handshake.stopping, &service.calls);
      } else {
        host::MailboxLoop loop(&plugins, arguments.descriptors);
        code = loop.serve(epoch, handshake.stopping, &service.calls,
                          [&](std::string text) { service.complain(std::move(text)); });
      }
    }
    // instances are gone with the process: a hanging destructor must not keep it
    if (!listens) std::_Exit(code);
    handshake.stopping = false;
  } while (true);
}

// The signal of a parent's death stays asked for across the exec.
int become(char** argv) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  execvp(argv[0], argv);
  std::cerr << "gravitas-worker: cannot start '" << argv[0] << "': " << std::strerror(errno) << '\n';
  return 127;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::string(argv[1]) == "--exec") return become(argv + 2);
  const std::string missing = missing_cpu_features();
  if (!missing.empty()) {
    std::cerr << "gravitas-worker: " << missing << '\n';
    return 1;
  }
  Arguments arguments;
  if (!parse(argc, argv, &arguments)) return usage();
  return arguments.describe ? describe(arguments.libraries) : serve(arguments);
}
