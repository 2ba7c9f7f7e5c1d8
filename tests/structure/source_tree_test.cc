#include "tests/structure/source_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/paths.h"
#include "tests/structure/sample_tree.h"

namespace gravitas::structure {
namespace {

using Lines = std::vector<std::string>;

TEST(SourceTree, OfThisRepositoryHoldsThisFileAndNoBuild) {
  const SourceTree tree = tree_of_repository(in_source());
  EXPECT_EQ(std::count(tree.files.begin(), tree.files.end(), "tests/structure/source_tree_test.cc"), 1);
  EXPECT_TRUE(std::none_of(tree.files.begin(), tree.files.end(),
                           [](const std::string& file) { return file.starts_with("build/"); }));
}

TEST(SourceTree, OfAFolderLeavesOutBuildAndGit) {
  const SampleTree sample({{"kernel/a.cc", ""}, {"build/b.cc", ""}, {".git/c", ""}, {".ci/run", ""}});
  EXPECT_EQ(sample.tree().files, (Lines{".ci/run", "kernel/a.cc"}));
}

TEST(SourceTree, OfAFolderThatGitDoesNotTrackIsTheFolder) {
  const SampleTree sample("kernel/a.cc", "");
  EXPECT_EQ(tree_of_repository(sample.tree().root).files, Lines{"kernel/a.cc"});
}

TEST(WithoutComments, BlanksCommentsOnly) {
  const Lines source = {"int a; // b", "/* c", "   d */ int e; /* f */ g();", "x = 1'000; // '"};
  const Lines expected = {"int a;     ", "    ", "        int e;         g();", "x = 1'000;     "};
  EXPECT_EQ(without_comments(source, Literals::kKeep), expected);
}

TEST(WithoutComments, MarksInsideLiteralsAreText) {
  const Lines source = {R"(f("// no", '"', "\"/*"); g(); // yes)"};
  EXPECT_EQ(without_comments(source, Literals::kKeep), Lines{R"(f("// no", '"', "\"/*"); g();       )"});
  EXPECT_EQ(without_comments(source, Literals::kBlank), Lines{R"(f("     ", ' ', "    "); g();       )"});
}

TEST(WithoutComments, RawStringsGoOverLines) {
  const Lines source = {"a = R\"x(/* )\" ", "std::sin(1) )x\"; b();"};
  const Lines expected = {"a =           ", "               ; b();"};
  EXPECT_EQ(without_comments(source, Literals::kKeep), expected);
}

TEST(Report, HasALinePerFinding) {
  EXPECT_EQ(report({{"kernel/a.cc", 3, "why"}, {"kernel/b.cc", 0, "whole"}}),
            "kernel/a.cc:3: why\nkernel/b.cc: whole\n");
  EXPECT_EQ(report({}), "");
}

}  // namespace
}  // namespace gravitas::structure
