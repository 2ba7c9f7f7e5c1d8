#include "services/recorder/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace gravitas {
namespace {

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

// A descriptor that is closed at the end of its scope.
class OpenFile {
 public:
  OpenFile(const std::string& path, int flags) : handle_(open(path.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~OpenFile() {
    if (handle_ >= 0) ::close(handle_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  int handle() const { return handle_; }
  bool is_open() const { return handle_ >= 0; }
  bool close() { return ::close(std::exchange(handle_, -1)) == 0; }

 private:
  int handle_;
};

void write_and_sync(const std::string& path, std::span<const std::byte> bytes) {
  const std::string what = "'" + path + "'";
  OpenFile file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file.is_open()) fail(what);
  write_all(file.handle(), bytes, what);
  if (fsync(file.handle()) != 0) fail(what);
  if (!file.close()) fail(what);
}

}  // namespace

bool has_lost_its_name(int file, const std::string& path) {
  struct stat written = {}, there = {};
  if (fstat(file, &written) != 0 || !S_ISREG(written.st_mode)) return false;
  if (stat(path.c_str(), &there) != 0) return errno == ENOENT || errno == ENOTDIR;
  return there.st_dev != written.st_dev || there.st_ino != written.st_ino;
}

bool is_disk_error(const std::error_code& code) {
  return code == std::errc::no_space_on_device || code == std::errc::file_too_large || code == std::errc::io_error ||
         code == std::error_code(EDQUOT, std::generic_category());
}

void write_all(int file, std::span<const std::byte> bytes, const std::string& what) {
  while (!bytes.empty()) {
    const ssize_t written = write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      if (written == 0) errno = ENOSPC;
      fail(what);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
}

std::string fresh_name_of(const std::string& path) { return path + ".tmp"; }

void replace_file(const std::string& path, std::span<const std::byte> bytes) {
  const std::string fresh = fresh_name_of(path);
  try {
    write_and_sync(fresh, bytes);
    if (std::rename(fresh.c_str(), path.c_str()) != 0) fail("'" + path + "'");
  } catch (const std::system_error&) {
    unlink(fresh.c_str());
    throw;
  }
  // the new name is durable once its folder is
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  const OpenFile folder(parent.empty() ? "." : parent.string(), O_RDONLY | O_DIRECTORY);
  if (!folder.is_open() || fsync(folder.handle()) != 0) fail("folder of '" + path + "'");
}

void write_text_file(const std::string& path, const std::string& text, const std::string& what) {
  const std::string named = what + " '" + path + "'";
  OpenFile file(path, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file.is_open()) fail(named);
  write_all(file.handle(), std::as_bytes(std::span(text)), named);
  if (!file.close()) fail(named);
}

std::vector<std::byte> read_whole_file(const std::string& path) {
  const std::string what = "'" + path + "'";
  // a pipe that nobody writes to must not block
  const OpenFile file(path, O_RDONLY | O_NONBLOCK);
  struct stat about = {};
  if (!file.is_open() || fstat(file.handle(), &about) != 0) fail(what);
  if (!S_ISREG(about.st_mode)) throw std::runtime_error(what + ": it is not an ordinary file");
  std::vector<std::byte> bytes(static_cast<std::size_t>(about.st_size));
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = read(file.handle(), bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(what);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace gravitas
