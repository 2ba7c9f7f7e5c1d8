// Bodies with bounds for a space, and an answer that uses nothing of the plugins.
#pragma once

#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "plugin_sdk/body.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {

using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

inline constexpr std::uint64_t kEverything = ~std::uint64_t{0};

struct BoundedBody {
  Vector3 lower = Vector3::Zero();
  Vector3 upper = Vector3::Ones();
  std::uint32_t flags = kMovable | kHasShape;
  std::uint64_t group = 1, mask = kEverything;
};

inline BoundedBody cube(const Vector3& centre, double half_extent) {
  return {centre - Vector3::Constant(half_extent), centre + Vector3::Constant(half_extent)};
}

inline Pairs ask_pairs(PluginUnderTest* space, const std::vector<BoundedBody>& bodies) {
  MessageColumns request = PluginUnderTest::request_of(stage::Method::kSpacePairs);
  for (const BoundedBody& body : bodies) {
    for (int k = 0; k < 3; ++k) {
      request.f64("lower").push_back(body.lower[k]);
      request.f64("upper").push_back(body.upper[k]);
    }
    request.u32("flags").push_back(body.flags);
    request.u64("filter_group").push_back(body.group);
    request.u64("filter_mask").push_back(body.mask);
  }
  const MessageColumns reply = space->ask(stage::Method::kSpacePairs, request);
  const std::vector<std::uint32_t>& numbers = reply.u32("pair");
  Pairs pairs;
  for (std::size_t i = 0; i + 1 < numbers.size(); i += 2) pairs.emplace_back(numbers[i], numbers[i + 1]);
  return pairs;
}

// The contract of space.proto, word by word, over all pairs in order.
inline Pairs expected_pairs(const std::vector<BoundedBody>& bodies) {
  Pairs pairs;
  for (std::uint32_t a = 0; a < bodies.size(); ++a) {
    for (std::uint32_t b = a + 1; b < bodies.size(); ++b) {
      const BoundedBody &x = bodies[a], &y = bodies[b];
      const bool have_shapes = (x.flags & kHasShape) != 0 && (y.flags & kHasShape) != 0;
      const bool one_moves = (x.flags & kMovable) != 0 || (y.flags & kMovable) != 0;
      const bool allowed = (x.group & y.mask) != 0 && (y.group & x.mask) != 0;
      bool overlap = true;
      for (int k = 0; k < 3; ++k) overlap = overlap && x.lower[k] <= y.upper[k] && y.lower[k] <= x.upper[k];
      if (have_shapes && one_moves && allowed && overlap) pairs.emplace_back(a, b);
    }
  }
  return pairs;
}

}  // namespace gravitas::test
