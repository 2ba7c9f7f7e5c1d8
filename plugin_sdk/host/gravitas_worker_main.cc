// gravitas-worker: hosts plugins in a process of their own.
//
//   gravitas-worker --describe LIBRARY...                             says what the libraries are, as a message on
//                                                                     standard output
//   gravitas-worker --control-fd N --descriptor-fd M LIBRARY...       serves a kernel over inherited sockets
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <mutex>
#include <string>
#include <vector>

#include "plugin_sdk/floating_point.h"
#include "plugin_sdk/host/control_service.h"
#include "plugin_sdk/host/describe.h"
#include "plugin_sdk/host/description_message.h"
#include "plugin_sdk/host/worker.h"

namespace {

using namespace gravitas;

struct Arguments {
  bool describe = false;
  int control = -1;
  int descriptors = -1;
  std::vector<std::string> libraries;
};

int usage() {
  std::cerr << "usage: gravitas-worker --describe LIBRARY...\n"
            << "       gravitas-worker --control-fd N --descriptor-fd M LIBRARY...\n";
  return 2;
}

bool parse(int argc, char** argv, Arguments* arguments) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--describe") {
      arguments->describe = true;
    } else if ((word == "--control-fd" || word == "--descriptor-fd") && i + 1 < argc) {
      (word == "--control-fd" ? arguments->control : arguments->descriptors) = std::atoi(argv[++i]);
    } else if (word.starts_with("--")) {
      return false;
    } else {
      arguments->libraries.push_back(word);
    }
  }
  return arguments->describe != (arguments->control >= 0 && arguments->descriptors >= 0) &&
         !arguments->libraries.empty();
}

int describe(const std::vector<std::string>& libraries) {
  const plugin::v1::Catalog catalog = host::describe_libraries(libraries, 5.0);
  return catalog.SerializeToFileDescriptor(STDOUT_FILENO) ? 0 : 1;
}

// The kernel's Hello, handed from the control stream's thread to the first thread, and the answer back.
struct Handshake {
  std::mutex mutex;
  std::condition_variable changed;
  const control::v1::Hello* hello = nullptr;
  bool answered = false;
  host::Admission admission;
};

int serve(const Arguments& arguments) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  signal(SIGPIPE, SIG_IGN);

  std::vector<PluginLibrary> libraries;
  std::vector<plugin::v1::Description> descriptions;
  std::string problem;
  for (const std::string& path : arguments.libraries) {
    PluginLibrary library = load_plugin_library(path, &problem);
    if (library.table == nullptr) break;
    descriptions.push_back(host::to_message(library.declaration));
    libraries.push_back(std::move(library));
  }
  if (!problem.empty()) descriptions.resize(arguments.libraries.size());

  Handshake handshake;
  std::atomic<bool> stopping{false};
  host::ControlService service(std::move(descriptions), floating_point_control(),
                               [&](const control::v1::Hello& hello) -> host::Admission {
                                 if (!problem.empty()) return {control::v1::Refusal::REASON_LIBRARY, problem};
                                 std::unique_lock lock(handshake.mutex);
                                 handshake.hello = &hello;
                                 handshake.changed.notify_all();
                                 handshake.changed.wait(lock, [&] { return handshake.answered; });
                                 return handshake.admission;
                               });
  service.on_end = [&](bool kernel_is_gone) {
    if (kernel_is_gone) std::_Exit(0);
    stopping = true;
    handshake.changed.notify_all();
  };
  const std::unique_ptr<grpc::Server> server = host::serve_descriptor(&service, arguments.control);
  if (!server) return 1;

  host::Worker worker(std::move(libraries), arguments.descriptors);
  std::uint64_t epoch = 0;
  std::uint32_t threads = 1;
  {
    std::unique_lock lock(handshake.mutex);
    handshake.changed.wait(lock, [&] { return handshake.hello != nullptr || stopping.load(); });
    if (handshake.hello != nullptr) {
      std::vector<std::vector<double>> settings;
      for (const auto& plugin : handshake.hello->plugins())
        settings.emplace_back(plugin.numbers().begin(), plugin.numbers().end());
      epoch = handshake.hello->epoch();
      threads = handshake.hello->threads();
      const std::string refusal = worker.create_instances(settings);
      if (!refusal.empty()) handshake.admission = {control::v1::Refusal::REASON_SETTINGS, refusal};
      handshake.answered = true;
      handshake.changed.notify_all();
    }
  }
  const int code = worker.serve(epoch, threads, stopping, &service.calls,
                                [&](std::string text) { service.complain(std::move(text)); });
  // instances are gone with the process: a hanging destructor must not keep it
  std::_Exit(code);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string missing = missing_cpu_features();
  if (!missing.empty()) {
    std::cerr << "gravitas-worker: " << missing << '\n';
    return 1;
  }
  Arguments arguments;
  if (!parse(argc, argv, &arguments)) return usage();
  return arguments.describe ? describe(arguments.libraries) : serve(arguments);
}
