// A house of seven cards: nothing but friction at edges holds it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using harness::turned;

constexpr double kThickness = 0.002, kCardHeight = 0.09, kWidth = 0.06;  // of a card, m
const double kLean = kPi / 9.0;                                          // from the vertical, rad

std::string card(const std::string& id, const std::string& shape, const Vector3& at, double lean) {
  return "Body { Id = \"" + id + "\" GeometryId = \"" + shape +
         "\" Material = \"Paper\" Mass = 0.002 KineticProperties { Position = " + literal(at) +
         " Orientation = " + literal(turned(Vector3::UnitZ(), lean)) + " } Forces = { \"Down\" } }\n";
}

std::string box(const std::string& id, const Vector3& half) {
  return "Geometry { Type = \"Box\" Id = \"" + id + "\" CustomProperties { HalfExtents = " + literal(half) + " } }\n";
}

// Two cards that lean on each other, on a shelf that lies on two such pairs.
std::string house() {
  const double c = std::cos(kLean), s = std::sin(kLean);
  const double rise = 0.5 * (kThickness * s + kCardHeight * c), reach = 0.5 * (kThickness * c + kCardHeight * s);
  const auto pair = [&](const std::string& id, double x, double y) {
    return card(id + "1", "Card", {x - reach, y + rise, 0}, -kLean) +
           card(id + "2", "Card", {x + reach, y + rise, 0}, kLean);
  };
  const double apart = kCardHeight * s + 0.004;
  return "Geometries { " + box("Card", {0.5 * kThickness, 0.5 * kCardHeight, 0.5 * kWidth}) +
         box("Shelf", {0.06, 0.5 * kThickness, 0.5 * kWidth}) +
         "Geometry { Type = \"Halfspace\" Id = \"Floor\" } }\n"
         "Materials { Material { Id = \"Paper\" StaticFrictionCoefficient = 0.6 } }\n"
         "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { CustomProperties { TimeStep = 0.016666666666666666 Duration = 60 SleepEnergy = 0 } }\n"
         "Environment { Space { Bodies { Body { Id = \"Ground\" GeometryId = \"Floor\" Material = \"Paper\" Immovable "
         "= true }\n" +
         pair("Left", -apart, 0) + pair("Right", apart, 0) +
         card("Shelf", "Shelf", {0, 2.0 * rise + 0.5 * kThickness, 0}, 0.0) + pair("Top", 0, 2.0 * rise + kThickness) +
         "} } }\n";
}

TEST(CardHouse, StandsForAMinute) {
  for (const auto& [solver, most] : std::map<std::string, double>{{"Newton", 1e-12}, {"Sequential", 1e-5}}) {
    SceneRun run(house(), {set("Solver", solver)});
    std::map<std::string, Vector3> start;
    for (const std::string& id : run.movable_bodies()) start[id] = run.body(id).pose.position;
    ASSERT_EQ(start.size(), 7U);
    run.to_end();
    for (const auto& [id, at] : start) EXPECT_LE((run.body(id).pose.position - at).norm(), most) << solver << " " << id;
    EXPECT_LE(run.report().max_penetration(), 1e-10) << solver;
  }
}

// It is friction that holds it: with less than tan(lean)/2 it slides apart.
TEST(CardHouse, FallsWhereItsEdgesSlide) {
  SceneRun run(house(), {set("Solver", std::string("Newton")), set("Material.Paper.StaticFrictionCoefficient", 0.1),
                         set("Simulator.Duration", 1.0)});
  run.to_end();
  EXPECT_LT(run.body("Shelf").pose.position.y(), 0.5 * kCardHeight);
}

}  // namespace
}  // namespace gravitas
