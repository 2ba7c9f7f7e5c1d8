// Bodies: masses, moments, poses, bounds, and what they may name.
#include "services/scene/build_bodies.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using kernel::BodyDescription;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kPi = std::numbers::pi;

// The one body of a scene that must build without a word.
BodyDescription body(const std::string& properties) {
  const BuiltScene built = build(scene_with_body(properties));
  EXPECT_THAT(built.errors(), IsEmpty());
  EXPECT_THAT(built.warnings(), IsEmpty());
  if (!built.description.has_value()) return {};
  EXPECT_EQ(built.description->validate(), "");
  return built.description->bodies[0];
}

std::vector<std::string> body_errors_of(const std::string& properties) {
  return build(scene_with_body(properties)).errors();
}

// Relative 1e-14: the closed form and the code multiply in another order.
void expect_vector(const Vector3& value, const Vector3& expected) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(value[i], expected[i], 1e-14 * (1.0 + std::fabs(expected[i]))) << i;
}

// ---- mass
// --------------------------------------------------------------------------------------------------------

TEST(BuildBodies, MassByDensity) {
  const BodyDescription ball = body("GeometryId = \"Unit\" MassDensity = 500");
  const double mass = 4.0 / 3.0 * kPi * 0.125 * 500;
  EXPECT_NEAR(ball.mass, mass, 1e-14 * mass);
  expect_vector(ball.inertia, Vector3::Constant(0.4 * mass * 0.25));
  EXPECT_EQ(ball.flags, kMovable | kHasShape | kCanSleep);

  const BodyDescription brick = body("GeometryId = \"Brick\" MassDensity = 2");
  EXPECT_EQ(brick.mass, 96.0);
  expect_vector(brick.inertia, Vector3(4 + 9, 1 + 9, 1 + 4) * 32.0);

  const BodyDescription rod = body("GeometryId = \"Rod\" MassDensity = 1");
  EXPECT_NEAR(rod.mass, kPi / 2, 1e-15);
  expect_vector(rod.inertia, Vector3((0.75 + 4) / 12, 0.125, (0.75 + 4) / 12) * (kPi / 2));
}

TEST(BuildBodies, MassAloneScalesTheMomentsOfTheShape) {
  const BodyDescription brick = body("GeometryId = \"Brick\" Mass = 3");
  EXPECT_EQ(brick.mass, 3.0);
  expect_vector(brick.inertia, Vector3(13, 10, 5));
  // 0 means unspecified, so it is no second mass
  EXPECT_EQ(body("GeometryId = \"Brick\" Mass = 3 MassDensity = 0").mass, 3.0);
}

TEST(BuildBodies, MassAndMomentsOverrideTheShape) {
  const BodyDescription brick = body("GeometryId = \"Brick\" Mass = 3 PrincipalMoments = {1, 2, 3}");
  EXPECT_EQ(brick.mass, 3.0);
  EXPECT_EQ(brick.inertia, Vector3(1, 2, 3));
}

TEST(BuildBodies, WithoutAGeometryTheyMustBeGiven) {
  const BodyDescription point = body("Mass = 3 PrincipalMoments = {1, 2, 3}");
  EXPECT_EQ(point.shape, kNone);
  EXPECT_EQ(point.flags, kMovable | kCanSleep);
  EXPECT_THAT(body_errors_of("MassDensity = 1"),
              ElementsAre("scene:1:71: error: Body \"Ball\" has no geometry to take its moments "
                          "from; required: Mass "
                          "and PrincipalMoments"));
  EXPECT_THAT(body_errors_of("Mass = 1"), ElementsAre("scene:2:8: error: Body \"Ball\" has no geometry "
                                                      "to take its moments from; required: Mass "
                                                      "and PrincipalMoments"));
}

TEST(BuildBodies, AShapeOfThePluginsOwnNeedsThem) {
  EXPECT_THAT(body_errors_of("GeometryId = \"Blob\" MassDensity = 1"),
              ElementsAre("scene:2:14: error: Body \"Ball\" has a geometry whose mass is not known here; required: "
                          "Mass and PrincipalMoments"));
  const BodyDescription blob = body("GeometryId = \"Blob\" Mass = 2 PrincipalMoments = {1, 1, 1}");
  EXPECT_EQ(blob.mass, 2.0);
  EXPECT_EQ(blob.bound.kind, BoundKind::kEverywhere);
  EXPECT_EQ(body("GeometryId = \"Blob\" Immovable = true").mass, 0.0);
}

TEST(BuildBodies, UnspecifiedDensityIsThatOfWater) {
  for (const char* density : {"", "MassDensity = 0"}) {
    const BuiltScene built = build(scene_with_body("GeometryId = \"Brick\"\n" + std::string(density)));
    ASSERT_TRUE(built.description.has_value());
    EXPECT_EQ(built.description->bodies[0].mass, 48000.0);
    EXPECT_EQ(built.warnings().size(), 1U);
  }
  EXPECT_THAT(build(scene_with_body("GeometryId = \"Brick\"\nMassDensity = 0")).warnings(),
              ElementsAre("scene:3:15: warning: Body \"Ball\" has MassDensity 0, which means "
                          "unspecified: it gets 1000 "
                          "kg/m^3"));
}

TEST(BuildBodies, RefuseContradictoryMasses) {
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" Mass = 1 MassDensity = 1"),
              ElementsAre("scene:2:28: error: Body \"Ball\" has Mass and MassDensity; allowed: one of them"));
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" Mass = 0"),
              ElementsAre("scene:2:28: error: Body \"Ball\" is movable and has Mass 0; allowed: a number > 0, or "
                          "Immovable = true"));
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" PrincipalMoments = {1, 1, 1}"),
              ElementsAre("scene:2:40: error: Body \"Ball\" has PrincipalMoments without Mass; "
                          "allowed: both together"));
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" Mass = 1 CentreOfMass = {0, 0, 0}"),
              ElementsAre("scene:2:45: error: Body \"Ball\" has CentreOfMass or PrincipalAxes without "
                          "PrincipalMoments; allowed: with Mass and PrincipalMoments"));
  EXPECT_THAT(body_errors_of("Mass = 1 PrincipalMoments = {1, 1, 1} CentreOfMass = {1, 0, 0}"),
              ElementsAre("scene:2:54: error: Body \"Ball\" has no geometry, so its Position is "
                          "the centre of mass; "
                          "allowed: leave CentreOfMass out"));
}

TEST(BuildBodies, RefuseMassesThatNoSolidHas) {
  EXPECT_THAT(body_errors_of("Mass = 1 PrincipalMoments = {1, 1, 3}"),
              ElementsAre(testing::StartsWith("scene:2:29: error: Body \"Ball\" has a mass that no solid can have: ")));
  EXPECT_THAT(body_errors_of("GeometryId = \"Brick\" MassDensity = 1e308"), testing::SizeIs(1));
  // velocities come of inverses
  EXPECT_THAT(body_errors_of("GeometryId = \"Brick\" Mass = 5e-309"),
              ElementsAre("scene:2:29: error: Body \"Ball\" has a mass of 5e-309 kg, whose inverse overflows; allowed: "
                          "from 1e-307 on"));
  EXPECT_THAT(body_errors_of("Mass = 1 PrincipalMoments = {1e-309, 1e-309, 1e-309}"),
              ElementsAre("scene:2:29: error: Body \"Ball\" has a moment of 1e-309 kg m^2, whose inverse overflows; "
                          "allowed: from 1e-307 on"));
  EXPECT_THAT(body_errors_of("Mass = 1e-307 PrincipalMoments = {1e-307, 1e-307, 1e-307}"), ElementsAre());
  EXPECT_THAT(body_errors_of("Mass = 1 PrincipalMoments = {1, 0, 1}"),
              ElementsAre("scene:2:33: error: an element of PrincipalMoments is 0; allowed: a list "
                          "of 3 numbers, each "
                          "> 0"));
}

// ---- immovable and kinematic
// -------------------------------------------------------------------------------------

TEST(BuildBodies, UnboundedGeometryIsImmovable) {
  const BodyDescription ground = body("GeometryId = \"Ground\" BoundingVolumeType = \"None\" MassDensity = 0");
  EXPECT_EQ(ground.flags, kUnbounded | kHasShape);
  EXPECT_EQ(ground.mass, 0.0);
  EXPECT_EQ(ground.inertia, Vector3::Zero());
  EXPECT_EQ(ground.bound.kind, BoundKind::kEverywhere);
  EXPECT_THAT(body_errors_of("GeometryId = \"Ground\" Immovable = false"),
              ElementsAre("scene:2:35: error: Body \"Ball\" has an unbounded geometry and is movable; allowed: "
                          "Immovable = true, or Kinematic = true"));
}

TEST(BuildBodies, ImmovableNeedsNoMass) {
  const BodyDescription wall = body("GeometryId = \"Brick\" Immovable = true");
  EXPECT_EQ(wall.flags, kHasShape);
  EXPECT_EQ(wall.mass, 0.0);
  EXPECT_EQ(body("Immovable = true").mass, 0.0);
}

TEST(BuildBodies, KinematicKeepsItsVelocities) {
  const BodyDescription belt =
      body("GeometryId = \"Brick\" Kinematic = true KineticProperties { LinearVelocity = {1, 0, 0} }");
  EXPECT_EQ(belt.flags, kKinematic | kHasShape);
  EXPECT_EQ(belt.mass, 0.0);
  EXPECT_EQ(belt.twist.linear, Vector3(1, 0, 0));
  EXPECT_EQ(body("GeometryId = \"Ground\" Kinematic = true").flags, kKinematic | kUnbounded | kHasShape);
  EXPECT_THAT(body_errors_of("GeometryId = \"Brick\" Kinematic = true Immovable = true"),
              ElementsAre("scene:2:51: error: Body \"Ball\" is Immovable and Kinematic; allowed: one of them"));
}

TEST(BuildBodies, WhatNothingCanDoIsDroppedAndSaid) {
  const BuiltScene built =
      build(scene_with_body("GeometryId = \"Brick\" Immovable = true Forces = {\"Down\"} "
                            "KineticProperties { AngularVelocity = {1, 0, 0} }"));
  ASSERT_TRUE(built.description.has_value());
  EXPECT_EQ(built.description->bodies[0].twist.angular, Vector3::Zero());
  EXPECT_THAT(built.description->bodies[0].forces, IsEmpty());
  EXPECT_THAT(built.warnings(), ElementsAre("scene:2:95: warning: Body \"Ball\" is immovable: its "
                                            "velocities are dropped (a body that "
                                            "keeps them is Kinematic)",
                                            "scene:2:48: warning: Body \"Ball\" is immovable: its "
                                            "Forces do nothing and are dropped"));
  const BuiltScene damped =
      build(scene_with_body("GeometryId = \"Brick\" Kinematic = true\nKineticProperties { DampingCoefficient = 3 }"));
  EXPECT_THAT(damped.warnings(), ElementsAre("scene:3:42: warning: Body \"Ball\" is kinematic: its DampingCoefficient "
                                             "does nothing and is dropped"));
}

TEST(BuildBodies, APictureIsPlacedByAPose) {
  const std::string picture = "GeometryId = \"Unit\" MassDensity = 1\nVisualTransform = ",
                    what = "scene:3:19: error: Body \"Ball\"";
  body(picture + "{{1, 2, 3}, {1, 0, 0, 0}}");
  const std::string allowed = "; allowed: {{px, py, pz}, {qw, qx, qy, qz}}";
  EXPECT_THAT(body_errors_of(picture + "\"x\""), ElementsAre(what + " has a VisualTransform that is \"x\"" + allowed));
  EXPECT_THAT(body_errors_of(picture + "{\"a\", {true}}"),
              ElementsAre(what + " has a VisualTransform that is a list of 2" + allowed));
  EXPECT_THAT(body_errors_of(picture + "{{1, 2, true}, {1, 0, 0, 0}}"),
              ElementsAre(HasSubstr(
                  "scene:3:27: error: Body \"Ball\": an element of the position of VisualTransform is true")));
  EXPECT_THAT(body_errors_of(picture + "{{1, 2, 3}, {2, 0, 0, 0}}"),
              ElementsAre(HasSubstr("the orientation of VisualTransform has the norm 2")));
}

// ---- poses
// -------------------------------------------------------------------------------------------------------

TEST(BuildBodies, APlainShapeKeepsItsPoseBitForBit) {
  const BodyDescription ball = body(
      "GeometryId = \"Unit\" MassDensity = 1 KineticProperties { Position = {0.1, 0.2, 0.3} "
      "Orientation = {0.6, 0, 0.8, "
      "0} LinearVelocity = {1, 2, 3} AngularVelocity = {4, 5, 6} DampingCoefficient = 0.1 CanSleep "
      "= false }");
  EXPECT_EQ(ball.pose.position, Vector3(0.1, 0.2, 0.3));
  EXPECT_EQ(ball.pose.orientation.coeffs(), Quaternion(0.6, 0, 0.8, 0).coeffs());
  EXPECT_EQ(ball.geometry.position, Vector3::Zero());
  EXPECT_EQ(ball.twist.linear, Vector3(1, 2, 3));
  EXPECT_EQ(ball.twist.angular, Vector3(4, 5, 6));
  EXPECT_EQ(ball.damping, 0.1);
  EXPECT_EQ(ball.flags & kCanSleep, 0U);
}

TEST(BuildBodies, PositionIsThatOfTheGeometry) {
  // the geometry's frame is turned by a quarter about z, so its x axis points along the world's y
  const BodyDescription brick = body(
      "GeometryId = \"Brick\" Mass = 2 PrincipalMoments = {2, 3, 4} CentreOfMass = {1, 0, 0} "
      "PrincipalAxes = "
      "{0.70710678118654757, 0, 0.70710678118654757, 0} KineticProperties { Position = {10, 20, "
      "30} Orientation = "
      "{0.70710678118654757, 0, 0, 0.70710678118654757} }");
  expect_vector(brick.pose.position, Vector3(10, 21, 30));
  // the body's z axis is the geometry's x, the world's y
  expect_vector(brick.pose.orientation * Vector3::UnitZ(), Vector3::UnitY());
  // and the geometry is where the scene put it
  const Pose X_WG = compose(brick.pose, brick.geometry);
  expect_vector(X_WG.position, Vector3(10, 20, 30));
  expect_vector(X_WG.orientation * Vector3::UnitX(), Vector3::UnitY());
}

// ---- bounds
// ------------------------------------------------------------------------------------------------------

TEST(BuildBodies, BoundsFollowTheShape) {
  const auto bound = [](const std::string& geometry, const std::string& type) {
    const std::string volume = type.empty() ? "" : " BoundingVolumeType = \"" + type + '"';
    return body("GeometryId = \"" + geometry + "\" MassDensity = 1" + volume).bound;
  };
  for (const char* type : {"", "Sphere", "AxisAlignedBox", "OrientedBox"}) {
    EXPECT_EQ(bound("Unit", type).kind, BoundKind::kSphere) << type;
    EXPECT_EQ(bound("Unit", type).half_extents.x(), 0.5) << type;
  }
  for (const char* type : {"", "AxisAlignedBox", "OrientedBox"}) {
    EXPECT_EQ(bound("Brick", type).kind, BoundKind::kBox) << type;
    EXPECT_EQ(bound("Brick", type).half_extents, Vector3(1, 2, 3)) << type;
    EXPECT_EQ(bound("Rod", type).half_extents, Vector3(0.5, 1, 0.5)) << type;
  }
  EXPECT_EQ(bound("Brick", "Sphere").kind, BoundKind::kSphere);
  // not smaller than the distance of the corner, and not by more than rounding
  EXPECT_GE(bound("Brick", "Sphere").half_extents.x(), std::sqrt(14.0));
  EXPECT_NEAR(bound("Brick", "Sphere").half_extents.x(), std::sqrt(14.0), 1e-14);
  EXPECT_NEAR(bound("Rod", "Sphere").half_extents.x(), std::sqrt(1.25), 1e-14);
  for (const char* shape : {"Unit", "Brick", "Rod"})
    EXPECT_EQ(bound(shape, "None").kind, BoundKind::kEverywhere) << shape;
}

TEST(BuildBodies, BoundsStandWhereTheGeometryDoes) {
  const BodyDescription brick =
      body("GeometryId = \"Brick\" Mass = 2 PrincipalMoments = {2, 3, 4} CentreOfMass = {1, 0, 0}");
  EXPECT_EQ(brick.bound.centre, Vector3(-1, 0, 0));
}

TEST(BuildBodies, ABoundOfTheUnboundedIsNone) {
  EXPECT_THAT(build(scene_with_body("GeometryId = \"Ground\" BoundingVolumeType = \"Sphere\"")).warnings(),
              ElementsAre("scene:2:44: warning: Body \"Ball\" has an unbounded geometry: "
                          "BoundingVolumeType \"Sphere\" "
                          "is taken as \"None\""));
}

// ---- motion

TEST(BuildBodies, StartWhereTheirMotionHasThem) {
  const BodyDescription door = body(
      "GeometryId = \"Brick\" Kinematic = true Motion = {{-1, {0, 0, 0}, {1, 0, 0, 0}}, {1, {2, 4, 6}, {1, 0, 0, 0}}}");
  EXPECT_EQ(door.motion.rows.size(), 16U);
  expect_vector(door.pose.position, Vector3(1, 2, 3));
  expect_vector(door.twist.linear, Vector3(1, 2, 3));
  // as it may say itself
  const BodyDescription same = body(
      "GeometryId = \"Brick\" Kinematic = true Motion = {{-1, {0, 0, 0}, {1, 0, 0, 0}}, {1, {2, 4, 6}, {1, 0, 0, 0}}} "
      "KineticProperties { Position = {1, 2, 3} Orientation = {1, 0, 0, 0} LinearVelocity = {1, 2, 3} AngularVelocity "
      "= {0, 0, 0} }");
  EXPECT_EQ((same.pose.position - door.pose.position).norm(), 0.0);
  EXPECT_EQ((same.twist.linear - door.twist.linear).norm(), 0.0);
}

TEST(BuildBodies, RefuseAMotionThatCannotBeFollowed) {
  const std::string row = "{0, {0, 0, 0}, {1, 0, 0, 0}}",
                    kinematic = "GeometryId = \"Unit\" Kinematic = true Motion = ";
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" Mass = 1 Motion = {" + row + "}"),
              ElementsAre(HasSubstr("has a Motion and is not kinematic; required: Kinematic = true")));
  EXPECT_THAT(body_errors_of(kinematic + "{" + row + "} KineticProperties { Position = {0, 0, 1} }"),
              ElementsAre(HasSubstr(
                  "starts where its Motion is at time 0, and as fast; allowed: leave out pose and velocities")));
  EXPECT_THAT(body_errors_of(kinematic + "{}"),
              ElementsAre(HasSubstr("Motion is a list of 0; allowed: {{t, {px, py, pz}")));
  EXPECT_THAT(body_errors_of(kinematic + "{{0, {0, 0, 0}}}"), ElementsAre(HasSubstr("row 0 of Motion is a list of 2")));
  EXPECT_THAT(body_errors_of(kinematic + "{" + row + ", " + row + "}"),
              ElementsAre(HasSubstr("the time of row 1 of Motion is 0; allowed")));
  EXPECT_THAT(body_errors_of(kinematic + "{{0, {0, 0, 0}, {2, 0, 0, 0}}}"),
              ElementsAre(HasSubstr("the orientation of row 0 of Motion")));
}

// ---- what they name
// ----------------------------------------------------------------------------------------------

TEST(BuildBodies, NameForcesInTheirOrder) {
  EXPECT_THAT(body("GeometryId = \"Unit\" MassDensity = 1 Forces = {\"Air\", \"Down\"}").forces, ElementsAre(1, 0));
  EXPECT_THAT(body("GeometryId = \"Unit\" MassDensity = 1 Forces = {}").forces, IsEmpty());
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" MassDensity = 1 Forces = {\"Air\", \"Air\"}"),
              ElementsAre("scene:2:46: error: Forces names \"Air\" twice; allowed: each force once"));
}

TEST(BuildBodies, RefuseNamesOfNothing) {
  EXPECT_THAT(body_errors_of("GeometryId = \"Unti\" MassDensity = 1"),
              ElementsAre("scene:2:14: error: GeometryId names no Geometry: \"Unti\"; did you mean "
                          "\"Unit\"? Allowed: "
                          "\"Blob\", \"Brick\", \"Ground\", \"Rod\", \"Unit\""));
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" MassDensity = 1 Material = \"Steel\""),
              ElementsAre("scene:2:48: error: Material names no Material: \"Steel\"; allowed: \"Ice\""));
  EXPECT_THAT(body_errors_of("GeometryId = \"Unit\" MassDensity = 1 Forces = {\"Dwon\"}"),
              ElementsAre("scene:2:46: error: Forces names no Force: \"Dwon\"; did you mean "
                          "\"Down\"? Allowed: \"Air\", "
                          "\"Down\""));
}

TEST(BuildBodies, CollisionFiltersAreOpen) {
  const BodyDescription ball = body("GeometryId = \"Unit\" MassDensity = 1 CollisionGroups = {\"A\"}");
  EXPECT_EQ(ball.filter_group, 1U);
  EXPECT_EQ(ball.filter_mask, ~std::uint64_t{0});
}

}  // namespace
}  // namespace gravitas::scene
