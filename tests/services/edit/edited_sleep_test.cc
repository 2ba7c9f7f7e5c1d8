// Whom an edit wakes, and who sleeps on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/services/edit/edited_run.h"

namespace gravitas::edited {
namespace {

// A ball that fell asleep on the ground is woken by the edit that takes the ground away, and falls.
TEST(EditedSleep, WhoSleepsWakesUp) {
  EditedRun run(scene("Body { Id = \"Ground\" GeometryId = \"Flat\" }\n" + ball("A", "Position = {0, 0.1, 0}", kFalls) +
                      ball("B", "Position = {3, 0.1, 0}", kFalls)),
                {"remove Body.Ground@step=81"}, {"Simulator.SleepEnergy=0.001", "Simulator.SleepTime=0.5"});
  run.options.events = run.folder.path("events");
  run.options.event_kinds = std::vector<std::string>{"sleep", "edit", "wake"};
  const std::map<std::string, Row> end = run.end();
  for (const char* id : {"A", "B"}) EXPECT_NEAR(end.at(id).velocity.y(), -10 * 20 * kStep, 1e-12);
  std::vector<std::string> kinds;
  std::istringstream text(harness::read_file(run.options.events));
  for (std::string line; std::getline(text, line);) {
    const std::size_t at = line.find("\"kind\":\"") + 8;
    kinds.push_back(line.substr(at, line.find('"', at) - at));
  }
  EXPECT_THAT(kinds, ::testing::ElementsAre("sleep", "sleep", "edit", "wake", "wake"));
}

// Two balls that fell asleep on the ground in one step, and one that flies far from them. What an edit changes wakes, with
// whom it touches and hangs together with; all others sleep on, and those that rest fall asleep when they would have.
TEST(EditedSleep, WhomAnEditDoesNotDisturbSleepsOn) {
  const auto happens = [](const std::vector<std::string>& edits, const std::string& rest = "",
                          const std::string& more = "", const std::string& bodies = "") {
    EditedRun run(scene(bodies + "Body { Id = \"Ground\" GeometryId = \"Flat\" }\n" +
                            ball("A", "Position = {0, 0.1, 0}", kFalls) + ball("B", "Position = {3, 0.1, 0}", kFalls) +
                            ball("Far", "Position = {100, 50, 0} LinearVelocity = {0, 0, 1}"),
                        rest),
                  edits, {"Simulator.SleepEnergy=0.001", "Simulator.SleepTime=0.5"});
    if (!more.empty()) run.options.edits = {"add " + run.folder.write("more.gravitas", more) + "@step=81"};
    run.options.steps = 100;
    run.options.events = run.folder.path("events");
    run.options.event_kinds = std::vector<std::string>{"sleep", "wake"};
    run.run();
    std::vector<std::string> told;
    std::istringstream text(harness::read_file(run.options.events));
    for (std::string line; std::getline(text, line);) {
      const auto after = [&](const std::string& name) {
        const std::size_t at = line.find(name) + name.size();
        return line.substr(at, line.find_first_of("\"],", at) - at);
      };
      told.push_back(after("\"kind\":\"") + " " + after("\"bodies\":[\"") + " " + after("\"step\":"));
    }
    return told;
  };
  using ::testing::ElementsAreArray;
  const std::vector<std::string> quiet = happens({});
  ASSERT_EQ(quiet.size(), 2U);
  const auto and_then = [&](const std::vector<std::string>& woken) {
    std::vector<std::string> all = quiet;
    for (const std::string& body : woken) all.push_back("wake " + body + " 80");
    return all;
  };
  for (const char* step : {"1", "20", "81"})
    for (const char* change : {"Body.Far.LinearVelocity={0,0,2}", "Body.Far.Position={90,50,0}", "Body.Far.Mass=3"})
      EXPECT_THAT(happens({std::string("set ") + change + "@step=" + step}), ElementsAreArray(quiet)) << change << step;
  EXPECT_THAT(happens({"remove Body.Far@step=81"}), ElementsAreArray(quiet));
  EXPECT_THAT(happens({"set Body.A.Mass=2@step=81"}), ElementsAreArray(and_then({"A"})));
  EXPECT_THAT(happens({"remove Body.A@step=81"}), ElementsAreArray(quiet));
  EXPECT_THAT(happens({"set Force.Down.Acceleration={0,-9,0}@step=81"}), ElementsAreArray(and_then({"A", "B"})));
  EXPECT_THAT(happens({"set Material.Rubber.StaticFrictionCoefficient=0.1@step=81"}),
              ElementsAreArray(and_then({"A", "B"})));
  EXPECT_THAT(happens({"set Body.Ground.Material=\"Rubber\"@step=81"}), ElementsAreArray(and_then({"A", "B"})));
  const std::string rope =
      "Constraints { Constraint { Type = \"Distance\" Id = \"Rope\" Body1 = \"A\" Body2 = \"B\" CustomProperties { "
      "BindPoint1 = {0, 0.1, 0} BindPoint2 = {3, 0.1, 0} MaximumDistance = 4 } } }";
  EXPECT_THAT(happens({"set Body.A.Mass=2@step=81"}, rope), ElementsAreArray(and_then({"A", "B"})));
  EXPECT_THAT(happens({"set Constraint.Rope.MaximumDistance=5@step=81"}, rope), ElementsAreArray(and_then({"A", "B"})));
  EXPECT_THAT(happens({"remove Constraint.Rope@step=81"}, rope), ElementsAreArray(and_then({"A", "B"})));
  // no contact is looked for between what stands still: who is where it is put wakes
  const auto wall = [](const std::string& position) {
    return "Bodies { Body { Id = \"Wall\" GeometryId = \"Unit\" Immovable = true KineticProperties { Position = " +
           position + " } } }";
  };
  EXPECT_THAT(happens({}, "", wall("{0.15, 0.1, 0}")), ElementsAreArray(and_then({"A"})));
  EXPECT_THAT(happens({}, "", wall("{3.15, 0.1, 0}")), ElementsAreArray(and_then({"B"})));
  EXPECT_THAT(happens({}, "", wall("{1.5, 40, 0}")), ElementsAreArray(quiet));
  // of one that is there already: whom it touched wakes, and whom it meets
  const std::string beside =
      "Body { Id = \"Wall\" GeometryId = \"Unit\" Immovable = true KineticProperties { Position = ";
  const auto moves = [&](const std::string& from, const std::string& to) {
    return happens({"set Body.Wall.Position=" + to + "@step=81"}, "", "", beside + from + " } }\n");
  };
  EXPECT_THAT(moves("{0.2, 0.1, 0}", "{1.5, 40, 0}"), ElementsAreArray(and_then({"A"})));
  EXPECT_THAT(moves("{1.5, 40, 0}", "{2.85, 0.1, 0}"), ElementsAreArray(and_then({"B"})));
  EXPECT_THAT(moves("{0.2, 0.1, 0}", "{2.85, 0.1, 0}"), ElementsAreArray(and_then({"A", "B"})));
  EXPECT_THAT(moves("{1.5, 40, 0}", "{1.5, 30, 0}"), ElementsAreArray(quiet));
}

// It hangs by a joint from a body that does not move, and falls with it when that may; it rests on a compound, of which a part
// is made smaller.
TEST(EditedSleep, WhatHoldsASleeperWakesItWhenItChanges) {
  const std::vector<std::string> sleep = {"Simulator.SleepEnergy=0.001", "Simulator.SleepTime=0.5"};
  const std::string rope =
      "Constraints { Constraint { Type = \"Spherical\" Id = \"Hang\" Body1 = \"A\" Body2 = \"B\" CustomProperties { "
      "BindPoint = {0, 5, 0} } } }";
  EditedRun hung(
      scene(ball("A", "Position = {0, 5, 0}", kFalls + " Immovable = true") + ball("B", "Position = {0, 4, 0}", kFalls),
            rope),
      {"set Body.A.Immovable=false@step=81"}, sleep);
  const std::map<std::string, Row> end = hung.end();
  for (const char* id : {"A", "B"}) EXPECT_NEAR(end.at(id).velocity.y(), -10 * 20 * kStep, 1e-9) << id;

  EditedRun laid(scene("Body { Id = \"Table\" GeometryId = \"Both\" Immovable = true }\n" +
                       ball("A", "Position = {0, 0.6, 0}", kFalls)),
                 {"set Geometry.Part.HalfExtents={1,0.1,1}@step=81"}, sleep);
  const std::string parts = laid.folder.write(
      "parts.gravitas",
      "Geometries { Geometry { Type = \"Box\" Id = \"Part\" CustomProperties { HalfExtents = {1, 0.5, 1} } }\n"
      "Geometry { Type = \"Compound\" Id = \"Both\" CustomProperties { Children = {{\"Part\", {0, 0, 0}, {1, 0, 0, "
      "0}}} } } }\n");
  laid.options.scenes.push_back(parts);
  EXPECT_NEAR(laid.end().at("A").velocity.y(), -10 * 20 * kStep, 1e-9);
}

// B is held to the ceiling by a spring that A alone lists, and falls when that goes; what is left is gravity.
TEST(EditedSleep, WhoASpringHeldWakesWhenItGoes) {
  EditedRun run(scene("Body { Id = \"Ground\" GeometryId = \"Flat\" }\n"
                      "Body { Id = \"Ceiling\" GeometryId = \"Flat\" KineticProperties { Position = {0, 4.9, 0} "
                      "Orientation = {0, 1, 0, 0} } }\n" +
                      ball("A", "Position = {0, 0.1, 0}", "Forces = { \"Down\", \"Pushes\" }") +
                      ball("B", "Position = {0, 4.8, 0}", kFalls)),
                {"set Body.A.Forces={\"Down\"}@step=81", "remove Force.Pushes@step=81"},
                {"Simulator.SleepEnergy=0.001", "Simulator.SleepTime=0.5"});
  run.options.scenes.push_back(run.folder.write(
      "spring.gravitas",
      "Forces { Force { Type = \"Spring\" Id = \"Pushes\" CustomProperties { Stiffness = 100 RestLength = 6 "
      "AnchorBody = \"B\" } } }"));
  run.options.steps = 100;
  EXPECT_NEAR(run.end().at("B").velocity.y(), -10 * 20 * kStep, 1e-9);
}

}  // namespace
}  // namespace gravitas::edited
