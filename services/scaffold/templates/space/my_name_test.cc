// What the space is known to find: the sweep by itself, and what comes of the pairs in my_name.gravitas.
#include "my_name.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "known_result.h"

using namespace known_result;

int main(int, char** arguments) {
  // closed intervals: 0 and 2 meet in a point; 1 meets nobody; 3 has no bounds
  const double infinity = HUGE_VAL;
  std::vector<plain::Interval> intervals = {{1, 2, 0}, {5, 6, 1}, {0, 1, 2}, {-infinity, infinity, 3}};
  std::set<std::pair<std::uint32_t, std::uint32_t>> met;
  plain::sweep(&intervals, [&](std::uint32_t a, std::uint32_t b) {
    expect(met.insert({std::min(a, b), std::max(a, b)}).second, "a pair is found once");
  });
  expect(met == decltype(met){{0, 2}, {0, 3}, {1, 3}, {2, 3}}, "pairs that overlap, and no others");

  // the scene: of two equal balls that meet head-on without loss each goes on with the other's velocity; one that passes
  // them by, and one far away, go on as before
  const auto last = [&](const char* body) {
    const std::vector<Sample> samples = samples_of(body, arguments[1]);
    expect(samples.size() == 101, "the scene has 100 steps, and the start");
    return samples.empty() ? Vector3(Vector3::Constant(HUGE_VAL)) : samples.back().velocity;
  };
  // where iterations end
  expect_near("velocity of what struck", last("Striking"), Vector3(-1, 0, 0), 1e-9);
  expect_near("velocity of what was struck", last("Struck"), Vector3(2, 0, 0), 1e-9);
  expect_near("velocity of what passes by", last("Passing"), Vector3(2, 0, 0), 0.0);
  expect_near("velocity far away", last("Far"), Vector3(0, 3, 0), 0.0);
  return failures == 0 ? 0 : 1;
}
