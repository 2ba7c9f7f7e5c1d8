// Slots that share a process: what one says of it holds for all, and what cannot be shared is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using kernel::Hosting;
using testing::ElementsAre;
using testing::IsEmpty;

BuiltScene with_plugins(const std::string& plugins) { return build("Environment { }\nPlugins {\n" + plugins + " }"); }

TEST(BuildProcess, SlotsThatNameTheSameShareIt) {
  const BuiltScene built = with_plugins(
      "Plugin { Slot = \"solver\" Process = \"one\" Hosting = \"grpc\" Standby = 2 }\n"
      "Plugin { Slot = \"collision\" Process = \"one\" Deadline = 0.5 }\n"
      "Plugin { Slot = \"space\" Process = \"two\" }");
  EXPECT_THAT(built.errors(), IsEmpty());
  ASSERT_TRUE(built.description.has_value());
  for (const kernel::SlotDescription* slot : {&built.description->solver, &built.description->collision}) {
    EXPECT_EQ(slot->process, "one");
    EXPECT_EQ(slot->hosting, Hosting::kGrpc);
    EXPECT_EQ(slot->standbys, 2U);
    EXPECT_EQ(slot->deadline, 0.5);
  }
  EXPECT_EQ(built.description->space.process, "two");
  EXPECT_EQ(built.description->space.hosting, Hosting::kSharedMemory);
  EXPECT_EQ(built.description->space.standbys, 1U);
  EXPECT_EQ(built.description->integrator.process, "");
}

TEST(BuildProcess, AListOfPluginsIsInOneProcess) {
  const BuiltScene built = with_plugins(
      "Plugin { Slot = \"force\" Name = \"Gravity\" Hosting = \"grpc\" }\n"
      "Plugin { Slot = \"force\" Name = \"Drag\" Process = \"one\" }\n"
      "Plugin { Slot = \"solver\" Process = \"one\" }");
  EXPECT_THAT(built.errors(), IsEmpty());
  ASSERT_TRUE(built.description.has_value());
  EXPECT_EQ(built.description->force.process, "one");
  EXPECT_EQ(built.description->solver.hosting, Hosting::kGrpc);
  EXPECT_THAT(with_plugins("Plugin { Slot = \"force\" Name = \"Gravity\" Process = \"one\" }\n"
                           "Plugin { Slot = \"force\" Name = \"Drag\" Process = \"two\" }")
                  .errors(),
              ElementsAre("scene:4:49: error: Process \"two\" differs from \"one\"; allowed: one for the whole slot "
                          "\"force\""));
}

TEST(BuildProcess, WhatIsSaidOfItMustNotDiffer) {
  EXPECT_THAT(
      with_plugins("Plugin { Slot = \"solver\" Process = \"one\" Deadline = 1 }\n"
                   "Plugin { Slot = \"collision\" Process = \"one\" Deadline = 2 }")
          .errors(),
      ElementsAre("scene:4:56: error: Deadline differs from that at scene:3:1; allowed: one for the whole process "
                  "\"one\""));
  EXPECT_THAT(
      with_plugins("Plugin { Slot = \"solver\" Process = \"one\" Hosting = \"shm\" }\n"
                   "Plugin { Slot = \"collision\" Process = \"one\" Hosting = \"grpc\" }")
          .errors(),
      ElementsAre("scene:4:55: error: Hosting differs from that at scene:3:1; allowed: one for the whole process "
                  "\"one\""));
}

TEST(BuildProcess, IsNeitherTheKernelsNorACommands) {
  EXPECT_THAT(with_plugins("Plugin { Slot = \"solver\" Process = \"one\" Hosting = \"direct\" }").errors(),
              ElementsAre("scene:3:52: error: Hosting \"direct\" of a slot with the Process \"one\"; allowed: \"shm\", "
                          "\"grpc\""));
  EXPECT_THAT(
      with_plugins("Plugin { Slot = \"solver\" Process = \"one\" Address = \"127.0.0.1:1\" }").errors(),
      ElementsAre("scene:3:36: error: Process beside Address, which is a worker of its own; allowed: one of them"));
  // none
  EXPECT_THAT(with_plugins("Plugin { Slot = \"solver\" Process = \"\" Hosting = \"direct\" }").errors(), IsEmpty());
}

}  // namespace
}  // namespace gravitas::scene
