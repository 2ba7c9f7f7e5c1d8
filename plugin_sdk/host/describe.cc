#include "plugin_sdk/host/describe.h"

#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <utility>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/host/description_message.h"
#include "plugin_sdk/library.h"
#include "plugin_sdk/printable.h"

namespace gravitas::host {
namespace {

using Entry = plugin::v1::Catalog::Entry;

bool write_all(int descriptor, const void* data, std::size_t size) {
  const char* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t written = write(descriptor, bytes, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

// Reads exactly `size` bytes before the clock passes `until`.
bool read_all(int descriptor, void* data, std::size_t size, std::uint64_t until) {
  char* bytes = static_cast<char*>(data);
  while (size > 0) {
    const std::uint64_t now = channel::now_ns();
    if (now >= until) return false;
    pollfd ready = {descriptor, POLLIN, 0};
    const int polled = poll(&ready, 1, static_cast<int>((until - now) / 1'000'000 + 1));
    if (polled < 0 && errno != EINTR) return false;
    if (polled <= 0) continue;
    const ssize_t got = read(descriptor, bytes, size);
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

// The child: describes libraries from `first` on, one message each, behind its length.
[[noreturn]] void describe_in_child(const std::vector<std::string>& libraries, std::size_t first, int out) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // what a library prints while it loads must not mix with the catalogue
  dup2(STDERR_FILENO, STDOUT_FILENO);
  for (std::size_t i = first; i < libraries.size(); ++i) {
    Entry entry;
    entry.set_library(printable(libraries[i]));
    std::string problem;
    const PluginLibrary library = look_into_plugin_library(libraries[i], &problem);
    entry.set_problem(printable(problem));
    if (library.table != nullptr) *entry.mutable_description() = to_message(library.declaration);
    const std::string bytes = entry.SerializeAsString();
    const auto size = static_cast<std::uint32_t>(bytes.size());
    if (!write_all(out, &size, sizeof size) || !write_all(out, bytes.data(), bytes.size())) _exit(1);
  }
  _exit(0);
}

std::string how_it_ended(int status) {
  if (WIFSIGNALED(status)) return std::string("ended with signal ") + strsignal(WTERMSIG(status));
  return "ended with exit code " + std::to_string(WEXITSTATUS(status));
}

void add_problem(plugin::v1::Catalog* catalog, const std::string& library, const std::string& what) {
  Entry* failed = catalog->add_entries();
  failed->set_library(printable(library));
  failed->set_problem(printable("'" + library + "' " + what));
}

}  // namespace

plugin::v1::Catalog describe_libraries(const std::vector<std::string>& libraries, double seconds) {
  plugin::v1::Catalog catalog;
  std::size_t next = 0;
  while (next < libraries.size()) {
    int pipe_ends[2] = {-1, -1};
    const pid_t child = pipe(pipe_ends) == 0 ? fork() : -1;
    if (child < 0) {
      add_problem(&catalog, libraries[next++], std::string("was not looked into: ") + std::strerror(errno));
      for (const int end : pipe_ends) close(end);
      continue;
    }
    if (child == 0) describe_in_child(libraries, next, pipe_ends[1]);
    close(pipe_ends[1]);
    bool in_time = true;
    while (next < libraries.size()) {
      const std::uint64_t until = channel::now_ns() + static_cast<std::uint64_t>(seconds * 1e9);
      std::uint32_t size = 0;
      std::string bytes;
      Entry entry;
      bool got = read_all(pipe_ends[0], &size, sizeof size, until) && size < (1U << 24);
      if (got) {
        bytes.resize(size);
        got = read_all(pipe_ends[0], bytes.data(), size, until) && entry.ParseFromString(bytes);
      }
      if (!got) {
        in_time = channel::now_ns() < until;
        break;
      }
      *catalog.add_entries() = std::move(entry);
      ++next;
    }
    close(pipe_ends[0]);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    if (next < libraries.size())
      add_problem(&catalog, libraries[next++],
                  (in_time ? how_it_ended(status) : "was not ready in time") + " while it was loaded");
  }
  return catalog;
}

}  // namespace gravitas::host
