#include "plugin_sdk/joint_load.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>
#include <vector>

#include "plugin_sdk/constraint.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

TEST(JointLoad, HeldBackIsTheWayThatTheImpulseKeptFrom) {
  Discrepancy d;
  const JointBody world;
  JointBody point, rod;
  point.inverse_mass = rod.inverse_mass = 0.5;
  // a point of 2 kg from the world: g h^2
  const double h = 0.01, g = 9.81;
  EXPECT_DOUBLE_EQ(held_back(d, Vector3(0, 2.0 * g * h, 0), world, point, h), g * h * h);
  // across the end of a rod of length 1 a quarter of the mass is felt, along it all
  rod.trial.position = Vector3(0.5, 0, 0);
  rod.inverse_moments = Vector3(0, 6, 6);
  EXPECT_NEAR(held_back(d, Vector3::UnitY(), world, rod, h), h * 4 * 0.5, 1e-16);
  EXPECT_NEAR(held_back(d, Vector3::UnitX(), world, rod, h), h * 0.5, 1e-16);
  // either end of a pair
  EXPECT_NEAR(held_back(d, -Vector3::UnitY(), rod, rod, h), h * 8 * 0.5, 1e-16);
  d.modes = pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked, true);
  // about an axis it is an angle
  EXPECT_NEAR(held_back(d, Vector3::UnitY(), world, rod, h), h * 6, 1e-16);
  EXPECT_EQ(held_back(d, Vector3::UnitX(), world, rod, h), 0.0);
}

// The principal axes turn with the body: the same rod along y.
TEST(JointLoad, HeldBackKnowsHowTheBodyLies) {
  JointBody rod;
  rod.inverse_mass = 0.5;
  rod.inverse_moments = Vector3(0, 6, 6);
  rod.trial = {Vector3(0, 0.5, 0), exp_rotation(Vector3(0, 0, std::numbers::pi / 2))};
  EXPECT_NEAR(held_back(Discrepancy{}, Vector3::UnitX(), JointBody{}, rod, 0.01), 0.01 * 4 * 0.5, 1e-16);
  EXPECT_NEAR(held_back(Discrepancy{}, Vector3::UnitY(), JointBody{}, rod, 0.01), 0.01 * 0.5, 1e-16);
}

// A pair of rods end to end, held by two rows at one point that share the load; the second row is off by 1 mm.
TEST(JointLoad, OfAJointIsItsWorstRowAndTheSumOfItsForces) {
  const std::vector<double> point(6, 0.0), moved{0, 0, 0, 0, 1e-3, 0}, zero(6, 0.0), correction(2, 1.0);
  const std::vector<double> axes{1, 0, 0, 0, 1, 0, 0, 0}, impulses{3, 0, 0, 0, 4, 0};
  const std::vector<double> unlimited(6, kUnlimited);
  const std::uint32_t locked = pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked);
  const std::vector<std::uint32_t> modes{locked, locked};
  const DiscrepancyColumns columns{point, moved, zero, correction, axes, modes, zero, zero, zero, zero, unlimited};
  JointBody one, two;
  one.inverse_mass = two.inverse_mass = 0.5;
  const JointRows rows{columns, impulses, 0, 2};
  const JointLoad load = joint_load(rows, one, 0.01);
  EXPECT_DOUBLE_EQ(joint_error(rows, one, two), 1e-3);
  EXPECT_DOUBLE_EQ(load.force, 500.0);
  EXPECT_EQ(load.torque, 0.0);
  EXPECT_DOUBLE_EQ(opening(rows, one, two, 0.01), 4.0 * 0.01);
}

// Rows at (1, 0, 0) and (3, 0, 0), and one that turns, before them: about the first point, wherever body 1 takes it.
TEST(JointLoad, TorqueIsAboutTheFirstPoint) {
  const std::vector<double> point{0, 0, 0, 1, 0, 0, 3, 0, 0}, zero(9, 0.0), correction(3, 1.0);
  const std::vector<double> axes{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, impulses{0, 0, 0.07, 0, 0.01, 0, 0, 0.02, 0};
  const std::vector<double> unlimited(9, kUnlimited);
  const std::uint32_t locked = pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked);
  const std::vector<std::uint32_t> modes{locked | kAngularDiscrepancy, locked, locked};
  const DiscrepancyColumns columns{point, point, zero, correction, axes, modes, zero, zero, zero, zero, unlimited};
  JointBody one;
  one.next.position = Vector3(5, 0, 0);
  EXPECT_DOUBLE_EQ(joint_load({columns, impulses, 0, 3}, one, 0.01).torque, (0.07 + 2 * 0.02) / 0.01);
}

// Of two bodies with radii of gyration of 0.02 m and 0.05 m: a turn by 0.1 rad is open by 5 mm, however it is held.
TEST(JointLoad, OpeningOfATurnIsAWay) {
  const std::vector<double> point(3, 0.0), moved{0.1, 0, 0}, zero(3, 0.0), correction(1, 1.0), axes{1, 0, 0, 0};
  const std::vector<double> unlimited(3, kUnlimited);
  const std::vector<std::uint32_t> modes{pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked, true)};
  const DiscrepancyColumns columns{point, moved, zero, correction, axes, modes, zero, zero, zero, zero, unlimited};
  JointBody one, two;
  one.inverse_mass = two.inverse_mass = 0.5;
  one.inverse_moments = Vector3::Constant(0.5 / (0.02 * 0.02));
  two.inverse_moments = Vector3::Constant(0.5 / (0.05 * 0.05));
  EXPECT_NEAR(opening({columns, zero, 0, 1}, one, two, 0.01), 0.05 * 0.1, 1e-12);
  // 0.02 N m s on 0.8e-3 kg m^2 and 5e-3 kg m^2 for 0.01 s
  const std::vector<double> impulse{2e-2, 0, 0};
  EXPECT_NEAR(opening({columns, impulse, 0, 1}, one, two, 0.01), 0.05 * 2e-2 * 0.01 * (1 / 0.8e-3 + 1 / 5e-3), 1e-12);
  EXPECT_EQ(opening({columns, impulse, 0, 1}, {}, {}, 0.01), 0.0) << "nothing that turns";
}

// A body that goes 1 mm along x while its joint to the world opens by all of that, or closes by it.
TEST(JointLoad, IsPulledApartByAShareOfTheBodiesWays) {
  const std::vector<double> point(3, 0.0), zero(3, 0.0), correction(1, 1.0), axes{1, 0, 0, 0};
  const std::vector<double> unlimited(3, kUnlimited);
  const auto is_apart = [&](AxisMode along, double moved, double started) {
    const std::vector<std::uint32_t> modes{pack_modes(along, AxisMode::kLocked, AxisMode::kLocked)};
    const DiscrepancyColumns columns{point, point, zero, correction, axes, modes, zero, zero, zero, zero, unlimited};
    JointBody body;
    body.inverse_mass = 0.5;
    body.inverse_moments = Vector3::Constant(0.5);
    body.start.position.x() = started;
    body.next.position.x() = moved;
    return is_pulled_apart({columns, zero, 0, 1}, {}, body);
  };
  EXPECT_TRUE(is_apart(AxisMode::kLocked, 1e-3, 0.0));
  EXPECT_FALSE(is_apart(AxisMode::kFree, 1e-3, 0.0));
  EXPECT_FALSE(is_apart(AxisMode::kLocked, 1e-3, 2e-3)) << "it closes";
  EXPECT_FALSE(is_apart(AxisMode::kLocked, 1e-16, 0.0)) << "rounding";
}

}  // namespace
}  // namespace gravitas
