// Files, by Landlock's own system calls: no C library wraps them.
#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "plugin_sdk/host/sandbox.h"

namespace gravitas::host {
namespace {

// What is handled is refused unless a rule allows it. The headers of an older system lack the newer parts.
struct Ruleset {
  std::uint64_t files;
  std::uint64_t network;
  std::uint64_t scope;
};
// Bits of Ruleset::files that versions 1 to 5 of the interface know; later ones know no more.
constexpr std::array<int, 5> kFileRights = {13, 14, 15, 15, 16};
constexpr std::uint64_t kReadAccess = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr long kNetworkVersion = 4;
constexpr std::uint64_t kBindAndConnectTcp = 3;
constexpr long kScopeVersion = 6;
constexpr std::uint64_t kAbstractSocketsAndSignals = 3;

// What the C library, gRPC and numeric libraries read of the system.
constexpr const char* kReadable[] = {"/usr",
                                     "/lib",
                                     "/lib64",
                                     "/etc/ld.so.cache",
                                     "/etc/localtime",
                                     "/proc/self",
                                     "/proc/cpuinfo",
                                     "/proc/meminfo",
                                     "/proc/stat",
                                     "/proc/sys/vm/overcommit_memory",
                                     "/sys/devices/system/cpu",
                                     "/sys/devices/system/node",
                                     "/dev/zero",
                                     "/dev/random",
                                     "/dev/urandom"};

// Allows it where it exists. False if the rule could not be made.
bool allow(int ruleset, const std::string& path, std::uint64_t rights) {
  const int descriptor = open(path.c_str(), O_PATH | O_CLOEXEC);
  if (descriptor < 0) return true;
  struct stat status {};
  landlock_path_beneath_attr rule{};
  rule.parent_fd = descriptor;
  rule.allowed_access = rights;
  if (fstat(descriptor, &status) == 0 && !S_ISDIR(status.st_mode)) rule.allowed_access &= ~LANDLOCK_ACCESS_FS_READ_DIR;
  const bool done = syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) == 0;
  const int problem = errno;
  close(descriptor);
  errno = problem;
  return done;
}

// The folder that a library really lies in.
std::string folder_of(const std::string& library) {
  std::array<char, PATH_MAX> resolved;
  if (realpath(library.c_str(), resolved.data()) == nullptr) return {};
  const std::string path = resolved.data();
  return path.substr(0, path.rfind('/') + 1);
}

bool allow_all(int ruleset, const std::vector<std::string>& libraries) {
  bool done = allow(ruleset, "/dev/null", kReadAccess | LANDLOCK_ACCESS_FS_WRITE_FILE);
  for (const char* path : kReadable) done = done && allow(ruleset, path, kReadAccess);
  // the program itself: a sanitizer reads the names of its functions
  done = done && allow(ruleset, "/proc/self/exe", kReadAccess);
  for (const std::string& library : libraries) {
    const std::string folder = folder_of(library);
    done = done && (folder.empty() || allow(ruleset, folder, kReadAccess));
  }
  if (const char* folders = std::getenv("LD_LIBRARY_PATH")) {
    std::istringstream list(folders);
    for (std::string folder; std::getline(list, folder, ':');)
      done = done && (folder.empty() || allow(ruleset, folder, kReadAccess));
  }
  return done;
}

}  // namespace

std::string restrict_files(const std::vector<std::string>& libraries) {
  const auto failed = [] { return std::string("no landlock: ") + std::strerror(errno); };
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 0 && (errno == ENOSYS || errno == EOPNOTSUPP)) return "no landlock: this system's kernel has none";
  if (version < 1) return failed();

  const std::size_t known = static_cast<std::size_t>(version) < kFileRights.size() ? version : kFileRights.size();
  Ruleset handled{};
  handled.files = (std::uint64_t{1} << kFileRights[known - 1]) - 1;
  if (version >= kNetworkVersion) handled.network = kBindAndConnectTcp;
  if (version >= kScopeVersion) handled.scope = kAbstractSocketsAndSignals;
  const int ruleset = static_cast<int>(syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0));
  if (ruleset < 0) return failed();
  std::string said = "landlock " + std::to_string(version);
  if (!allow_all(ruleset, libraries) || syscall(SYS_landlock_restrict_self, ruleset, 0) != 0) said = failed();
  close(ruleset);
  return said;
}

}  // namespace gravitas::host
