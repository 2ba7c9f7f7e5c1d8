// No file is written over that a run reads, or writes under another option.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::HasSubstr;

TEST(FileNames, WhatIsReadIsNotWrittenOver) {
  const ScratchFolder folder;
  const std::string text = harness::read_file(kSample), scene = folder.write("scene.gravitas", text);
  for (const char* option :
       {"--trajectory", "--report", "--events", "--reactions", "--joints", "--instrumentation", "--checkpoint"}) {
    const ProgramResult result =
        run_program({"run", scene, "--steps", "1", "--hosting", "direct", option, "./scene.gravitas"}, folder);
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_THAT(result.err, HasSubstr(std::string(option) + " ./scene.gravitas: it is the same file as the scene " +
                                      scene + "; allowed: a file of its own"));
    EXPECT_EQ(harness::read_file(scene), text);
  }
  // files that a scene or an edit names
  const std::string mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const std::string obj = folder.write("x.obj", mesh);
  const std::string solid = folder.write(
      "solid.gravitas",
      "Geometries { Geometry { Type = \"TriangleMesh\" Id = \"X\" CustomProperties { File = \"x.obj\" } } }");
  const std::string added = folder.write("added.gravitas", "Materials { Material { Id = \"Ice\" } }");
  for (const auto& [options, problem] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{solid, "--report", "x.obj"}, "--report x.obj: it is the same file as a mesh of the scene, " + obj},
           {{solid, "--checkpoint", "x.obj"}, "the same file as a mesh of the scene, " + obj},
           {{"--edit", "add added.gravitas@step=1", "--events", added},
            "the same file as --edit add " + added + "; allowed"},
           {{"--edit", "add solid.gravitas@step=1", "--trajectory", "x.obj"},
            "the same file as a mesh of the scene, "}}) {
    std::vector<std::string> arguments = {"run", scene};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProgramResult result = run_program(arguments, folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(problem));
  }
  EXPECT_EQ(harness::read_file(obj), mesh);
  const ProgramResult capture =
      run_program({"capture", scene, "--steps", "1", "--slot", "solver", "--out", scene}, folder);
  EXPECT_EQ(capture.exit_code, 2);
  EXPECT_EQ(harness::read_file(scene), text);
  EXPECT_EQ(run_program({"capture", scene, solid, "--steps", "1", "--slot", "solver", "--out", obj}, folder).exit_code,
            2);
  EXPECT_EQ(harness::read_file(obj), mesh);
}

TEST(FileNames, NoFileIsWrittenTwice) {
  const ScratchFolder folder;
  const auto run = [&](const std::vector<std::string>& options) {
    std::vector<std::string> arguments = {"run", kSample, "--steps", "1", "--hosting", "direct"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run_program(arguments, folder);
  };
  const ProgramResult result = run({"--trajectory", "x", "--report", folder.path("x")});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("/x: it is the same file as --trajectory x; allowed: a file of its own"));
  EXPECT_FALSE(std::filesystem::exists(folder.path("x")));
  EXPECT_EQ(run({"--report", "/dev/null", "--events", "/dev/null"}).exit_code, 0);
  // over links, though nothing is there yet
  std::filesystem::create_symlink("x", folder.path("z"));
  std::filesystem::create_symlink(folder.path("z"), folder.path("y"));
  EXPECT_THAT(run({"--trajectory", "x", "--report", "y"}).err, HasSubstr("--report y: it is the same file as"));
  EXPECT_EQ(run({"--checkpoint", "z", "--report", "y"}).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder.path("x")));

  // a checkpoint may take the place of the one that the run goes on from, and nothing else may
  EXPECT_EQ(run({"--checkpoint", "c"}).exit_code, 0);
  EXPECT_EQ(run({"--resume", "c", "--checkpoint", "./c"}).exit_code, 0);
  std::filesystem::create_hard_link(folder.path("c"), folder.path("h"));
  EXPECT_EQ(run({"--resume", "c", "--checkpoint", "h"}).exit_code, 2);
  // a link that leads nowhere yet
  std::filesystem::create_directory(folder.path("disk"));
  std::filesystem::create_symlink("disk/run", folder.path("link"));
  EXPECT_EQ(run({"--checkpoint", "link"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(folder.path("link")));
  EXPECT_TRUE(std::filesystem::is_regular_file(folder.path("disk/run")));
  EXPECT_EQ(run({"--resume", "c", "--report", "c"}).exit_code, 2);
  EXPECT_EQ(run({"--resume", "c", "--events", "c.journal"}).exit_code, 2);
  EXPECT_EQ(run({"--resume", "c", "--checkpoint", "c.journal"}).exit_code, 2);
  EXPECT_EQ(run({"--checkpoint", "d", "--events", "d.journal"}).exit_code, 2);
  EXPECT_EQ(run({"--checkpoint", "d", "--events", "d.tmp"}).exit_code, 2);
  EXPECT_EQ(run({"--resume", "c"}).exit_code, 0);
}

}  // namespace
}  // namespace gravitas
