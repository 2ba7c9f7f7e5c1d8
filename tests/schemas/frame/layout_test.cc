// Sizes and places of what crosses a process: a change here is a change of the wire, and needs
// another GRAVITAS_LAYOUT_VERSION.
#include "schemas/frame/layout.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstring>
#include <string>
#include <type_traits>

namespace {

template <typename T>
constexpr bool kIsPlain = std::is_standard_layout_v<T>&& std::is_trivial_v<T>;

TEST(FrameLayout, StructuresHaveTheSizesOfVersionTwo) {
  ASSERT_EQ(GRAVITAS_LAYOUT_VERSION, 2);
  EXPECT_EQ(sizeof(gravitas_column), 16U);
  EXPECT_EQ(sizeof(gravitas_reply_column), 24U);
  EXPECT_EQ(sizeof(gravitas_frame_column), 24U);
  EXPECT_EQ(sizeof(gravitas_frame_header), 96U);
  EXPECT_EQ(GRAVITAS_COLUMN_ALIGNMENT, 64);
  EXPECT_EQ(GRAVITAS_MAX_COLUMNS, 48);
}

TEST(FrameLayout, HeaderFieldsAreWhereVersionTwoPutThem) {
  EXPECT_EQ(offsetof(gravitas_frame_header, magic), 0U);
  EXPECT_EQ(offsetof(gravitas_frame_header, schema_hash), 8U);
  EXPECT_EQ(offsetof(gravitas_frame_header, epoch), 16U);
  EXPECT_EQ(offsetof(gravitas_frame_header, sequence), 24U);
  EXPECT_EQ(offsetof(gravitas_frame_header, attempt), 32U);
  EXPECT_EQ(offsetof(gravitas_frame_header, kind), 36U);
  EXPECT_EQ(offsetof(gravitas_frame_header, method), 40U);
  EXPECT_EQ(offsetof(gravitas_frame_header, target), 44U);
  EXPECT_EQ(offsetof(gravitas_frame_header, status), 48U);
  EXPECT_EQ(offsetof(gravitas_frame_header, column_count), 52U);
  EXPECT_EQ(offsetof(gravitas_frame_header, reply_count), 56U);
  EXPECT_EQ(offsetof(gravitas_frame_header, fault), 60U);
  EXPECT_EQ(offsetof(gravitas_frame_header, state_generation), 64U);
  EXPECT_EQ(offsetof(gravitas_frame_header, response_generation), 72U);
  EXPECT_EQ(offsetof(gravitas_frame_header, deadline_ns), 80U);
  EXPECT_EQ(offsetof(gravitas_frame_header, digest), 88U);
}

TEST(FrameLayout, StructuresArePlainAndWithoutHiddenPadding) {
  EXPECT_TRUE(kIsPlain<gravitas_column> && kIsPlain<gravitas_reply_column>);
  // every bit of these is digested
  EXPECT_TRUE(kIsPlain<gravitas_frame_header>);
  EXPECT_TRUE(std::has_unique_object_representations_v<gravitas_frame_header>);
  EXPECT_TRUE(kIsPlain<gravitas_frame_column>);
  EXPECT_TRUE(std::has_unique_object_representations_v<gravitas_frame_column>);
}

TEST(FrameLayout, MagicSpellsTheName) {
  std::string letters;
  for (int shift = 56; shift >= 0; shift -= 8) letters += static_cast<char>((GRAVITAS_MAGIC >> shift) & 0xFF);
  EXPECT_EQ(letters, "GRAVITAS");
  EXPECT_EQ(GRAVITAS_NONE, 4294967295U);
}

TEST(FrameLayout, CodesOfKindsAndStatusesStand) {
  EXPECT_EQ(GRAVITAS_FRAME_REQUEST, 1);
  EXPECT_EQ(GRAVITAS_FRAME_REPLY, 2);
  EXPECT_EQ(GRAVITAS_FRAME_CALLBACK, 3);
  EXPECT_EQ(GRAVITAS_FRAME_ANSWER, 4);
  EXPECT_EQ(GRAVITAS_FRAME_CRASH, 5);
  EXPECT_EQ(GRAVITAS_FRAME_STOP, 6);
  EXPECT_EQ(GRAVITAS_OK, 0);
  EXPECT_EQ(GRAVITAS_NEEDS_CAPACITY, 1);
  EXPECT_EQ(GRAVITAS_REFUSED, 2);
  EXPECT_EQ(GRAVITAS_FAILED, 3);
  EXPECT_EQ(GRAVITAS_UNKNOWN_METHOD, 4);
  EXPECT_EQ(GRAVITAS_CALLBACK_FAILED, 5);
}

}  // namespace
