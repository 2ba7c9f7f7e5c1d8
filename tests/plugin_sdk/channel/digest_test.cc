// The digest against published values of XXH3, and its chaining.
#include "plugin_sdk/channel/digest.h"

#include <gtest/gtest.h>

namespace gravitas::channel {
namespace {

TEST(Digest, OfNothingIsZero) { EXPECT_EQ(Digest().value(), 0U); }

// XXH3_64bits of no bytes with seed 0, from the specification's test vectors.
TEST(Digest, IsXxh3) {
  Digest digest;
  digest.add("", 0);
  EXPECT_EQ(digest.value(), 0x2D06800538D394C2ULL);
}

TEST(Digest, BordersOfRunsCount) {
  Digest whole, parts, other_parts;
  whole.add("abcdef", 6);
  parts.add("abc", 3), parts.add("def", 3);
  other_parts.add("ab", 2), other_parts.add("cdef", 4);
  EXPECT_NE(whole.value(), parts.value());
  EXPECT_NE(parts.value(), other_parts.value());
  Digest again;
  again.add("abc", 3), again.add("def", 3);
  EXPECT_EQ(again.value(), parts.value());
}

}  // namespace
}  // namespace gravitas::channel
