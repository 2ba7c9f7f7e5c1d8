// Observed orders of all integrators, free and jointed (simulator Smooth), against their theory.
//
// The table in tests/numerics/ORDERS.md is written by
//   GRAVITAS_TABLES=tests/numerics build/release/bin/test_numerics --gtest_filter='Orders.*'
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "tests/numerics/motion_problem.h"

namespace gravitas {
namespace {

using harness::MotionMethod;
using harness::MotionProblem;

// A method on a problem: the coarsest of four steps that halve, small enough for the leading term, large enough for
// errors above rounding.
struct Case {
  const char* method;
  std::uint32_t steps;
};

struct Row {
  std::string problem, method;
  double theory = 0.0;
  std::vector<double> errors;
  double order() const { return std::log2(errors[errors.size() - 2] / errors.back()); }
};

MotionMethod method_named(const std::string& name) {
  for (const MotionMethod& method : harness::fixed_step_methods())
    if (method.name == name) return method;
  // at this accuracy they take whole steps
  for (const MotionMethod& method : harness::adaptive_methods(1.0))
    if (method.name == name) return method;
  throw std::out_of_range(name);
}

std::vector<Row>& all_rows() {
  static std::vector<Row> rows;
  return rows;
}

void expect_orders(const MotionProblem& problem, const std::vector<Case>& cases) {
  for (const Case& one : cases) {
    const MotionMethod method = method_named(one.method);
    Row row{problem.name, method.name, method.order, {}};
    for (std::uint32_t steps = one.steps; steps <= 8 * one.steps; steps *= 2)
      row.errors.push_back(harness::run_motion(problem, method, steps).error);
    EXPECT_NEAR(row.order(), row.theory, 0.1) << problem.name << ", " << method.name;
    all_rows().push_back(row);
  }
}

TEST(Orders, OfFreeMotionAreThoseOfTheTheory) {
  expect_orders(harness::spring_and_spin(), {{"Euler", 20000},
                                             {"SemiImplicitEuler", 2000},
                                             {"Verlet", 200},
                                             {"BasicVerlet", 200},
                                             {"ImplicitMidpoint", 200},
                                             {"RK4", 100},
                                             {"RKMK4", 100},
                                             {"SymplecticSplitting 2", 200},
                                             {"SymplecticSplitting 4", 50},
                                             {"SymplecticSplitting 6", 20},
                                             {"DormandPrince54", 40},
                                             {"DormandPrince853", 5},
                                             {"Rosenbrock", 100},
                                             {"Radau", 40}});
}

TEST(Orders, OfJointedMotionAreThoseOfTheTheory) {
  expect_orders(harness::double_pendulum(), {{"SemiImplicitEuler", 2000},
                                             {"Verlet", 500},
                                             {"BasicVerlet", 500},
                                             {"ImplicitMidpoint", 500},
                                             {"RK4", 200},
                                             {"RKMK4", 200},
                                             {"SymplecticSplitting 2", 500},
                                             {"SymplecticSplitting 4", 200},
                                             {"SymplecticSplitting 6", 100},
                                             {"Radau", 50}});
}

// DormandPrince853, and Rosenbrock where joints turn far, come to rounding before their leading term stands alone; on the
// double pendulum, where the leading terms of both pairs cancel, they are of order 5.9 and 10.
TEST(Orders, OfARodInSpaceAreThoseOfTheTheory) {
  expect_orders(harness::spherical_pendulum(), {{"ImplicitMidpoint", 1000},
                                                {"RK4", 800},
                                                {"RKMK4", 800},
                                                {"SymplecticSplitting 4", 800},
                                                {"SymplecticSplitting 6", 250},
                                                {"DormandPrince54", 200},
                                                {"Radau", 100}});
}

// A fast top turns far in a step; RKMK4 comes to rounding first.
TEST(Orders, OfAHeavyTopAreThoseOfTheTheory) {
  expect_orders(harness::heavy_top(), {{"RK4", 2000},
                                       {"SymplecticSplitting 2", 1000},
                                       {"SymplecticSplitting 4", 500},
                                       {"SymplecticSplitting 6", 400},
                                       {"DormandPrince54", 1000},
                                       {"Radau", 400}});
}

// A joint's spring and damper are forces among the others, along an axis that turns.
TEST(Orders, OfASprungJointAreThoseOfTheTheory) {
  expect_orders(harness::sprung_wheel(), {{"SemiImplicitEuler", 4000},
                                          {"Verlet", 200},
                                          {"BasicVerlet", 200},
                                          {"ImplicitMidpoint", 200},
                                          {"RK4", 80},
                                          {"RKMK4", 80},
                                          {"SymplecticSplitting 2", 200},
                                          {"SymplecticSplitting 4", 80},
                                          {"SymplecticSplitting 6", 20},
                                          {"DormandPrince54", 40},
                                          {"Rosenbrock", 80},
                                          {"Radau", 40}});
}

// The axis of an Axle's camber turns with both bodies.
TEST(Orders, OfAWheelThatSteersAreThoseOfTheTheory) {
  expect_orders(harness::steered_wheel(), {{"ImplicitMidpoint", 800},
                                           {"RK4", 100},
                                           {"RKMK4", 100},
                                           {"SymplecticSplitting 2", 400},
                                           {"SymplecticSplitting 4", 100},
                                           {"SymplecticSplitting 6", 40}});
}

// The error of a method of order five per step falls like the accuracy asked for.
TEST(Orders, AdaptiveMethodsKeepWhatIsAskedOfThem) {
  for (const MotionProblem& problem : {harness::double_pendulum(), harness::spherical_pendulum(),
                                       harness::point_pendulum(), harness::sprung_wheel()}) {
    for (const double accuracy : {1e-6, 1e-8, 1e-10}) {
      for (const MotionMethod& method : harness::adaptive_methods(accuracy)) {
        const double error = harness::run_motion(problem, method, 100).error;
        // errors of a hundred steps add up, and grow along the motion
        EXPECT_LT(error, 100.0 * accuracy) << problem.name << ", " << method.name << ", " << accuracy;
        all_rows().push_back({problem.name, method.name + " " + std::to_string(accuracy), 0.0, {error}});
      }
    }
  }
}

// With the simulator Basic the same integrator is of first order: what Smooth is for.
TEST(Orders, WithoutReactionsInTheDerivativeAreOne) {
  const MotionProblem problem = harness::double_pendulum();
  const MotionMethod method = method_named("RK4");
  const double basic = harness::run_motion(problem, method, 1000, kernel::Simulator::kBasic).error;
  EXPECT_GT(basic, 1e-3);
  EXPECT_LT(harness::run_motion(problem, method, 1000).error, 1e-5 * basic);
}

// Last, since it writes what the others found.
TEST(Orders, TableIsWrittenWhereOneIsAskedFor) {
  const char* folder = std::getenv("GRAVITAS_TABLES");
  if (folder == nullptr) GTEST_SKIP() << "GRAVITAS_TABLES is not set";
  std::ofstream out(std::string(folder) + "/ORDERS.md");
  out << "# Observed orders\n\nWritten by `GRAVITAS_TABLES=tests/numerics build/release/bin/test_numerics "
         "--gtest_filter='Orders.*'`.\nErrors at the end, relative to the problem's size (m or rad), for a step and "
         "its "
         "half, quarter and eighth; the order is\nthat between the last two. Jointed problems: simulator Smooth, "
         "solver "
         "Direct.\n\n"
         "| problem | integrator | theory | observed | errors |\n| --- | --- | --- | --- | --- |\n";
  for (const Row& row : all_rows()) {
    if (row.errors.size() < 2) continue;
    std::string errors;
    for (const double error : row.errors) {
      char text[32];
      std::snprintf(text, sizeof text, "%s%.1e", errors.empty() ? "" : ", ", error);
      errors += text;
    }
    char order[32];
    std::snprintf(order, sizeof order, "%.0f | %.2f", row.theory, row.order());
    out << "| " << row.problem << " | " << row.method << " | " << order << " | " << errors << " |\n";
  }
  EXPECT_TRUE(out.good());
}

}  // namespace
}  // namespace gravitas
