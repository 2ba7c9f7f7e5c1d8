// Descriptions of small worlds, made by hand: what the kernel's tests run.
#pragma once

#include <string>
#include <vector>

#include "kernel/description.h"
#include "plugin_sdk/solver.h"

namespace gravitas::harness {

// Path of a shipped plugin library, by folder name ("solver_sequential").
std::string plugin_path(const std::string& name);
// Path of one of the deliberately bad ones.
std::string faulty_plugin_path(const std::string& name);

struct Material {
  double restitution = 0.0, static_friction = 0.5, dynamic_friction = 0.5, perturbation = 0.0;
  double rolling_friction = 0.0, spinning_friction = 0.0;  // m
};

// Makes kernel::EnvironmentDescription step by step. All bodies share one material.
class WorldBuilder {
 public:
  // Every slot hosted as said, plugins Basic space, Standard collision, Sequential, SemiImplicitEuler.
  explicit WorldBuilder(kernel::Hosting hosting = kernel::Hosting::kDirect);

  WorldBuilder& steps(std::uint32_t count, double time_step);
  WorldBuilder& hosting(Slot slot, kernel::Hosting hosting);
  WorldBuilder& integrator(const std::string& library);
  WorldBuilder& space(const std::string& library);
  WorldBuilder& plugin(Slot slot, const std::string& path, std::vector<double> settings = {});
  WorldBuilder& material(const Material& material);
  WorldBuilder& threads(std::uint32_t count);

  // The last body added, to be changed.
  kernel::BodyDescription& body() { return description_.bodies.back(); }

  WorldBuilder& ground();  // half-space y <= 0, immovable
  WorldBuilder& sphere(double radius, double mass, const Vector3& position, const Vector3& velocity = Vector3::Zero());
  WorldBuilder& box(const Vector3& half_extents, double mass, const Vector3& position,
                    const Vector3& velocity = Vector3::Zero());
  // Without a shape.
  WorldBuilder& point(double mass, const Vector3& inertia, const Vector3& position);

  // A force that acts on all bodies added so far that can move.
  WorldBuilder& gravity(const Vector3& acceleration);
  // A force of the type on the last body, properties flattened.
  WorldBuilder& force(const std::string& type, const std::string& library, std::vector<double> parameters);
  WorldBuilder& joint(const std::string& type, const std::string& library, std::uint32_t body1, std::uint32_t body2,
                      std::vector<double> parameters);

  const kernel::EnvironmentDescription& description() const { return description_; }
  kernel::EnvironmentDescription& description() { return description_; }

 private:
  std::uint32_t plugin_index(Slot slot, const std::string& path);
  void add_body(kernel::BodyDescription body, const std::string& type, std::vector<double> parameters);

  kernel::EnvironmentDescription description_;
};

// A box that slides and topples on the ground, two balls on a joint that can break when they land, a force that is asked
// in every step and one that acts once.
WorldBuilder busy_world(kernel::Hosting hosting, double breaking_force = 0.0);

}  // namespace gravitas::harness
