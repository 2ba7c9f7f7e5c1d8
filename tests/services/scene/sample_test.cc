// Whole scenes: the shipped sample, a very large one, and a great many broken ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/paths.h"
#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const std::string kSample = in_source("/deploy/scenes/two_spheres_motor.gravitas");

std::string sample_text() {
  std::ifstream file(kSample, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Sample, IsTheSeedsScene) {
  const BuiltScene built = build(sample_text());
  ASSERT_THAT(built.errors(), IsEmpty());
  ASSERT_TRUE(built.description.has_value());
  const kernel::EnvironmentDescription& scene = *built.description;
  EXPECT_EQ(scene.validate(), "");
  EXPECT_EQ(scene.id, "DefaultEnvironment");
  EXPECT_EQ(scene.steps, 600U);
  ASSERT_EQ(scene.bodies.size(), 3U);
  EXPECT_EQ(scene.bodies[0].flags, kUnbounded | kHasShape);
  EXPECT_EQ(scene.bodies[1].flags, kMovable | kHasShape | kCanSleep);
  EXPECT_EQ(scene.bodies[1].pose.position, Vector3(0, 1, 0));
  EXPECT_EQ(scene.bodies[2].pose.position, Vector3(0, 3, 0));
  EXPECT_EQ(scene.bodies[1].damping, 0.1);
  // a ball of radius 0.5 and density 1000: 500/3 pi
  EXPECT_NEAR(scene.bodies[1].mass, 523.59877559829887, 1e-12);
  EXPECT_THAT(scene.bodies[1].forces, ElementsAre(0));
  EXPECT_THAT(scene.forces[0].parameters, ElementsAre(0, -5, 0));
  EXPECT_EQ(scene.constraints[0].body1, 1U);
  EXPECT_EQ(scene.constraints[0].body2, 2U);
  EXPECT_EQ(scene.constraints[0].parameters[6], 3.1412);
  EXPECT_EQ(scene.constraints[0].breaking_threshold, 100.0);
  EXPECT_EQ(scene.integrator.plugins[0].declaration.name, "Euler");
  // ground against plastic: mean restitution 0.25, summed perturbation 0.2
  EXPECT_DOUBLE_EQ(scene.material_pairs[6], 0.25);
  EXPECT_DOUBLE_EQ(scene.material_pairs[6 + 5], 0.2);
  EXPECT_EQ(built.warnings().size(), 2U);
}

TEST(Sample, EveryPrefixIsReadOrRefused) {
  const std::string text = sample_text();
  std::size_t good = 0;
  for (std::size_t size = 0; size < text.size(); ++size) {
    const BuiltScene built = build(text.substr(0, size));
    good += built.description.has_value() ? 1 : 0;
    // what is not built has an error that stands inside the text
    ASSERT_EQ(built.description.has_value(), built.errors().empty()) << size;
    for (const SceneError& error : built.read.problems.errors) {
      ASSERT_GE(error.line, 1);
      ASSERT_GE(error.column, 1);
      ASSERT_FALSE(error.text.empty());
    }
  }
  // a scene without its last brace is no scene; only the final line end may go
  EXPECT_LE(good, 1U);
}

TEST(Sample, NoMutationCrashes) {
  const std::string text = sample_text();
  std::mt19937_64 random(20240607);
  const std::string pieces[] = {"{",
                                "}",
                                "=",
                                ",",
                                "\"",
                                "\\",
                                "/*",
                                "*/",
                                "//",
                                "#",
                                "\n",
                                "-",
                                "1e9",
                                "1e999",
                                "nan",
                                "0",
                                "{}",
                                "{{{{",
                                "\0 ",
                                "true",
                                "Id",
                                "\xEF\xBB\xBF",
                                "\xFF",
                                " Mass = 1 ",
                                " Immovable = true ",
                                " Kinematic = true ",
                                " Type = \"Box\" "};
  std::size_t refused = 0;
  for (int i = 0; i < 4000; ++i) {
    std::string mutated = text;
    for (std::uint64_t changes = 1 + random() % 4; changes > 0; --changes) {
      const std::size_t at = random() % mutated.size();
      const std::string& piece = pieces[random() % std::size(pieces)];
      switch (random() % 4) {
        case 0:
          mutated.insert(at, piece);
          break;
        case 1:
          mutated.erase(at, 1 + random() % 20);
          break;
        case 2:
          mutated.replace(at, std::min(piece.size(), mutated.size() - at), piece);
          break;
        default:
          mutated[at] = static_cast<char>(random() % 256);
          break;
      }
    }
    const BuiltScene built = build(mutated);
    ASSERT_EQ(built.description.has_value(), built.errors().empty()) << mutated;
    if (built.description.has_value()) {
      ASSERT_EQ(built.description->validate(), "") << mutated;
    } else {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000U);
}

TEST(Sample, NoMutatedOverrideCrashes) {
  const std::string text = sample_text();
  const std::string good[] = {
      "Solver.Iterations=50",     "Body.Ball01.LinearVelocity={1,0,0}",       "Space=KDTree",
      "Simulator.TimeStep=0.001", "Constraint.MyAngularMotor.AngularSpeed=2", "Plugin.solver.Deadline=1"};
  const std::string characters = "{}=.,\"\\#/ -+eABab01\n\xC3";
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    std::string mutated = good[random() % std::size(good)];
    for (std::uint64_t changes = random() % 3; changes > 0; --changes)
      mutated[random() % mutated.size()] = characters[random() % characters.size()];
    const BuiltScene built = build(text, {mutated});
    ASSERT_EQ(built.description.has_value(), built.errors().empty()) << mutated;
  }
}

TEST(Sample, AMillionLinesAreRead) {
  constexpr int kBodies = 90909;
  std::string text =
      "Geometries { Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = 0.5 } } }\n"
      "Environment { Space { Bodies {\n";
  for (int i = 0; i < kBodies; ++i) {
    const std::string number = std::to_string(i);
    text += "Body {\nType = \"Rigid\"\nId = \"Ball" + number + "\"\nGeometryId = \"S\"\nMassDensity = 1000.0\n" +
            "KineticProperties {\nPosition = {" + number + ".5, 0, -" + number + "}\nOrientation = {1, 0, 0, 0}\n" +
            "LinearVelocity = {0, 0, 1}\nCanSleep = false }\n}\n";
  }
  text += "} } }\n";
  const BuiltScene built = build(text);
  ASSERT_THAT(built.errors(), IsEmpty());
  ASSERT_EQ(built.description->bodies.size(), static_cast<std::size_t>(kBodies));
  const kernel::BodyDescription& last = built.description->bodies.back();
  EXPECT_EQ(last.id, "Ball90908");
  EXPECT_EQ(last.pose.position, Vector3(90908.5, 0, -90908));
  EXPECT_EQ(last.flags, kMovable | kHasShape);
  // the place of the last body: two lines of head, eleven per body
  const v1::Bodies& bodies = built.read.document->scene().environment(0).space().bodies();
  EXPECT_EQ(bodies.body(kBodies - 1).location().line(), 3U + 11U * (kBodies - 1));
}

}  // namespace
}  // namespace gravitas::scene
