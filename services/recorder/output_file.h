// A file that a run writes as it goes: none of it is lost unnoticed.
#pragma once

#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

namespace gravitas {

class OutputFile {
 public:
  // kOrdinary: no pipe, which would be waited for, nor a device.
  enum class Allowed : std::uint8_t { kAny, kOrdinary };

  // `what` names it in errors: "trajectory". No file if `path` is empty. What stands there stays up to begin(). Throws
  // std::system_error if it cannot be made, std::runtime_error if it is not allowed, or another run is writing it.
  OutputFile(std::string what, std::string path, Allowed allowed = Allowed::kAny);

  bool is_open() const { return file_ != nullptr; }
  const std::string& path() const { return path_; }

  // Removes the file if it was made for nothing: it is new, and nobody began it.
  void discard();

  // Empties the file, once; so does what writes or closes it. Throws std::system_error.
  void begin();
  // Needs an open file. Throws std::system_error (a full disk).
  void write(std::string_view text);
  // What was written is the file's, whatever becomes of this process. Throws std::system_error.
  void flush();
  // Writes out everything; throws std::system_error if that fails, or if the name is no longer that of the file that was
  // written: somebody removed it, or put another into its place. Does nothing the second time.
  void close();

 private:
  [[noreturn]] void fail() const;
  std::string named() const { return what_ + " '" + path_ + "'"; }

  std::string what_, path_;
  bool is_old_ = false;  // it holds what stood there
  bool is_new_ = false;  // there was none, and it has not begun
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
};

}  // namespace gravitas
