// What a file is, seen from outside: nothing of it is run.
#pragma once

#include <string>

namespace gravitas::check {

enum class FileKind {
  kMissing,  // no regular file, or it cannot be read
  kPlugin,   // a shared library that exports the entry point of plugin_sdk/abi.h
  kLibrary,  // a shared library that does not
  kProgram,  // an executable file or a script
  kOther
};

FileKind kind_of_file(const std::string& path);

}  // namespace gravitas::check
