// Runs the real `gravitas` program and keeps what it said.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <vector>

#include "gravitas/report/v1/report.pb.h"

namespace gravitas::harness {

struct ProgramResult {
  int exit_code = -1;  // 128 + signal if it was killed
  std::string out, err;
};

// A folder of its own for a test's files, removed with everything in it at the end.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  // Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& text) const;

 private:
  std::string folder_;
};

// Files that a run leaves where it was started go into a folder of the test's own.
class CurrentFolder {
 public:
  CurrentFolder() { std::filesystem::current_path(scratch_.path("")); }
  ~CurrentFolder() { std::filesystem::current_path(before_); }
  CurrentFolder(const CurrentFolder&) = delete;
  CurrentFolder& operator=(const CurrentFolder&) = delete;

 private:
  const std::filesystem::path before_ = std::filesystem::current_path();
  const ScratchFolder scratch_;
};

std::string read_file(const std::string& path);
// The file of --report, or what --json prints.
report::v1::Report read_report(const std::string& text);

// Starts `gravitas` with its standard streams in files of `folder`; returns its process id.
pid_t start_program(const std::vector<std::string>& arguments, const ScratchFolder& folder);
// Waits for it to end; killed after five minutes.
ProgramResult finish_program(pid_t process, const ScratchFolder& folder);

ProgramResult run_program(const std::vector<std::string>& arguments, const ScratchFolder& folder);

// A shipped scene.
std::string shipped_scene(const std::string& name);

}  // namespace gravitas::harness

namespace gravitas {

inline const std::string kSample = harness::shipped_scene("two_spheres_motor");

}  // namespace gravitas
