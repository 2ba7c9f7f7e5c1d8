// Stability on the oscillator x'' = -w^2 x - 2 zeta w x', against the limits that the heads of the integrators state, and
// the map method x h w x zeta (`--gtest_filter=Stability.Map`).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/sanitized.h"
#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

struct StabilityMethod {
  const char* library;
  std::vector<double> settings;
  double limit;  // of h w without damping; 0: never stable, infinite: always
  std::string name() const {
    return std::string(library).substr(11) +
           (settings.empty() ? "" : "_" + std::to_string(static_cast<int>(settings[0])));
  }
};

std::vector<StabilityMethod> stability_methods() {
  return {{"integrator_euler", {}, 0.0},
          {"integrator_semi_implicit_euler", {}, 2.0},
          {"integrator_verlet", {}, 2.0},
          {"integrator_basic_verlet", {}, 2.0},
          // 2 sqrt 2
          {"integrator_rk4", {}, 2.8284271247461903},
          {"integrator_rkmk4", {}, 2.8284271247461903},
          // where the trace of the composition's matrix passes 2
          {"integrator_symplectic_splitting", {2}, 2.0},
          {"integrator_symplectic_splitting", {4}, 2.72},
          {"integrator_symplectic_splitting", {6}, 2.532},
          {"integrator_implicit_midpoint", {}, HUGE_VAL},
          {"integrator_rosenbrock", {1e-2}, HUGE_VAL},
          {"integrator_radau", {1e-2}, HUGE_VAL}};
}

// By how much the energy of a 1 kg oscillator grows in some steps of one second; infinite where a step is refused.
double growth(const StabilityMethod& method, double frequency, double ratio, int steps) {
  IntegratorProblem problem(method.library, method.settings);
  problem.wrench_is_constant = false;
  problem.time_step = 1.0;
  problem.bodies = {FreeBody{.mass = 1.0}};
  // as small as leaves error control nothing to do
  const double start = 1e-6 / frequency;
  problem.bodies[0].state.pose.position = Vector3(start, 0, 0);
  const double k = frequency * frequency, c = 2.0 * ratio * frequency;
  problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
    return std::vector<double>{-k * q.position()[0] - c * q.linear_velocity()[0], 0, 0, 0, 0, 0};
  };
  for (int i = 0; i < steps; ++i) {
    const BodyState& s = problem.bodies[0].state;
    const double energy = (s.twist.linear.squaredNorm() + k * s.pose.position.squaredNorm()) / (k * start * start);
    if (!(energy < 1e12)) return HUGE_VAL;
    if (i < 2 && !problem.plugin.refusal(stage::Method::kIntegratorIntegrate, problem.request()).empty())
      return HUGE_VAL;
    problem.step();
  }
  const BodyState& s = problem.bodies[0].state;
  return (s.twist.linear.squaredNorm() + k * s.pose.position.squaredNorm()) / (k * start * start);
}

TEST(Stability, EndsWhereTheHeadsSay) {
  for (const StabilityMethod& method : stability_methods()) {
    if (method.limit == 0.0) {
      EXPECT_GT(growth(method, 0.1, 0.0, 3000), 1e6) << method.name();
    } else if (std::isinf(method.limit)) {
      for (const double frequency : {1.0, 10.0, 1e3, 1e5})
        EXPECT_LT(growth(method, frequency, 0.0, 200), 1.1) << method.name();
    } else {
      // close to the limit the swing of a stable method is large, and bounded
      EXPECT_LT(growth(method, 0.99 * method.limit, 0.0, 2000), 1e4) << method.name();
      EXPECT_GT(growth(method, 1.01 * method.limit, 0.0, 2000), 1e6) << method.name();
    }
  }
}

TEST(Stability, Map) {
  if (harness::kSanitized) GTEST_SKIP() << "figures of what EndsWhereTheHeadsSay runs, too";
  const std::vector<double> frequencies = {0.1, 0.3, 1.0, 1.9, 2.1, 2.6, 2.9, 10.0, 100.0, 1e4};
  for (const double ratio : {0.0, 0.1, 1.0, 10.0}) {
    std::printf("zeta = %-5g h w =        ", ratio);
    for (const double frequency : frequencies) std::printf("%7g", frequency);
    std::printf("\n");
    for (const StabilityMethod& method : stability_methods()) {
      std::printf("%-28s", method.name().c_str());
      for (const double frequency : frequencies) {
        const bool holds = growth(method, frequency, ratio, 400) < 1e3;
        std::printf("%7s", holds ? "." : "x");
        if (std::isinf(method.limit)) {
          EXPECT_TRUE(holds) << method.name() << " " << frequency << " " << ratio;
        }
      }
      std::printf("\n");
    }
  }
}

}  // namespace
}  // namespace gravitas::test
