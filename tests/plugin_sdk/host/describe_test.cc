// Libraries described in a process of their own: one that crashes or hangs while it is loaded is
// described as such, and the others are still described.
#include "plugin_sdk/host/describe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <vector>

#include "plugin_sdk/channel/private_folder.h"
#include "plugin_sdk/host/description_message.h"
#include "schemas/stage_frames.h"
#include "tests/paths.h"

namespace gravitas::host {
namespace {

using testing::HasSubstr;

// Far more than a library takes to load, even under a sanitizer on a busy machine.
constexpr double kLongSeconds = 30.0;

std::string good(const std::string& name) { return in_build("/lib/gravitas/") + name + ".so"; }
std::string faulty(const std::string& name) { return in_build("/lib/gravitas-faulty/") + name + ".so"; }

TEST(DescribeLibraries, DescribesEachInOrder) {
  const std::vector<std::string> libraries = {good("hello"), good("integrator_euler"), good("space_grid")};
  const plugin::v1::Catalog catalog = describe_libraries(libraries, kLongSeconds);
  ASSERT_EQ(catalog.entries_size(), 3);
  const std::vector<std::string> names = {"Hello", "Euler", "Grid"};
  for (int i = 0; i < 3; ++i) {
    const auto& entry = catalog.entries(i);
    const auto index = static_cast<std::size_t>(i);
    EXPECT_EQ(entry.library(), libraries[index]);
    EXPECT_EQ(entry.problem(), "");
    EXPECT_EQ(entry.description().name(), names[index]);
    EXPECT_EQ(entry.description().build_id(), GRAVITAS_BUILD_ID);
  }
  EXPECT_EQ(from_message(catalog.entries(1).description()).slot, Slot::kIntegrator);
  EXPECT_EQ(catalog.entries(1).description().theta(), 0.0);
  EXPECT_EQ(catalog.entries(2).description().properties(0).name(), "CellSize");
}

TEST(DescribeLibraries, NoLibrariesGiveNoEntries) { EXPECT_EQ(describe_libraries({}, kLongSeconds).entries_size(), 0); }

TEST(DescribeLibraries, SaysWhyALibraryIsNoPlugin) {
  const std::vector<std::string> libraries = {"/no/such/library.so", faulty("wrong_schema_hash"), good("hello")};
  const plugin::v1::Catalog catalog = describe_libraries(libraries, kLongSeconds);
  ASSERT_EQ(catalog.entries_size(), 3);
  EXPECT_EQ(catalog.entries(0).problem(), "cannot read '/no/such/library.so': No such file or directory");
  EXPECT_FALSE(catalog.entries(0).has_description());
  EXPECT_THAT(catalog.entries(1).problem(), HasSubstr("another schema"));
  EXPECT_EQ(catalog.entries(2).description().name(), "Hello");
}

TEST(DescribeLibraries, ALibraryThatCrashesHurtsNoOther) {
  const std::string crashing = faulty("crash_on_load");
  const plugin::v1::Catalog catalog =
      describe_libraries({good("hello"), crashing, crashing, good("space_basic")}, kLongSeconds);
  ASSERT_EQ(catalog.entries_size(), 4);
  EXPECT_EQ(catalog.entries(0).description().name(), "Hello");
  for (const int i : {1, 2}) {
    EXPECT_EQ(catalog.entries(i).library(), crashing);
    EXPECT_EQ(catalog.entries(i).problem(),
              "'" + crashing + "' ended with signal Segmentation fault while it was loaded");
    EXPECT_FALSE(catalog.entries(i).has_description());
  }
  EXPECT_EQ(catalog.entries(3).description().name(), "Basic");
  EXPECT_EQ(catalog.entries(3).problem(), "");
}

TEST(DescribeLibraries, ALibraryThatHangsHoldsNoOtherUp) {
  const std::string hanging = faulty("hang_on_load");
  // the time is per library, so the good ones need enough of it too
  const plugin::v1::Catalog catalog = describe_libraries({good("hello"), hanging, good("space_basic")}, 2.0);
  ASSERT_EQ(catalog.entries_size(), 3);
  EXPECT_EQ(catalog.entries(0).description().name(), "Hello");
  EXPECT_EQ(catalog.entries(1).problem(), "'" + hanging + "' was not ready in time while it was loaded");
  EXPECT_EQ(catalog.entries(2).description().name(), "Basic");
}

// What describes them is a message, which takes UTF-8 only.
TEST(DescribeLibraries, OneInAFolderWhoseNameIsNoUtf8HurtsNoOther) {
  const channel::PrivateFolder place;
  const std::string folder = place.path() + "/pl\xfcgins";
  std::filesystem::create_directory(folder);
  std::filesystem::copy_file(good("hello"), folder + "/hello.so");
  const plugin::v1::Catalog made =
      describe_libraries({folder + "/hello.so", folder + "/no.so", good("space_basic")}, kLongSeconds);
  plugin::v1::Catalog catalog;
  ASSERT_TRUE(catalog.ParseFromString(made.SerializeAsString()));
  ASSERT_EQ(catalog.entries_size(), 3);
  EXPECT_EQ(catalog.entries(0).library(), place.path() + "/pl?gins/hello.so");
  EXPECT_EQ(catalog.entries(0).problem(), "");
  EXPECT_EQ(catalog.entries(0).description().name(), "Hello");
  EXPECT_THAT(catalog.entries(1).problem(), HasSubstr("/pl?gins/no.so"));
  EXPECT_EQ(catalog.entries(2).description().name(), "Basic");
}

TEST(DescribeLibraries, LeavesNoChildBehind) {
  EXPECT_EQ(describe_libraries({faulty("crash_on_load"), good("hello")}, kLongSeconds).entries_size(), 2);
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

}  // namespace
}  // namespace gravitas::host
