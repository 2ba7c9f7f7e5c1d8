#include "kernel/hash.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kernel/environment.h"
#include "tests/kernel/world_builder.h"

namespace gravitas::kernel {
namespace {

TEST(Hash, IsThirtyTwoHexadecimalDigits) { EXPECT_EQ((Hash{0xABC, 0x1}.text()), "00000000000000010000000000000abc"); }

TEST(Hash, EveryBitOfEveryBodyCounts) {
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

TEST(Hash, TheSignOfAZeroDoesNotCount) {
  const auto hash_of = [](double zero) {
    harness::WorldBuilder builder;
    builder.sphere(1, 1, Vector3(zero, 0, 0));
    return Environment(builder.description()).state_hash();
  };
  EXPECT_EQ(hash_of(0.0), hash_of(-0.0));
}

TEST(Hash, TheChainKnowsTheOrder) {
  const Hash a{1, 2}, b{3, 4};
  EXPECT_FALSE(chain_hash(chain_hash({}, a), b) == chain_hash(chain_hash({}, b), a));
}

}  // namespace
}  // namespace gravitas::kernel
