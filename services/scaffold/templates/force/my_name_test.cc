// What the force is known to do: the plain code by itself, and the motion that my_name.gravitas comes to.
#include "my_name.h"

#include <cstddef>
#include <vector>

#include "known_result.h"

using namespace known_result;

int main(int, char** arguments) {
  const Vector3 wind(3, 0, -1), velocity(1, 2, -1);
  expect_near("force in the wind", plain::wind_force(2.0, wind, wind), Vector3::Zero(), 0.0);
  expect_near("force", plain::wind_force(2.0, wind, velocity), Vector3(4, -4, 0), 1e-15);
  // the slope is what a difference says
  const Vector3 faster = velocity + Vector3(0.5, 0, 0);
  const Vector3 change = plain::wind_force(2.0, wind, faster) - plain::wind_force(2.0, wind, velocity);
  expect_near("slope", plain::wind_force_slope(2.0) * Vector3(0.5, 0, 0), change, 1e-15);

  // the scene: 2 kg at rest, c = 1 N s/m, wind (3, 0, -1) m/s, h = 0.01 s. Symplectic Euler takes c h/m of what the velocity
  // lacks in every step, and moves with the new velocity
  const std::vector<Sample> samples = samples_of("Leaf", arguments[1]);
  expect(samples.size() == 101, "the scene has 100 steps, and the start");
  Vector3 v = Vector3::Zero(), x = Vector3::Zero();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    v += 0.01 * 1.0 / 2.0 * (wind - v);
    x += 0.01 * v;
    // rounding of a hundred steps
    expect_near("velocity", samples[i].velocity, v, 1e-13);
    expect_near("position", samples[i].position, x, 1e-13);
  }
  return failures == 0 ? 0 : 1;
}
