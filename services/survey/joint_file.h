// What `gravitas run --joints FILE` writes: CSV, a row per coordinate of each joint that holds and sample, 17 significant
// digits so that every double can be read back bit for bit.
//
//   time,joint,coordinate,value,rate
//
// Joints stand in the scene's order, coordinates as their types declare them (`gravitas describe`): in m and m/s, or rad and
// rad/s. Samples: those of services/recorder/sampling.h.
#pragma once

#include <string>
#include <vector>

#include "services/recorder/output_file.h"
#include "services/recorder/sampling.h"
#include "services/survey/surveyor.h"

namespace gravitas::survey {

inline constexpr const char* kJointHead = "time,joint,coordinate,value,rate\n";
std::string joint_row(double time, const std::string& joint, const std::string& coordinate, double value, double rate);

class JointFile {
 public:
  // `interval` as in Sampling. Throws std::system_error if the file cannot be made.
  JointFile(const std::string& path, Surveyor* surveyor, double interval);

  // Empties the file and writes its first line, which the first sample does, too. Throws std::system_error.
  void begin();
  // Writes out what was told so far; throws as close().
  void flush() { file_.flush(); }

  // The scene was edited, and who answers knows it.
  void begin_again(Surveyor* surveyor) { surveyor_ = surveyor; }

  // Called for the initial state and after every commit; `last` forces a sample.
  void offer(const kernel::Environment& environment, bool last);

  // Writes out everything; throws std::system_error if that fails (a full disk).
  void close() { file_.close(); }

  // Different reasons why rows are missing, in the order of their appearance.
  const std::vector<std::string>& missing() const { return missing_; }

 private:
  OutputFile file_;
  Surveyor* surveyor_;
  Sampling sampling_;
  bool has_begun_ = false;
  std::vector<std::string> missing_;
};

}  // namespace gravitas::survey
