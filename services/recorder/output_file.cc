#include "services/recorder/output_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "services/recorder/durable_file.h"

namespace gravitas {

OutputFile::OutputFile(std::string what, std::string path, Allowed allowed)
    : what_(std::move(what)), path_(std::move(path)) {
  if (path_.empty()) return;
  const bool is_any = allowed == Allowed::kAny;
  const int flags = O_WRONLY | O_CREAT | O_CLOEXEC | (is_any ? 0 : O_NONBLOCK);
  int handle = open(path_.c_str(), flags | O_EXCL, 0666);
  is_new_ = handle >= 0;
  if (!is_new_ && errno == EEXIST) handle = open(path_.c_str(), flags, 0666);
  // ENXIO: a pipe that nobody reads
  struct stat about = {};
  if (handle < 0 ? errno != ENXIO || is_any : fstat(handle, &about) != 0) fail();
  if (handle >= 0) file_.reset(fdopen(handle, "w"));
  is_old_ = S_ISREG(about.st_mode);
  if (!is_old_ && !is_any) throw std::runtime_error(named() + ": it is not an ordinary file");
  if (!file_) fail();
  // where the file system has no locks there is none
  if (is_old_ && flock(handle, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw std::runtime_error(named() + ": another run is writing it");
}

void OutputFile::discard() {
  if (std::exchange(is_new_, false)) unlink(path_.c_str());
}

void OutputFile::begin() {
  is_new_ = false;
  if (std::exchange(is_old_, false) && ftruncate(fileno(file_.get()), 0) != 0) fail();
}

void OutputFile::write(std::string_view text) {
  begin();
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail();
}

void OutputFile::flush() {
  if (file_ && std::fflush(file_.get()) != 0) fail();
}

void OutputFile::close() {
  begin();
  if (!file_) return;
  const bool is_lost = has_lost_its_name(fileno(file_.get()), path_);
  if (std::fclose(file_.release()) != 0) fail();
  if (is_lost)
    throw std::system_error(ENOENT, std::generic_category(),
                            named() + " was removed or replaced while it was being written");
}

void OutputFile::fail() const { throw std::system_error(errno, std::generic_category(), named()); }

}  // namespace gravitas
