// What a scene may write for a shape beside what its plugin receives: faces with more than three corners, a file, the
// children of a compound by their ids.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/property_value.h"

namespace gravitas::scene {

// The other geometries of a scene.
class SiblingShapes {
 public:
  struct Found {
    std::shared_ptr<const SceneShape> shape;
    std::string why;  // there is none; empty: it was reported where it stands
  };
  virtual Found find(const std::string& id) = 0;

 protected:
  SiblingShapes() = default;
  ~SiblingShapes() = default;
  SiblingShapes(const SiblingShapes&) = default;
  SiblingShapes& operator=(const SiblingShapes&) = default;
};

// Numbers that take the place of what `values` leave empty.
struct ShapeExpansion {
  std::vector<double> vertices;  // three each; empty: nothing to replace
  std::vector<double> faces;
  std::string prefix;     // of a complaint: the file that was read
  TextPosition position;  // and where it was named
};

// Puts what stands in `values` into the form in which the declared type takes it. Vertices and Faces of a file are large
// and go to *expansion. False, with a problem, where a row is none, a file cannot be read, a polyhedron is not convex
// (the face of the scene is named), or a child is none.
bool expand_shape_values(const TypeDeclaration& type, const std::string& folder, SiblingShapes* siblings,
                         std::vector<NamedValue>* values, ShapeExpansion* expansion,
                         std::vector<PropertyProblem>* problems);

// Replaces the tables Vertices and Faces in flattened parameters.
void splice(const std::vector<Property>& declared, const ShapeExpansion& expansion, std::vector<double>* parameters);

}  // namespace gravitas::scene
