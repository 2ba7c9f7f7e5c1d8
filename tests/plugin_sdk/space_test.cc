#include "plugin_sdk/space.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "plugin_sdk/message_columns.h"

namespace gravitas {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<std::uint32_t> written(const PairList& list) {
  std::vector<std::uint32_t> room(2 * list.size());
  gravitas_reply_column column{room.data(), room.size(), 0};
  list.write(stage::ReplyColumn<std::uint32_t>(&column));
  EXPECT_EQ(column.count, room.size());
  return room;
}

// Movable bodies with shapes, of which each pair may touch.
class Bodies {
 public:
  void add(double lower, double upper, std::uint32_t flags = kMovable | kHasShape) {
    columns_.f64("lower").insert(columns_.f64("lower").end(), 3, lower);
    columns_.f64("upper").insert(columns_.f64("upper").end(), 3, upper);
    columns_.u32("flags").push_back(flags);
    columns_.u64("filter_group").push_back(1);
    columns_.u64("filter_mask").push_back(1);
  }
  PairRule rule() {
    plain_ = columns_.plain();
    return PairRule(stage::SpacePairsRequest(plain_.data()));
  }

 private:
  MessageColumns columns_{stage::method_info(stage::Method::kSpacePairs).request};
  std::vector<gravitas_column> plain_;
};

TEST(PairList, BringsPairsIntoOrder) {
  PairList list;
  for (const auto& [a, b] : {std::pair{4U, 2U}, {0U, 3U}, {2U, 3U}, {1U, 0U}, {4U, 0U}}) list.add(a, b);
  list.sort(5);
  EXPECT_THAT(list.partners(0), ElementsAre(1, 3, 4));
  EXPECT_THAT(list.partners(1), IsEmpty());
  EXPECT_THAT(list.partners(2), ElementsAre(3, 4));
  EXPECT_THAT(list.partners(4), IsEmpty());
  EXPECT_THAT(written(list), ElementsAre(0, 1, 0, 3, 0, 4, 2, 3, 2, 4));
}

TEST(PairList, IsEmptyAgainAfterClear) {
  PairList list;
  list.sort(0);
  EXPECT_THAT(written(list), IsEmpty());
  list.add(0, 1);
  list.sort(2);
  list.clear();
  list.sort(3);
  EXPECT_THAT(written(list), IsEmpty());
}

TEST(PairList, OnlyCountsWhereThereIsNoRoom) {
  PairList list;
  list.add(0, 1);
  list.sort(2);
  gravitas_reply_column column{nullptr, 0, 0};
  list.write(stage::ReplyColumn<std::uint32_t>(&column));
  EXPECT_EQ(column.count, 2U);
}

TEST(TestAgainstAll, MeetsEachOtherBodyOnce) {
  Bodies bodies;
  bodies.add(0.0, 1.0);
  bodies.add(-kInfinity, kInfinity);
  bodies.add(5.0, 6.0);
  bodies.add(-kInfinity, 0.5, kHasShape);
  const PairRule rule = bodies.rule();
  PairList list;
  test_against_all(std::vector<std::uint32_t>{1, 3}, rule, &list);
  list.sort(rule.bodies());
  EXPECT_THAT(written(list), ElementsAre(0, 1, 0, 3, 1, 2, 1, 3));
}

TEST(PairRule, KnowsBoundsThatAStructureCannotHold) {
  Bodies bodies;
  bodies.add(-1.0, 1.0);
  bodies.add(2.0, 2.0);
  bodies.add(-kInfinity, 1.0);
  bodies.add(1.0, -1.0);
  bodies.add(std::numeric_limits<double>::quiet_NaN(), 1.0);
  bodies.add(1e200, 1e201);
  const PairRule rule = bodies.rule();
  EXPECT_TRUE(rule.is_regular(0));
  EXPECT_TRUE(rule.is_regular(1));
  for (std::uint32_t i = 2; i < 6; ++i) EXPECT_FALSE(rule.is_regular(i)) << i;
}

}  // namespace
}  // namespace gravitas
