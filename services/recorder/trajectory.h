// The trajectory file: CSV, a row per body and sample, 17 significant digits so that every double can be read
// back bit for bit.
//
//   time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz
//
// SI units, world frame. Position and orientation are those of the geometry's frame (of the centre of mass where there
// is no geometry), vx vy vz is the velocity of the centre of mass. Immovable bodies have no rows. Samples: those of
// sampling.h.
#pragma once

#include <string>
#include <vector>

#include "kernel/environment.h"
#include "services/recorder/output_file.h"
#include "services/recorder/sampling.h"

namespace gravitas {

class TrajectoryWriter {
 public:
  // `interval` 0: every step. Throws std::system_error if the file cannot be made.
  TrajectoryWriter(const std::string& path, const kernel::EnvironmentDescription& description, double interval);

  // Empties the file and writes its first line, which the first sample does, too. Throws std::system_error.
  void begin();

  // The bodies are these from now on.
  void follow(const kernel::EnvironmentDescription& description);

  // Called for the initial state and after every commit; `last` forces a sample.
  void offer(const kernel::Environment& environment, bool last);

  // Writes out everything; throws std::system_error if that fails (a full disk).
  void close() { file_.close(); }
  void flush() { file_.flush(); }

 private:
  void write_sample(const kernel::Environment& environment);

  struct Row {
    std::uint32_t body;
    std::string id;
    Pose geometry;  // of the geometry's frame in the body's
  };

  OutputFile file_;
  bool has_begun_ = false;
  std::vector<Row> rows_;
  Sampling sampling_;
};

}  // namespace gravitas
