// `gravitas new`: what it writes is built, tested and used by the very commands that its README names, and what it refuses leaves
// nothing behind.
#include "services/scaffold/new_project.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <ostream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "plugin_sdk/shell_word.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas::scaffold {
namespace {

using harness::ProgramResult;
using harness::read_file;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::HasSubstr;
using ::testing::Not;

// Of a shell script: how it ended, and both of its outputs.
struct ScriptResult {
  int exit_code = -1;
  std::string words;
};
ScriptResult run_script(const std::string& folder, const std::string& script) {
  const std::string command =
      "cd " + shell_word(folder) + " && exec bash -eo pipefail -c " + shell_word(script) + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return {};
  ScriptResult result;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) result.words += static_cast<char>(c);
  const int status = pclose(pipe);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

// The commands of a README, block by block.
std::vector<std::string> commands_of(const std::string& readme) {
  std::vector<std::string> blocks;
  bool is_inside = false;
  std::istringstream lines(readme);
  for (std::string line; std::getline(lines, line);) {
    if (line == "```sh") blocks.emplace_back();
    if (is_inside && line != "```") blocks.back() += line + '\n';
    is_inside = line == "```sh" || (is_inside && line != "```");
  }
  return blocks;
}

bool has(const std::string& block, const char* word) { return block.find(word) != std::string::npos; }

// Those which come to an end by themselves, and need neither a debugger nor another terminal.
std::string plain_commands(const std::string& readme) {
  std::string script;
  for (const std::string& block : commands_of(readme))
    if (!has(block, "gdb ") && !has(block, "serve ") && !has(block, "ctl ") && !has(block, "unix:")) script += block;
  return script;
}

// A server beside which the commands to it are given.
std::string live_commands(const std::string& readme) {
  const std::vector<std::string> blocks = commands_of(readme);
  const auto block_with = [&](const char* word) {
    return *std::ranges::find_if(blocks, [&](const std::string& block) { return has(block, word); });
  };
  std::string serve = block_with("gravitas serve ");
  serve.pop_back();
  return blocks[0] + "export XDG_RUNTIME_DIR=$PWD/build\n" + serve + " &\ntrap \"kill $!; wait\" EXIT\n" +
         "until gravitas ctl status >/dev/null 2>&1; do kill -0 $!; done\n" + block_with("gravitas ctl ");
}

// What runs end with: all the same, wherever the plugin was, and whatever was done to its worker.
std::set<std::string> chain_hashes(const std::string& words) {
  const std::string before = "chain hash ";
  std::set<std::string> hashes;
  for (std::size_t at = words.find(before); at != std::string::npos; at = words.find(before, at + 1))
    hashes.insert(words.substr(at + before.size(), 32));
  return hashes;
}

// A compiler is asked again only where something changed.
const char* const kWithCache =
    "if command -v ccache >/dev/null; then\n"
    "  export CMAKE_CXX_COMPILER_LAUNCHER=ccache CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=true\n"
    "fi\n";

struct Scaffold {
  const char* kind;
  const char* name;
  const char* file;
};
void PrintTo(const Scaffold& one, std::ostream* out) { *out << one.kind; }
std::string kind_of(const testing::TestParamInfo<Scaffold>& one) { return one.param.kind; }

class NewProject : public testing::TestWithParam<Scaffold> {};

TEST_P(NewProject, IsBuiltTestedAndUsedAsItsReadmeSays) {
  const ScratchFolder folder;
  const ProgramResult written = run_program({"new", GetParam().kind, GetParam().name}, folder);
  ASSERT_EQ(written.exit_code, 0) << written.err;
  EXPECT_EQ(written.err, "");
  EXPECT_THAT(written.out, HasSubstr(std::string("\nnext:\n  cd ") + GetParam().file + "\n  cmake -B build -G Ninja"));
  const std::string project = folder.path(GetParam().file);
  const std::string readme = read_file(project + "/README.md");
  const ScriptResult ended = run_script(project, kWithCache + plain_commands(readme));
  EXPECT_EQ(ended.exit_code, 0) << ended.words;
  EXPECT_THAT(ended.words, HasSubstr("100% tests passed, 0 tests failed out of 3"));
  EXPECT_THAT(ended.words, Not(HasSubstr("warning: ")));
  EXPECT_THAT(chain_hashes(ended.words), testing::SizeIs(1)) << ended.words;
  const ScriptResult live = run_script(project, live_commands(readme));
  EXPECT_EQ(live.exit_code, 0) << live.words;
  // nothing of the template's own is left, of names or of what stands between two @
  const ScriptResult left = run_script(project, "grep -rnIE 'MyName|my_name|@[A-Z_]+@' --exclude-dir=build . || true");
  EXPECT_EQ(left.words, "");
}

INSTANTIATE_TEST_SUITE_P(Kinds, NewProject,
                         testing::Values(Scaffold{"space", "XSweep", "x_sweep"},
                                         Scaffold{"collision", "BallsOnly", "balls_only"},
                                         Scaffold{"constraint", "In_Plane", "in_plane"},
                                         Scaffold{"force", "MyWind", "my_wind"}, Scaffold{"solver", "PGS", "pgs"},
                                         Scaffold{"integrator", "String", "string"}),
                         kind_of);

class NewPythonProject : public testing::TestWithParam<Scaffold> {};

TEST_P(NewPythonProject, IsTestedAndUsedAsItsReadmeSays) {
  const ScratchFolder folder;
  const ProgramResult written =
      run_program({"new", GetParam().kind, GetParam().name, "--language", "python", "--out", "in python"}, folder);
  ASSERT_EQ(written.exit_code, 0) << written.err;
  EXPECT_THAT(written.out, HasSubstr("\nnext:\n  cd 'in python'\n  /usr/bin/python3 -B " +
                                     std::string(GetParam().file) + "_test.py\n"));
  const std::string project = folder.path("in python");
  // checking it whole takes ten seconds, and its own test does so, too: of one kind, since most levels are of the SDK
  const bool is_whole = GetParam().kind == std::string("force");
  std::string script;
  std::istringstream lines(plain_commands(read_file(project + "/README.md")));
  for (std::string line; std::getline(lines, line);) {
    if (has(line, "_test.py") && !is_whole) line += " KnownResults";
    if (!has(line, "gravitas check"))
      script += line + '\n';
    else if (!is_whole)
      script += line + " --level C5\n" + line + " --case purity/after-others\n";
  }
  const ScriptResult ended = run_script(project, script);
  EXPECT_EQ(ended.exit_code, 0) << ended.words;
  EXPECT_THAT(ended.words, testing::ContainsRegex("Ran [2-4] tests"));
  EXPECT_THAT(chain_hashes(ended.words), testing::SizeIs(1)) << ended.words;
  const ScriptResult left = run_script(project, "grep -rnIE 'MyName|my_name|@[A-Z_]+@' . || true");
  EXPECT_EQ(left.words, "");
}

// words of the language and names of the template's own are no harm
INSTANTIATE_TEST_SUITE_P(Kinds, NewPythonProject,
                         testing::Values(Scaffold{"space", "numpy", "numpy"}, Scaffold{"collision", "Values", "values"},
                                         Scaffold{"constraint", "None", "none"}, Scaffold{"force", "main", "main"},
                                         Scaffold{"integrator", "class", "class"}),
                         kind_of);

// A checkout that is none, or that is not built, is named with what is required.
TEST(NewProjectBuild, SaysWhatIsMissing) {
  const ScratchFolder folder;
  ASSERT_EQ(run_program({"new", "force", "MyWind"}, folder).exit_code, 0);
  const std::string project = folder.path("my_wind");
  const ScriptResult no_tree = run_script(project, "cmake -B build -G Ninja -DGRAVITAS=/nowhere");
  EXPECT_NE(no_tree.exit_code, 0);
  EXPECT_THAT(no_tree.words, HasSubstr("GRAVITAS is '/nowhere'"));
  const ScriptResult no_build = run_script(project, "cmake -B other -G Ninja -DGRAVITAS_BUILD=/nowhere");
  EXPECT_NE(no_build.exit_code, 0);
  EXPECT_THAT(no_build.words, HasSubstr("Gravitas is not built in '/nowhere'"));
}

// A build is named as a shell names it, and one that nothing can be linked with is refused.
TEST(NewProjectBuild, MayLieAnywhereButNotBeSanitized) {
  const ScratchFolder folder;
  ASSERT_EQ(run_program({"new", "force", "MyWind"}, folder).exit_code, 0);
  const std::string project = folder.path("my_wind");
  const std::string built = in_shell(in_build());
  const ScriptResult relative = run_script(project, kWithCache + ("ln -s " + built +
                                                                  " it\ncmake -B build -G Ninja -DGRAVITAS_BUILD=it\n"
                                                                  "cmake --build build --target my_wind_test\n"));
  EXPECT_EQ(relative.exit_code, 0) << relative.words;
  EXPECT_THAT(relative.words, Not(HasSubstr("Warning")));
  const ScriptResult sanitized =
      run_script(project, "mkdir other && ln -s " + built +
                              "/* other/ && rm other/CMakeCache.txt\n"
                              "echo GRAVITAS_SANITIZERS:STRING=address >other/CMakeCache.txt\n"
                              "cmake -B elsewhere -G Ninja -DGRAVITAS_BUILD=$PWD/other\n");
  EXPECT_NE(sanitized.exit_code, 0);
  EXPECT_THAT(sanitized.words, HasSubstr("sanitizers (address)"));
}

// Beside templates may lie what editors and interpreters leave: here in a tree of its own, with its own program.
TEST(NewProjectTemplates, AreFilesAloneAndNoCopiesOfEditors) {
  namespace fs = std::filesystem;
  const ScratchFolder folder;
  const fs::path tree = folder.path("tree"), templates = tree / "services/scaffold/templates";
  fs::create_directories(tree / "build/bin");
  fs::create_directories(tree / "build/lib/gravitas");
  for (const char* program : {"gravitas", "gravitas-worker"})
    fs::copy_file(in_build(std::string("/bin/") + program), tree / "build/bin" / program);
  fs::create_directories(templates);
  fs::copy(in_source("/services/scaffold/templates"), templates, fs::copy_options::recursive);
  fs::create_directories(templates / "python_force/__pycache__");
  fs::copy_file(templates / "python_force/plugin.py", templates / "python_force/plugin.py~");
  const ScriptResult written =
      run_script(tree, "build/bin/gravitas new force MyWind --language python && ls -xA -w 0 my_wind");
  EXPECT_EQ(written.exit_code, 0) << written.words;
  EXPECT_THAT(written.words,
              HasSubstr(".gitignore  README.md  known_result.py  my_wind.gravitas  my_wind_test.py  plugin.py\n"));
}

TEST(NewProjectRefusal, NamesWhatIsAllowedAndLeavesNothing) {
  struct Trial {
    std::vector<std::string> words;
    const char* expected;
  };
  const ScratchFolder folder;
  folder.write("file", "");
  std::filesystem::create_directory(folder.path("full"));
  folder.write("full/file", "kept");
  const std::string long_name(65, 'n');
  for (const Trial& trial : {
           Trial{{"new", "forces", "MyWind"}, "KIND \"forces\": there is no such slot; did you mean \"force\"?"},
           Trial{{"new", "force", "My-Wind"}, "NAME \"My-Wind\"; allowed: letters, digits and '_', a letter first"},
           Trial{{"new", "force", "2Winds"}, "NAME \"2Winds\"; allowed"},
           Trial{{"new", "force", "My/Wind"}, "NAME \"My/Wind\"; allowed"},
           Trial{{"new", "force", "Solver"}, "NAME \"Solver\" is one that every project has"},
           Trial{{"new", "force", "KnownResult"}, "NAME \"KnownResult\" is one that every project has"},
           Trial{{"new", "force", long_name}, "64 at most"},
           Trial{{"new", "force", "Newton"},
                 "NAME \"Newton\" is taken: the installed plugin Newton (slot solver) has it"},
           Trial{{"new", "space", "Sphere"}, "serves a type of that name"},
           Trial{{"new", "force", "MyWind", "--out", "full"}, "folder 'full' is not empty"},
           Trial{{"new", "force", "MyWind", "--out", "file"}, "folder 'file' cannot be made"},
           Trial{{"new", "force", "MyWind", "--out", "no/where"}, "folder 'no/where' cannot be made"},
           Trial{{"new", "force", "MyWind", "--out", ""}, "--out"},
           Trial{{"new", "solver", "MyWind", "--language", "python"},
                 "no template of slot solver in Python; allowed: c++"},
           Trial{{"new", "force", "MyWind", "--language", "rust"}, "--language"},
           Trial{{"new", "force"}, "NAME is required"},
       }) {
    const ProgramResult result = run_program(trial.words, folder);
    EXPECT_EQ(result.exit_code, 2) << trial.expected;
    EXPECT_THAT(result.err, HasSubstr(trial.expected));
    EXPECT_EQ(result.out, "");
  }
  std::vector<std::string> there;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path("")))
    there.push_back(entry.path().filename().string());
  EXPECT_THAT(there, testing::UnorderedElementsAre("file", "full", "file", "stdout", "stderr"));
  EXPECT_EQ(read_file(folder.path("full/file")), "kept");
}

// Its folder can be made, and its files have names that are too long for the system.
TEST(NewProjectRefusal, WhatCannotBeWrittenIsTakenBackWhole) {
  const ScratchFolder folder;
  std::string place = folder.path("deep");
  // a file of the project is the first that is beyond Linux's 4095 characters
  constexpr std::size_t kParent = 4090;
  while (place.size() + 202 < kParent) place += '/' + std::string(200, 'd');
  place += '/' + std::string(kParent - place.size() - 1, 'e');
  std::filesystem::create_directories(place);
  const ProgramResult result = run_program({"new", "force", "MyWind", "--out", place + "/p"}, folder);
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_THAT(result.err, HasSubstr("gravitas new: '"));
  EXPECT_THAT(result.err, HasSubstr("cannot be written: File name too long; allowed: "));
  EXPECT_TRUE(std::filesystem::is_empty(place));
}

TEST(FileStyle, IsThatOfTheTreesFolders) {
  EXPECT_EQ(file_style("MyWind"), "my_wind");
  EXPECT_EQ(file_style("GjkOnly"), "gjk_only");
  EXPECT_EQ(file_style("KDTree"), "kd_tree");
  EXPECT_EQ(file_style("DynamicBVH"), "dynamic_bvh");
  EXPECT_EQ(file_style("DormandPrince54"), "dormand_prince54");
  EXPECT_EQ(file_style("SPH2Solver"), "sph2_solver");
  EXPECT_EQ(file_style("already_so"), "already_so");
  EXPECT_EQ(file_style("Half_Way"), "half_way");
}

}  // namespace
}  // namespace gravitas::scaffold
