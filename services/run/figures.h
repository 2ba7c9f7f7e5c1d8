// Conserved quantities and errors of a run, followed from commit to commit for the report.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"

namespace gravitas {

class Figures {
 public:
  explicit Figures(const kernel::EnvironmentDescription& description);

  // Called for the initial state and after every commit. May throw StageFault (a force was asked for its potential); then
  // its energy and momenta are written as NaN.
  void follow(kernel::Environment* environment);
  // Called for every call of a plugin in a step, but for those that only compare.
  void count_call() { ++calls_; }
  // Called for every inner step.
  void look_at(const kernel::InnerStep& inner);
  // The scene was edited: energy is compared with that of now.
  void begin_again(kernel::Environment* environment);

  // Energy, momenta, penetration, joint error, drives; warnings where joints came open, and why, where a body runs away, where
  // bodies overlap at the start, and where a step, be it the one that was not ended, takes very many calls.
  void write(report::v1::Report* report) const;

  // The warning of a step that takes very many calls; empty where none does.
  std::string why_dear() const;

  // The extremes so far, into a checkpoint and out of it. To resume: follow() the initial state, resume(), and follow()
  // from the restored state on.
  void write(recorder::v1::Tally* tally) const;
  // `was_edited`: what was followed so far is the scene with its edits at the start, which never was.
  void resume(const recorder::v1::Tally& tally, bool was_edited);

 private:
  struct Totals {
    double kinetic = 0.0, potential = 0.0;  // J
    Vector3 linear = Vector3::Zero();       // kg m/s
    Vector3 angular = Vector3::Zero();      // kg m^2/s, about the origin
    double speed = 0.0;                     // m/s, of the fastest body
    std::uint32_t fastest = kNone;
    double energy() const { return kinetic + potential; }
  };
  // A joint that drives its second body about an axis, or along it.
  struct Drive {
    std::uint32_t constraint;
    Vector3 axis_in_body1;  // unit
    double target;          // rad/s or m/s
    bool slides = false;
    double speed = 0.0;                            // in the last state
    std::optional<Vector3> rolling_in_body2 = {};  // of a wheel, which steers about the other, or a cross
    bool is_of_first = false;                      // of two axes
  };

  struct Runaway {
    std::uint64_t step;  // that was made last
    std::string body;    // its id: rows change by edits
    double way;          // m, in a step
    bool is_given;       // no step has been made with that speed
  };

  struct Effort {
    std::uint64_t calls = 0, step = 0;
  };

  // Of two bodies at the start.
  struct Overlap {
    std::string one, two;
    double depth = 0.0;      // m, of the deepest
    std::size_t others = 0;  // pairs
  };

  Totals totals(kernel::Environment* environment) const;
  void find_overlaps(const kernel::InnerStep& inner);
  // Of all steps, with the one that goes on.
  Effort largest_effort() const;
  void find_drives();
  void measure(kernel::Environment* environment);
  double drive_speed(const Drive& drive, const kernel::StateView& state) const;

  const kernel::EnvironmentDescription& description_;
  std::vector<Drive> drives_;
  std::optional<Totals> initial_;
  double reference_energy_ = 0.0;  // J
  std::optional<Totals> last_;     // of the state that was committed last; absent where a force failed in it
  double largest_kinetic_ = 0.0, largest_deviation_ = 0.0;
  double penetration_ = 0.0, joint_error_ = 0.0;
  double joined_size_ = 0.0, scene_size_ = 0.0;  // m, of what joints hold together, and of all
  bool contradicts_ = false;                     // joints, limits or drives each other, in some step
  std::optional<Runaway> runaway_;               // the first
  std::optional<std::uint64_t> opening_step_;    // the first in which joints came open by kTorn of it
  std::optional<std::uint64_t> edited_step_;     // the one after the last edit
  std::uint64_t calls_ = 0;                      // in the step that goes on
  std::uint64_t steps_ = 0;                      // that were made
  Effort effort_;                                // the largest of these
  bool is_at_start_ = false;                     // no step has been made
  Overlap overlap_;
};

}  // namespace gravitas
