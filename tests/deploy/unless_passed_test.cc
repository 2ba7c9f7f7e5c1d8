// tests/unless_passed: a test runs again when, and only when, something that it looks at has changed or it failed.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "plugin_sdk/channel/private_folder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

class Shard {
 public:
  Shard() { set_program("echo run >>runs; echo results >results.xml"); }

  void set_program(const std::string& script) const {
    std::ofstream(folder_.path() + "/program") << "#!/bin/bash\n" << script << '\n';
    chmod((folder_.path() + "/program").c_str(), 0755);
  }
  // Compiled, with line tables.
  void set_compiled(const std::string& source) const {
    std::ofstream(folder_.path() + "/program.cc") << source;
    const std::string command = "cd " + folder_.path() + " && clang++ -g1 -O1 program.cc -o program";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }
  // Returns the exit code.
  int test(const std::string& inputs, const std::string& arguments = "") const {
    const std::string command = "cd " + folder_.path() + " && GRAVITAS_TEST_INPUTS='" + inputs + "' " +
                                in_shell(in_source("/tests/unless_passed")) + " results.xml ./program " + arguments +
                                " >out 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));
  }
  int runs() const {
    std::ifstream file(folder_.path() + "/runs");
    int count = 0;
    for (std::string line; std::getline(file, line);) ++count;
    return count;
  }
  void forget_results() const { fs::remove(folder_.path() + "/results.xml"); }

 private:
  const channel::PrivateFolder folder_;
};

TEST(UnlessPassed, WhatPassedIsNotRunAgain) {
  const Shard shard;
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.runs(), 1);
}

TEST(UnlessPassed, AnotherProgramInputOrArgumentIsAnotherTest) {
  const Shard shard;
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.test("b"), 0);
  EXPECT_EQ(shard.test("b", "--more"), 0);
  shard.set_program("echo run >>runs; echo other >results.xml");
  EXPECT_EQ(shard.test("b", "--more"), 0);
  EXPECT_EQ(shard.runs(), 4);
  // without its results nothing could be counted
  shard.forget_results();
  EXPECT_EQ(shard.test("b", "--more"), 0);
  EXPECT_EQ(shard.runs(), 5);
}

TEST(UnlessPassed, WithoutInputsItAlwaysRunsAndForgets) {
  const Shard shard;
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.test(""), 0);
  EXPECT_EQ(shard.test(""), 0);
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.runs(), 4);
}

TEST(UnlessPassed, AFailureIsRunAgain) {
  const Shard shard;
  shard.set_program("echo run >>runs; echo results >results.xml; exit 3");
  EXPECT_EQ(shard.test("a"), 3);
  EXPECT_EQ(shard.test("a"), 3);
  EXPECT_EQ(shard.runs(), 2);
}

TEST(UnlessPassed, ACommentThatMovesLinesChangesNoProgram) {
  const Shard shard;
  const std::string head = "#include <cstdlib>\n",
                    body = "int main() { return system(\"echo run >>runs; >results.xml\"); }\n";
  shard.set_compiled(head + body);
  EXPECT_EQ(shard.test("a"), 0);
  shard.set_compiled(head + "// A comment.\n\n" + body);
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.runs(), 1);
  shard.set_compiled(head + "// A comment.\nint other() { return 1; }\n" + body);
  EXPECT_EQ(shard.test("a"), 0);
  EXPECT_EQ(shard.runs(), 2);
}

}  // namespace
}  // namespace gravitas
