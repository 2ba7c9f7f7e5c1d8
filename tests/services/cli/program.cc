#include "tests/services/cli/program.h"

#include <fcntl.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/paths.h"

extern char** environ;

namespace gravitas::harness {
namespace {

constexpr int kLimitMs = 300'000;  // for what hangs: a campaign takes a minute and more of a busy machine

}  // namespace

ScratchFolder::ScratchFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "gravitas-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("mkdtemp");
  folder_ = pattern;
}

ScratchFolder::~ScratchFolder() { std::filesystem::remove_all(folder_); }

std::string ScratchFolder::write(const std::string& name, const std::string& text) const {
  std::ofstream(path(name), std::ios::binary) << text;
  return path(name);
}

std::string read_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

report::v1::Report read_report(const std::string& text) {
  report::v1::Report report;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(text, &report).ok()) << text;
  return report;
}

pid_t start_program(const std::vector<std::string>& arguments, const ScratchFolder& folder) {
  std::vector<std::string> words = {in_build("/bin/gravitas")};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const std::string out = folder.path("stdout"), err = folder.path("stderr");
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  // what it leaves where it was started goes with the folder
  posix_spawn_file_actions_addchdir_np(&actions, folder.path("").c_str());
  pid_t process = -1;
  const int problem = posix_spawn(&process, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (problem != 0) throw std::runtime_error("cannot start gravitas");
  return process;
}

ProgramResult finish_program(pid_t process, const ScratchFolder& folder) {
  const int handle = static_cast<int>(syscall(SYS_pidfd_open, process, 0));
  pollfd ended = {handle, POLLIN, 0};
  if (poll(&ended, 1, kLimitMs) == 0) kill(process, SIGKILL);
  close(handle);
  int status = 0;
  waitpid(process, &status, 0);
  ProgramResult result;
  result.exit_code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  result.out = read_file(folder.path("stdout"));
  result.err = read_file(folder.path("stderr"));
  return result;
}

ProgramResult run_program(const std::vector<std::string>& arguments, const ScratchFolder& folder) {
  return finish_program(start_program(arguments, folder), folder);
}

std::string shipped_scene(const std::string& name) { return in_source("/deploy/scenes/") + name + ".gravitas"; }

}  // namespace gravitas::harness
