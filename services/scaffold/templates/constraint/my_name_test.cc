// What the joint is known to do: its rows by themselves, and the motion that my_name.gravitas comes to.
#include "my_name.h"

#include <cstddef>
#include <vector>

#include "known_result.h"
#include "plugin_sdk/math/rotation.h"

using namespace known_result;

int main(int, char** arguments) {
  // a plane whose normal is y, a point 0.25 above it: that is the error, wherever the point is along the plane
  const gravitas::Pose plane{Vector3(1, 2, 3), gravitas::exp_rotation(Vector3(0, 0, gravitas::kHalfTurn / 2))};
  for (const double way : {0.0, 5.0}) {
    const gravitas::Discrepancy d = plain::point_in_plane(plane, Vector3(1 + way, 2.25, 3 - way));
    expect_near("error", d.point2 - d.point1, Vector3(0, 0.25, 0), 1e-14);
  }

  // the scene: a bead on a slope with the normal (3, 4, 0)/5, g = 10 m/s^2, h = 0.01 s. What is left of g along the slope is
  // (4.8, -3.6, 0) m/s^2, and symplectic Euler moves with the new velocity
  const std::vector<Sample> samples = samples_of("Bead", arguments[1]);
  expect(samples.size() == 101, "the scene has 100 steps, and the start");
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const Vector3 along(4.8, -3.6, 0);
    const double count = static_cast<double>(n);
    // rounding of a hundred steps
    expect_near("velocity", samples[n].velocity, 0.01 * count * along, 1e-12);
    expect_near("position", samples[n].position, 0.5e-4 * count * (count + 1) * along, 1e-12);
  }
  return failures == 0 ? 0 : 1;
}
