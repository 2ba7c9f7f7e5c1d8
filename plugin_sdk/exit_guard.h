// A plugin that lives in a program of ours and calls exit() would end it with the exit code of work that is done.
#pragma once

namespace gravitas {

// From the first one that is made for the program itself (`plugin` is null), and as long as one lives, exit() and
// quick_exit() end the program at once: with an exit code that says failure, and a word on standard error that names who is
// at work. That is the innermost of the thread that ends it; for a thread of a pool or of the plugin's own, who began last.
// Of _exit() no program hears. Programs that have none for themselves, such as workers, whose end others notice, end as
// before.
class ExitGuard {
 public:
  // The name must last as long as the guard.
  explicit ExitGuard(const char* plugin);
  ~ExitGuard();
  ExitGuard(const ExitGuard&) = delete;
  ExitGuard& operator=(const ExitGuard&) = delete;

  // What was registered last is heard first: again when a library is loaded, whose statics exit() would destroy before.
  static void listen_first();

 private:
  const char* const plugin_;
  const ExitGuard* const outer_;  // of this thread

  static void on_exit();
  static thread_local const ExitGuard* innermost;
};

}  // namespace gravitas
