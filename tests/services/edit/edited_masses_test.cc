// Edits after which a body has another centre of mass, or other principal axes: its matter, and the points of its joints in it,
// stay where they are and as fast as they are.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/services/edit/edited_run.h"

namespace gravitas::edited {
namespace {

// What bodies become: a box's centre of mass is its middle, a cone's a quarter of its height above its base; Lopsided has most
// of its mass at one end.
std::string scene_of_masses(const std::string& bodies, const std::string& joint) {
  return R"(
Geometries {
  Geometry { Type = "Box" Id = "Plank" CustomProperties { HalfExtents = {0.5, 0.2, 0.1} } }
  Geometry { Type = "Box" Id = "Lead" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} } }
  Geometry { Type = "Cone" Id = "Cone" CustomProperties { Radius = 0.3 Height = 1 } }
  Geometry { Type = "Compound" Id = "Lopsided" CustomProperties { Children =
    {{"Plank", {0, 0, 0}, {1, 0, 0, 0}}, {"Lead", {0.4, 0, 0}, {1, 0, 0, 0}, 20000}} } }
})" + scene(bodies, "Constraints { Constraint { " + joint + " } }\n");
}

std::string plank(const std::string& id, const std::string& kinetic) {
  return "Body { Id = \"" + id + "\" GeometryId = \"Plank\" Mass = 2 KineticProperties { " + kinetic + " } }\n";
}

std::string set_masses(const std::string& property, std::uint32_t step) {
  return "set Body.A." + property + "@step=" + std::to_string(step);
}

const std::vector<std::vector<std::string>> kOtherMasses = {
    {"GeometryId=\"Cone\""},
    {"GeometryId=\"Lopsided\""},
    {"PrincipalMoments={0.1,0.2,0.25}", "PrincipalAxes={0.8,0,0.6,0}"},
    {"PrincipalMoments={0.1,0.2,0.25}", "CentreOfMass={-0.4,0.1,0.05}"}};

// Two bodies that hang together at rest.
TEST(EditedMasses, WhatRestsStays) {
  const std::string ends = "Body1 = \"A\" Body2 = \"B\" CustomProperties { ";
  const std::string turned = "0.7071067811865476, 0, 0.7071067811865476, 0}";
  for (const std::string& joint :
       {"Type = \"Rigid\" " + ends + "BindPoint = {1, 0, 0} }",
        "Type = \"Spherical\" " + ends + "BindPoint = {1, 0, 0} }",
        "Type = \"Revolute\" " + ends + "BindAxisPoint1 = {1, 0, 0} BindAxisPoint2 = {1, 0.6, 0.8} }",
        "Type = \"Slider\" " + ends + "BindPoint = {1, 0, 0} Axis = {0, 1, 0} }",
        "Type = \"Distance\" " + ends + "BindPoint1 = {0.5, 0.2, 0} BindPoint2 = {1.5, 0, 0.1} }"})
    for (const std::vector<std::string>& masses : kOtherMasses) {
      const std::string what = joint + " " + masses.back();
      EditedRun run(scene_of_masses(plank("A", "Orientation = {" + turned) + plank("B", "Position = {2, 0, 0}"),
                                    "Id = \"J\" " + joint),
                    {}, {"Solver=Newton"});
      for (const std::string& one : masses) run.options.edits.push_back(set_masses(one, 11));
      // and another edit after it, of what is bound by then
      run.options.edits.push_back(set_masses("Mass=3", 21));
      run.options.edits.push_back(set_masses(masses[0], 31));
      for (const std::uint32_t steps : {11U, 40U}) {
        run.options.steps = steps;
        std::map<std::string, Row> now = run.end();
        EXPECT_NEAR(now["A"].position.norm(), 0.0, 1e-12) << what;
        EXPECT_NEAR((now["B"].position - Vector3(2, 0, 0)).norm(), 0.0, 1e-12) << what;
        EXPECT_NEAR(std::fabs(now["A"].orientation.y()), std::sqrt(0.5), 1e-12) << what;
        EXPECT_NEAR(std::fabs(now["B"].orientation.w()), 1.0, 1e-12) << what;
      }
    }
}

// A door whose edge is on its hinge: nothing pushes it, so it turns as fast as before. A run that was stopped comes to the same
// bits.
TEST(EditedMasses, ADoorKeepsItsEdgeOnTheHinge) {
  for (const std::vector<std::string>& masses : kOtherMasses) {
    EditedRun run(
        scene_of_masses(
            plank("A", "Position = {0.5, 0, 0} LinearVelocity = {0, 1.5, 0} AngularVelocity = {0, 0, 3}"),
            "Type = \"Revolute\" Id = \"J\" Body2 = \"A\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 "
            "= {0, 0, 1} }"),
        {}, {"Simulator=Smooth", "Solver=Direct", "Integrator=RKMK4"});
    for (const std::string& one : masses) run.options.edits.push_back(set_masses(one, 31));
    const std::string what = masses.back();
    for (const std::uint32_t steps : {31U, 100U}) {
      run.options.steps = steps;
      const Row door = run.end()["A"];
      const double angle = 3 * kStep * steps;
      EXPECT_NEAR((door.orientation * Vector3(-0.5, 0, 0) + door.position).norm(), 0.0, 1e-9) << what;
      EXPECT_NEAR((door.position - 0.5 * Vector3(std::cos(angle), std::sin(angle), 0)).norm(), 0.0, 1e-6) << what;
    }
    const std::string chain = run.run().report.chain_hash();
    for (const std::uint32_t stop : {20U, 50U}) {
      run.options.steps = stop;
      run.options.checkpoint = run.folder.path("checkpoint");
      run.run();
      run.options.steps = 100;
      run.options.resume = std::exchange(run.options.checkpoint, "");
      EXPECT_EQ(run.run().report.chain_hash(), chain) << what << stop;
      run.options.resume.clear();
    }
  }
}

TEST(EditedMasses, AnEditBeforeTheFirstStepIsTheSceneWrittenSo) {
  for (const std::vector<std::string>& masses : kOtherMasses) {
    const std::string text = scene_of_masses(
        plank("A", "Position = {0.3, 0.7, 0.1} Orientation = {0.48, 0.6, 0, 0.64} AngularVelocity = {1, 2, 3}") +
            plank("B", "Position = {2, 0, 0}"),
        "Type = \"Spherical\" Id = \"J\" Body1 = \"A\" Body2 = \"B\" CustomProperties { BindPoint = {1, 0.1, 0.3} }");
    EditedRun edited(text, {}, {"Solver=Newton"}), written(text, {}, {"Solver=Newton"});
    for (const std::string& one : masses) {
      edited.options.edits.push_back(set_masses(one, 1));
      written.options.overrides.push_back("Body.A." + one);
    }
    EXPECT_EQ(edited.run().report.state_hash(), written.run().report.state_hash()) << masses.back();
  }
}

// A body that spins about its standing middle gets a centre of mass 0.4 m beside it: that moves with what was there, v + w x r.
TEST(EditedMasses, TheMatterOfATurningBodyKeepsItsVelocity) {
  EditedRun run(
      scene_of_masses(plank("A", "AngularVelocity = {0, 0, 3}"),
                      "Type = \"Spherical\" Id = \"J\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} }"),
      {"remove Constraint.J@step=1", set_masses("PrincipalMoments={0.1,0.1,0.1}", 11),
       set_masses("CentreOfMass={0.4,0,0}", 11)});
  const double angle = 3 * 10 * kStep;
  const Vector3 arm = 0.4 * Vector3(std::cos(angle), std::sin(angle), 0);
  const Vector3 velocity = Vector3(0, 0, 3).cross(arm);
  run.options.steps = 11;
  EXPECT_NEAR((run.end()["A"].velocity - velocity).norm(), 0.0, 1e-12);
  // what is set as well is of the new centre of mass, and a spin that is set begins there
  run.options.edits.push_back(set_masses("AngularVelocity={0,0,0}", 11));
  EXPECT_NEAR((run.end()["A"].velocity - velocity).norm(), 0.0, 1e-12);
  EXPECT_NEAR((run.end()["A"].position - kStep * velocity).norm(), 0.0, 1e-12);
  run.options.edits.push_back(set_masses("LinearVelocity={0,0,1}", 11));
  EXPECT_EQ(run.end()["A"].velocity, Vector3(0, 0, 1));
}

}  // namespace
}  // namespace gravitas::edited
