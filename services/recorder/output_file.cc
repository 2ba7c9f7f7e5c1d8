#include "services/recorder/output_file.h"

#include <cerrno>
#include <system_error>
#include <utility>

namespace gravitas {

OutputFile::OutputFile(std::string what, std::string path) : what_(std::move(what)), path_(std::move(path)) {
  if (path_.empty()) return;
  file_.reset(std::fopen(path_.c_str(), "we"));
  if (!file_) fail();
}

void OutputFile::write(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size()) fail();
}

void OutputFile::close() {
  if (file_ && std::fclose(file_.release()) != 0) fail();
}

void OutputFile::fail() const { throw std::system_error(errno, std::generic_category(), what_ + " '" + path_ + "'"); }

}  // namespace gravitas
