#include "services/recorder/sampling.h"

namespace gravitas {
namespace {

// A boundary counts as "at k * interval" within this share of a time step.
constexpr double kTimeTolerance = 1e-9;

}  // namespace

bool Sampling::is_due(const kernel::Environment& environment, bool last) {
  const double time = environment.time();
  const double tolerance = kTimeTolerance * environment.time_step();
  const bool is_each = interval_ <= 0.5 * environment.time_step();
  const bool due = is_each || time >= static_cast<double>(next_sample_) * interval_ - tolerance;
  if (!due && !last) return false;
  if (last_taken_ == environment.step_count()) return false;
  while (!is_each && static_cast<double>(next_sample_) * interval_ - tolerance <= time) ++next_sample_;
  last_taken_ = environment.step_count();
  return true;
}

}  // namespace gravitas
