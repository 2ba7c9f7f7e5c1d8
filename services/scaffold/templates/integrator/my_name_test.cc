// What the integrator is known to do: half a step by itself, and the motion that my_name.gravitas comes to.
#include "my_name.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include "known_result.h"

using namespace known_result;

int main(int, char** arguments) {
  for (const double damping : {0.0, 0.5, 40.0}) {
    const plain::HalfDrift half = plain::half_drift(damping, 0.1);
    expect_near("way of two halves", half.way + half.kept * half.way, gravitas::damped_time(damping, 0.1), 1e-15);
    expect_near("what two halves keep", half.kept * half.kept, std::exp(-0.1 * damping), 1e-15);
  }

  // the scene: 1 kg on a spring of 100 N/m, let go at 1 m, h = 0.01 s: cos(n phi) with cos(phi) = 1 - (h w)^2/2, w = 10 rad/s
  const double phi = std::acos(1.0 - 0.5 * 0.1 * 0.1);
  const std::vector<Sample> oscillator = samples_of("Oscillator", arguments[1]);
  expect(oscillator.size() == 201, "the scene has 200 steps, and the start");
  for (std::size_t n = 0; n < oscillator.size(); ++n)
    // rounding of two hundred steps
    expect_near("position", oscillator[n].position, Vector3(std::cos(static_cast<double>(n) * phi), 0, 0), 1e-11);

  // a body thrown up at 5 m/s under 10 m/s^2: the parabola, exactly
  for (const Sample& sample : samples_of("Thrown", arguments[1]))
    expect_near("height", sample.position.y(), 5.0 * sample.time - 5.0 * sample.time * sample.time, 1e-11);
  return failures == 0 ? 0 : 1;
}
