#include "services/campaign/host_trouble.h"

#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>

namespace gravitas::campaign {
namespace {

constexpr std::chrono::microseconds kBetweenSignals{300};
// Ignored by default, so that one which comes late does no harm.
constexpr int kSignal = SIGURG;

void do_nothing(int) {}

}  // namespace

SignalStorm::SignalStorm() {
  struct sigaction action {};
  action.sa_handler = do_nothing;
  sigaction(kSignal, &action, nullptr);
  thread_ = std::jthread([](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      kill(getpid(), kSignal);
      std::this_thread::sleep_for(kBetweenSignals);
    }
  });
}

SignalStorm::~SignalStorm() {
  thread_.request_stop();
  thread_.join();
  signal(kSignal, SIG_DFL);
}

ForeignSurroundings::ForeignSurroundings() {
  const std::string proxy = "http://127.0.0.1:9", locale = "de_DE.UTF-8";
  for (const auto& [name, value] :
       {std::pair{"http_proxy", proxy}, {"https_proxy", proxy}, {"grpc_proxy", proxy}, {"LC_ALL", locale}}) {
    const char* old = std::getenv(name);
    before_[name] = old != nullptr ? std::optional<std::string>(old) : std::nullopt;
    setenv(name, value.c_str(), 1);
  }
}

ForeignSurroundings::~ForeignSurroundings() {
  for (const auto& [name, value] : before_) {
    if (value) {
      setenv(name.c_str(), value->c_str(), 1);
    } else {
      unsetenv(name.c_str());
    }
  }
}

std::jthread continue_later(int process, double seconds) {
  // its number may be another's by then
  const int handle = static_cast<int>(syscall(SYS_pidfd_open, process, 0));
  return std::jthread([handle, seconds] {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    if (handle < 0) return;
    syscall(SYS_pidfd_send_signal, handle, SIGCONT, nullptr, 0);
    close(handle);
  });
}

}  // namespace gravitas::campaign
