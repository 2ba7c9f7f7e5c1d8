// What the solver is known to do: the sweeps by themselves, and the motions that my_name.gravitas comes to.
#include "my_name.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "known_result.h"

using namespace known_result;

namespace {

// A row along an axis between the world, body 1, and a load, body 0.
plain::Row row_along(const Vector3& axis) {
  plain::Row row;
  row.body1 = 1, row.body2 = 0;
  row.direction.linear = axis;
  return row;
}

// What becomes of 2 kg that meet a wall, y >= 0, with a coefficient of friction.
Vector3 met(const Vector3& velocity, double friction) {
  std::vector<gravitas::SolverBody> bodies(2);
  bodies[0].inverse_mass = 0.5;
  plain::Problem problem;
  plain::Row normal = row_along(Vector3::UnitY());
  normal.law.has_lower = true;
  expect(problem.add(normal, bodies), "the row pushes a body");
  problem.add(row_along(Vector3::UnitX()), bodies);
  problem.add(row_along(Vector3::UnitZ()), bodies);
  problem.frictions = {{0, 1, 2, friction, 1.0}};
  gravitas::BodyMotion x(2);
  x[0].linear = velocity;
  expect(plain::solve(bodies, 100, &problem, &x, [] {}).converged, "it converges");
  return x[0].linear;
}

// Two loads, one on the other, whose weight has just gone: sweeps halve what the warm start gives, until only rounding is left.
void take_weight_away() {
  std::vector<gravitas::SolverBody> bodies(3);
  bodies[0].inverse_mass = bodies[2].inverse_mass = 1.0;
  plain::Problem problem;
  for (const std::uint32_t lower : {1U, 0U}) {
    plain::Row row = row_along(Vector3::UnitY());
    row.body1 = lower, row.body2 = lower == 1 ? 0 : 2;
    row.law.has_lower = true;
    row.multiplier = 1.0;
    expect(problem.add(row, bodies), "the row pushes a body");
  }
  gravitas::BodyMotion x(3);
  expect(plain::solve(bodies, 60, &problem, &x, [] {}).converged, "it converges where nothing moved before");
  expect_near("the lower load", x[0].linear, Vector3::Zero(), 1e-13);
  expect_near("the upper load", x[2].linear, Vector3::Zero(), 1e-13);
}

}  // namespace

int main(int, char** arguments) {
  expect_near("what leaves the wall", met({1, 3, 2}, 0.5), Vector3(1, 3, 2), 0.0);
  expect_near("what runs into it and slides", met({3, -2, 4}, 0.5), Vector3(2.4, 0, 3.2), 1e-13);
  expect_near("what runs into it and sticks", met({3, -20, 4}, 0.5), Vector3::Zero(), 1e-13);
  take_weight_away();

  // the scene, h = 0.01 s, g = 10 m/s^2; tolerances: where sweeps end
  const auto samples = [&](const char* body) {
    std::vector<Sample> all = samples_of(body, arguments[1]);
    expect(all.size() == 101, "the scene has 100 steps, and the start");
    all.resize(101);
    return all;
  };
  // of two equal balls that meet head-on without loss each goes on with the other's velocity
  expect_near("velocity of what struck", samples("Striking").back().velocity, Vector3(-1, 0, 0), 1e-9);
  expect_near("velocity of what was struck", samples("Struck").back().velocity, Vector3(2, 0, 0), 1e-9);
  // friction 0.5 takes 5 m/s^2 of 2 m/s, until nothing is left
  const std::vector<Sample> sliding = samples("Sliding");
  for (std::size_t n = 0; n < sliding.size(); ++n)
    expect_near("velocity of what slides", sliding[n].velocity,
                Vector3(std::max(0.0, 2.0 - 0.05 * static_cast<double>(n)), 0, 0), 1e-6);
  // and what hangs still stays
  expect_near("where it hangs", samples("Hanging").back().position, Vector3(5, -1, 0), 1e-9);
  return failures == 0 ? 0 : 1;
}
