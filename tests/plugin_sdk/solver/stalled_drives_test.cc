// Drives that have run against a stop, at any size.
#include "plugin_sdk/solver/stalled_drives.h"

#include <gtest/gtest.h>

#include <vector>

namespace gravitas {
namespace {

struct TestedRow {
  ConstraintDirection direction;
  JointLaw law;
};

JointLaw held() {
  JointLaw law;
  law.has_lower = law.has_upper = true;
  return law;
}

// A hinge at the origin, about z, of a body whose centre is at (1, 2, 3): closed at its upper limit, against which points on the
// body drive, `lever` from the axis. All of it times `size`.
std::vector<TestedRow> hinge(double size, double lever) {
  SolverBody world, body;
  body.inverse_mass = 1.0, body.inverse_inertia = Matrix3::Identity();
  body.trial.position = size * Vector3(1, 2, 3);
  std::vector<TestedRow> rows;
  for (int k = 0; k < 3; ++k)
    rows.push_back({ConstraintDirection::through(Vector3(0, 0, 0), Vector3::Unit(k), world, body), held()});
  for (int k = 0; k < 2; ++k) rows.push_back({ConstraintDirection::about(Vector3::Unit(k), world, body), held()});
  JointLaw limit;
  limit.has_upper = true;
  rows.push_back({ConstraintDirection::about(Vector3::UnitZ(), world, body), limit});
  JointLaw drive = held();
  drive.is_velocity_only = true;
  drive.lower_target = drive.upper_target = 0.5 * size * lever;
  rows.push_back({ConstraintDirection::through(Vector3(size * lever, 0, 0), Vector3::UnitY(), world, body), drive});
  return rows;
}

TEST(StalledDrives, AreToldAtAnySize) {
  for (const double size : {1e-6, 1e-3, 1.0, 1e3, 1e6})
    for (const double lever : {0.1, 1.0, 10.0}) {
      std::vector<TestedRow> rows = hinge(size, lever);
      StalledDrives().stall([&](auto&& visit) {
        for (TestedRow& row : rows) visit(0U, 1U, row.direction, &row.law);
      });
      const JointLaw& drive = rows.back().law;
      // keeps the body from going back, and no more
      EXPECT_TRUE(drive.has_lower) << size << ' ' << lever;
      EXPECT_FALSE(drive.has_upper) << size << ' ' << lever;
      EXPECT_EQ(drive.lower_target, 0.0) << size << ' ' << lever;
    }
}

// Along the axis, where nothing stops it, though the pivot holds it: no motion of the hinge is its.
TEST(StalledDrives, AreNoneThatTheStopIsNot) {
  for (const double size : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    std::vector<TestedRow> rows = hinge(size, 1.0);
    SolverBody world, body;
    body.inverse_mass = 1.0, body.inverse_inertia = Matrix3::Identity();
    body.trial.position = size * Vector3(1, 2, 3);
    rows.back().direction = ConstraintDirection::through(Vector3(size, 0, 0), Vector3::UnitZ(), world, body);
    StalledDrives().stall([&](auto&& visit) {
      for (TestedRow& row : rows) visit(0U, 1U, row.direction, &row.law);
    });
    EXPECT_TRUE(rows.back().law.is_equality()) << size;
  }
}

}  // namespace
}  // namespace gravitas
