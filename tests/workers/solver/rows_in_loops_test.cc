// RowsInLoops: which joints may share a load.
#include "workers/solver/sequential/rows_in_loops.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <vector>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {
namespace {

using testing::ElementsAreArray;
using testing::IsEmpty;

void join(std::uint32_t one, std::uint32_t two, int rows, std::vector<RowEnds>* all) {
  all->insert(all->end(), static_cast<std::size_t>(rows), RowEnds(one, two));
}

std::vector<std::uint32_t> first(std::uint32_t count) {
  std::vector<std::uint32_t> places(count);
  std::iota(places.begin(), places.end(), 0);
  return places;
}

TEST(RowsInLoops, NoneInTrees) {
  std::vector<RowEnds> rows;
  join(kNone, 0, 6, &rows);
  for (std::uint32_t body = 1; body < 20; ++body) join(body / 2, body, 6, &rows);
  RowsInLoops loops;
  EXPECT_THAT(loops.find(rows), IsEmpty());
  EXPECT_THAT(loops.find({}), IsEmpty());
}

TEST(RowsInLoops, AreThoseOfADoorOnTwoHinges) {
  std::vector<RowEnds> rows;
  join(kNone, 0, 10, &rows);
  join(0, 1, 3, &rows);  // its handle
  RowsInLoops loops;
  EXPECT_THAT(loops.find(rows), ElementsAreArray(first(10)));
}

// Four hinges of three bars in the plane are 20 rows for 18 freedoms; what hangs on it has no part.
TEST(RowsInLoops, AreThoseOfAFourBarAndNotOfAChainThatHangsOnIt) {
  std::vector<RowEnds> rows;
  join(kNone, 0, 5, &rows);
  join(1, 0, 5, &rows);
  join(1, 2, 5, &rows);
  join(kNone, 2, 5, &rows);
  for (std::uint32_t body = 3; body < 30; ++body) join(body == 3 ? 1 : body - 1, body, 3, &rows);
  RowsInLoops loops;
  EXPECT_THAT(loops.find(rows), ElementsAreArray(first(20)));
  std::ranges::reverse(rows);
  EXPECT_EQ(loops.find(rows).size(), 20U);
  EXPECT_EQ(loops.find(rows).front(), rows.size() - 20);
}

// Six bars in a loop with the ground, 35 rows for 36 freedoms: no more than these could meet, wherever they stand.
TEST(RowsInLoops, NoneWhereBodiesHaveMoreFreedoms) {
  std::vector<RowEnds> rows;
  for (std::uint32_t body = 0; body < 6; ++body) join(body == 0 ? kNone : body - 1, body, 5, &rows);
  join(5, kNone, 5, &rows);
  RowsInLoops loops;
  EXPECT_THAT(loops.find(rows), IsEmpty());
}

}  // namespace
}  // namespace gravitas
