#include "services/catalog/describe_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "kernel/carrier/carrier.h"
#include "plugin_sdk/channel/process_output.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/printable.h"
#include "plugin_sdk/shell_word.h"

extern char** environ;

namespace gravitas {
namespace {

using DescribeClock = std::chrono::steady_clock;

// An answer of this size would be wrong anyway.
constexpr std::size_t kLargestAnswer = std::size_t{64} << 20;
constexpr std::size_t kShownCharacters = 300;

struct Pipe {
  int read = -1;
  int write = -1;

  Pipe() {
    std::array<int, 2> ends = {-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) == 0) read = ends[0], write = ends[1];
  }
  ~Pipe() {
    close_end(&read);
    close_end(&write);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  static void close_end(int* end) {
    if (*end >= 0) ::close(*end);
    *end = -1;
  }
};

// Starts the worker in a process group of its own, so that a timeout also reaches what it started.
int spawn(std::vector<std::string> words, const Pipe& out, const Pipe& err, pid_t* pid) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  posix_spawn_file_actions_init(&actions);
  posix_spawnattr_init(&attributes);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.write, STDERR_FILENO);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int result = ::posix_spawn(pid, words[0].c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return result;
}

// Reads once from a pipe that is ready; closes it at its end.
void drain(int* end, std::string* text) {
  std::array<char, 65536> buffer;
  const ssize_t got = ::read(*end, buffer.data(), buffer.size());
  if (got > 0 && text->size() < kLargestAnswer) {
    text->append(buffer.data(), static_cast<std::size_t>(got));
  } else if (got >= 0 || errno != EINTR) {
    Pipe::close_end(end);
  }
}

// Reads both pipes to their ends. False if time ran out before.
bool read_all(Pipe* out, Pipe* err, DescribeClock::time_point until, std::string* answer, std::string* messages) {
  while (out->read >= 0 || err->read >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - DescribeClock::now()).count();
    if (left <= 0) return false;
    std::array<pollfd, 2> ends = {pollfd{out->read, POLLIN, 0}, pollfd{err->read, POLLIN, 0}};
    if (::poll(ends.data(), ends.size(), static_cast<int>(left)) < 0 && errno != EINTR) return false;
    if (out->read >= 0 && ends[0].revents != 0) drain(&out->read, answer);
    if (err->read >= 0 && ends[1].revents != 0) drain(&err->read, messages);
  }
  return true;
}

// The status of a process that has ended or is about to; it is killed if time runs out.
int wait_for(pid_t pid, DescribeClock::time_point until, bool* is_in_time) {
  const int handle = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
  while (*is_in_time && handle >= 0) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - DescribeClock::now()).count();
    pollfd end = {handle, POLLIN, 0};
    const int ready = left > 0 ? ::poll(&end, 1, static_cast<int>(left)) : 0;
    if (ready > 0) break;
    *is_in_time = ready < 0 && errno == EINTR;
  }
  if (handle >= 0) ::close(handle);
  if (!*is_in_time) ::kill(-pid, SIGKILL);
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

// The last line says why, and indented ones before it where; without these if that is too much.
std::string last_line(const std::string& messages) {
  channel::ProcessOutput output;
  output.add(channel::OutputStream::kStderr, messages);
  output.end(channel::OutputStream::kStderr);
  const std::string words = output.last_words();
  if (words.size() <= kShownCharacters) return words.empty() ? "" : ": " + words;
  const std::size_t end = messages.find_last_not_of("\n ");
  if (end == std::string::npos) return "";
  const std::size_t before = messages.find_last_of('\n', end);
  const std::size_t begin = before == std::string::npos ? 0 : before + 1;
  return ": " + printable(messages.substr(begin, std::min(end + 1 - begin, kShownCharacters)));
}

// What a plugin in Python lacks, by the error that its interpreter ends with.
std::string missing_module(const std::string& messages) {
  const auto lacks = [&](const char* module) {
    return messages.find(std::string("No module named '") + module) != std::string::npos;
  };
  if (lacks("gravitas")) {
    const std::filesystem::path bin = std::filesystem::path(kernel::worker_program()).parent_path();
    return "; PYTHONPATH must name the folder of the Python SDK: " +
           shell_word((bin.parent_path() / "lib" / "python").string());
  }
  if (lacks("numpy") || lacks("grpc") || lacks("google"))
    return "; it needs Debian's packages python3-numpy, python3-grpcio and python3-protobuf, which /usr/bin/python3 "
           "finds";
  return {};
}

// What stands where the catalogue should.
std::string first_line(const std::string& bytes) {
  if (bytes.empty()) return "it wrote nothing";
  return "its standard output, which is the catalogue's alone, begins with \"" +
         printable(bytes.substr(0, std::min(bytes.find('\n'), kShownCharacters))) + '"';
}

// `what` stands for the program in messages. `was_killed`: by a signal. Libraries are each looked at in a process of their own,
// so that it came from outside, which says nothing about them.
bool describe_once(const std::string& what, const std::vector<std::string>& words, int entries,
                   std::chrono::milliseconds timeout, plugin::v1::Catalog* answer, std::string* problem,
                   bool* was_killed) {
  Pipe out, err;
  if (out.read < 0 || err.read < 0) {
    *problem = std::string("no pipe could be made: ") + std::strerror(errno);
    return false;
  }
  pid_t pid = -1;
  const int failure = spawn(words, out, err, &pid);
  if (failure != 0) {
    *problem = what + " could not be started: " + std::strerror(failure);
    return false;
  }
  Pipe::close_end(&out.write);
  Pipe::close_end(&err.write);

  std::string bytes, messages;
  const DescribeClock::time_point until = DescribeClock::now() + timeout;
  bool is_complete = read_all(&out, &err, until, &bytes, &messages);
  const int status = wait_for(pid, until, &is_complete);
  *was_killed = is_complete && WIFSIGNALED(status);
  if (!is_complete) {
    *problem = what + " --describe did not end within " + std::to_string(timeout.count()) + " ms" + last_line(messages);
  } else if (WIFSIGNALED(status)) {
    *problem = what + " --describe was ended by signal " + std::to_string(WTERMSIG(status)) + last_line(messages);
  } else if (WEXITSTATUS(status) != 0) {
    *problem = what + " --describe ended with status " + std::to_string(WEXITSTATUS(status)) + last_line(messages) +
               missing_module(messages);
  } else if (!answer->ParseFromString(bytes) || answer->entries_size() != entries) {
    *problem = what + " --describe wrote no catalogue of " + counted(entries, "plugin") + ": " + first_line(bytes);
  } else {
    return true;
  }
  return false;
}

bool describe(const std::string& what, const std::vector<std::string>& words, int entries,
              std::chrono::milliseconds timeout, plugin::v1::Catalog* answer, std::string* problem) {
  bool was_killed = false;
  if (describe_once(what, words, entries, timeout, answer, problem, &was_killed)) return true;
  return was_killed && describe_once(what, words, entries, timeout, answer, problem, &was_killed);
}

}  // namespace

bool describe_libraries(const std::string& worker_path, const std::vector<std::string>& libraries,
                        std::chrono::milliseconds timeout, plugin::v1::Catalog* answer, std::string* problem) {
  std::vector<std::string> words = {worker_path, "--describe"};
  words.insert(words.end(), libraries.begin(), libraries.end());
  return describe(worker_path, words, static_cast<int>(libraries.size()), timeout, answer, problem);
}

bool describe_command(const std::string& command, std::chrono::milliseconds timeout, plugin::v1::Catalog* answer,
                      std::string* problem) {
  return describe(command, {"/bin/sh", "-c", "exec env " + command + " --describe"}, 1, timeout, answer, problem);
}

}  // namespace gravitas
