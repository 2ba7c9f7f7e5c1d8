#include "tests/structure/document_paths.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/paths.h"
#include "tests/structure/sample_tree.h"

namespace gravitas::structure {
namespace {

// the findings in a document that stands beside kernel/step.cc, kernel/README.md and a generated
// schemas/made.h
std::string dead_paths(const std::string& path, const std::string& text) {
  const SampleTree sample(
      {{"kernel/step.cc", ""}, {"kernel/README.md", ""}, {path, text}, {"build/generated/schemas/made.h", ""}});
  const SourceTree tree = sample.tree();
  return report(find_dead_paths(tree, tree.root / "build/generated"));
}

TEST(DocumentPaths, OfThisRepositoryExist) {
  EXPECT_EQ(report(find_dead_paths(tree_of_repository(in_source()), std::filesystem::path(in_build()) / "generated")),
            "");
}

TEST(DocumentPaths, LivingOnesPass) {
  EXPECT_EQ(dead_paths("README.md",
                       "See `kernel/step.cc`, `kernel/`, `./kernel/step.cc:12`, `cat kernel/step.cc`.\n"
                       "`schemas/made.h` is made by the build, `build/release/bin/x` too.\n"
                       "[guide](kernel/README.md#start), [web](https://a.org/b), [here](#below)\n"),
            "");
  EXPECT_EQ(dead_paths("kernel/NOTES.md", "[guide](README.md) [top](../kernel/step.cc)\n"), "");
}

TEST(DocumentPaths, PatternsFencesAndForeignPathsAreNotLookedAt) {
  EXPECT_EQ(dead_paths("README.md",
                       "`kernel/*.cc` `workers/<slot>/x.cc` `kernel/{a,b}.h` `kernel/…` `/etc/x` `and/or`\n"
                       "```\n`kernel/gone.cc` [a](gone.md)\n```\n"),
            "");
}

TEST(DocumentPaths, DeadOnesAreFoundOnTheirLine) {
  EXPECT_EQ(dead_paths("README.md", "\nSee `kernel/gone.cc`.\n"), "README.md:2: kernel/gone.cc does not exist\n");
  EXPECT_EQ(dead_paths("README.md", "`./deploy/gone --flag`\n"), "README.md:1: deploy/gone does not exist\n");
  EXPECT_EQ(dead_paths("kernel/NOTES.md", "[guide](GONE.md#top)\n"),
            "kernel/NOTES.md:1: the link to GONE.md#top leads nowhere\n");
  EXPECT_EQ(dead_paths("README.md", "```\n```\n`tests/gone/`\n"), "README.md:3: tests/gone/ does not exist\n");
}

}  // namespace
}  // namespace gravitas::structure
