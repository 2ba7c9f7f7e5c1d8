#include "services/campaign/scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>

#include "kernel/environment.h"
#include "plugin_sdk/slots.h"
#include "services/catalog/catalog.h"
#include "services/run/session.h"
#include "services/scene/build.h"
#include "services/scene/reader.h"

namespace gravitas::campaign {
namespace {

struct BuiltIn {
  const char* name;
  const char* text;
  const char* plugins = "";
};

// Contacts, joints, and a force that is asked in every step.
constexpr const char* kAll = R"(
Geometries {
  Geometry { Type = "Halfspace" Id = "Plane" }
  Geometry { Type = "Box" Id = "Block" CustomProperties { HalfExtents = {0.5, 0.4, 0.3} } }
  Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.5 } }
}
Forces {
  Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } }
  Force { Type = "Basic" Id = "Thrust" CustomProperties { ApplicationPoint = {0.1, 0, 0.2} Force = {0.5, 0.2, 3} Frame = "Body" } }
}
Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.01 Duration = 5 } }
Environment {
  Id = "all"
  Space { Type = "Grid" Id = "Pairs"
    Bodies {
      Body { Type = "Rigid" Id = "Ground" GeometryId = "Plane" BoundingVolumeType = "None" }
      Body { Type = "Rigid" Id = "Sliding" GeometryId = "Block" Mass = 2 Forces = {"Down", "Thrust"}
        KineticProperties { Position = {0, 0.4, 0} LinearVelocity = {2, 0, 0.5} } }
      Body { Type = "Rigid" Id = "Left" GeometryId = "Ball" Mass = 1 Forces = {"Down", "Thrust"}
        KineticProperties { Position = {3, 0.6, 0} } }
      Body { Type = "Rigid" Id = "Right" GeometryId = "Ball" Mass = 1 Forces = {"Down"}
        KineticProperties { Position = {4.5, 0.55, 0} LinearVelocity = {0, 0, 1} } }
    }
  }
  Constraints {
    Constraint { Type = "Spherical" Id = "Elbow" Body1 = "Left" Body2 = "Right" CustomProperties { BindPoint = {3.75, 0.6, 0} } }
  }
  KineticIntegrator = "SemiImplicitEuler"
  ConstraintSolver = "Sequential"
}
)";

constexpr std::array<BuiltIn, 4> kBuiltIn = {{
    {"contacts", R"(
Geometries {
  Geometry { Type = "Halfspace" Id = "Plane" }
  Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.5 } }
  Geometry { Type = "Box" Id = "Block" CustomProperties { HalfExtents = {0.5, 0.4, 0.3} } }
}
Materials { Material { Id = "Rubber" RestitutionCoefficient = 0.3 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.01 Duration = 5 } }
Environment {
  Id = "contacts"
  Space { Type = "Basic" Id = "Pairs"
    Bodies {
      Body { Type = "Rigid" Id = "Ground" GeometryId = "Plane" BoundingVolumeType = "None" Material = "Rubber" }
      Body { Type = "Rigid" Id = "Sliding" GeometryId = "Block" Mass = 2 Material = "Rubber" Forces = {"Down"}
        KineticProperties { Position = {0, 0.4, 0} LinearVelocity = {2, 0, 0.5} } }
      Body { Type = "Rigid" Id = "Falling" GeometryId = "Ball" Mass = 1 Material = "Rubber" Forces = {"Down"}
        KineticProperties { Position = {0.1, 1.35, 0} } }
      Body { Type = "Rigid" Id = "Rolling" GeometryId = "Ball" Mass = 1 Material = "Rubber" Forces = {"Down"}
        KineticProperties { Position = {-2, 0.5, 0} LinearVelocity = {3, 0, 0} AngularVelocity = {0, 0, -6} } }
    }
  }
  KineticIntegrator = "SemiImplicitEuler"
  ConstraintSolver = "Sequential"
}
)"},
    {"joints", R"(
Geometries { Geometry { Type = "Sphere" Id = "Bob" CustomProperties { Radius = 0.3 } } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.005 Duration = 5 } }
Environment {
  Id = "joints"
  Space { Type = "Grid" Id = "Pairs"
    Bodies {
      Body { Type = "Rigid" Id = "Upper" GeometryId = "Bob" Mass = 1 Forces = {"Down"}
        KineticProperties { Position = {0.5, 0, 0} } }
      Body { Type = "Rigid" Id = "Lower" GeometryId = "Bob" Mass = 1 Forces = {"Down"}
        KineticProperties { Position = {1.2, 0, 0} AngularVelocity = {0, 1, 0} } }
      Body { Type = "Rigid" Id = "Free" GeometryId = "Bob" Mass = 1 Forces = {"Down"}
        KineticProperties { Position = {1.3, 0.7, 0} } }
    }
  }
  Constraints {
    Constraint { Type = "Spherical" Id = "Pivot" Body1 = "Upper" CustomProperties { BindPoint = {0, 0, 0} } }
    Constraint { Type = "Spherical" Id = "Elbow" Body1 = "Upper" Body2 = "Lower" CustomProperties { BindPoint = {0.8, 0, 0} } }
  }
  KineticIntegrator = "Euler"
  ConstraintSolver = "Sequential"
}
)"},
    {"all", kAll},
    {"shared", kAll, R"(
Plugins {
  Plugin { Slot = "space" Process = "one" } Plugin { Slot = "collision" Process = "two" }
  Plugin { Slot = "constraint" Process = "two" } Plugin { Slot = "solver" Process = "two" }
  Plugin { Slot = "force" Process = "one" } Plugin { Slot = "integrator" Process = "one" }
}
)"},
}};

std::vector<std::string> built_in_scenes() {
  std::vector<std::string> names;
  for (const BuiltIn& one : kBuiltIn) names.emplace_back(one.name);
  return names;
}

void require(const scene::Problems& problems) {
  if (problems.ok()) return;
  std::string text;
  for (const scene::SceneError& error : problems.errors) text += (text.empty() ? "" : "\n") + scene::to_string(error);
  throw BadInput(text);
}

kernel::EnvironmentDescription describe(const std::string& name, Catalog* catalog) {
  scene::Problems problems;
  scene::SceneDocument document;
  const auto found = std::ranges::find_if(kBuiltIn, [&](const BuiltIn& one) { return name == one.name; });
  if (found != kBuiltIn.end()) {
    const std::array<scene::SceneText, 2> texts = {{{name, found->text}, {name + ", plugins", found->plugins}}};
    scene::read_texts(texts, &document, &problems);
  } else {
    if (!std::filesystem::exists(name))
      throw BadInput(
          fmt::format("there is no scene '{}': neither a file, nor one of contacts, joints, all, shared", name));
    const std::array<std::string, 1> files = {name};
    scene::read_files(files, &document, &problems);
  }
  require(problems);
  std::optional<kernel::EnvironmentDescription> description = scene::build(document.scene(), catalog, &problems);
  require(problems);
  return std::move(*description);
}

void run_quietly(Scene* scene, std::uint32_t steps) {
  kernel::EnvironmentDescription description = scene->description;
  for (const Slot slot : kSlots) description.slot(slot).hosting = kernel::Hosting::kDirect;
  const std::unique_ptr<kernel::Environment> world = start(description);
  for (const kernel::PlannedSlot& planned : world->plan().slots)
    if (std::ranges::find(scene->slots, planned.slot) == scene->slots.end()) scene->slots.push_back(planned.slot);
  scene->chains.push_back(world->chain_hash());
  while (world->step_count() < steps) {
    if (world->step() != kernel::StepOutcome::kCommitted)
      throw BadInput(fmt::format("scene '{}' does not run without faults: step {}: {}", scene->name,
                                 world->step_count() + 1, world->fault()->fault.text()));
    scene->chains.push_back(world->chain_hash());
  }
}

}  // namespace

std::vector<Slot> sharing(const Scene& scene, Slot slot) {
  std::vector<Slot> all;
  const std::string& process = scene.description.slot(slot).process;
  for (const Slot other : scene.slots)
    if (other == slot || (!process.empty() && scene.description.slot(other).process == process)) all.push_back(other);
  return all;
}

std::vector<Scene> load_scenes(const std::vector<std::string>& names, std::uint32_t steps) {
  Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  std::vector<Scene> scenes;
  for (const std::string& name : names.empty() ? built_in_scenes() : names) {
    Scene scene;
    scene.name = name;
    scene.description = describe(name, &catalog);
    scene.description.steps = steps;
    scene.description.last_time_step = scene.description.time_step;
    run_quietly(&scene, steps);
    for (const Slot slot : scene.slots)
      for (const kernel::PluginChoice& plugin : scene.description.slot(slot).plugins) {
        if (!plugin.address.empty())
          throw BadInput(fmt::format(
              "scene '{}': the worker of slot {} is at an Address, and could not be started again; allowed: "
              "plugins that are installed, a Library, a Command",
              name, slot_name(slot)));
        if (!plugin.command.empty() && std::ranges::find(scene.commands, slot) == scene.commands.end())
          scene.commands.push_back(slot);
      }
    if (scene.slots.empty())
      throw BadInput(fmt::format("scene '{}' needs no plugin at all: there is nothing to inject faults into", name));
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace gravitas::campaign
