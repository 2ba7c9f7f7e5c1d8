#include "plugin_sdk/host/faulty_reply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "schemas/stage_frames.h"

namespace gravitas::host {
namespace {

using ::testing::ElementsAre;
using Manifolds = stage::CollisionManifoldsReply;

// A reply of Collision.Manifolds: `contacts` of them, element k of a column of numbers being k + 1, the features 10,
// 20, ..., the pairs 0, 1, ...
class Contacts {
 public:
  explicit Contacts(std::uint32_t contacts) {
    for (std::size_t i = 0; i < kMethod.reply.size(); ++i) {
      rooms_.emplace_back(64, 0);
      columns.push_back({rooms_[i].data(), 64, contacts * kMethod.reply[i].components});
      for (std::uint32_t k = 0; k < columns[i].count; ++k) {
        if (i == Manifolds::kContactPair) u32(i)[k] = k;
        if (i == Manifolds::kFeature) u32(i)[k] = 10 * (k + 1);
        if (i > Manifolds::kFeature) f64(i)[k] = k + 1;
      }
    }
  }
  double* f64(std::size_t column) { return static_cast<double*>(columns[column].data); }
  std::uint32_t* u32(std::size_t column) { return static_cast<std::uint32_t*>(columns[column].data); }
  std::vector<double> numbers(std::size_t column) { return {f64(column), f64(column) + columns[column].count}; }
  std::vector<std::uint32_t> ids(std::size_t column) { return {u32(column), u32(column) + columns[column].count}; }

  std::string change(const std::string& order) {
    std::string problem;
    const std::optional<FaultOrder> parsed = parse_fault_order(order, &problem);
    EXPECT_TRUE(parsed.has_value()) << problem;
    return parsed ? change_reply(*parsed, kMethod, nothing_.data(), columns.data()) : problem;
  }

  static constexpr const stage::MethodInfo& kMethod = stage::method_info(stage::Method::kCollisionManifolds);
  std::vector<gravitas_reply_column> columns;

 private:
  std::vector<std::vector<std::uint64_t>> rooms_;
  std::vector<gravitas_column> nothing_ = std::vector<gravitas_column>(GRAVITAS_MAX_COLUMNS);
};

TEST(FaultyReply, ChangesTheMiddleRowOfTheFirstColumnOfNumbers) {
  Contacts reply(3);
  EXPECT_EQ(reply.change("zero"), "");
  EXPECT_THAT(reply.numbers(Manifolds::kNormal), ElementsAre(1, 2, 3, 0, 0, 0, 7, 8, 9));
  EXPECT_THAT(reply.numbers(Manifolds::kPoint), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8, 9));
}

TEST(FaultyReply, ChangesTheRowThatIsNamed) {
  Contacts reply(3);
  EXPECT_EQ(reply.change("scale,factor=-2,column=depth,row=2"), "");
  EXPECT_THAT(reply.numbers(Manifolds::kDepth), ElementsAre(1, 2, -6));
  EXPECT_EQ(reply.change("sign,column=depth,all=1"), "");
  EXPECT_THAT(reply.numbers(Manifolds::kDepth), ElementsAre(-1, -2, 6));
}

TEST(FaultyReply, AnUlpIsTheNextNumberAwayFromZero) {
  Contacts reply(3);
  const double numbers[] = {1.0, -1.0, 0.0};
  std::copy(std::begin(numbers), std::end(numbers), reply.f64(Manifolds::kDepth));
  EXPECT_EQ(reply.change("ulp,column=depth,all=1"), "");
  EXPECT_THAT(reply.numbers(Manifolds::kDepth), ElementsAre(1.0 + 0x1p-52, -1.0 - 0x1p-52, 0x1p-1074));
}

TEST(FaultyReply, ADenormalKeepsItsSign) {
  Contacts reply(1);
  *reply.f64(Manifolds::kDepth) = -4.0;
  EXPECT_EQ(reply.change("denormal,column=depth"), "");
  EXPECT_EQ(std::fpclassify(*reply.f64(Manifolds::kDepth)), FP_SUBNORMAL);
  EXPECT_TRUE(std::signbit(*reply.f64(Manifolds::kDepth)));
}

// All columns that share the row word, in step.
TEST(FaultyReply, ReversesWholeRows) {
  Contacts reply(3);
  EXPECT_EQ(reply.change("permute"), "");
  EXPECT_THAT(reply.ids(Manifolds::kContactPair), ElementsAre(2, 1, 0));
  EXPECT_THAT(reply.ids(Manifolds::kFeature), ElementsAre(30, 20, 10));
  EXPECT_THAT(reply.numbers(Manifolds::kNormal), ElementsAre(7, 8, 9, 4, 5, 6, 1, 2, 3));
  EXPECT_THAT(reply.numbers(Manifolds::kDepth), ElementsAre(3, 2, 1));
  Contacts even(2);
  EXPECT_EQ(even.change("permute"), "");
  EXPECT_THAT(even.ids(Manifolds::kFeature), ElementsAre(20, 10));
}

TEST(FaultyReply, AddsAndTakesWholeRows) {
  Contacts reply(2);
  EXPECT_EQ(reply.change("double"), "");
  EXPECT_THAT(reply.ids(Manifolds::kFeature), ElementsAre(10, 20, 20));
  EXPECT_THAT(reply.numbers(Manifolds::kPoint), ElementsAre(1, 2, 3, 4, 5, 6, 4, 5, 6));
  EXPECT_EQ(reply.change("missing"), "");
  EXPECT_EQ(reply.change("missing"), "");
  EXPECT_THAT(reply.ids(Manifolds::kContactPair), ElementsAre(0));
  EXPECT_THAT(reply.numbers(Manifolds::kRelativeVelocity), ElementsAre(1, 2, 3));
}

TEST(FaultyReply, APhantomIsACopyWithAnotherId) {
  Contacts reply(2);
  EXPECT_EQ(reply.change("phantom"), "");
  EXPECT_THAT(reply.ids(Manifolds::kContactPair), ElementsAre(0, 1, 1));
  EXPECT_THAT(reply.ids(Manifolds::kFeature), ElementsAre(10, 20, 21));
  EXPECT_THAT(reply.numbers(Manifolds::kDepth), ElementsAre(1, 2, 2));
}

// As a plugin does: what there is no room for is only counted.
TEST(FaultyReply, ARowWithoutRoomIsOnlyCounted) {
  Contacts reply(2);
  for (std::size_t i = 0; i < reply.columns.size(); ++i) reply.columns[i].capacity = reply.columns[i].count;
  for (const char* order : {"double", "phantom"}) {
    EXPECT_EQ(reply.change(order), "");
    EXPECT_EQ(reply.columns[Manifolds::kNormal].count, 9U);
    EXPECT_EQ(reply.f64(Manifolds::kNormal)[6], 0.0);
    EXPECT_EQ(reply.u32(Manifolds::kFeature)[2], 0U);
    for (gravitas_reply_column& column : reply.columns) column.count = column.capacity;
  }
}

TEST(FaultyReply, SaysWhatItCannotBeCarriedOutOn) {
  Contacts reply(2);
  EXPECT_EQ(reply.change("nan,row=2"), "column normal has 2 rows, and none with number 2");
  EXPECT_EQ(reply.change("nan,column=feature"), "column feature has whole numbers, not f64");
  EXPECT_EQ(reply.change("nan,column=colour"),
            "the reply of Collision.Manifolds has no column 'colour'; it has contact_pair, feature, normal, point, "
            "depth, relative_velocity");
  Contacts none(0);
  EXPECT_EQ(none.change("nan"), "the reply of Collision.Manifolds has no column of f64 with elements");
  EXPECT_EQ(none.change("missing,column=depth"), "column depth is none with rows");
}

TEST(FaultyReply, FlipsTheBitThatIsCountedThroughAllColumns) {
  Contacts reply(2);
  // two columns of two u32, then numbers
  EXPECT_EQ(payload_bits(Contacts::kMethod.reply, reply.columns.data()), 2U * (32 + 32 + 64 * (3 + 3 + 1 + 3)));
  flip_payload(32 + 3, Contacts::kMethod.reply, reply.columns.data());
  EXPECT_THAT(reply.ids(Manifolds::kContactPair), ElementsAre(0, 1 ^ 8));
  flip_payload(128 + 63, Contacts::kMethod.reply, reply.columns.data());
  EXPECT_EQ(reply.numbers(Manifolds::kNormal)[0], -1.0);
}

TEST(RandomNumbers, AreThoseOfSplitMix64) {
  RandomNumbers numbers(1234567);
  EXPECT_EQ(numbers.next(), 6457827717110365317ULL);
  EXPECT_EQ(numbers.next(), 3203168211198807973ULL);
}

}  // namespace
}  // namespace gravitas::host
