// Scenes that all engines are given alike, and what is measured of them. y is up.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/integrator.h"

namespace gravitas::peers {

enum class Form { kSphere, kBox };

struct SceneBody {
  Form form = Form::kSphere;
  Vector3 half_sizes = Vector3::Zero();  // m; of a sphere its radius, three times
  double mass = 1.0;                     // kg
  Vector3 inertia = Vector3::Ones();     // principal moments, kg m^2
  BodyState start;
};

// Solid where normal . x <= offset.
struct Plane {
  Vector3 normal;
  double offset;  // m
};

// Holds a point of body1 (kNone: of the world) to one of body2.
struct BallJoint {
  std::uint32_t body1, body2;
  Vector3 point;  // world, at the start
};

// What a run came to, by name; a name ends with its unit.
using Figures = std::map<std::string, double>;

struct Scene {
  std::string name;
  double time_step = 1.0 / 60.0;  // s
  std::uint32_t steps = 60;
  std::uint32_t steps_per_look = 1;  // where a step is too short for a look at the clock, more
  Vector3 gravity{0.0, -9.81, 0.0};  // m/s^2
  double friction = 0.5, restitution = 0.0;
  bool collides = true;
  std::vector<SceneBody> bodies;
  std::vector<Plane> planes;
  std::vector<BallJoint> joints;
  // Adds what it sees, body by body, to what it saw before.
  void (*judge)(const Scene& scene, const std::vector<BodyState>& bodies, double time, Figures* figures) = nullptr;

  double duration() const { return time_step * steps; }
};

// One body at rest in the air; what is timed is nothing but a step.
Scene one_body();
// A thousand balls fall side by side: error_m.
Scene freefall1000();
// A free body turns about its middle axis, and over: energy_drift, attitude_error_rad.
Scene freetop();
// Cubes of 1 m and 1 kg on each other, the top one of another mass: stands, sag_mm.
Scene stack(const std::string& name, int cubes, double top_mass, double duration);
// Twenty links with a thousand times their mass at the end swing from 45 degrees: gap_m, tip_error_m.
Scene chain20(const std::string& name, double time_step);
// A ball bounces for 10 s and loses nothing: energy_error.
Scene bounce();
// A cube slides to a stop at an angle to its edges: distance_error, direction_error_deg.
Scene slide(const std::string& name, double degrees);
// Balls fall in layers on an open floor: depth_mm.
Scene balls666(const std::string& name, double time_step);
// 120 cubes in 15 rows: stands, depth_mm.
Scene pyramid15();
// A thousand cubes fall at random attitudes into a pen: depth_mm, and in the last second settled_depth_mm.
Scene pile1000();

std::vector<Scene> all_scenes();

}  // namespace gravitas::peers
