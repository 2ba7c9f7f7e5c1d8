// Which states have the same hash.
#include <gtest/gtest.h>

#include <cmath>

#include "kernel/environment.h"
#include "tests/kernel/world_builder.h"

namespace gravitas::kernel {
namespace {

TEST(StateHash, EveryBitOfEveryBodyCounts) {
  const auto hash_of = [](double y, double w) {
    harness::WorldBuilder builder;
    builder.sphere(1, 1, Vector3(1, y, 3)).sphere(1, 1, Vector3(9, 9, 9));
    builder.body().twist.angular.z() = w;
    return Environment(builder.description()).state_hash();
  };
  const Hash reference = hash_of(2.0, 0.5);
  EXPECT_EQ(reference, hash_of(2.0, 0.5));
  EXPECT_FALSE(reference == hash_of(std::nextafter(2.0, 3.0), 0.5));
  EXPECT_FALSE(reference == hash_of(2.0, std::nextafter(0.5, 1.0)));
}

TEST(StateHash, TheSignOfAZeroDoesNotCount) {
  const auto hash_of = [](double zero) {
    harness::WorldBuilder builder;
    builder.sphere(1, 1, Vector3(zero, 0, 0));
    return Environment(builder.description()).state_hash();
  };
  EXPECT_EQ(hash_of(0.0), hash_of(-0.0));
}

}  // namespace
}  // namespace gravitas::kernel
