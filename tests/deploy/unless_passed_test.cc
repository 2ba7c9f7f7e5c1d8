// tests/unless_passed: a test runs again when, and only when, something that it looks at has changed or it failed.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

class Shard {
 public:
  Shard() {
    std::string pattern = (fs::temp_directory_path() / "gravitas-test-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    set_program("echo run >>runs; echo results >results.xml");
  }
  ~Shard() { fs::remove_all(folder_); }
  Shard(const Shard&) = delete;
  Shard& operator=(const Shard&) = delete;

  void set_program(const std::string& script) const {
    std::ofstream(folder_ + "/program") << "#!/bin/bash\n" << script << '\n';
    chmod((folder_ + "/program").c_str(), 0755);
  }
  // Returns the exit code.
  int test(const std::string& inputs, const std::string& arguments = "") const {
    const std::string command = "cd " + folder_ + " && GRAVITAS_TEST_INPUTS='" + inputs + "' " +
                                in_source("/tests/unless_passed results.xml ./program ") + arguments + " >out 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));
  }
  int runs() const {
    std::ifstream file(folder_ + "/runs");
    int count = 0;
    for (std::string line; std::getline(file, line);) ++count;
    return count;
  }
  void forget_results() const { fs::remove(folder_ + "/results.xml"); }

 private:
  std::string folder_;
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

}  // namespace
}  // namespace gravitas
