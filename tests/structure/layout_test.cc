#include "tests/structure/layout.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "tests/paths.h"
#include "tests/structure/sample_tree.h"

namespace gravitas::structure {
namespace {

SourceTree this_repository() { return tree_of_repository(in_source()); }

std::string lines(int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += "line\n";
  return text;
}

TEST(TopLevel, OfThisRepositoryHoldsWhatItShould) { EXPECT_EQ(report(find_strays_at_the_top(this_repository())), ""); }

TEST(TopLevel, StraysAreFound) {
  const SampleTree sample({{"CMakeLists.txt", ""},
                           {"LICENSE", ""},
                           {".clang-tidy", ""},
                           {".ci/run", ""},
                           {"kernel/a.cc", ""},
                           {"docs/a.md", ""},
                           {"docs/b.md", ""},
                           {"notes.txt", ""}});
  const auto findings = find_strays_at_the_top(sample.tree());
  ASSERT_EQ(findings.size(), 2u) << report(findings);
  EXPECT_EQ(findings[0].path, "docs");
  EXPECT_EQ(findings[1].path, "notes.txt");
}

TEST(TopLevel, AFileCalledLikeARoomIsAStray) {
  const SampleTree sample("kernel", "");
  EXPECT_EQ(find_strays_at_the_top(sample.tree()).size(), 1u);
}

TEST(Guides, EveryRoomOfThisRepositoryHasOneOfAPage) {
  EXPECT_EQ(report(find_rooms_without_guide(this_repository())), "");
}

TEST(Guides, MissingAndLongOnesAreFound) {
  std::map<std::string, std::string> files;
  for (const std::string_view room : kRooms) {
    files[std::string(room) + "/README.md"] = lines(kLongestReadme);
  }
  EXPECT_EQ(report(find_rooms_without_guide(SampleTree(files).tree())), "");

  files.erase("kernel/README.md");
  files["tests/README.md"] = lines(kLongestReadme + 1);
  const SampleTree sample(files);
  const auto findings = find_rooms_without_guide(sample.tree());
  ASSERT_EQ(findings.size(), 2u) << report(findings);
  EXPECT_EQ(findings[0].path, "kernel/README.md");
  EXPECT_EQ(findings[1].path, "tests/README.md");
}

TEST(Sizes, OfThisRepositoryReadWell) { EXPECT_EQ(report(find_overlong_sources(this_repository())), ""); }

TEST(Sizes, AFileAtTheLimitPassesAndOneBeyondIsFound) {
  const SampleTree sample({{"workers/a.cc", lines(kLongestFile)},
                           {"workers/b.h", lines(kLongestFile + 1)},
                           {"kernel/simulators/a.cc", lines(kLongestSimulator)},
                           {"kernel/simulators/b.cc", lines(kLongestSimulator + 1)},
                           {"deploy/scenes/c.gravitas", lines(kLongestFile + 1)}});
  const auto findings = find_overlong_sources(sample.tree());
  ASSERT_EQ(findings.size(), 2u) << report(findings);
  EXPECT_EQ(findings[0].path, "kernel/simulators/b.cc");
  EXPECT_EQ(findings[1].path, "workers/b.h");
}

TEST(Sizes, AKernelBeyondAnAfternoonIsFound) {
  std::map<std::string, std::string> files;
  for (int i = 0; i < kLongestKernel / kLongestFile; ++i) {
    files["kernel/part" + std::to_string(i) + ".cc"] = lines(kLongestFile);
  }
  EXPECT_EQ(report(find_overlong_sources(SampleTree(files).tree())), "");

  files["kernel/one_more.h"] = "line\n";
  const SampleTree sample(files);
  const auto findings = find_overlong_sources(sample.tree());
  ASSERT_EQ(findings.size(), 1u) << report(findings);
  EXPECT_EQ(findings[0].path, "kernel");
}

TEST(Names, OfThisRepositorySayWhatIsInside) { EXPECT_EQ(report(find_vague_names(this_repository())), ""); }

TEST(Names, VagueOnesAreFoundAsWholeWords) {
  const SampleTree vague({{"kernel/utils.h", ""},
                          {"kernel/string_util.cc", ""},
                          {"services/common/a.h", ""},
                          {"services/Misc.md", ""},
                          {"tests/helper_test.cc", ""},
                          {"workers/body-manager.cc", ""}});
  EXPECT_EQ(find_vague_names(vague.tree()).size(), 6u) << report(find_vague_names(vague.tree()));

  const SampleTree plain({{"kernel/commons_tragedy.h", ""}, {"kernel/miscount.cc", ""}, {"kernel/utility.h/x", ""}});
  EXPECT_EQ(find_vague_names(plain.tree()).size(), 1u) << report(find_vague_names(plain.tree()));
}

}  // namespace
}  // namespace gravitas::structure
