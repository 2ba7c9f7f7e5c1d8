// Plugin libraries that a scene brings along. A shell script stands in for the worker program: it
// describes every library as the one plugin that the test wrote down.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "plugin_sdk/host/description_message.h"
#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

namespace files = std::filesystem;
using testing::ElementsAre;
using testing::IsEmpty;

class BuildLibrary : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = files::temp_directory_path() / ("gravitas_library_" + std::to_string(::getpid()) + '_' +
                                              testing::UnitTest::GetInstance()->current_test_info()->name());
    files::create_directories(folder_ / "scenes");
    files::create_directories(folder_ / "none");
    std::ofstream(folder_ / "scenes" / "own.so") << "no real library";
  }
  void TearDown() override { files::remove_all(folder_); }

  // Builds a scene file beside which "own.so" is the given plugin, the only one there is.
  BuiltScene build_with(Slot slot, const std::string& name, const std::string& text) {
    PluginDeclaration declaration;
    declaration.slot = slot;
    declaration.name = name;
    declaration.version = "1";
    declaration.meaning = "Serves a test.";
    declaration.properties = {Property::number("Strength", "1").defaults_to({1.0}).means("How much.")};
    if (slot == Slot::kForce) declaration.types = {{"Wind", "Blows.", {}}};
    if (slot == Slot::kCollision) declaration.types = {{"Torus", "A ring.", {}}};
    plugin::v1::Catalog answer;
    *answer.add_entries()->mutable_description() = host::to_message(declaration);
    std::ofstream(folder_ / "answer", std::ios::binary) << answer.SerializeAsString();
    std::ofstream(folder_ / "worker") << "#!/bin/sh\ncat '" << (folder_ / "answer").string() << "'\n";
    ::chmod((folder_ / "worker").c_str(), 0755);

    Catalog catalog = Catalog::installed((folder_ / "worker").string(), (folder_ / "none").string());
    const std::vector<std::string> paths = {(folder_ / "scenes" / "scene").string()};
    std::ofstream(paths[0]) << text;
    BuiltScene built;
    built.read.is_good = read_files(paths, built.read.document.get(), &built.read.problems);
    if (built.read.is_good) built.description = scene::build(built.read.scene(), &catalog, &built.read.problems);
    return built;
  }

  std::string own() const { return (folder_ / "scenes" / "own.so").string(); }
  std::string at(const std::string& place) const {
    return (folder_ / "scenes" / "scene").string() + ':' + place + ": ";
  }

  files::path folder_;
};

TEST_F(BuildLibrary, IsFoundBesideTheSceneAndUsed) {
  const BuiltScene built =
      build_with(Slot::kSolver, "Own", "Environment { } Plugins { Plugin { Slot = \"solver\" Library = \"own.so\" } }");
  EXPECT_THAT(built.errors(), IsEmpty());
  ASSERT_TRUE(built.description.has_value());
  ASSERT_EQ(built.description->solver.plugins.size(), 1U);
  EXPECT_EQ(built.description->solver.plugins[0].library, own());
  EXPECT_THAT(built.description->solver.plugins[0].settings, ElementsAre(1));
}

TEST_F(BuildLibrary, ServesTheSlotUnderTheNameThatTheSceneGives) {
  const BuiltScene built =
      build_with(Slot::kSolver, "Own",
                 "Environment { ConstraintSolver { Type = \"Own\" CustomProperties { Strength = 2 } "
                 "} } Plugins { Plugin { Slot = \"solver\" Library = \"own.so\" } }");
  ASSERT_TRUE(built.description.has_value());
  EXPECT_THAT(built.description->solver.plugins[0].settings, ElementsAre(2));
}

TEST_F(BuildLibrary, BringsForcesAndShapes) {
  const BuiltScene wind =
      build_with(Slot::kForce, "Winds",
                 "Forces { Force { Type = \"Wind\" Id = \"W\" } } Environment { } Plugins { Plugin { "
                 "Slot = \"force\" Library = \"own.so\" CustomProperties { Strength = 3 } } }");
  ASSERT_TRUE(wind.description.has_value());
  EXPECT_THAT(wind.description->force.plugins.at(0).settings, ElementsAre(3));
  const BuiltScene torus = build_with(Slot::kCollision, "Round",
                                      "Geometries { Geometry { Type = \"Torus\" Id = \"T\" } } Environment { "
                                      "ConstraintSolver = \"S\" } Plugins { Plugin { Slot = \"collision\" Library = "
                                      "\"own.so\" } }");
  // there is no solver and no space here, but the shape has its plugin
  for (const std::string& error : torus.errors()) EXPECT_THAT(error, testing::Not(testing::HasSubstr("Torus")));
}

TEST_F(BuildLibrary, OfAnotherSlotIsRefused) {
  EXPECT_THAT(build_with(Slot::kForce, "Winds",
                         "Environment { }\nPlugins { Plugin { Slot = \"solver\" Library = \"own.so\" } }")
                  .errors(),
              ElementsAre(at("2:46") + "error: Library \"own.so\" is a plugin for the slot \"force\", not \"solver\""));
}

// One error says it, not one more for each type and name that it would have served.
TEST_F(BuildLibrary, ThatCannotBeUsedIsSaidOnce) {
  EXPECT_THAT(build_with(Slot::kForce, "Winds",
                         "Forces { Force { Type = \"Magnet\" Id = \"W\" } } Environment { }\n"
                         "Plugins { Plugin { Slot = \"force\" Library = \"none.so\" } }")
                  .errors(),
              ElementsAre(testing::StartsWith(at("2:45") + "error: Library \"none.so\" cannot be used: ")));
  EXPECT_THAT(build_with(Slot::kSolver, "Own",
                         "Environment { ConstraintSolver = \"Own\" }\n"
                         "Plugins { Plugin { Slot = \"solver\" Library = \"none.so\" } }")
                  .errors(),
              ElementsAre(testing::StartsWith(at("2:46") + "error: Library \"none.so\" cannot be used: ")));
}

TEST_F(BuildLibrary, OfAnotherNameIsRefused) {
  EXPECT_THAT(build_with(Slot::kForce, "Winds",
                         "Environment { }\nPlugins { Plugin { Slot = \"force\" Name = \"Gale\" Library = "
                         "\"own.so\" } }")
                  .errors(),
              ElementsAre(at("2:42") + "error: Name is \"Gale\"; the plugin there is \"Winds\""));
}

TEST_F(BuildLibrary, ThatNothingUsesIsSaid) {
  EXPECT_THAT(
      build_with(Slot::kForce, "Winds", "Environment { }\nPlugins { Plugin { Slot = \"force\" Library = \"own.so\" } }")
          .warnings(),
      ElementsAre(at("2:45") + "warning: the plugin \"Winds\" of this Library is not used by anything in the scene"));
}

}  // namespace
}  // namespace gravitas::scene
