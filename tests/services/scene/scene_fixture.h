// What the tests of the scene language share: a catalogue of declared plugins that need no library,
// and reading and building in one call.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "kernel/description.h"
#include "services/catalog/catalog.h"
#include "services/scene/build.h"
#include "services/scene/overrides.h"
#include "services/scene/reader.h"

namespace gravitas::scene {

// Space DynamicBVH, Grid, KDTree; collision Standard (Sphere, Box, Cylinder, Halfspace, Blob); force plugins
// Gravity and Drag; constraint plugin Joints (Spherical, AngularMotor); solvers Sequential, LCP;
// integrators Euler, SemiImplicitEuler, RK4.
std::vector<InstalledPlugin> declared_plugins();

// A scene that was read, and what was said about it.
struct ReadScene {
  std::unique_ptr<SceneDocument> document = std::make_unique<SceneDocument>();
  Problems problems;
  bool is_good = false;

  v1::Scene& scene() { return document->scene(); }
};

// Reads one text by the name "scene".
ReadScene read(const std::string& text);

// Reads, applies overrides and builds.
struct BuiltScene {
  ReadScene read;
  std::optional<kernel::EnvironmentDescription> description;

  // All errors, or all warnings, as their readers see them.
  std::vector<std::string> errors() const;
  std::vector<std::string> warnings() const;
};

BuiltScene build(const std::string& text, const std::vector<std::string>& overrides = {});
BuiltScene build(const std::string& text, const std::vector<std::string>& overrides, Catalog catalog);

std::vector<std::string> texts(const std::vector<SceneError>& errors);

// A scene with one body, "Ball", whose properties are `body`: a ball "Unit" of radius 0.5, a
// "Brick" of half extents 1, 2, 3, a "Rod" of radius 0.5 and height 2, a half-space "Ground", and a
// "Blob" can be its geometry; "Down" and "Air" its forces; "Ice" its material. `body` begins at
// line 2, column 1.
std::string scene_with_body(const std::string& body);

}  // namespace gravitas::scene
