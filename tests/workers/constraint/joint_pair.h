// A joint between two bodies anywhere, about a point and axes of the world of the start, for the tests of joints.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {

// Rounding of transforms of points within ten metres, some of them in a row.
inline constexpr double kFreedomRounding = 2e-14;
inline const double kNoValue = std::nan("");
inline const Vector3 kPoint(0.3, -0.2, 0.5);
inline const Vector3 kAxis = Vector3(1.0, 2.0, -0.5).normalized();
inline const Vector3 kAcross = kAxis.cross(Vector3::UnitZ()).normalized();
inline const Vector3 kBent = (kAxis + 0.8 * kAcross).normalized();

inline std::vector<double> numbers(const std::vector<Vector3>& vectors, const std::vector<double>& rest = {}) {
  std::vector<double> all;
  for (const Vector3& v : vectors) all.insert(all.end(), {v.x(), v.y(), v.z()});
  all.insert(all.end(), rest.begin(), rest.end());
  return all;
}

class JointPair : public testing::Test {
 protected:
  JointPair() {
    for (JointedBody& body : bodies_) body.pose = random_.pose(3.0);
  }
  JointProblem joint(PluginUnderTest* plugin, const char* type, const std::vector<double>& properties) {
    JointProblem made(plugin, type);
    made.bodies = bodies_;
    made.bind(properties);
    return made;
  }
  std::string refused(PluginUnderTest* plugin, const char* type, const std::vector<double>& properties) {
    JointProblem made(plugin, type);
    made.bodies = bodies_;
    return plugin->refusal(stage::Method::kConstraintBind, made.bind_request(properties));
  }
  // Turns body 2 of a joint about its point.
  static void turn(JointProblem* joint, const Vector3& rotation) {
    const Quaternion q = exp_rotation(rotation);
    Pose& pose = joint->bodies[1].pose;
    pose = {kPoint + q * (pose.position - kPoint), normalized(q * pose.orientation)};
  }

  conformance::Draw random_{11};
  std::vector<JointedBody> bodies_ = std::vector<JointedBody>(2);
};

}  // namespace gravitas::test
