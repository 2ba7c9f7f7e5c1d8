#include "services/study/measure.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::study {
namespace {

constexpr double kUnseen = std::numeric_limits<double>::quiet_NaN();

double angle_apart(const Quaternion& a, const Quaternion& b) {
  return log_rotation(shorter_arc(a * b.conjugate())).norm();
}

// As max does, but keeps what is no number.
void take_worst(double error, double* worst) {
  if (!(error <= *worst)) *worst = error;
}

Pose pose_in(const kernel::StateView& state, std::size_t body) {
  return {vector_at(state.position, body), quaternion_at(state.orientation, body)};
}

std::vector<Pose> movable_poses(const kernel::Environment& environment) {
  std::vector<Pose> poses;
  const kernel::Model& model = environment.model();
  const kernel::StateView state = environment.state();
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    if ((model.flags[i] & kMovable) != 0) poses.push_back(pose_in(state, i));
  return poses;
}

}  // namespace

KnownMeasure::KnownMeasure(const std::vector<Known>& known, const kernel::EnvironmentDescription& description) {
  for (const Known& one : known) {
    const auto found = std::ranges::find(description.bodies, one.body, &kernel::BodyDescription::id);
    rows_.push_back({one, static_cast<std::uint32_t>(found - description.bodies.begin())});
  }
}

void KnownMeasure::look(const kernel::Environment& environment) {
  for (const Row& row : rows_) {
    const Known& known = row.known;
    if (std::fabs(environment.time() - known.time) > 1e-3 * environment.time_step()) continue;
    ++seen_;
    const Pose pose = pose_in(environment.state(), row.body);
    const std::vector<double>& v = known.value;
    if (known.what == Known::What::kPosition) {
      take_worst((pose.position - Vector3(v[0], v[1], v[2])).norm() / known.size, &worst_);
    } else {
      take_worst(angle_apart(pose.orientation, Quaternion(v[0], v[1], v[2], v[3])), &worst_);
    }
  }
}

double KnownMeasure::error() const { return seen_ == rows_.size() ? worst_ : kUnseen; }

void Samples::look(const kernel::Environment& environment) { poses_.push_back(movable_poses(environment)); }

double Samples::size() const {
  double longest = 0.0;
  for (const std::vector<Pose>& poses : poses_)
    for (std::size_t i = 0; i < poses.size(); ++i)
      longest = std::max(longest, (poses[i].position - poses_[0][i].position).norm());
  return longest > 0.0 ? longest : 1.0;
}

void DistanceTo::look(const kernel::Environment& environment) {
  const std::vector<Pose> poses = movable_poses(environment);
  const std::size_t at = looks_++;
  if (at >= reference_.poses().size()) return;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Pose& known = reference_.poses()[at][i];
    take_worst((poses[i].position - known.position).norm() / size_, &worst_);
    take_worst(angle_apart(poses[i].orientation, known.orientation), &worst_);
  }
}

double DistanceTo::error() const { return looks_ == reference_.poses().size() ? worst_ : kUnseen; }

}  // namespace gravitas::study
