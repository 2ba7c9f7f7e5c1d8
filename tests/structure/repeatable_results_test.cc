#include "tests/structure/repeatable_results.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>

#include "tests/paths.h"
#include "tests/structure/sample_tree.h"

namespace gravitas::structure {
namespace {

std::size_t findings_in(const std::string& path, const std::string& line) {
  const SampleTree sample(path, line + "\n");
  return find_unrepeatable(sample.tree()).size();
}

TEST(RepeatableResults, HoldInThisRepository) {
  EXPECT_EQ(report(find_unrepeatable(tree_of_repository(in_source()))), "");
}

class Unrepeatable : public testing::TestWithParam<std::string> {};

TEST_P(Unrepeatable, IsFoundWhereResultsAreMade) {
  EXPECT_EQ(findings_in("kernel/a.cc", GetParam()), 1u);
  EXPECT_EQ(findings_in("workers/force/x/a.h", GetParam()), 1u);
  EXPECT_EQ(findings_in("plugin_sdk/geometry/a.cc", GetParam()), 1u);
  EXPECT_EQ(findings_in("services/a.cc", GetParam()), 0u);
  EXPECT_EQ(findings_in("kernel/a.cc", "// " + GetParam()), 0u);
  EXPECT_EQ(findings_in("kernel/a.cc", "log(\"" + GetParam() + "\");"), 0u);
}

INSTANTIATE_TEST_SUITE_P(Every, Unrepeatable,
                         testing::Values("y = std::sin(x);", "y=std::atan2 (a, b);", "y = ::exp(x);",
                                         "y = __builtin_cosf(x);", "y = std::acosh(x);", "y = std::powl(x, z);",
                                         "y = std::tgamma(x);", "q = Eigen::AngleAxisd(a, n);", "q = p.slerp(t, r);",
                                         "std::complex<double> z;", "std::unordered_map<int, int> m;",
                                         "std::unordered_multiset<int> m;"));

TEST(RepeatableResults, OtherCallsPass) {
  for (const std::string line :
       {"y = math::sin(x);", "y = gravitas::math::exp(x);", "y = std::sqrt(x);", "y = std::fabs(x);",
        "spdlog::log(level);", "y = std::logical_and<>()(a, b);", "std::map<int, int> m;", "void sin(int);"}) {
    EXPECT_EQ(findings_in("kernel/a.cc", line), 0u) << line;
  }
}

TEST(RepeatableResults, MathMayMentionLibmButNotUnorderedContainers) {
  EXPECT_EQ(findings_in("plugin_sdk/math/a.cc", "y = std::sin(x);"), 0u);
  EXPECT_EQ(findings_in("plugin_sdk/math/a.cc", "std::unordered_set<int> s;"), 1u);
}

}  // namespace
}  // namespace gravitas::structure
