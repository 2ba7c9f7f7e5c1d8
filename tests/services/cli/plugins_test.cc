// `gravitas plan`, `plugins`, `describe` and the help of all.
#include <gmock/gmock.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <vector>

#include "gravitas/plugin/v1/description.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using google::protobuf::util::JsonStringToMessage;
using harness::ProgramResult;
using harness::run_program;
using harness::ScratchFolder;
using harness::shipped_scene;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

TEST(Plan, NamesWhatIsNeededAndWhyTheRestIsNot) {
  const ScratchFolder folder;
  const ProgramResult table = run_program({"plan", shipped_scene("two_spheres_motor")}, folder);
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_THAT(table.out, HasSubstr("AngularMotor"));
  EXPECT_THAT(table.out, HasSubstr("force                 left out: all forces are constant"));
  const ProgramResult json = run_program({"plan", shipped_scene("two_spheres_motor"), "--json"}, folder);
  report::v1::Plan plan;
  ASSERT_TRUE(JsonStringToMessage(json.out, &plan).ok());
  EXPECT_EQ(plan.slots_size(), 5);
  for (const report::v1::PlannedSlot& slot : plan.slots()) EXPECT_EQ(slot.pid(), 0);
}

// A worker for each slot, one for those that share it, and none for those in the program itself.
TEST(Plan, NamesTheProcessesThatItStarts) {
  const ScratchFolder folder;
  const std::string scene = shipped_scene("two_spheres_motor");
  const auto processes = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"plan", scene, "--json"};
    words.insert(words.end(), more.begin(), more.end());
    report::v1::Plan plan;
    EXPECT_TRUE(JsonStringToMessage(run_program(words, folder).out, &plan).ok());
    std::map<std::string, std::uint32_t> of;
    for (const report::v1::PlannedSlot& slot : plan.slots()) of[slot.slot()] = slot.process();
    return of;
  };
  std::set<std::uint32_t> all;
  for (const auto& [slot, process] : processes({"--hosting", "shm"})) all.insert(process);
  EXPECT_EQ(all, (std::set<std::uint32_t>{1, 2, 3, 4, 5}));
  for (const auto& [slot, process] : processes({"--hosting", "direct"})) EXPECT_EQ(process, 0U) << slot;
  auto shared =
      processes({"--hosting", "shm", "--set", "Plugin.solver.Process=one", "--set", "Plugin.integrator.Process=one"});
  EXPECT_EQ(shared["solver"], shared["integrator"]);
  EXPECT_NE(shared["solver"], shared["collision"]);
  // what is said of a slot counts more than what is said of all
  const ProgramResult table = run_program({"plan", scene, "--hosting", "solver=direct", "--hosting", "shm"}, folder);
  EXPECT_THAT(table.out, ContainsRegex("solver +Sequential +direct +this one\n"));
  EXPECT_THAT(table.out, ContainsRegex("integrator +Euler +shm +worker [1-4]"));
}

TEST(Plugins, ListsThemAsTableAndJson) {
  const ScratchFolder folder;
  const ProgramResult table = run_program({"plugins"}, folder);
  EXPECT_EQ(table.exit_code, 0) << table.err;
  EXPECT_EQ(table.err, "");
  plugin::v1::Catalog catalog;
  ASSERT_TRUE(JsonStringToMessage(run_program({"plugins", "--json"}, folder).out, &catalog).ok());
  EXPECT_GE(catalog.entries_size(), 11);
  for (const plugin::v1::Catalog::Entry& entry : catalog.entries())
    EXPECT_THAT(table.out, HasSubstr(entry.description().name()));
}

TEST(Describe, ShowsPropertiesWithUnitRangeDefaultAndMeaning) {
  const ScratchFolder folder;
  const ProgramResult solver = run_program({"describe", "Sequential"}, folder);
  EXPECT_EQ(solver.exit_code, 0);
  EXPECT_THAT(solver.out, HasSubstr("slot solver"));
  EXPECT_THAT(solver.out, HasSubstr("Iterations"));
  EXPECT_THAT(solver.out, HasSubstr("live: `ctl set` may change it"));
  EXPECT_THAT(run_program({"describe", "Gravity"}, folder).out, ContainsRegex("Acceleration .* required +ctl edit "));
  // a name may stand for several
  google::protobuf::ListValue several;
  ASSERT_TRUE(JsonStringToMessage(run_program({"describe", "Basic", "--json"}, folder).out, &several).ok());
  EXPECT_GT(several.values_size(), 1);
  // a type's name stands for the plugin that serves it, a path for the library
  EXPECT_THAT(run_program({"describe", "Sphere"}, folder).out, HasSubstr("Radius"));
  const ProgramResult library = run_program({"describe", in_build("/lib/gravitas/hello.so"), "--json"}, folder);
  plugin::v1::Description description;
  ASSERT_TRUE(JsonStringToMessage(library.out, &description).ok());
  EXPECT_EQ(description.name(), "Hello");
  EXPECT_EQ(description.types(0).properties(0).unit(), "N");
}

// As the templates of plugins in Python promise.
TEST(Describe, TakesACommand) {
  const ScratchFolder folder;
  const std::string command =
      in_shell(in_build("/bin/gravitas-worker")) + " " + in_shell(in_build("/lib/gravitas/hello.so"));
  const ProgramResult hello = run_program({"describe", command}, folder);
  EXPECT_EQ(hello.exit_code, 0) << hello.err;
  EXPECT_THAT(hello.out, HasSubstr("Hello "));
  EXPECT_THAT(hello.out, HasSubstr("\n  command       " + command + "\n"));
}

TEST(Describe, WhatIsNotInstalledIsAnErrorThatListsWhatIs) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"describe", "Nope"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("installed: "));
  EXPECT_THAT(run_program({"describe", "Sequentail"}, folder).err, HasSubstr("did you mean 'Sequential'? installed: "));
  const ProgramResult file = run_program({"describe", "nope.so"}, folder);
  EXPECT_EQ(file.exit_code, 2);
  EXPECT_THAT(file.err, HasSubstr("'nope.so' is no file that can be read; allowed: a plugin library, a command that"));
  EXPECT_THAT(run_program({"describe", "echo nope"}, folder).err,
              HasSubstr("'echo nope': echo nope --describe wrote no catalogue of 1 plugin"));
  EXPECT_EQ(run_program({"describe"}, folder).exit_code, 2);
}

TEST(Help, OfEverySubcommandHasAnExample) {
  const ScratchFolder folder;
  EXPECT_EQ(run_program({"--help"}, folder).exit_code, 0);
  for (const char* command : {"run", "plan", "plugins", "describe", "new", "check"}) {
    const ProgramResult result = run_program({command, "--help"}, folder);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr(std::string("Example: gravitas ") + command));
  }
}

}  // namespace
}  // namespace gravitas
