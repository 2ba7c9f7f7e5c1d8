#include "services/edit/turned_joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "services/survey/surveyor.h"

namespace gravitas {
namespace {

constexpr double kFullTurn = 6.283185307179586, kSameAngle = 1e-6;  // rad

// "Constraint.Hinge.LowerLimit=-1"; by name, since only a plugin knows which of its properties are limits.
bool sets_limit(const std::string& set, const std::string& joint) {
  const std::string path = set.substr(0, set.find('=')), begin = "Constraint." + joint + ".";
  if (!path.starts_with(begin)) return false;
  return path.find("Lower", begin.size()) != std::string::npos || path.find("Upper", begin.size()) != std::string::npos;
}

std::vector<survey::JointCoordinate> coordinates_of(const EditedSide& side) {
  std::vector<std::string> missing;
  return survey::Surveyor(side.description).coordinates(side.environment, &missing);
}

bool is_turned(double before, double after) {
  const double turns = std::round((after - before) / kFullTurn);
  return turns != 0.0 && std::fabs(after - before - turns * kFullTurn) < kSameAngle;
}

}  // namespace

std::vector<std::string> warnings_of_turned_joints(const edit::v1::Edit& edit, const EditedSide& before,
                                                   const EditedSide& after) {
  std::vector<std::string> warnings;
  const auto& joints = after.description.constraints;
  const auto limiting = [&](const std::string& joint) {
    return std::ranges::find_if(edit.changes(), [&](const auto& change) { return sets_limit(change.set(), joint); });
  };
  if (std::ranges::none_of(joints, [&](const auto& one) { return limiting(one.id) != edit.changes().end(); }))
    return {};
  const std::vector<survey::JointCoordinate> stood = coordinates_of(before);
  for (const survey::JointCoordinate& now : coordinates_of(after)) {
    const std::string& joint = joints[now.joint].id;
    const auto change = limiting(joint);
    if (change == edit.changes().end()) continue;
    const auto was = std::ranges::find_if(stood, [&](const survey::JointCoordinate& one) {
      return one.name == now.name && before.description.constraints[one.joint].id == joint;
    });
    if (was == stood.end() || !is_turned(was->value, now.value)) continue;
    warnings.push_back(fmt::format(
        "edit before step {}: set {}: the joint '{}' stands at {} = {:.6g} rad, which counts as {:.6g} rad with its "
        "limits",
        edit.step(), change->set(), joint, now.name, was->value, now.value));
  }
  return warnings;
}

}  // namespace gravitas
