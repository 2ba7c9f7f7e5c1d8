#include "plugin_sdk/trajectory_hash.h"

#include <gtest/gtest.h>

namespace gravitas {
namespace {

TEST(TrajectoryHash, IsThirtyTwoHexadecimalDigits) {
  EXPECT_EQ((Hash{0xABC, 0x1}.text()), "00000000000000010000000000000abc");
}

TEST(TrajectoryHash, OfAChainKnowsTheOrder) {
  const Hash a{1, 2}, b{3, 4};
  EXPECT_FALSE(chain_hash(chain_hash({}, a), b) == chain_hash(chain_hash({}, b), a));
}

}  // namespace
}  // namespace gravitas
