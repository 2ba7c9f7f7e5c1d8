// A tree in another folder compiled everything again: unity builds name their sources by absolute paths, and precompiled
// headers know where they lie.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "plugin_sdk/channel/private_folder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

namespace fs = std::filesystem;

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

// A small project, built as this one is, in folders of its own and with a cache of its own.
class Project {
 public:
  // Writes the project into a folder and builds it there; what ninja says.
  std::string build(const std::string& name) const {
    const std::string tree = folder_.path() + "/" + name;
    fs::create_directories(tree + "/lib");
    fs::create_directories(tree + "/deploy");
    fs::copy(in_source("/deploy/compile"), tree + "/deploy/compile", fs::copy_options::overwrite_existing);
    write(tree + "/CMakeLists.txt", R"(
cmake_minimum_required(VERSION 3.25)
project(small LANGUAGES CXX)
set(CMAKE_UNITY_BUILD ON)
set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_SOURCE_DIR}/deploy/compile ${CMAKE_SOURCE_DIR})
add_compile_options(-g -ffile-prefix-map=${CMAKE_SOURCE_DIR}=. "SHELL:-Xclang -fno-pch-timestamp")
include_directories(${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/generated)
file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/answer.h CONTENT "inline int answer() { return 42; }")
add_library(small STATIC lib/first.cc lib/second.cc)
target_precompile_headers(small PRIVATE <lib/common.h>)
)");
    for (const auto& [header, text] : headers_) write(tree + "/lib/" + header, text);
    write(tree + "/lib/first.cc", "#include \"lib/first.h\"\nconst char* first() { return __FILE__; }\n");
    write(tree + "/lib/second.cc", "#include \"answer.h\"\nstd::size_t second() { return answer(); }\n");
    return run("cd " + in_shell(tree) + " && cmake -G Ninja -B build -D CMAKE_CXX_COMPILER=clang++ && ninja -C build");
  }
  std::string rebuild(const std::string& name) const {
    return run("ninja -C " + in_shell(folder_.path() + "/" + name + "/build"));
  }
  void leave(const std::string& name) const { fs::remove_all(folder_.path() + "/" + name); }
  void change(const std::string& header) { headers_.at(header) += "// changed\n"; }
  std::string library(const std::string& name) const {
    return content(folder_.path() + "/" + name + "/build/libsmall.a");
  }

  // How many compilations the cache has served, and how many it had not.
  int hits() const { return count("direct_cache_hit"); }
  int misses() const { return count("cache_miss"); }

 private:
  static void write(const std::string& path, const std::string& text) { std::ofstream(path) << text; }
  static std::string content(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  std::string run(const std::string& command) const {
    const std::string out = folder_.path() + "/out";
    const std::string whole =
        "export CCACHE_DIR=" + in_shell(folder_.path() + "/cache") + "; (" + command + ") >" + in_shell(out) + " 2>&1";
    EXPECT_EQ(std::system(whole.c_str()), 0) << content(out);
    return content(out);
  }
  int count(const std::string& statistic) const {
    const std::string lines = run("ccache --print-stats");
    const std::size_t at = lines.find("\n" + statistic + "\t");
    return at == std::string::npos ? -1 : std::stoi(lines.substr(at + statistic.size() + 2));
  }

  const channel::PrivateFolder folder_;
  std::map<std::string, std::string> headers_ = {{"first.h", "const char* first();\n"},
                                                 {"common.h", "#include <cstddef>\n"}};
};

TEST(Compile, ATreeInAnotherFolderIsServedWhatTheFirstOneCompiled) {
  const Project project;
  project.build("first_place");
  EXPECT_EQ(project.hits(), 0);
  EXPECT_EQ(project.misses(), 1);
  const std::string library = project.library("first_place");
  EXPECT_THAT(library, HasSubstr("./lib/first.cc"));
  EXPECT_THAT(library, Not(HasSubstr("first_place")));

  project.leave("first_place");
  project.build("second");
  EXPECT_EQ(project.hits(), 1);
  EXPECT_EQ(project.misses(), 1);
  EXPECT_EQ(project.library("second"), library);
  // nothing of the folder that is gone is missed
  EXPECT_THAT(project.rebuild("second"), HasSubstr("no work to do"));
}

TEST(Compile, WhatASourceIncludesIsCompiledAgainWhenItChanges) {
  for (const std::string header : {"first.h", "common.h"}) {
    Project project;
    project.build("place");
    project.change(header);
    EXPECT_THAT(project.build("place"), ContainsRegex("Building CXX object.*unity_0_cxx.cxx.o")) << header;
    EXPECT_EQ(project.misses(), 2) << header;
    project.build("other");
    EXPECT_EQ(project.hits(), 1) << header;
  }
}

}  // namespace
}  // namespace gravitas
