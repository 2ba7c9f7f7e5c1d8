// Mechanisms in places where their joints' rows depend on each other and from which no motion leads: velocities are allowed
// there that go nowhere. They stand still, whatever pulls at them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

constexpr double kBar = 0.4;  // m
const char* const kLockedIntegrators[] = {"SemiImplicitEuler",  "Verlet",           "RK4",   "DormandPrince54",
                                          "DormandPrince853",   "ImplicitMidpoint", "Radau", "RKMK4",
                                          "SymplecticSplitting"};

std::string bar(const std::string& id, const Vector3& position, double spin, const Vector3& velocity) {
  return "Body { Id = \"" + id + R"(" Mass = 1 PrincipalMoments = {0.001, 0.014, 0.014} Forces = { "Down" })" +
         " KineticProperties { Position = " + literal(position) + " LinearVelocity = " + literal(velocity) +
         " AngularVelocity = {0, 0, " + literal(spin) + "} } }\n";
}

std::string connection(const std::string& type, const std::string& id, const std::string& one, const std::string& two,
                       const std::string& properties) {
  return "Constraint { Type = \"" + type + "\" Id = \"" + id + "\"" + (one.empty() ? "" : " Body1 = \"" + one + "\"") +
         " Body2 = \"" + two + "\" CustomProperties { " + properties + " } }\n";
}

std::string hinged(const std::string& id, const std::string& one, const std::string& two, double x,
                   const std::string& type = "Revolute", const std::string& more = "") {
  return connection(
      type, id, one, two,
      "BindAxisPoint1 = " + literal(Vector3(x, 0, 0)) + " BindAxisPoint2 = " + literal(Vector3(x, 0, 1)) + more);
}

std::string locked_scene(const std::string& bodies, const std::string& joints) {
  return R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.00390625 Duration = 0.5 CheckPhysicsEvery = 1 } }
Environment { Space { Bodies {
)" + bodies +
         "} } CollisionFilter { DefaultAllow = false Rules { } } Constraints {\n" + joints + "} }";
}

// Two links in a row from a pivot to a slider, whose guide their whole length just reaches, across them.
std::string stretched_toggle(const std::string& first = "Revolute", const std::string& more = "") {
  return locked_scene(
      bar("A", {0.2, 0, 0}, 0, {0, 0, 0}) + bar("B", {0.6, 0, 0}, 0, {0, 0, 0}) + bar("C", {1.0, 0, 0}, 0, {0, 0, 0}),
      hinged("Pivot", "", "A", 0.0, first, more) + hinged("Knee", "A", "B", kBar) + hinged("End", "B", "C", 2 * kBar) +
          connection("Slider", "Guide", "", "C", "BindPoint = {1, 0, 0} Axis = {0, 1, 0}"));
}

// Three links in a row between two pivots, as far apart as they are long; the first given a spin that leads nowhere.
std::string stretched_four_bar(double spin) {
  const double end = spin * kBar;
  return locked_scene(bar("A", {0.2, 0, 0}, spin, {0, 0.5 * end, 0}) + bar("B", {0.6, 0, 0}, 0, {0, end, 0}) +
                          bar("C", {1.0, 0, 0}, -spin, {0, 0.5 * end, 0}),
                      hinged("First", "", "A", 0.0) + hinged("Second", "A", "B", kBar) +
                          hinged("Third", "B", "C", 2 * kBar) + hinged("Fourth", "", "C", 3 * kBar));
}

// Links on balls, straight and taut between two walls: free to give way up, down and sideways, but not by any length.
std::string taut_bridge(int links) {
  std::string bodies, joints, before;
  const auto at = [](int place) { return "BindPoint = " + literal(Vector3(kBar * place, 0, 0)); };
  for (int i = 0; i < links; ++i) {
    const std::string id = "L" + std::to_string(i);
    bodies += bar(id, {kBar * (i + 0.5), 0, 0}, 0, {0, 0, 0});
    joints += connection("Spherical", "J" + std::to_string(i), before, id, at(i));
    before = id;
  }
  return locked_scene(bodies, joints + connection("Spherical", "Wall", "", before, at(links)));
}

// A step from rest falls by g h^2/2 and comes back: it ends no faster than g h, and where it began to within what a length off
// by rounding gives way, and `open` more.
void expect_stands(const std::string& text, const std::string& integrator, const std::string& solver, double h) {
  SCOPED_TRACE(integrator + ", " + solver + ", " + std::to_string(h));
  SceneRun run(text, {set("Integrator", integrator), set("Solver", solver), set("Simulator.TimeStep", h)});
  const std::vector<std::string> bodies = run.movable_bodies();
  std::vector<Vector3> start;
  for (const std::string& id : bodies) start.push_back(run.body(id).pose.position);
  run.to_end();
  const double fall = 0.5 * kG * h * h, speed = kG * h;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    EXPECT_LT((run.body(bodies[i]).pose.position - start[i]).norm(), fall) << bodies[i];
  EXPECT_LT(run.kinetic_energy(), 0.5 * static_cast<double>(bodies.size()) * speed * speed);
  // a turn of fall/kBar at either end
  EXPECT_LT(run.report().max_joint_error(), fall * fall / kBar);
}

TEST(Locked, AToggleThatIsStretchedOutStands) {
  for (const char* integrator : kLockedIntegrators)
    for (const double h : {1.0 / 1024, 1.0 / 256, 1.0 / 64}) expect_stands(stretched_toggle(), integrator, "Newton", h);
  expect_stands(stretched_toggle(), "Verlet", "Direct", 1.0 / 256);
}

TEST(Locked, AFourBarThatIsStretchedOutStands) {
  for (const char* integrator : kLockedIntegrators)
    expect_stands(stretched_four_bar(0.0), integrator, "Newton", 1.0 / 256);
}

TEST(Locked, WhatLeadsNowhereIsGone) {
  for (const char* integrator : {"Verlet", "RK4", "Radau"}) {
    SceneRun run(stretched_four_bar(1.0),
                 {set("Integrator", std::string(integrator)), set("Solver", std::string("Newton"))});
    run.to_end();
    EXPECT_LT(run.kinetic_energy(), 1.5 * kG * kG / (256.0 * 256.0)) << integrator;
    EXPECT_LT(run.report().max_joint_error(), 1e-8) << integrator;
  }
}

TEST(Locked, ATautBridgeStands) {
  for (const char* integrator : {"Verlet", "RK4", "DormandPrince853", "ImplicitMidpoint"})
    for (const int links : {4, 8}) expect_stands(taut_bridge(links), integrator, "Newton", 1.0 / 256);
}

// Four balls on twelve rods of 1 m, in a plane, between walls.
TEST(Locked, ATautNetStands) {
  constexpr int kSide = 3;
  std::string bodies, rods;
  const auto is_wall = [](int i, int j) { return i == 0 || j == 0 || i == kSide || j == kSide; };
  const auto name = [](int i, int j) { return "P" + std::to_string(i) + std::to_string(j); };
  const auto add = [&](int i, int j, int k, int l) {
    if (is_wall(i, j)) return;
    rods += connection("Distance", name(i, j) + name(k, l), is_wall(k, l) ? "" : name(k, l), name(i, j),
                       "BindPoint1 = " + literal(Vector3(k, 0, l)) + " BindPoint2 = " + literal(Vector3(i, 0, j)));
  };
  for (int i = 1; i < kSide; ++i) {
    for (int j = 1; j < kSide; ++j) {
      bodies += bar(name(i, j), Vector3(i, 0, j), 0, {0, 0, 0});
      add(i, j, i - 1, j), add(i, j, i, j - 1);
      if (is_wall(i + 1, j)) add(i, j, i + 1, j);
      if (is_wall(i, j + 1)) add(i, j, i, j + 1);
    }
  }
  for (const char* integrator : {"Verlet", "RK4", "Radau"})
    expect_stands(locked_scene(bodies, rods), integrator, "Newton", 1.0 / 256);
}

// A motor without bound against a lock has no answer: it stalls, and what holds stays closed.
TEST(Locked, AMotorStalls) {
  for (const char* integrator : {"Verlet", "RK4", "SemiImplicitEuler"}) {
    SceneRun run(stretched_toggle("AngularMotor", " AngularSpeed = -2"),
                 {set("Integrator", std::string(integrator)), set("Solver", std::string("Newton"))});
    run.to_end();
    EXPECT_LT((run.body("C").pose.position - Vector3(1, 0, 0)).norm(), 2.0 / 256.0) << integrator;
    EXPECT_LT(run.report().max_joint_error(), 1e-5) << integrator;
  }
}

// No such place: a boom that a bounded drive holds up, in a triangle of hinges. What the step falls freely is taken back all
// the same, in steps of Newton's method that end in roundings.
TEST(Locked, ABoomOnABoundedDriveIsNotTakenForIt) {
  const Quaternion slope = harness::turned(Vector3::UnitZ(), std::atan2(0.5, 0.8));
  const auto tube = [&](const std::string& id, const Vector3& position) {
    return "Body { Id = \"" + id + R"(" Mass = 2 PrincipalMoments = {0.01, 0.05, 0.05} Forces = { "Down" })" +
           " KineticProperties { Position = " + literal(position) + " Orientation = " + literal(slope) + " } }\n";
  };
  const std::string at_foot = " BindAxisPoint1 = {0, -0.5, 0} BindAxisPoint2 = {0, -0.5, 1}";
  const std::string scene = locked_scene(
      R"(Body { Id = "Boom" Mass = 100 PrincipalMoments = {1, 33, 33} Forces = { "Down" } KineticProperties { Position = {1, 0, 0} } }
)" + tube("Tube", {0.2, -0.375, 0}) +
          tube("Rod", {0.6, -0.125, 0}),
      hinged("Pivot", "", "Boom", 0.0) + connection("Revolute", "Foot", "", "Tube", at_foot) +
          hinged("Head", "Rod", "Boom", 0.8) +
          connection("Slider", "Drive", "Tube", "Rod",
                     "BindPoint = {0, -0.5, 0} Axis = {0.8, 0.5, 0} Speed = 0 MaximumForce = 10000"));
  for (const double steps_a_second : {30.0, 50.0, 60.0, 100.0}) {
    for (const char* integrator : {"Verlet", "RK4", "DormandPrince54"}) {
      SceneRun run(scene, {set("Integrator", std::string(integrator)), set("Solver", std::string("Direct")),
                           set("Simulator.TimeStep", 1.0 / steps_a_second)});
      run.to_end();
      // it fell by 0.5 mm in each of some steps, with nothing of the drive's force
      EXPECT_GT(run.body("Boom").pose.position.y(), -1e-5) << integrator << ' ' << steps_a_second;
    }
  }
}

}  // namespace
}  // namespace gravitas
