// Scenes by chance, for laws that hold in all of them: bodies of all shapes that fly into each other in free space.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/pose.h"

namespace gravitas::harness {

enum class Shapes {
  kSpheres,
  kIsotropic,  // spheres, cubes, and cylinders as high as sqrt(3) radii: one moment about all axes, no gyroscopic term
  kAny
};

struct RandomBody {
  std::string id, geometry, properties;  // type of the geometry, its sizes in words of the scene language
  double density, restitution, friction;
  Pose pose;
  Twist twist;
};

// Eight bodies apart from each other, moving towards their middle; the same for the same seed, on every machine.
std::vector<RandomBody> random_bodies(std::uint64_t seed, Shapes shapes);

// A rigid displacement of everything.
RandomBody displaced(const RandomBody& body, const Pose& by);

// Scene text with these bodies, in this order, without forces.
std::string scene_text(const std::vector<RandomBody>& bodies, double time_step, double duration);

}  // namespace gravitas::harness
