#include "plugin_sdk/exit_guard.h"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>

namespace gravitas {
namespace {

constexpr int kFailure = 1;

std::atomic<pid_t> guarded{0};           // the program; a child that a plugin forks is none
std::atomic<int> open_guards{0};         // of the program itself
std::atomic<const char*> last{nullptr};  // who began last; null once any thread is done

void say(const std::string& text) {
  // NOLINTNEXTLINE(bugprone-unused-return-value): there is nobody left to tell
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

thread_local const ExitGuard* ExitGuard::innermost = nullptr;

ExitGuard::ExitGuard(const char* plugin) : plugin_(plugin), outer_(innermost) {
  innermost = this;
  last.store(plugin, std::memory_order_relaxed);
  if (plugin != nullptr) return;
  ++open_guards;
  if (guarded != 0) return;
  guarded = getpid();
  listen_first();
}

ExitGuard::~ExitGuard() {
  innermost = outer_;
  last.store(outer_ == nullptr ? nullptr : outer_->plugin_, std::memory_order_relaxed);
  if (plugin_ == nullptr) --open_guards;
}

void ExitGuard::listen_first() {
  if (guarded == 0) return;
  std::atexit(on_exit);
  std::at_quick_exit(on_exit);
}

void ExitGuard::on_exit() {
  if (open_guards == 0 || guarded != getpid()) return;
  const char* name = innermost != nullptr ? innermost->plugin_ : last.load();
  const std::string who = name != nullptr ? "plugin " + std::string(name) : "a thread of a plugin, it seems,";
  say("gravitas: " + who +
      " called exit() and so ended this program in the middle of its work, as it is hosted direct; " +
      "hosted shm its worker would have been replaced\n");
  _exit(kFailure);
}

}  // namespace gravitas
