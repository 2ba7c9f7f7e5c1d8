// The column that a plugin fills: it never writes beyond its room, and counts what it would take.
#include "schemas/frame/column.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

namespace gravitas::stage {
namespace {

constexpr double kUntouched = -1.0;

// Room for `capacity` numbers with a guard behind it.
struct Room {
  explicit Room(std::uint64_t capacity) : numbers(capacity + 2, kUntouched), plain{numbers.data(), capacity, 0} {}
  bool guard_is_untouched() const {
    return numbers[plain.capacity] == kUntouched && numbers[plain.capacity + 1] == kUntouched;
  }
  std::vector<double> numbers;
  gravitas_reply_column plain;
};

TEST(ReplyColumn, PushAppendsRows) {
  Room room(6);
  const ReplyColumn<double> column(&room.plain);
  column.push(1.0, 2.0, 3.0);
  column.push(4, 5, 6);
  EXPECT_EQ(column.count(), 6U);
  EXPECT_EQ(room.numbers, (std::vector<double>{1, 2, 3, 4, 5, 6, kUntouched, kUntouched}));
}

TEST(ReplyColumn, PushBeyondTheRoomOnlyCounts) {
  Room room(4);
  const ReplyColumn<double> column(&room.plain);
  for (int row = 0; row < 1000; ++row) column.push(1.0, 2.0, 3.0);
  EXPECT_EQ(column.count(), 3000U);
  EXPECT_TRUE(room.guard_is_untouched());
  EXPECT_EQ(room.numbers[3], 1.0);
}

TEST(ReplyColumn, ResizeGivesTheRoomOrNothing) {
  Room room(3);
  const ReplyColumn<double> column(&room.plain);
  EXPECT_EQ(column.resize(3).size(), 3U);
  EXPECT_EQ(column.resize(3).data(), room.numbers.data());
  EXPECT_TRUE(column.resize(4).empty());
  EXPECT_EQ(column.count(), 4U);
  EXPECT_TRUE(column.resize(0).empty());
  EXPECT_EQ(column.count(), 0U);
}

TEST(ReplyColumn, SetWritesASingleValue) {
  Room room(1), none(0);
  ReplyColumn<double>(&room.plain).set(7.0);
  EXPECT_EQ(room.numbers[0], 7.0);
  EXPECT_EQ(room.plain.count, 1U);
  ReplyColumn<double>(&none.plain).set(7.0);
  EXPECT_EQ(none.plain.count, 1U);
  EXPECT_TRUE(none.guard_is_untouched());
}

TEST(ReplyColumn, ElementSizesAreThoseOfTheTypes) {
  EXPECT_EQ(element_size(ElementType::kF64), sizeof(double));
  EXPECT_EQ(element_size(ElementType::kU32), sizeof(std::uint32_t));
  EXPECT_EQ(element_size(ElementType::kU64), sizeof(std::uint64_t));
}

}  // namespace
}  // namespace gravitas::stage
