// What the collision is known to find: contacts by themselves, and what comes of them in my_name.gravitas.
#include "my_name.h"

#include <vector>

#include "known_result.h"

using namespace known_result;

int main(int, char** arguments) {
  const auto balls = plain::touch_of_balls(Vector3(1, 0, 0), 2.0, Vector3(3.5, 0, 0), 1.0);
  expect_near("depth of balls", balls.depth, 0.5, 1e-15);
  expect_near("their normal", balls.normal, Vector3(1, 0, 0), 1e-15);
  expect_near("point midway between their surfaces", balls.point, Vector3(2.75, 0, 0), 1e-15);
  const auto same = plain::touch_of_balls(Vector3::Zero(), 1.0, Vector3::Zero(), 1.0);
  expect_near("depth in one place", same.depth, 2.0, 0.0);
  expect_near("normal in one place", same.normal, Vector3(0, 1, 0), 0.0);
  const auto above = plain::touch_of_halfspace(Vector3(7, 0, -2), Vector3(0, 1, 0), Vector3(3, 1.25, 4), 1.0);
  expect_near("gap above a half-space", above.depth, -0.25, 1e-15);
  expect_near("point midway in the gap", above.point, Vector3(3, 0.125, 4), 1e-15);

  // the scene: of two equal balls that meet head-on without loss each goes on with the other's velocity, and one that is
  // dropped without bounce comes to rest on its radius
  const auto last = [&](const char* body) {
    const std::vector<Sample> samples = samples_of(body, arguments[1]);
    expect(samples.size() == 101, "the scene has 100 steps, and the start");
    return samples.empty() ? Sample{} : samples.back();
  };
  // where iterations end
  expect_near("velocity of what struck", last("Striking").velocity, Vector3(-1, 0, 0), 1e-9);
  expect_near("velocity of what was struck", last("Struck").velocity, Vector3(2, 0, 0), 1e-9);
  expect_near("where the dropped ball rests", last("Dropped").position, Vector3(0, 0.5, 9), 1e-8);
  expect_near("its velocity", last("Dropped").velocity, Vector3::Zero(), 1e-8);
  return failures == 0 ? 0 : 1;
}
