// The grammar: what a scene may say, where, and what its author is told about the rest.
#include "services/scene/reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> read_errors_of(const std::string& text) { return texts(read(text).problems.errors); }
std::vector<std::string> warnings_of(const std::string& text) { return texts(read(text).problems.warnings); }

// A body at line 1; its properties begin at column 41.
std::string read_body(const std::string& properties) {
  return "Environment { Space { Bodies { Body {   " + properties + " } } } }";
}
const v1::Body& first_body(ReadScene& read) { return read.scene().environment(0).space().bodies().body(0); }

// ---- what is taken
// -----------------------------------------------------------------------------------------------

TEST(Reader, TakesAnEmptyScene) {
  ReadScene scene = read("");
  EXPECT_TRUE(scene.is_good);
  EXPECT_EQ(scene.scene().environment_size(), 0);
  EXPECT_EQ(scene.scene().simulator().type(), "Basic");
  EXPECT_EQ(scene.scene().simulator().custom_properties().time_step(), 1.0 / 60.0);
  EXPECT_EQ(scene.scene().simulator().custom_properties().duration(), 10.0);
  EXPECT_EQ(scene.scene().simulator().custom_properties().substeps(), 1U);
}

TEST(Reader, FillsTheDefaultsOfABody) {
  ReadScene scene = read(read_body("Id = \"A\""));
  ASSERT_TRUE(scene.is_good);
  const v1::Body& a = first_body(scene);
  EXPECT_THAT(a.kinetic_properties().position(), ElementsAre(0, 0, 0));
  EXPECT_THAT(a.kinetic_properties().orientation(), ElementsAre(1, 0, 0, 0));
  EXPECT_THAT(a.kinetic_properties().linear_velocity(), ElementsAre(0, 0, 0));
  EXPECT_THAT(a.kinetic_properties().angular_velocity(), ElementsAre(0, 0, 0));
  EXPECT_EQ(a.kinetic_properties().damping_coefficient(), 0.0);
  EXPECT_TRUE(a.kinetic_properties().can_sleep());
  EXPECT_EQ(a.type(), "Rigid");
  EXPECT_FALSE(a.has_mass_density());
  EXPECT_FALSE(a.has_immovable());
}

TEST(Reader, TakesBlocksAndPropertiesInAnyOrder) {
  ReadScene scene = read(
      "Environment{ConstraintSolver=\"LCP\" Space{Bodies{Body{KineticProperties{CanSleep=false "
      "Position={1,2,3}}Id=\"A\"}}Type=\"Grid\"}Id=\"E\"}Materials{Material{Id=\"M\"}}");
  ASSERT_TRUE(scene.is_good);
  EXPECT_EQ(scene.scene().environment(0).id(), "E");
  EXPECT_THAT(first_body(scene).kinetic_properties().position(), ElementsAre(1, 2, 3));
  EXPECT_FALSE(first_body(scene).kinetic_properties().can_sleep());
  EXPECT_EQ(scene.scene().environment(0).constraint_solver().type(), "LCP");
  EXPECT_EQ(scene.scene().environment(0).kinetic_integrator().type(), "SemiImplicitEuler");
}

TEST(Reader, TakesAComponentAsATextOrABlock) {
  ReadScene scene = read("Environment { KineticIntegrator { Type = \"RK4\" CustomProperties { Order = 4 } } }");
  ASSERT_TRUE(scene.is_good);
  const v1::Component& integrator = scene.scene().environment(0).kinetic_integrator();
  EXPECT_EQ(integrator.type(), "RK4");
  ASSERT_EQ(integrator.custom_properties().property_size(), 1);
  EXPECT_EQ(integrator.custom_properties().property(0).value().number(), 4.0);
}

TEST(Reader, KeepsFreePropertiesWithTheirPlaces) {
  ReadScene scene = read(
      "Forces { Force { Type = \"F\" Id = \"f\" CustomProperties {\n  Table = {{0, {1, 2}}, \"x\", "
      "true} } } }");
  ASSERT_TRUE(scene.is_good);
  const v1::Property& table = scene.scene().forces().force(0).custom_properties().property(0);
  EXPECT_EQ(table.name(), "Table");
  EXPECT_EQ(table.location().line(), 2U);
  EXPECT_EQ(table.location().column(), 3U);
  const v1::List& list = table.value().list();
  ASSERT_EQ(list.value_size(), 3);
  EXPECT_EQ(list.value(0).list().value(1).list().value(1).number(), 2.0);
  EXPECT_EQ(list.value(0).list().value(1).list().value(1).column(), 20U);
  EXPECT_EQ(list.value(1).text(), "x");
  EXPECT_TRUE(list.value(2).flag());
}

TEST(Reader, JoinsListsOfElements) {
  ReadScene scene = read("Materials { Material { Id = \"A\" } } Materials { Material { Id = \"B\" } }");
  ASSERT_TRUE(scene.is_good);
  EXPECT_EQ(scene.scene().materials().material_size(), 2);
}

TEST(Reader, AcceptsWhatChangesNoResult) {
  ReadScene scene = read(read_body("Id = \"A\" VisualFile = \"a.obj\" VisualTransform = {{0, 0, 0}, {1, 0, 0, 0}} "
                                   "CollisionGroups = {\"G\"}") +
                         "Plugins { Plugin { Slot = \"solver\" Standby = 2 } }");
  EXPECT_THAT(texts(scene.problems.errors), IsEmpty());
}

// ---- what is refused
// ---------------------------------------------------------------------------------------------

TEST(Reader, SuggestsNamesForUnknownOnes) {
  EXPECT_THAT(read_errors_of("Material { }"),
              ElementsAre("scene:1:1: error: unknown block \"Material\"; it belongs into Materials { … }"));
  EXPECT_THAT(read_errors_of("Environmnt { Nonsense { a = { 1 } } }"),
              ElementsAre("scene:1:1: error: unknown block \"Environmnt\"; did you mean \"Environment\"? Allowed: "
                          "\"Geometries\", \"Materials\", \"Forces\", \"Simulator\", \"Environment\", "
                          "\"Plugins\""));
  EXPECT_THAT(
      read_errors_of("Simulator { CustomProperties { TimeStp = 1 } }"),
      ElementsAre(
          "scene:1:32: error: unknown property \"TimeStp\" in CustomProperties; did you mean "
          "\"TimeStep\"? Allowed: \"TimeStep\", \"Duration\", \"Substeps\", \"Accuracy\", \"CheckPhysicsEvery\", "
          "\"SleepEnergy\", \"SleepTime\""));
}

TEST(Reader, SaysWhereANameBelongs) {
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" Position = {0, 0, 0}")),
              ElementsAre("scene:1:50: error: unknown property \"Position\" in Body; it belongs into "
                          "KineticProperties { … }"));
  EXPECT_THAT(read_errors_of("Geometries { Geometry { Type = \"Sphere\" Id = \"A\" Radius = 1 } }"),
              ElementsAre("scene:1:50: error: unknown property \"Radius\" in Geometry; allowed: \"Type\", \"Id\", "
                          "\"CustomProperties\"; properties of its type go into CustomProperties { … }"));
}

TEST(Reader, IsCaseSensitive) {
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" massdensity = 1")),
              ElementsAre(testing::StartsWith("scene:1:50: error: unknown property \"massdensity\" in Body; did you "
                                              "mean \"MassDensity\"? Allowed: ")));
}

TEST(Reader, RefusesWrongKindsOfValues) {
  EXPECT_THAT(read_errors_of(read_body("Id = 1")),
              ElementsAre("scene:1:46: error: Id is 1; allowed: a text in double quotes"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" MassDensity = \"heavy\"")),
              ElementsAre("scene:1:64: error: MassDensity is \"heavy\"; allowed: a number >= 0"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" Immovable = 1")),
              ElementsAre("scene:1:62: error: Immovable is 1; allowed: true or false"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" Forces = \"G\"")),
              ElementsAre("scene:1:59: error: Forces is \"G\"; allowed: a list of texts, { \"…\" }"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" Forces = {\"G\", 2}")),
              ElementsAre("scene:1:65: error: an element of Forces is 2; allowed: texts in double quotes"));
  EXPECT_THAT(read_errors_of("Environment { ConstraintSolver = 1 }"),
              ElementsAre("scene:1:34: error: ConstraintSolver is 1; allowed: a text in double "
                          "quotes, or a block { … }"));
}

TEST(Reader, RefusesPropertiesAsBlocksAndBlocksAsProperties) {
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" MassDensity { }")),
              ElementsAre("scene:1:50: error: MassDensity is a property, no block; allowed: MassDensity = value"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" KineticProperties = { }")),
              ElementsAre("scene:1:50: error: KineticProperties is a block, no property; allowed: "
                          "KineticProperties "
                          "{ … }"));
}

TEST(Reader, RefusesValuesOutOfRange) {
  const auto kinetic = [](const std::string& text) {
    return read_body("Id = \"A\" KineticProperties { " + text + " }");
  };
  EXPECT_THAT(read_errors_of(kinetic("Position = {0, 2e15, 0}")),
              ElementsAre("scene:1:85: error: an element of Position is 2e+15; allowed: a list of "
                          "3 numbers, each in "
                          "[-1e+15, 1e+15]"));
  EXPECT_THAT(read_errors_of(kinetic("Position = {0, 1e15, 0}")), IsEmpty());
  EXPECT_THAT(read_errors_of(kinetic("Position = {0, 1}")),
              ElementsAre("scene:1:81: error: Position is a list of 2; allowed: a list of 3 "
                          "numbers, each in [-1e+15, "
                          "1e+15]"));
  EXPECT_THAT(read_errors_of(kinetic("DampingCoefficient = -1")),
              ElementsAre("scene:1:91: error: DampingCoefficient is -1; allowed: a number >= 0"));
  EXPECT_THAT(read_errors_of("Simulator { CustomProperties { TimeStep = 0 Duration = -1 Substeps = 1.5 } }"),
              ElementsAre("scene:1:43: error: TimeStep is 0; allowed: a number > 0",
                          "scene:1:56: error: Duration is -1; allowed: a number >= 0",
                          "scene:1:70: error: Substeps is 1.5; allowed: a whole number in [1, 4294967295]"));
  EXPECT_THAT(read_errors_of("Materials { Material { Id = \"M\" RestitutionCoefficient = 1.1 } }"),
              ElementsAre("scene:1:58: error: RestitutionCoefficient is 1.1; allowed: a number in [0, 1]"));
}

TEST(Reader, RefusesUnknownChoices) {
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" BoundingVolumeType = \"Spere\"")),
              ElementsAre("scene:1:71: error: BoundingVolumeType is \"Spere\"; did you mean \"Sphere\"? Allowed: "
                          "\"None\", \"Sphere\", \"AxisAlignedBox\", \"OrientedBox\""));
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\" Type = \"Soft\"")),
              ElementsAre("scene:1:57: error: Type is \"Soft\"; allowed: \"Rigid\""));
}

TEST(Reader, NormalisesOrientationsWithinATolerance) {
  const auto turned = [](const char* q) {
    return read_body("Id = \"A\" KineticProperties { Orientation = " + std::string(q) + " }");
  };
  EXPECT_THAT(warnings_of(turned("{0.7071, 0.7071, 0, 0}")),
              ElementsAre("scene:1:84: warning: Orientation has the norm 0.9999904099540154 and was normalised"));
  EXPECT_THAT(read_errors_of(turned("{1, 1, 0, 0}")),
              ElementsAre("scene:1:84: error: Orientation has the norm 1.4142135623730951; "
                          "allowed: a list of 4 numbers "
                          "(w, x, y, z) with norm 1 (within 1e-3)"));
}

TEST(Reader, RefusesNamesGivenTwice) {
  EXPECT_THAT(read_errors_of(read_body("Id = \"A\"\nId = \"B\"")),
              ElementsAre("scene:2:1: error: Id is given twice, first at scene:1:46; allowed: once"));
  EXPECT_THAT(read_errors_of("Simulator { }\nSimulator { }"),
              ElementsAre("scene:2:1: error: Simulator is given twice, first at scene:1:1; allowed: once"));
  EXPECT_THAT(read_errors_of("Forces { Force { Type = \"F\" Id = \"f\" CustomProperties { A = 1\nA = 2 } } }"),
              ElementsAre("scene:2:1: error: A is given twice, first at scene:1:57; allowed: once"));
  EXPECT_THAT(read_errors_of("Environment { ConstraintSolver = \"A\"\nConstraintSolver { Type = \"B\" } }"),
              ElementsAre("scene:2:1: error: ConstraintSolver is given twice, first at scene:1:15; allowed: once"));
}

TEST(Reader, RefusesMissingNames) {
  EXPECT_THAT(read_errors_of("Geometries {\n Geometry { } }"),
              ElementsAre("scene:2:2: error: Geometry without Id; required: a text",
                          "scene:2:2: error: Geometry without Type; required: a text"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"\"")),
              ElementsAre("scene:1:46: error: Id is empty; required: a text of at least one character"));
  EXPECT_THAT(read_errors_of("Environment { KineticIntegrator { } }"),
              ElementsAre("scene:1:15: error: KineticIntegrator without Type; required: a text"));
}

TEST(Reader, TrimsBlanksAroundIds) {
  ReadScene scene = read(read_body("Id = \" Ball01\" GeometryId = \" Unit Sphere \" Forces = {\"G \"}"));
  ASSERT_TRUE(scene.is_good);
  EXPECT_EQ(first_body(scene).id(), "Ball01");
  EXPECT_EQ(first_body(scene).geometry_id(), "Unit Sphere");
  EXPECT_EQ(first_body(scene).forces(0), "G");
  EXPECT_THAT(texts(scene.problems.warnings),
              ElementsAre("scene:1:46: warning: Id is \" Ball01\"; the blanks around \"Ball01\" are dropped",
                          "scene:1:69: warning: GeometryId is \" Unit Sphere \"; the blanks around \"Unit Sphere\" "
                          "are "
                          "dropped",
                          "scene:1:95: warning: Forces is \"G \"; the blanks around \"G\" are dropped"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"  \"")),
              ElementsAre("scene:1:46: error: Id is empty; required: a text of at least one character"));
  EXPECT_THAT(read_errors_of(read_body("Id = \"a\\nb\"")),
              ElementsAre("scene:1:46: error: Id holds a tab, a line end or the like; allowed: "
                          "visible characters and "
                          "blanks inside"));
}

// ---- syntax
// ------------------------------------------------------------------------------------------------------

TEST(Reader, RefusesBadLists) {
  const auto forces = [](const char* list) { return read_body("Id = \"A\" Forces = " + std::string(list)); };
  EXPECT_THAT(read_errors_of(forces("{\"a\" \"b\"}")),
              ElementsAre("scene:1:64: error: a list goes on with the text \"b\"; allowed: a comma and the next "
                          "element, or \"}\""));
  EXPECT_THAT(read_errors_of(forces("{\"a\",}")),
              ElementsAre("scene:1:64: error: an element is missing after the comma; allowed: a value"));
  EXPECT_THAT(read_errors_of(forces("{,}")), ElementsAre("scene:1:60: error: a value was expected, not "
                                                         "a comma; allowed: a number, a text in double "
                                                         "quotes, true, false, a list { v, v }"));
  EXPECT_THAT(read_errors_of(forces("nan")),
              ElementsAre("scene:1:59: error: a value was expected, not the word \"nan\"; allowed: "
                          "a number, a text in "
                          "double quotes, true, false, a list { v, v }"));
}

TEST(Reader, RefusesUnbalancedBraces) {
  EXPECT_THAT(read_errors_of("Environment {\n Space {\n"),
              ElementsAre("scene:3:1: error: the file ends inside the block Space opened in line "
                          "2; a \"}\" is missing"));
  EXPECT_THAT(read_errors_of("Environment { } }"),
              ElementsAre("scene:1:17: error: a \"}\" that closes nothing; allowed: Name { … }"));
  EXPECT_THAT(read_errors_of("Forces { Force { CustomProperties {"),
              ElementsAre("scene:1:36: error: the file ends inside the block CustomProperties opened in line 1; a "
                          "\"}\" is missing"));
  EXPECT_THAT(read_errors_of("Bogus {\n"),
              ElementsAre(testing::HasSubstr("unknown block \"Bogus\""),
                          "scene:2:1: error: the file ends inside the block opened in line 1; a \"}\" is missing"));
}

TEST(Reader, RefusesOtherSyntax) {
  EXPECT_THAT(read_errors_of("Environment ="),
              ElementsAre("scene:1:1: error: Environment is a block, no property; allowed: Environment { … }",
                          "scene:1:14: error: a value was expected, not the end of the file; allowed: a number, a "
                          "text "
                          "in double quotes, true, false, a list { v, v }"));
  EXPECT_THAT(read_errors_of("Environment Id"),
              ElementsAre("scene:1:13: error: \"Environment\" is followed by the word \"Id\"; "
                          "allowed: \"=\" or \"{\""));
  EXPECT_THAT(read_errors_of("Environment { 1 }"),
              ElementsAre("scene:1:15: error: a name was expected, not the number 1; allowed: Name "
                          "= value, Name { … }, "
                          "or \"}\""));
  EXPECT_THAT(read_errors_of("Forces { Force { CustomProperties { A { } } } }"),
              ElementsAre("scene:1:39: error: \"A\" is followed by \"{\"; allowed inside "
                          "CustomProperties: \"=\" and a "
                          "value"));
}

TEST(Reader, RefusesDeepNesting) {
  std::string blocks, lists = "Forces { Force { Type = \"F\" Id = \"f\" CustomProperties { A = ";
  for (int i = 0; i < 100000; ++i) blocks += "B { ", lists += '{';
  EXPECT_THAT(read_errors_of(blocks),
              ElementsAre(testing::HasSubstr("unknown block \"B\""),
                          "scene:1:259: error: braces are nested too deep; allowed: 64 levels"));
  EXPECT_THAT(read_errors_of(lists), ElementsAre("scene:1:122: error: braces are nested too deep; allowed: 64 levels"));
}

TEST(Reader, TakesNestingUpToTheLimit) {
  // three blocks around 61 lists
  const std::string text = "Forces { Force { Type = \"F\" Id = \"f\" CustomProperties { A = " + std::string(61, '{') +
                           std::string(61, '}') + " } } }";
  EXPECT_THAT(read_errors_of(text), IsEmpty());
}

TEST(Reader, ReportsSeveralErrorsUpToALimit) {
  std::string text;
  for (int i = 0; i < 100; ++i) text += "Bogus { }\n";
  const std::vector<std::string> errors = read_errors_of(text);
  ASSERT_EQ(errors.size(), 20U);
  EXPECT_THAT(errors[18], Not(HasSubstr("no more are looked for")));
  EXPECT_THAT(errors[19], HasSubstr("(after 20 errors no more are looked for)"));
  text.clear();
  for (int i = 0; i < 50; ++i) text += "Body { Id = \" b" + std::to_string(i) + "\" }\n";
  const std::vector<std::string> warnings = warnings_of("Environment { Space { Bodies {\n" + text + "} } }");
  ASSERT_EQ(warnings.size(), 21U);
  EXPECT_EQ(warnings.back(), "scene:51:13: warning: 30 more warnings, the last one here");
}

// ---- files
// -------------------------------------------------------------------------------------------------------

class ReaderFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("gravitas_reader_" + std::to_string(::getpid()) + '_' +
                                                        testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return (folder_ / name).string();
  }

  std::filesystem::path folder_;
};

TEST_F(ReaderFiles, AreReadAsOneScene) {
  const std::vector<std::string> paths = {write("a", "Materials { Material { Id = \"A\" } }"),
                                          write("b", "Environment { }\nMaterials { Material { Id = \"B\" } }")};
  SceneDocument document;
  Problems problems;
  ASSERT_TRUE(read_files(paths, &document, &problems));
  ASSERT_EQ(document.scene().materials().material_size(), 2);
  EXPECT_EQ(document.scene().materials().material(1).location().file(), 1U);
  EXPECT_EQ(document.scene().environment_size(), 1);
}

TEST_F(ReaderFiles, ErrorsNameTheirFiles) {
  const std::vector<std::string> paths = {write("a", "Simulator { }"), write("b", "\nSimulator { }")};
  SceneDocument document;
  Problems problems;
  EXPECT_FALSE(read_files(paths, &document, &problems));
  EXPECT_THAT(texts(problems.errors), ElementsAre(paths[1] + ":2:1: error: Simulator is given twice, first at " +
                                                  paths[0] + ":1:1; allowed: once"));
}

TEST_F(ReaderFiles, ThatCannotBeReadAreErrors) {
  const std::vector<std::string> paths = {(folder_ / "none").string(), folder_.string()};
  SceneDocument document;
  Problems problems;
  EXPECT_FALSE(read_files(paths, &document, &problems));
  EXPECT_THAT(texts(problems.errors),
              ElementsAre(paths[0] + ":1:1: error: cannot be read: No such file or directory; a scene is a readable "
                                     "text file",
                          paths[1] + ":1:1: error: cannot be read: it is a folder; a scene is a readable text file"));
}

// `--set Body.Ball.Position={0,1,0}` without quotes is three words, of which two are taken for scenes.
TEST_F(ReaderFiles, ThatAreLeftOfAnOverrideAreToldAsThat) {
  for (const std::string word : {"Body.Ball.Position=1", "1,", "0}"}) {
    SceneDocument document;
    Problems problems;
    EXPECT_FALSE(read_files(std::vector{word}, &document, &problems));
    EXPECT_THAT(texts(problems.errors),
                ElementsAre(testing::EndsWith("a --set with braces is quoted, or the shell splits it: --set "
                                              "'Body.Ball.Position={0,1,0}'")));
  }
}

}  // namespace
}  // namespace gravitas::scene
