#include "plugin_sdk/answer_checks.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/solver.h"

namespace gravitas {
namespace {

using Ids = std::vector<std::uint32_t>;
using Numbers = std::vector<double>;

// Two balls, the ground, and a body without a shape.
const Ids kFlags{kMovable | kHasShape, kMovable | kHasShape, kHasShape, kMovable};

void expect_structure(const AnswerProblem& problem, const std::string& text) {
  EXPECT_TRUE(problem.is_structure);
  EXPECT_EQ(problem.text, text);
}

void expect_number(const AnswerProblem& problem, const std::string& text) {
  EXPECT_FALSE(problem.is_structure);
  EXPECT_EQ(problem.text, text);
}

TEST(AnswerChecks, Pairs) {
  EXPECT_EQ(check_pairs(Ids{}, kFlags).text, "");
  EXPECT_EQ(check_pairs(Ids{0, 1, 0, 2, 1, 2}, kFlags).text, "");
  expect_structure(check_pairs(Ids{0, 1, 1, 0}, kFlags), "pair of row 1 is not two bodies in order");
  expect_structure(check_pairs(Ids{0, 0}, kFlags), "pair of row 0 is not two bodies in order");
  expect_structure(check_pairs(Ids{0, 4}, kFlags), "pair of row 0 is not two bodies in order");
  expect_structure(check_pairs(Ids{0, 3}, kFlags), "pair of row 0 is two bodies that cannot touch");
  expect_structure(check_pairs(Ids{0, 1}, Ids{kHasShape, kHasShape}), "pair of row 0 is two bodies that cannot touch");
  const std::string order = " is not in ascending order, or stands twice";
  expect_structure(check_pairs(Ids{0, 2, 0, 1}, kFlags), "pair of row 1" + order);
  expect_structure(check_pairs(Ids{0, 1, 0, 1}, kFlags), "pair of row 1" + order);
}

TEST(AnswerChecks, RememberedContacts) {
  const auto check = [](const Ids& body, const Ids& feature, const Numbers& correction) {
    return check_remembered_contacts(body, feature, correction, kFlags);
  };
  EXPECT_EQ(check({0, 1, 0, 1, 0, 2}, {3, 4, 0}, {0, 0, 1e-3}).text, "");
  const std::string order = "contact_body of row 1 is not in ascending order, or stands twice";
  expect_structure(check({0, 1, 0, 1}, {4, 4}, {0, 0}), order);
  expect_structure(check({0, 1, 0, 1}, {4, 3}, {0, 0}), order);
  expect_structure(check({0, 3}, {0}, {0}), "contact_body of row 0 is not two bodies that can touch");
  expect_number(check({0, 1}, {0}, {-1e-9}), "contact_correction of row 0 is negative");
}

TEST(AnswerChecks, Impacts) {
  const auto check = [](const Ids& pair, const Numbers& fraction, const Numbers& normal) {
    return check_impact_rows(pair, fraction, normal, 3);
  };
  EXPECT_EQ(check({0, 2}, {0, 1}, {1, 0, 0, 0, 0.6, 0.8}).text, "");
  expect_structure(check({3}, {0}, {1, 0, 0}), "impact_pair of row 0 is not one of the pairs asked for");
  expect_structure(check({1, 1}, {0, 0}, {1, 0, 0, 1, 0, 0}),
                   "impact_pair of row 1 is not in ascending order, or stands twice");
  for (const double fraction : {-1e-3, 1.001, std::numeric_limits<double>::quiet_NaN()})
    expect_number(check({0}, {fraction}, {1, 0, 0}), "fraction of row 0 is outside 0 … 1");
  expect_number(check({0, 2}, {0, 0}, {1, 0, 0, 0, 0.6, 0.9}), "normal of row 1 is not of unit length");
}

TEST(AnswerChecks, Contacts) {
  const auto check = [](const Ids& pair, const Ids& feature, const Numbers& normal) {
    return check_contact_rows(pair, feature, normal, 2);
  };
  EXPECT_EQ(check({0, 0, 1}, {5, 7, 1}, {1, 0, 0, 1, 0, 0, 0, 1, 0}).text, "");
  expect_structure(check({2}, {0}, {1, 0, 0}), "contact_pair of row 0 is not one of the pairs asked for");
  expect_structure(check({0, 0}, {7, 7}, {1, 0, 0, 1, 0, 0}),
                   "contact of row 1 is not in ascending order of pair and feature, or stands twice");
  expect_number(check({1}, {0}, {0, 0, 0}), "normal of row 0 is not of unit length");
}

// One row of a joint, all well.
struct Rows {
  Ids constraint{0}, mode{pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kUnilateral)};
  Numbers point1 = Numbers(3), point2 = Numbers(3), velocity = Numbers(3), correction{1}, axes{1, 0, 0, 0};
  Numbers lower = Numbers(3, -kUnlimited), upper = Numbers(3, kUnlimited);
  Numbers compliance = Numbers(3), damping = Numbers(3), maximum_force = Numbers(3, kUnlimited);
  Numbers restitution{0.5};

  AnswerProblem check(const Ids& intact = {1}) const {
    return check_discrepancy_rows(constraint, intact,
                                  {point1, point2, velocity, correction, axes, mode, lower, upper, compliance, damping,
                                   maximum_force, restitution});
  }
};

TEST(AnswerChecks, Discrepancies) {
  EXPECT_EQ(Rows().check().text, "");
  expect_structure(Rows().check({}), "constraint of row 0 is no joint that holds");
  expect_structure(Rows().check({0}), "constraint of row 0 is no joint that holds");
  const auto with = [](auto&& change) {
    Rows rows;
    change(rows);
    return rows.check();
  };
  expect_structure(with([](Rows& rows) { rows.mode[0] = ~0U; }), "mode of row 0 is unknown");
  expect_number(with([](Rows& rows) { rows.correction[0] = 1.1; }), "correction of row 0 is outside 0 … 1");
  for (const double wrong : {-0.1, 1.5, std::nan("")})
    expect_number(with([&](Rows& rows) { rows.restitution[0] = wrong; }), "restitution of row 0 is outside 0 … 1");
  expect_number(with([](Rows& rows) { rows.lower[1] = 1.0, rows.upper[1] = 0.5; }), "lower of row 0 lies above upper");
  for (Numbers Rows::*column : {&Rows::compliance, &Rows::damping, &Rows::maximum_force})
    expect_number(with([&](Rows& rows) { (rows.*column)[2] = -1e-12; }),
                  "compliance, damping or maximum_force of row 0 is negative");
  expect_number(with([](Rows& rows) { rows.axes = {1, 0, 0, 0.1}; }), "axes of row 0 is not of unit length");

  Rows two;
  two.constraint = {1, 0};
  for (Numbers Rows::*column :
       {&Rows::point1, &Rows::point2, &Rows::velocity, &Rows::correction, &Rows::axes, &Rows::lower, &Rows::upper,
        &Rows::compliance, &Rows::damping, &Rows::maximum_force, &Rows::restitution}) {
    const Numbers once = two.*column;
    (two.*column).insert((two.*column).end(), once.begin(), once.end());
  }
  two.mode.push_back(two.mode[0]);
  expect_structure(two.check({1, 1}), "constraint of row 1 is out of order");
}

TEST(AnswerChecks, Multipliers) {
  const Numbers still(3);
  const Ids mode{pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kUnilateral)};
  Numbers material(kMaterialColumns);
  material[kStaticFriction] = 0.5;
  material[kDynamicFriction] = 0.4;
  const auto check = [&](const Numbers& impulse, double correction, const Numbers& axis_impulse) {
    const Numbers direction{0, 1, 0}, contact_correction{correction}, axis_correction(3);
    SolutionColumns answer;
    answer.contact_impulse = impulse;
    answer.contact_correction = contact_correction;
    answer.contact_direction = direction;
    answer.contact_turning = still;
    answer.discrepancy_impulse = axis_impulse;
    answer.discrepancy_correction = axis_correction;
    return check_multipliers(answer, material, mode);
  };
  EXPECT_EQ(check({0, 0, 0}, 0, {0, 0, 0}).text, "");
  EXPECT_EQ(check({0.3, 1, 0.4}, 1e-3, {-1, -1, 1}).text, "");  // on the cone
  expect_number(check({0, -1, 0}, 0, {0, 0, 0}), "contact_impulse of row 0 pulls the bodies together");
  expect_number(check({0.3, 1, 0.401}, 0, {0, 0, 0}), "contact_impulse of row 0 leaves the friction cone");
  expect_number(check({0, 1, 0}, -1e-9, {0, 0, 0}), "contact_correction of row 0 is negative");
  expect_number(check({0, 1, 0}, 0, {0, 0, -1e-9}), "discrepancy_impulse of row 0 pulls along a one-sided axis");
}

// Of a contact that is pressed by 2 N s, and slides.
TEST(AnswerChecks, FrictionOfTurning) {
  const auto check = [](double rolling, double spinning, const Numbers& turning) {
    Numbers material(kMaterialColumns);
    material[kStaticFriction] = material[kDynamicFriction] = 0.5;
    material[kRollingFriction] = rolling, material[kSpinningFriction] = spinning;
    const Numbers impulse{0, 2, 1}, correction{0}, direction{0, 1, 0};
    SolutionColumns answer;
    answer.contact_impulse = impulse;
    answer.contact_correction = correction;
    answer.contact_direction = direction;
    answer.contact_turning = turning;
    return check_multipliers(answer, material, {});
  };
  EXPECT_EQ(check(0, 0, {0, 0, 0}).text, "");
  EXPECT_EQ(check(0.05, 0.03, {0.06, -0.06, -0.08}).text, "");  // both at their bounds
  EXPECT_EQ(check(0.05, 0, {0.06, 1e-17, 0.08}).text, "");
  EXPECT_EQ(check(0.05, 0, {6e-202, 1e-217, 8e-202}).text, "");  // its square is no number
  const char* const spins = "contact_turning of row 0 spins by more than spinning friction can";
  const char* const rolls = "contact_turning of row 0 rolls by more than rolling friction can";
  expect_number(check(0.05, 0.03, {0, 0.0601, 0}), spins);
  expect_number(check(0.05, 0, {0, -1e-6, 0}), spins);
  expect_number(check(0.05, 0.03, {0.0601, 0, 0.08}), rolls);
  expect_number(check(0, 0.03, {0, 0, 1e-6}), rolls);
}

}  // namespace
}  // namespace gravitas
