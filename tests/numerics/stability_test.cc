// The map of stability: method x k h^2 x damping, measured on the engine against the theory. With GRAVITAS_TABLES the
// map is written to stability.csv, which tests/bench/motion_ladders.py draws.
#include "tests/numerics/stability.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>

#include "tests/numerics/reached.h"

namespace gravitas {
namespace {

using harness::MotionMethod;
using harness::SpringCell;

// k h^2 from 1e-2 to 1e6 and zeta from 0 to 100, `finer` cells a decade.
std::vector<SpringCell> cells(int finer) {
  std::vector<SpringCell> all;
  for (int z = -3 * finer; z <= 2 * finer; ++z)
    for (int k = -2 * finer; k <= 6 * finer; ++k)
      all.push_back({std::pow(10.0, static_cast<double>(k) / finer),
                     z == -3 * finer ? 0.0 : std::pow(10.0, static_cast<double>(z) / finer)});
  return all;
}

// Eigenvalues that nearly coincide go by the root of rounding; those of a method with a history are found from states that
// lie nearly in one direction where they grow, so that rounding counts as a share of the map's entries. The stages of
// DormandPrince853 have weights of up to 43: where it grows ten thousand times in a step, they cancel.
void expect_near(double measured, double theory, const MotionMethod& method, const SpringCell& cell, double share) {
  if (!(theory < harness::kOverflows)) {
    EXPECT_EQ(measured, harness::kOverflows) << method.name;
    return;
  }
  const bool has_history = method.name == "BasicVerlet";
  if (method.name == "DormandPrince853" && theory > 1e4) share = std::max(share, 1e-4);
  const double size = has_history ? 10.0 * (1.0 + cell.stiffness * (1.0 + cell.damping())) : 1.0;
  EXPECT_NEAR(measured, theory, share * std::max({1.0, size, theory}))
      << method.name << ", k h^2 " << cell.stiffness << ", zeta " << cell.zeta;
}

TEST(Stability, OneMassGrowsAsTheTheorySays) {
  const std::vector<SpringCell> grid = cells(4);
  for (const MotionMethod& method : harness::mapped_methods()) {
    const std::vector<double> measured = harness::amplifications(method, grid);
    for (std::size_t i = 0; i < grid.size(); ++i)
      expect_near(measured[i], harness::amplification_in_theory(method, grid[i]), method, grid[i], 1e-6);
  }
}

// Limits without damping that are known: an oscillator's h w, squared.
TEST(Stability, LimitsOfTheTheoryAreThoseOfTheBooks) {
  const std::map<std::string, double> known = {{"SemiImplicitEuler", 4.0},
                                               {"Verlet", 4.0},
                                               {"BasicVerlet", 4.0},
                                               {"RK4", 8.0},
                                               {"RKMK4", 8.0},
                                               {"SymplecticSplitting 2", 4.0},
                                               {"ImplicitMidpoint", HUGE_VAL},
                                               {"Rosenbrock", HUGE_VAL},
                                               {"Radau", HUGE_VAL},
                                               {"Euler", 0.0}};
  for (const MotionMethod& method : harness::mapped_methods())
    if (const auto limit = known.find(method.name); limit != known.end()) {
      const double found = harness::stability_limit(method, 0.0);
      EXPECT_TRUE(found == limit->second || std::fabs(found / limit->second - 1.0) < 1e-5) << method.name << found;
    }
}

// Just below the limit it stays for many steps, just above it grows within the steps that the theory says.
TEST(Stability, LimitsAreSharp) {
  for (const MotionMethod& method : harness::mapped_methods())
    for (const double zeta : {0.0, 0.3, 1.0}) {
      const double limit = harness::stability_limit(method, zeta);
      if (limit > 0.0 && std::isfinite(limit)) {
        EXPECT_TRUE(harness::stays_bounded(method, {0.99 * limit, zeta}, 1000)) << method.name << ", zeta " << zeta;
        const SpringCell above{1.01 * limit, zeta};
        const double growth = std::log(harness::amplification_in_theory(method, above));
        const auto steps = static_cast<std::uint32_t>(std::ceil(3.0 * std::log(1e3) / growth)) + 50;
        if (steps > 10000) continue;  // it takes too long to show
        EXPECT_FALSE(harness::stays_bounded(method, above, steps)) << method.name << ", zeta " << zeta << ", " << steps;
      } else {
        EXPECT_EQ(harness::stays_bounded(method, {1.0, zeta}, 1000), limit > 0.0) << method.name << ", zeta " << zeta;
      }
    }
}

// The stiffest mode of the lattice goes as a mass on a spring does.
TEST(Stability, ALatticeGrowsAsItsStiffestMode) {
  for (const MotionMethod& method : harness::mapped_methods())
    for (const double zeta : {0.0, 0.1, 0.5})
      for (const double stiffness : {0.1, 3.9, 4.1, 1e3}) {
        const SpringCell cell{stiffness, zeta};
        if (harness::amplification_in_theory(method, cell) > 1e3) continue;  // it bends the springs
        // springs bend by the square of the displacement
        expect_near(harness::lattice_amplification(method, cell), harness::amplification_in_theory(method, cell),
                    method, cell, 1e-4);
      }
}

TEST(Stability, MapIsWrittenWhereOneIsAskedFor) {
  if (harness::table_folder() == nullptr) GTEST_SKIP() << "GRAVITAS_TABLES is not set";
  std::ofstream out(std::string(harness::table_folder()) + "/stability.csv");
  out << "world,method,stiffness_kh2,zeta,measured,theory\n";
  const auto write = [&](const char* world, const MotionMethod& method, const SpringCell& cell, double measured) {
    char row[160];
    std::snprintf(row, sizeof row, "%s,%s,%.6g,%.6g,%.9g,%.9g\n", world, method.name.c_str(), cell.stiffness, cell.zeta,
                  measured, harness::amplification_in_theory(method, cell));
    out << row;
  };
  const std::vector<SpringCell> grid = cells(8), coarse = cells(2);
  for (const MotionMethod& method : harness::mapped_methods()) {
    const std::vector<double> measured = harness::amplifications(method, grid);
    for (std::size_t i = 0; i < grid.size(); ++i) write("mass", method, grid[i], measured[i]);
    for (const SpringCell& cell : coarse)
      if (harness::amplification_in_theory(method, cell) < 1e3)
        write("lattice", method, cell, harness::lattice_amplification(method, cell));
  }
  EXPECT_TRUE(out.good());
}

}  // namespace
}  // namespace gravitas
