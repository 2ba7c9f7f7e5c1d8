#include "services/scene/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>

namespace gravitas::scene {
namespace {

// More than any scene and less than what would fill the memory of a small machine.
constexpr std::int64_t kLargestFile = std::int64_t{4} << 30;
constexpr const char* kTooLarge = "it is larger than 4 GiB";

// Why a file that is open is not read; empty: it is.
std::string find_obstacle(int file, const struct stat& about, InputKind allowed) {
  if (S_ISDIR(about.st_mode)) return "it is a folder";
  // a terminal ends when the person says so
  if (S_ISBLK(about.st_mode) || (S_ISCHR(about.st_mode) && isatty(file) == 0))
    return "it is no file that ends but a device";
  if (allowed == InputKind::kOrdinary && !S_ISREG(about.st_mode)) return "it is not an ordinary file";
  return about.st_size > kLargestFile ? kTooLarge : "";
}

// Empty, or why not all could be read.
std::string read_all(int file, std::size_t expected, std::string* text) {
  std::size_t size = 0;
  std::string why;
  for (;;) {
    text->resize(std::max(size + 65536, expected + 1));
    const ssize_t got = ::read(file, text->data() + size, text->size() - size);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) why = std::strerror(errno);
    if (got <= 0) break;
    size += static_cast<std::size_t>(got);
    if (static_cast<std::int64_t>(size) > kLargestFile) why = kTooLarge;
    if (!why.empty()) break;
  }
  text->resize(why.empty() ? size : 0);
  return why;
}

}  // namespace

bool read_input_file(const std::string& path, std::string* text, std::string* why, InputKind allowed) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | (allowed == InputKind::kOrdinary ? O_NONBLOCK : 0));
  struct stat about = {};
  if (file < 0 || ::fstat(file, &about) != 0) {
    *why = std::strerror(errno);
  } else {
    *why = find_obstacle(file, about, allowed);
  }
  if (why->empty()) *why = read_all(file, static_cast<std::size_t>(about.st_size), text);
  if (file >= 0) ::close(file);
  return why->empty();
}

}  // namespace gravitas::scene
