// What joints and contacts did to their bodies in a step, and the file of it: JSON lines, an object per joint and contact
// of each sampled step (Reaction of report.proto).
//
// Force = the solver's impulses of all inner steps of the step, over its length: the mean over the step to first order, and as
// well as the state is known where inner steps are extrapolated (reaction_sums.h). A contact's torque likewise: of rolling and
// spinning friction, about its point. With the simulator Smooth joints act within the derivatives: their force is that of the
// last one asked for in the step, and the solver's impulses come on top.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"
#include "services/recorder/output_file.h"
#include "services/recorder/reaction_sums.h"
#include "services/recorder/sampling.h"

namespace gravitas {

class ReactionLog {
 public:
  // No file if `path` is empty. Samples as Sampling has them, without the initial state: no step led there. Throws
  // std::system_error if the file cannot be made.
  ReactionLog(const std::string& path, const kernel::EnvironmentDescription& description, double interval);

  // Empties the file, which writing does, too. Throws std::system_error.
  void begin() { file_.begin(); }
  // Writes out what was told so far; throws as close().
  void flush() { file_.flush(); }

  // What kernel::CommitListener hears of inner steps.
  void add(const kernel::Environment& environment, const kernel::InnerStep& inner);
  void add_attempt(const kernel::StepData& data, std::uint32_t pieces);

  // The description has changed; no step of it has been made.
  void begin_again();

  // Of the step that led to the committed state: joints in the scene's order, then contacts by their pairs.
  std::vector<report::v1::Reaction> last(const kernel::Environment& environment) const;

  // Called after every commit; `is_last` forces a sample. Throws std::system_error if it cannot be written.
  void offer(const kernel::Environment& environment, bool is_last);
  // Writes out everything; throws std::system_error if that fails.
  void close() { file_.close(); }

 private:
  bool acts_in_derivatives() const { return description_.simulator == kernel::Simulator::kSmooth; }
  report::v1::Reaction message(const kernel::Environment& environment, const ReactionSum& sum) const;

  const kernel::EnvironmentDescription& description_;
  OutputFile file_;
  Sampling sampling_;

  std::uint32_t step_ = 0;  // that the sums are of
  double length_ = 0.0;     // s
  ReactionSums sums_;
  std::vector<ReactionSums> attempts_;  // at a part of it, in 1, 2, 3, … inner steps
};

}  // namespace gravitas
