// A folder that only this user can enter, for sockets; gone, with what is in it, at the end of the object.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace gravitas::channel {

class PrivateFolder {
 public:
  PrivateFolder() {
    std::error_code error;
    const std::filesystem::path place = std::filesystem::temp_directory_path(error);
    errno = error.value();
    if (error) return;
    path_ = (place / "gravitas-XXXXXX").string();
    if (mkdtemp(path_.data()) == nullptr) path_.clear();
  }
  ~PrivateFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  // Empty, and errno set, if it could not be made.
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace gravitas::channel
