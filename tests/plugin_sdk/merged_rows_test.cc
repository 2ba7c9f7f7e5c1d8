#include "plugin_sdk/merged_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <tuple>

namespace gravitas {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(MergedRows, KeepTheOrderOfTheKeysAndWhatGoesOn) {
  const std::vector<int> fresh = {2, 5, 5, 9}, old = {1, 3, 4, 7, 11},
                         old_value = {10, 11, 30, 31, 40, 41, 70, 71, 110, 111};
  std::vector<MergedRow> rows;
  merge_rows(
      fresh.size(), [&](std::size_t i) { return fresh[i]; }, old.size(), [&](std::size_t i) { return old[i]; },
      [&](std::size_t i) { return old[i] != 4; }, &rows);
  const auto copy = [&](const std::vector<int>& from, const std::vector<int>& kept, std::size_t components) {
    struct Target {
      std::vector<int>* numbers;
      void resize(std::size_t count) const { numbers->resize(count); }
      int* data() const { return numbers->data(); }
    };
    std::vector<int> f = from, k = kept, out;
    copy_rows(rows, components, Target{&f}, Target{&k}, Target{&out});
    return out;
  };
  EXPECT_THAT(copy(fresh, old, 1), ElementsAre(1, 2, 3, 5, 5, 7, 9, 11));
  EXPECT_THAT(copy({20, 21, 50, 51, 52, 53, 90, 91}, old_value, 2),
              ElementsAre(10, 11, 20, 21, 30, 31, 50, 51, 52, 53, 70, 71, 90, 91, 110, 111));
}

TEST(MergedRows, ChangesArePairsThatOneListAloneHas) {
  const std::vector<std::uint32_t> before = {0, 1, 0, 4, 2, 3}, now = {0, 2, 0, 4, 5, 6};
  std::vector<std::tuple<bool, std::uint32_t, std::uint32_t>> changes;
  const auto note = [&](bool is_new, std::uint32_t a, std::uint32_t b) { changes.emplace_back(is_new, a, b); };
  visit_changes(before, now, note);
  EXPECT_THAT(changes, ElementsAre(std::tuple(false, 0, 1), std::tuple(true, 0, 2), std::tuple(false, 2, 3),
                                   std::tuple(true, 5, 6)));
  changes.clear();
  visit_changes(now, now, note);
  EXPECT_THAT(changes, IsEmpty());
}

}  // namespace
}  // namespace gravitas
