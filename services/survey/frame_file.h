// What `gravitas run --instrumentation FILE` writes: a Frame per sample as a line of JSON, or, if the file's name ends
// in `.svg`, a picture of the last state with the trajectories that led there.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "services/recorder/output_file.h"
#include "services/recorder/sampling.h"
#include "services/survey/instrumentation.h"

namespace gravitas::survey {

class FrameFile {
 public:
  // `interval` as in Sampling. Throws std::system_error if the file cannot be made.
  FrameFile(const std::string& path, Surveyor* surveyor, std::vector<Kind> kinds, double interval);

  // Empties the file, which writing does, too. Throws std::system_error.
  void begin() { file_.begin(); }
  // Writes out what was told so far; throws as close().
  void flush() { file_.flush(); }

  // The scene was edited, and who answers knows it.
  void begin_again(Surveyor* surveyor) {
    Instrumentation next(surveyor);
    next.go_on_from(std::move(*instrumentation_));
    instrumentation_.emplace(std::move(next));
  }

  // Called for the initial state and after every commit; `last` forces a sample.
  void offer(const kernel::Environment& environment, bool last);

  // Writes out everything; throws std::system_error if that fails (a full disk).
  void close();

  // Different reasons why something was missing, in the order of their appearance.
  const std::vector<std::string>& missing() const { return missing_; }

 private:
  bool is_picture() const { return file_.path().ends_with(".svg"); }
  void note_missing(const Frame& frame);

  OutputFile file_;
  std::optional<Instrumentation> instrumentation_;
  std::vector<Kind> kinds_;
  Sampling sampling_;
  std::string title_;
  Frame picture_;
  std::optional<std::uint32_t> drawn_step_;
  std::vector<std::string> missing_;
};

}  // namespace gravitas::survey
