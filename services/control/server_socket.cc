#include "services/control/server_socket.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "plugin_sdk/channel/address.h"
#include "services/run/session.h"

namespace gravitas::control {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPrefix = "gravitas-serve-";
constexpr const char* kName = "control.sock";
constexpr const char* kShared = "/tmp";

std::string runtime_folder() {
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  return folder != nullptr && *folder == '/' ? folder : "";
}

bool is_own_folder(const std::string& path) {
  struct stat about {};
  return lstat(path.c_str(), &about) == 0 && S_ISDIR(about.st_mode) && about.st_uid == geteuid() &&
         (about.st_mode & 077) == 0;
}

void make_room(const std::string& path) {
  const fs::path folder = fs::absolute(path).parent_path();
  if (access(folder.c_str(), W_OK | X_OK) != 0)
    throw BadInput(fmt::format("--socket {}: folder {}: {}; allowed: one that you can write to", path, folder.string(),
                               std::generic_category().message(errno)));
  struct stat about {};
  if (lstat(path.c_str(), &about) != 0) return;
  if (!S_ISSOCK(about.st_mode)) throw BadInput(fmt::format("--socket {}: a file stands there that is no socket", path));
  const int problem = channel::probe_unix(path);
  if (problem == 0) throw BadInput(fmt::format("--socket {}: another server listens there", path));
  // only what a server that is gone has left behind
  if (problem != ECONNREFUSED)
    throw BadInput(
        fmt::format("--socket {}: a socket stands there: {}", path, std::generic_category().message(problem)));
  unlink(path.c_str());
}

}  // namespace

ServerSocket::ServerSocket(const std::string& path) : path_(path) {
  if (path_.empty()) {
    const std::string wanted = runtime_folder();
    const std::string parent = !wanted.empty() && access(wanted.c_str(), W_OK | X_OK) == 0 ? wanted : kShared;
    std::string folder = parent + "/" + kPrefix + "XXXXXX";
    if (mkdtemp(folder.data()) == nullptr)
      throw std::system_error(errno, std::generic_category(), "a folder for the socket in " + parent);
    folder_ = folder;
    path_ = folder + "/" + kName;
  }
  const std::size_t longest = sizeof(sockaddr_un::sun_path) - 1;
  if (path_.size() > longest) {
    if (!folder_.empty()) rmdir(folder_.c_str());
    throw BadInput(fmt::format("socket {}: the path has {} bytes; allowed: {}", path_, path_.size(), longest));
  }
  if (folder_.empty()) make_room(path_);
}

ServerSocket::~ServerSocket() {
  unlink(path_.c_str());
  if (!folder_.empty()) rmdir(folder_.c_str());
}

std::vector<std::string> find_servers() {
  std::vector<std::string> found;
  for (const std::string& parent : {runtime_folder(), std::string(kShared)}) {
    if (parent.empty()) continue;
    std::error_code problem;
    for (fs::directory_iterator entry(parent, problem); !problem && entry != fs::directory_iterator();
         entry.increment(problem)) {
      const std::string folder = entry->path().string(), path = folder + "/" + kName;
      const bool is_named = entry->path().filename().string().starts_with(kPrefix);
      if (is_named && is_own_folder(folder) && channel::probe_unix(path) == 0) found.push_back(path);
    }
  }
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace gravitas::control
