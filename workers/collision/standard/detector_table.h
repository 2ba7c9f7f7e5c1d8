// Which function answers a pair of shape types (§ 3.4), and how a new type joins.
//
// A new convex shape is one new file: a support map (plugin_sdk/geometry/support_map.h) and
//
//   const ShapeRegistration kEllipsoid(&declare_ellipsoid, &read_ellipsoid);
//
// It is declared with the others, so the scene language knows it, and meets every other shape by the general method. A
// closed form for one of its pairs is a line more:
//
//   const DetectorRegistration kOnPlane(ShapeType::kHalfspace, kEllipsoid.type(), &collide_halfspace_ellipsoid);
#pragma once

#include <memory>
#include <span>

#include "plugin_sdk/plugin.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {

inline constexpr std::size_t kMostShapeTypes = 32;

using ShapeDeclaration = TypeDeclaration (*)();
// The support map of a shape from its flattened properties; throws Refusal with the reason if there is none.
using ShapeReader = std::unique_ptr<SupportMap> (*)(PropertyCursor parameters);

struct RegisteredShape {
  ShapeDeclaration declaration;
  ShapeReader read;
};

// Objects of static storage; more types than kMostShapeTypes end the program when it starts.
class ShapeRegistration {
 public:
  ShapeRegistration(ShapeDeclaration declaration, ShapeReader read) noexcept;
  ShapeType type() const { return type_; }

 private:
  ShapeType type_;
};

class DetectorRegistration {
 public:
  // The function gets the shape of the lower type first.
  DetectorRegistration(ShapeType a, ShapeType b, PairFunction function) noexcept;
};

// In the order of registration: the first has the type kRegistered.
std::span<const RegisteredShape> registered_shapes();

// The function for a pair of convex types or half-spaces, a <= b.
PairFunction detector(ShapeType a, ShapeType b);

}  // namespace gravitas::collision
