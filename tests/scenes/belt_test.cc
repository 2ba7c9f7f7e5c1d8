// A belt of hinged links over a hinged pulley: a long chain of light bodies between heavy ones, with friction at half of them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

constexpr double kPulleyRadius = 0.5, kHalfOfBelt = 0.02, kBeltPitch = 0.1;
constexpr int kOnPulley = 17, kHanging = 10, kBeltLinks = kOnPulley + 2 * kHanging;

// Where the belt is after `s` of it from the middle of its left hanging end's lowest link, and how it lies there.
Pose on_belt(double s) {
  const double path = kPulleyRadius + kHalfOfBelt + 0.01, straight = kHanging * kBeltPitch;
  const double along = s - straight + 0.5 * kBeltPitch, arc = std::numbers::pi * path;
  if (along < 0.0) return {{-path, along, 0}, exp_rotation({0, 0, 0.5 * std::numbers::pi})};
  if (along > arc) return {{path, arc - along, 0}, exp_rotation({0, 0, -0.5 * std::numbers::pi})};
  const double angle = along / path;
  return {path * Vector3(-std::cos(angle), std::sin(angle), 0), exp_rotation({0, 0, 0.5 * std::numbers::pi - angle})};
}

std::string belt_scene() {
  const double pitch =
      (2.0 * kHanging * kBeltPitch + std::numbers::pi * (kPulleyRadius + kHalfOfBelt + 0.01)) / kBeltLinks;
  std::string bodies, joints;
  const auto add = [&](const std::string& id, const std::string& what, const Pose& pose) {
    bodies += "Body { Id = \"" + id + "\" " + what +
              " Material = \"Rubber\" KineticProperties { Position = " + literal(pose.position) +
              " Orientation = " + literal(pose.orientation) + " } }\n";
  };
  const auto hinge = [&](const std::string& one, const std::string& two, const Vector3& at) {
    joints += "Constraint { Type = \"Revolute\" Id = \"" + one + two + "\" Body1 = \"" + one + "\" Body2 = \"" + two +
              "\" CustomProperties { BindAxisPoint1 = " + literal(at) +
              " BindAxisPoint2 = " + literal(Vector3(at + Vector3::UnitZ())) + " } }\n";
  };
  add("Pulley", "GeometryId = \"Pulley\" Mass = 4", {Vector3::Zero(), exp_rotation({0.5 * std::numbers::pi, 0, 0})});
  hinge("", "Pulley", Vector3::Zero());
  const std::string link = "GeometryId = \"Link\" Mass = 0.05 CollisionGroups = { \"Links\" } Forces = { \"Down\" }";
  for (int i = 0; i < kBeltLinks; ++i) {
    add("L" + std::to_string(i), link, on_belt(pitch * i));
    if (i > 0) hinge("L" + std::to_string(i - 1), "L" + std::to_string(i), on_belt(pitch * (i - 0.5)).position);
  }
  const auto load = [&](const std::string& id, double mass, int end, double s) {
    const Vector3 at = on_belt(s).position;
    add(id, "GeometryId = \"Load\" Forces = { \"Down\" } Mass = " + literal(mass),
        {at - 0.15 * Vector3::UnitY(), Quaternion::Identity()});
    hinge("L" + std::to_string(end), id, at);
  };
  load("Light", 3.0, 0, -0.5 * pitch);
  load("Heavy", 5.0, kBeltLinks - 1, (kBeltLinks - 0.5) * pitch);
  return R"(
Geometries {
  Geometry { Type = "Cylinder" Id = "Pulley" CustomProperties { Radius = 0.5 Height = 0.2 } }
  Geometry { Type = "Box" Id = "Link" CustomProperties { HalfExtents = {0.04, 0.02, 0.04} } }
  Geometry { Type = "Box" Id = "Load" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} } }
}
Materials { Material { Id = "Rubber" RestitutionCoefficient = 0 StaticFrictionCoefficient = 0.8 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.004166666666666667 Duration = 0.6 } }
Environment { Space { Bodies {
)" + bodies +
         R"(} }
CollisionFilter { Rules { Rule { Allow = false Groups = {"Links", "Links"} } } }
Constraints {
)" + joints +
         "} }\n";
}

// Sweeps take more than there are at this ratio of masses: joints come open, but by no more than the links measure in a row,
// and nothing flies off.
TEST(Belt, ComesOpenWithinBoundsBySweeps) {
  for (const double step : {1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0}) {
    SceneRun run(belt_scene(), {set("Simulator.TimeStep", step)});
    const double energy = run.energy();
    run.to_end();
    EXPECT_LT(run.report().max_joint_error(), 2.0) << step;
    EXPECT_LT(run.energy(), energy) << step;
  }
}

}  // namespace
}  // namespace gravitas
