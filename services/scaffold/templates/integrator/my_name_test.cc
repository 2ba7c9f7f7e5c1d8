// What the integrator is known to do: half a step by itself, and the motion that my_name.gravitas comes to.
#include "my_name.h"

#include <Eigen/Geometry>
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
  const std::vector<Sample> thrown = samples_of("Thrown", arguments[1]);
  expect(thrown.size() == 201, "all of its samples");
  for (const Sample& sample : thrown)
    expect_near("height", sample.position.y(), 5.0 * sample.time - 5.0 * sample.time * sample.time, 1e-11);

  // a free top with the moments (1, 1, 2) kg m^2 that turns with (1, 0, 2) rad/s: its axis z goes about the angular momentum L,
  // (1, 0, 4) N m s, with L/(1 kg m^2), while it turns about that axis with (1 - 2/1) 2 rad/s
  const Vector3 momentum(1, 0, 4);
  const std::vector<Sample> spinning = samples_of("Spinning", arguments[1]);
  expect(spinning.size() == 201, "all of its samples");
  for (const Sample& sample : spinning) {
    const gravitas::Quaternion precession(
        Eigen::AngleAxisd(momentum.norm() * sample.time, Vector3(momentum.normalized())));
    const gravitas::Quaternion attitude = precession * Eigen::AngleAxisd(-2.0 * sample.time, Vector3::UnitZ());
    expect_near("its axis x", sample.orientation * Vector3::UnitX(), attitude * Vector3::UnitX(), 1e-11);
    expect_near("its axis z", sample.orientation * Vector3::UnitZ(), attitude * Vector3::UnitZ(), 1e-11);
    expect_near("angular velocity", sample.angular_velocity, precession * Vector3(1, 0, 2), 1e-11);
  }
  return failures == 0 ? 0 : 1;
}
