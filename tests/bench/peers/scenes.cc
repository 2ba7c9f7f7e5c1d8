#include <cmath>
#include <numbers>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/bench/peers/judges.h"
#include "tests/bench/peers/scene.h"

namespace gravitas::peers {
namespace {

const Plane kGround{{0.0, 1.0, 0.0}, 0.0};

SceneBody ball(double radius, double mass, const Vector3& at) {
  SceneBody body{Form::kSphere, Vector3::Constant(radius), mass, Vector3::Constant(0.4 * mass * radius * radius), {}};
  body.start.pose.position = at;
  return body;
}

SceneBody box(const Vector3& half_sizes, double mass, const Vector3& at) {
  const Vector3 squares = half_sizes.cwiseAbs2();
  SceneBody body{Form::kBox, half_sizes, mass, mass / 3.0 * (Vector3::Constant(squares.sum()) - squares), {}};
  body.start.pose.position = at;
  return body;
}

SceneBody cube(double half, double mass, const Vector3& at) { return box(Vector3::Constant(half), mass, at); }

// The i-th place of a lattice, x first, then z, then y.
Vector3 place_in_lattice(int i, int along_x, int along_z) {
  const int layer = i / (along_x * along_z);
  return {i % along_x + 0.0, layer + 0.0, i / along_x % along_z + 0.0};
}

std::uint32_t steps_in(double duration, double time_step) {
  return static_cast<std::uint32_t>(std::lround(duration / time_step));
}

Scene scene_of(const std::string& name, double duration, double time_step = 1.0 / 60.0) {
  Scene scene;
  scene.name = name;
  scene.time_step = time_step;
  scene.steps = steps_in(duration, time_step);
  return scene;
}

}  // namespace

Scene one_body() {
  Scene scene = scene_of("one_body", 100.0);
  scene.steps_per_look = scene.steps;
  scene.gravity = Vector3::Zero();
  scene.bodies = {ball(0.5, 1.0, {1, 2, 3})};
  scene.judge = nothing;
  return scene;
}

Scene freefall1000() {
  Scene scene = scene_of("freefall1000", 1.0);
  scene.steps_per_look = scene.steps;
  for (int i = 0; i < 1000; ++i) {
    scene.bodies.push_back(ball(0.5, 1.0, 5.0 * place_in_lattice(i, 10, 10)));
    scene.bodies.back().start.twist.linear = {1, 2, 3};
  }
  scene.judge = fall;
  return scene;
}

Scene freetop() {
  Scene scene = scene_of("freetop", 10.0);
  scene.steps_per_look = scene.steps;
  scene.gravity = Vector3::Zero();
  scene.collides = false;
  scene.bodies = {ball(0.5, 1.0, Vector3::Zero())};
  scene.bodies[0].inertia = {1, 2, 3};
  scene.bodies[0].start.twist.angular = {0.01, 5, 0.01};
  scene.judge = turn;
  return scene;
}

Scene stack(const std::string& name, int cubes, double top_mass, double duration) {
  Scene scene = scene_of(name, duration);
  for (int i = 0; i < cubes; ++i)
    scene.bodies.push_back(cube(0.5, i == cubes - 1 ? top_mass : 1.0, Vector3(0, 0.5 + i, 0)));
  scene.planes = {kGround};
  scene.judge = stand;
  return scene;
}

Scene chain20(const std::string& name, double time_step) {
  Scene scene = scene_of(name, 5.0, time_step);
  scene.collides = false;
  const Vector3 along = Vector3(1, -1, 0).normalized();
  const Quaternion attitude = exp_rotation({0, 0, -0.75 * std::numbers::pi});  // y to `along`
  for (int i = 0; i < 20; ++i) {
    scene.bodies.push_back(box({0.05, 0.25, 0.05}, 1.0, (0.25 + 0.5 * i) * along));
    scene.bodies.back().start.pose.orientation = attitude;
  }
  scene.bodies.push_back(ball(0.5, 1000.0, 10.5 * along));
  for (std::uint32_t i = 0; i < scene.bodies.size(); ++i)
    scene.joints.push_back({i == 0 ? kNone : i - 1, i, 0.5 * i * along});
  scene.judge = hang;
  return scene;
}

Scene bounce() {
  Scene scene = scene_of("bounce", 10.0);
  scene.steps_per_look = scene.steps;
  scene.restitution = 1.0;
  scene.bodies = {ball(0.5, 1.0, {0, 1.5, 0})};
  scene.planes = {kGround};
  scene.judge = rebound;
  return scene;
}

Scene slide(const std::string& name, double degrees) {
  Scene scene = scene_of(name, 2.0);
  scene.steps_per_look = scene.steps;
  const double angle = degrees * std::numbers::pi / 180.0;
  scene.bodies = {cube(0.5, 1.0, {0, 0.5, 0})};
  scene.bodies[0].start.twist.linear = 5.0 * Vector3(std::cos(angle), 0, std::sin(angle));
  scene.planes = {kGround};
  scene.judge = stop;
  return scene;
}

Scene balls666(const std::string& name, double time_step) {
  Scene scene = scene_of(name, 2.0, time_step);
  conformance::Draw draw(666);
  for (int i = 0; i < 666; ++i) {
    const Vector3 place = Vector3(0, 0.3, 0) + 0.25 * place_in_lattice(i, 9, 9);
    scene.bodies.push_back(ball(0.1, 1.0, place + draw.vector(0.01)));
  }
  scene.planes = {kGround};
  scene.judge = overlap;
  return scene;
}

Scene pyramid15() {
  Scene scene = scene_of("pyramid15", 5.0);
  for (int row = 0; row < 15; ++row)
    for (int i = 0; i < 15 - row; ++i)
      scene.bodies.push_back(cube(0.5, 1.0, {1.02 * (i - 0.5 * (14 - row)), 0.5 + row, 0}));
  scene.planes = {kGround};
  scene.judge = stand_and_overlap;
  return scene;
}

Scene pile1000() {
  Scene scene = scene_of("pile1000", 5.0);
  conformance::Draw draw(1000);
  for (int i = 0; i < 1000; ++i) {
    const Vector3 place = place_in_lattice(i, 10, 10) + Vector3(-4.5, 1.0, -4.5);
    scene.bodies.push_back(cube(0.25, 1.0, 0.75 * place));
    scene.bodies.back().start.pose.orientation = draw.rotation();
  }
  scene.planes = {kGround, {{1, 0, 0}, -4}, {{-1, 0, 0}, -4}, {{0, 0, 1}, -4}, {{0, 0, -1}, -4}};
  scene.judge = settle;
  return scene;
}

std::vector<Scene> all_scenes() {
  return {one_body(),
          freefall1000(),
          freetop(),
          stack("stack10", 10, 1.0, 10.0),
          stack("stack20", 20, 1.0, 10.0),
          stack("massratio2", 2, 1000.0, 5.0),
          stack("massratio10", 10, 1000.0, 5.0),
          chain20("chain20", 1.0 / 60.0),
          chain20("chain20_at_240", 1.0 / 240.0),
          bounce(),
          slide("slide", 0.0),
          slide("slide30", 30.0),
          balls666("balls666", 1.0 / 60.0),
          balls666("balls666_at_240", 1.0 / 240.0),
          pyramid15(),
          pile1000()};
}

}  // namespace gravitas::peers
