#include "services/recorder/library_digest.h"

#include <sys/stat.h>

#include <map>
#include <mutex>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "plugin_sdk/channel/digest.h"
#include "services/recorder/durable_file.h"

namespace gravitas {

std::uint64_t library_digest(const std::string& path) {
  struct stat status;
  if (path.empty() || ::stat(path.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return 0;
  // runs of one process have the same libraries; what was written since is another file, or has another stamp
  static std::mutex mutex;
  static std::map<std::tuple<std::string, dev_t, ino_t, off_t, time_t, long>, std::uint64_t> known;
  const std::tuple print{path,           status.st_dev,         status.st_ino,
                         status.st_size, status.st_ctim.tv_sec, status.st_ctim.tv_nsec};
  const std::lock_guard lock(mutex);
  if (const auto found = known.find(print); found != known.end()) return found->second;
  try {
    const auto bytes = read_whole_file(path);
    channel::Digest digest;
    digest.add(bytes.data(), bytes.size());
    return known[print] = digest.value();
  } catch (const std::runtime_error&) {
    return 0;
  }
}

}  // namespace gravitas
