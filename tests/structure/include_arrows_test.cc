#include "tests/structure/include_arrows.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/paths.h"
#include "tests/structure/sample_tree.h"

namespace gravitas::structure {
namespace {

// the findings in a tree of one file with one line
std::string objections(const std::string& path, const std::string& line) {
  const SampleTree sample(path, line + "\n");
  return report(find_wrong_includes(sample.tree()));
}

TEST(IncludeArrows, HoldInThisRepository) {
  EXPECT_EQ(report(find_wrong_includes(tree_of_repository(in_source()))), "");
}

TEST(IncludeArrows, AllowedOnesPass) {
  const SampleTree sample({
      {"schemas/frame_compiler.cc", "#include \"gravitas/options/v1/options.pb.h\"\n"},
      {"plugin_sdk/a.h", "#include \"schemas/stage_frames.h\"\n#include \"plugin_sdk/b.h\"\n"},
      {"plugin_sdk/host/a.h", "#include \"gravitas/control/v1/control.pb.h\"\n"},
      {"kernel/a.cc", "#include \"kernel/a.h\"\n#include \"plugin_sdk/b.h\"\n#include <vector>\n"},
      {"workers/hello/plugin.cc", "#include \"workers/hello/a.h\"\n#include <Eigen/Dense>\n"},
      {"workers/force/x/a.cc", "#include \"plugin_sdk/b.h\"\n#include \"schemas/stage_frames.h\"\n"},
      {"workers/force/x/part/a.cc", "#include \"workers/force/x/a.h\"\n"},
      {"services/a.cc", "#include \"kernel/a.h\"\n#include \"plugin_sdk/b.h\"\n"},
      {"services/scaffold/templates/force/plugin.cc",
       "#include \"a.h\"\n#include \"b.h\"\n#include \"plugin_sdk/b.h\"\n"},
      {"services/scaffold/templates/force/a.h", ""},
      {"services/scaffold/templates/every_kind/b.h", ""},
      {"tests/kernel/a_test.cc", "#include \"kernel/a.h\"\n#include \"workers/force/x/a.h\"\n"},
  });
  EXPECT_EQ(report(find_wrong_includes(sample.tree())), "");
}

TEST(IncludeArrows, CommentsAreNoIncludes) {
  EXPECT_EQ(objections("kernel/a.cc", "// #include \"workers/hello/a.h\""), "");
  EXPECT_EQ(objections("kernel/a.cc", "/* was\n#include \"workers/hello/a.h\"\n*/"), "");
}

struct WrongArrow {
  std::string path;
  std::string line;
};

class WrongArrows : public testing::TestWithParam<WrongArrow> {};

TEST_P(WrongArrows, IsFoundOnItsLine) {
  const std::string found = objections(GetParam().path, GetParam().line);
  EXPECT_TRUE(found.starts_with(GetParam().path + ":1: ")) << "found: '" << found << "'";
}

INSTANTIATE_TEST_SUITE_P(
    Every, WrongArrows,
    testing::Values(WrongArrow{"schemas/a.cc", "#include \"plugin_sdk/b.h\""},
                    WrongArrow{"plugin_sdk/a.h", "#include \"kernel/a.h\""},
                    WrongArrow{"plugin_sdk/a.h", "#include <services/a.h>"},
                    WrongArrow{"plugin_sdk/a.h", "#include \"workers/hello/a.h\""},
                    WrongArrow{"kernel/a.cc", "#include \"workers/force/x/a.h\""},
                    WrongArrow{"kernel/a.cc", "#  include \"services/a.h\""},
                    WrongArrow{"kernel/a.cc", "#include \"tests/a.h\""},
                    WrongArrow{"kernel/a.cc", "#include \"plugin_sdk/host/host.h\""},
                    WrongArrow{"workers/force/x/a.cc", "#include \"kernel/a.h\""},
                    WrongArrow{"workers/force/x/a.cc", "#include \"workers/force/y/a.h\""},
                    WrongArrow{"workers/force/x/a.cc", "#include \"workers/force/xy/a.h\""},
                    WrongArrow{"workers/force/x/a.cc", "#include \"plugin_sdk/host/host.h\""},
                    WrongArrow{"workers/force/x/a.cc", "#include \"gravitas/stage/v1/f.pb.h\""},
                    WrongArrow{"workers/force/x/a.cc", "#include \"a.h\""},
                    WrongArrow{"services/a.cc", "#include \"workers/hello/a.h\""},
                    WrongArrow{"services/a.cc", "#include \"../kernel/a.h\""},
                    WrongArrow{"services/scaffold/templates/force/a.cc", "#include \"b.h\""},
                    WrongArrow{"services/scaffold/templates/force/a.cc", "#include \"kernel/a.h\""},
                    WrongArrow{"services/scaffold/templates/force/a.cc", "#include \"services/a.h\""},
                    WrongArrow{"tests/kernel/a_test.cc", "#include \"../../kernel/a.h\""}));

}  // namespace
}  // namespace gravitas::structure
