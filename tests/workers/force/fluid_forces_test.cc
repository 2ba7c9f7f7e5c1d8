// Forces `Buoyancy` and `Aerodynamic` against closed forms.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/force/force_problem.h"
#include "workers/force/buoyancy/submerged.h"

namespace gravitas::test {
namespace {

constexpr double kPi = std::numbers::pi;
const Vector3 kUp(0, 1, 0);

struct FluidProperties {
  double density = 1000, level = 0;
  Vector3 gravity = Vector3(0, -10, 0);
  std::vector<double> region = {};
  Vector3 velocity = Vector3::Zero();
  double linear_drag = 0, angular_drag = 0;

  std::vector<double> flat() const {
    std::vector<double> numbers = {density,     level,       gravity.x(),
                                   gravity.y(), gravity.z(), static_cast<double>(region.size() / 3)};
    numbers.insert(numbers.end(), region.begin(), region.end());
    numbers.insert(numbers.end(), {velocity.x(), velocity.y(), velocity.z(), linear_drag, angular_drag});
    return numbers;
  }
};

const std::vector<ForceShape> kShapes = {{type_id("Sphere"), {0.5}},        {type_id("Box"), {0.5, 1.0, 0.25}},
                                         {type_id("Cylinder"), {0.5, 2.0}}, {type_id("Cone"), {0.5, 2.0}},
                                         {type_id("Capsule"), {0.5, 2.0}},  {type_id("Halfspace"), {}}};

ForceAnswer ask(PluginUnderTest* plugin, const char* type, const std::vector<double>& properties,
                const ForcedBody& body) {
  ForceProblem problem{0.0, {type_id(type)}, {properties}, {body}, {0, 0}};
  problem.shapes = kShapes;
  return ask_wrenches(plugin, problem).at(0);
}

// ---- what is submerged

TEST(Submerged, BallIsItsCap) {
  for (const double z : {-2.0, -1.0, -0.3, 0.0, 0.4, 0.99, 1.0, 3.0}) {
    const Submerged part = submerged_ball(Vector3(5, z, -2), 1.0, kUp, 0.0);
    // integral of the discs below the plane
    const double top = std::clamp(-z, -1.0, 1.0);
    const double volume = kPi * (top - top * top * top / 3.0 + 2.0 / 3.0);
    const double moment = kPi * (0.5 * (top * top - 1.0) - 0.25 * (top * top * top * top - 1.0));
    EXPECT_NEAR(part.volume, volume, 1e-14) << z;
    if (volume > 1e-3) {
      EXPECT_NEAR(part.centre.y(), z + moment / volume, 1e-13) << z;
    }
    EXPECT_NEAR(part.whole_volume, 4.0 / 3.0 * kPi, 1e-14);
  }
}

TEST(Submerged, UprightBoxIsItsPart) {
  const Surface box = box_surface({0.5, 1.0, 0.25});
  for (const double z : {-3.0, -1.0, -0.25, 0.0, 0.7, 1.0, 2.0}) {
    const Submerged part = submerged_polyhedron(box, {Vector3(3, z, 1), Quaternion::Identity()}, kUp, 0.0);
    const double depth = std::clamp(1.0 - z, 0.0, 2.0);
    EXPECT_NEAR(part.volume, 0.5 * depth, 1e-14) << z;
    if (depth > 0.0) {
      EXPECT_LT((part.centre - Vector3(3, z - 1.0 + 0.5 * depth, 1)).norm(), 1e-14) << z;
    }
  }
}

// A cube with a corner down, the water at the height of its middle: half the volume; at a third of the diagonal: the
// corner's pyramid.
TEST(Submerged, CubeOnItsCorner) {
  const Surface cube = box_surface(Vector3::Constant(0.5));
  const Vector3 up = Vector3::Ones().normalized();
  EXPECT_NEAR(submerged_polyhedron(cube, {}, up, 0.0).volume, 0.5, 1e-15);
  const double third = -0.5 * std::sqrt(3.0) + std::sqrt(3.0) / 3.0;
  const Submerged corner = submerged_polyhedron(cube, {}, up, third);
  EXPECT_NEAR(corner.volume, 1.0 / 6.0, 1e-15);
  EXPECT_LT((corner.centre - Vector3::Constant(-0.5 + 0.25)).norm(), 1e-14);
}

// The part below and the part above make the whole, in any attitude.
TEST(Submerged, PartsMakeTheWhole) {
  conformance::Draw random(1);
  const Surface box = box_surface({0.5, 1.0, 0.25});
  for (int i = 0; i < 200; ++i) {
    const Pose pose = random.pose(1.0);
    const Vector3 up = random.direction();
    const Submerged below = submerged_polyhedron(box, pose, up, 0.1),
                    above = submerged_polyhedron(box, pose, -up, -0.1);
    EXPECT_NEAR(below.volume + above.volume, 1.0, 1e-14);
    EXPECT_LT((below.volume * below.centre + above.volume * above.centre - pose.position).norm(), 1e-13);
  }
}

// ---- Buoyancy

TEST(Buoyancy, LiftsByTheWeightOfTheFluid) {
  PluginUnderTest force("force_buoyancy");
  const double volumes[] = {kPi / 6.0, 1.0, kPi / 2.0, kPi / 6.0, kPi / 2.0 + kPi / 6.0};
  for (std::uint32_t shape = 0; shape < 5; ++shape) {
    ForcedBody body;
    body.shape = shape;
    body.pose = {Vector3(1, -20, 2), exp_rotation(Vector3(0.3, -1, 0.5))};
    const ForceAnswer answer = ask(&force, "Buoyancy", FluidProperties{}.flat(), body);
    const double tolerance = 1e-8;
    EXPECT_LT((answer.wrench.force - 1e4 * volumes[shape] * kUp).norm(), tolerance) << shape;
    // the cone's centroid is a quarter of its height above its base
    const double below = shape == 3 ? (body.pose.orientation * Vector3(0, 0.5, 0)).y() : 0.0;
    EXPECT_NEAR(answer.potential, 1e4 * volumes[shape] * (20.0 + below), 1e3 * tolerance) << shape;
    body.pose.position.y() = 20.0;
    EXPECT_EQ(ask(&force, "Buoyancy", FluidProperties{}.flat(), body).wrench.force, Vector3::Zero());
  }
}

TEST(Buoyancy, RocksABoxBackUpright) {
  PluginUnderTest force("force_buoyancy");
  ForcedBody body;
  body.shape = 1;
  // a low, wide raft is stable: moment against a small tilt is -rho g (I - V BG) angle
  ForceProblem problem{0.0, {type_id("Buoyancy")}, {FluidProperties{}.flat()}, {body}, {0, 0}};
  problem.shapes = {{type_id("Box"), {1.0, 0.25, 2.0}}};
  problem.bodies[0].shape = 0;
  const double tilt = 1e-4;
  problem.bodies[0].pose.orientation = exp_rotation(Vector3(0, 0, tilt));
  const ForceAnswer answer = ask_wrenches(&force, problem).at(0);
  // half submerged: water plane 2 x 4, I about z = 4 * 8/12, V = 2, BG = 0.125
  EXPECT_NEAR(answer.wrench.torque.z() / tilt, -1e4 * (4.0 * 8.0 / 12.0 - 2.0 * 0.125), 1e-2);
  EXPECT_NEAR(answer.wrench.force.y(), 2e4, 1e-3);
}

// Force and torque are the slope of the potential, cut or not, for every shape.
TEST(Buoyancy, IsTheSlopeOfItsPotential) {
  PluginUnderTest force("force_buoyancy");
  conformance::Draw random(3);
  for (std::uint32_t shape = 0; shape < 5; ++shape) {
    for (int i = 0; i < 20; ++i) {
      ForcedBody body;
      body.shape = shape;
      body.pose = random.pose(0.4), body.geometry = random.pose(0.2);
      const ForceAnswer here = ask(&force, "Buoyancy", FluidProperties{}.flat(), body);
      for (int axis = 0; axis < 3; ++axis) {
        const auto potential = [&](const Vector3& shift, const Vector3& turn) {
          ForcedBody moved = body;
          moved.pose = displaced(body.pose, shift, turn);
          return ask(&force, "Buoyancy", FluidProperties{}.flat(), moved).potential;
        };
        const Vector3 step = 1e-5 * Vector3::Unit(axis);
        // second differences of 1e4 N/m over 1e-5 m, squared
        EXPECT_NEAR(here.wrench.force[axis], -(potential(step, {0, 0, 0}) - potential(-step, {0, 0, 0})) / 2e-5, 1e-3);
        EXPECT_NEAR(here.wrench.torque[axis], -(potential({0, 0, 0}, step) - potential({0, 0, 0}, -step)) / 2e-5, 1e-3);
      }
    }
  }
}

TEST(Buoyancy, DragsAgainstTheFlow) {
  PluginUnderTest force("force_buoyancy");
  ForcedBody body;
  body.shape = 0;
  body.pose.position = Vector3(0, 0, 0);
  body.twist = {Vector3(3, 0, 0), Vector3(0, 4, 0)};
  FluidProperties fluid{.velocity = Vector3(1, 0, 0), .linear_drag = 8, .angular_drag = 6};
  // half submerged
  const ForceAnswer answer = ask(&force, "Buoyancy", fluid.flat(), body);
  EXPECT_NEAR(answer.wrench.force.x(), -0.5 * 8 * 2, 1e-12);
  EXPECT_NEAR(answer.wrench.torque.y(), -0.5 * 6 * 4, 1e-12);
}

TEST(Buoyancy, EndsWithItsRegion) {
  PluginUnderTest force("force_buoyancy");
  FluidProperties fluid{.region = {-1, -5, -1, 1, 0, 1}};
  ForcedBody body;
  body.shape = 0;
  body.pose.position = Vector3(0.9, -2, 0);
  EXPECT_GT(ask(&force, "Buoyancy", fluid.flat(), body).wrench.force.y(), 0.0);
  body.pose.position.x() = 1.1;
  EXPECT_EQ(ask(&force, "Buoyancy", fluid.flat(), body).wrench.force.y(), 0.0);
}

// A pool that ends at its surface carries what floats with its centre above it.
TEST(Buoyancy, OfARegionUpToItsLevelIsThatOfNone) {
  PluginUnderTest force("force_buoyancy");
  ForcedBody body;
  body.shape = 0;
  for (const double height : {-0.4, 0.0, 0.1, 0.4}) {
    body.pose.position.y() = height;
    const double lift = ask(&force, "Buoyancy", FluidProperties{}.flat(), body).wrench.force.y();
    EXPECT_GT(lift, 0.0) << height;
    const FluidProperties pool{.region = {-1, -5, -1, 1, 0, 1}};
    EXPECT_EQ(ask(&force, "Buoyancy", pool.flat(), body).wrench.force.y(), lift) << height;
  }
}

TEST(Buoyancy, RefusesRegionsThatAreNoBoxes) {
  PluginUnderTest force("force_buoyancy");
  for (const std::vector<double>& region : {std::vector<double>{1, 1, 1}, std::vector<double>{-1, 1, -1, 1, -1, 1}}) {
    ForceProblem problem{
        0.0, {type_id("Buoyancy")}, {FluidProperties{.region = region}.flat()}, {ForcedBody{}}, {0, 0}};
    problem.bodies[0].shape = 0;
    problem.shapes = kShapes;
    EXPECT_THAT(force.refusal(stage::Method::kForceWrenches, problem.request()), ::testing::HasSubstr("min <= max"));
  }
}

TEST(Buoyancy, RefusesShapesThatItDoesNotKnow) {
  PluginUnderTest force("force_buoyancy");
  for (const std::uint32_t shape : {5U, kNone, 77U}) {
    ForceProblem problem{0.0, {type_id("Buoyancy")}, {FluidProperties{}.flat()}, {ForcedBody{.shape = shape}}, {0, 0}};
    problem.bodies[0].pose.position = Vector3(0, -3, 0);
    problem.shapes = kShapes;
    EXPECT_NE(force.refusal(stage::Method::kForceWrenches, problem.request()), "") << shape;
  }
}

// A box as polyhedron, given by its corners or by its faces, floats as the box does.
TEST(Buoyancy, OfAPolyhedronIsThatOfTheBox) {
  PluginUnderTest force("force_buoyancy");
  conformance::Draw random(7);
  std::vector<double> corners = {8};
  for (int i = 0; i < 8; ++i)
    corners.insert(corners.end(), {(i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 1.0 : -1.0, (i & 4) != 0 ? 0.25 : -0.25});
  corners.push_back(0);
  for (int i = 0; i < 50; ++i) {
    ForceProblem problem{0.0, {type_id("Buoyancy")}, {FluidProperties{}.flat()}, {ForcedBody{}}, {0, 0}};
    problem.shapes = {{type_id("Box"), {0.5, 1.0, 0.25}}, {type_id("ConvexPolyhedron"), corners}};
    problem.bodies[0].pose = random.pose(0.5);
    problem.bodies[0].shape = 0;
    const ForceAnswer box = ask_wrenches(&force, problem).at(0);
    problem.bodies[0].shape = 1;
    const ForceAnswer hull = ask_wrenches(&force, problem).at(0);
    // rounding of 1e4 N
    EXPECT_LT((box.wrench.force - hull.wrench.force).norm(), 1e-10);
    EXPECT_LT((box.wrench.torque - hull.wrench.torque).norm(), 1e-10);
  }
}

// ---- Aerodynamic

std::vector<double> flow(double density, const Vector3& velocity, double drag) {
  return {density, velocity.x(), velocity.y(), velocity.z(), drag};
}

TEST(Aerodynamic, IsThatOfAPlate) {
  PluginUnderTest force("force_aerodynamic");
  ForcedBody body;
  body.shape = 1;  // 1 x 2 x 0.5
  body.twist.linear = Vector3(0, 0, 6);
  // rho/2 C A u^2 against the motion, relative to the wind
  EXPECT_LT(
      (ask(&force, "Aerodynamic", flow(1.2, {0, 0, 0}, 1.5), body).wrench.force - Vector3(0, 0, -0.6 * 1.5 * 2 * 36))
          .norm(),
      1e-12);
  EXPECT_LT(
      (ask(&force, "Aerodynamic", flow(1.2, {0, 0, 2}, 1), body).wrench.force - Vector3(0, 0, -0.6 * 2 * 16)).norm(),
      1e-12);
  EXPECT_LT(ask(&force, "Aerodynamic", flow(1.2, {0, 0, 6}, 1), body).wrench.force.norm(), 1e-15);
  // two faces at 45 degrees
  body.twist.linear = Vector3(1, 0, 1);
  EXPECT_LT((ask(&force, "Aerodynamic", flow(2, {0, 0, 0}, 1), body).wrench.force - Vector3(-1, 0, -2)).norm(), 1e-12);
}

TEST(Aerodynamic, OfABallIsHalfItsSection) {
  PluginUnderTest force("force_aerodynamic");
  ForcedBody body;
  body.shape = 0;
  body.twist = {Vector3(0, 3, 4), Vector3(50, 0, 0)};
  const Wrench w = ask(&force, "Aerodynamic", flow(1.2, {0, 0, 0}, 1), body).wrench;
  EXPECT_LT((w.force + 0.6 * 0.5 * kPi * 0.25 * 5 * Vector3(0, 3, 4)).norm(), 1e-12);
  EXPECT_EQ(w.torque, Vector3::Zero());
}

// A plate that turns: half of each face looks into its motion; torque = -rho/2 C 2 integral (w x)^2 x dA.
TEST(Aerodynamic, ResistsTurning) {
  PluginUnderTest force("force_aerodynamic");
  ForceProblem problem{0.0, {type_id("Aerodynamic")}, {flow(2, {0, 0, 0}, 1)}, {ForcedBody{.shape = 0}}, {0, 0}};
  problem.shapes = {{type_id("Box"), {1.0, 0.5, 1e-6}}};
  problem.bodies[0].twist.angular = Vector3(0, 3, 0);
  const Wrench w = ask_wrenches(&force, problem).at(0).wrench;
  // per half 9 x^3 over 0..1 times the height 1: 9/4; one half of the front, the other of the back; the thin ends: 1e-6
  EXPECT_NEAR(w.torque.y(), -2 * 9.0 / 4.0, 1e-4);
  EXPECT_LT(w.force.norm(), 1e-4);
}

TEST(Aerodynamic, IsTheSameInATurnedWorld) {
  PluginUnderTest force("force_aerodynamic");
  conformance::Draw random(5);
  for (std::uint32_t shape = 0; shape < 5; ++shape) {
    for (int i = 0; i < 20; ++i) {
      ForcedBody body, turned;
      body.shape = turned.shape = shape;
      body.geometry = turned.geometry = random.pose(0.3);
      body.pose = random.pose(3.0);
      body.twist = {random.vector(5.0), random.vector(5.0)};
      const Quaternion turn = random.rotation();
      turned.pose = compose({Vector3(1, 2, 3), turn}, body.pose);
      turned.twist = {turn * body.twist.linear, turn * body.twist.angular};
      const Vector3 wind = random.vector(4.0);
      const Wrench one = ask(&force, "Aerodynamic", flow(1.2, wind, 1), body).wrench;
      const Wrench two = ask(&force, "Aerodynamic", flow(1.2, turn * wind, 1), turned).wrench;
      // clipped where a face turns into the wind: continuous, so rounding
      EXPECT_LT((two.force - turn * one.force).norm(), 1e-11);
      EXPECT_LT((two.torque - turn * one.torque).norm(), 1e-11);
    }
  }
}

}  // namespace
}  // namespace gravitas::test
