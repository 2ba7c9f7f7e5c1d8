// An engine under measurement, as the same few questions for all.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/bench/peers/scene.h"

namespace gravitas::peers {

// A scene as an engine runs it. Throws std::runtime_error where it cannot make it or go on.
class World {
 public:
  World() = default;
  virtual ~World() = default;
  World(const World&) = delete;
  World& operator=(const World&) = delete;

  virtual void step() = 0;
  // After a step; changes nothing of what follows.
  virtual BodyState state(std::size_t body) = 0;
};

// An engine with one way to use it.
struct Engine {
  std::string name;  // "Bullet", without blanks
  std::string how;   // plugins or method, for people
  std::function<std::unique_ptr<World>(const Scene& scene)> make;
};

// The ways to run a scene, ours first.
std::vector<Engine> engines_for(const Scene& scene);

Engine gravitas_for(const Scene& scene);
#ifdef GRAVITAS_HAS_BULLET
std::vector<Engine> bullet_for(const Scene& scene);
#endif
#ifdef GRAVITAS_HAS_ODE
std::vector<Engine> ode_for(const Scene& scene);
#endif
#ifdef GRAVITAS_HAS_MUJOCO
std::vector<Engine> mujoco_for(const Scene& scene);
#endif

}  // namespace gravitas::peers
