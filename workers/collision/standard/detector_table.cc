#include "workers/collision/standard/detector_table.h"

#include <array>
#include <exception>

namespace gravitas::collision {
namespace {

constexpr auto kFirst = static_cast<std::size_t>(ShapeType::kRegistered);

// initialised before any registration runs
constinit std::array<RegisteredShape, kMostShapeTypes> shape_types{};
constinit std::size_t shape_count = 0;
constinit std::array<std::array<PairFunction, kMostShapeTypes>, kMostShapeTypes> detectors{};

void collide_nothing(const Shape&, const Shape&, const Placement&, double, Manifold* out) { out->count = 0; }

// row: type of a, column: type of b, of the types with functions of their own
constexpr std::size_t kOwn = 4;
constexpr PairFunction kPairFunctions[kOwn][kOwn] = {
    {collide_sphere_sphere, collide_sphere_box, collide_sphere_cylinder, collide_sphere_halfspace},
    {nullptr, collide_box_box, collide_convex, collide_box_halfspace},
    {nullptr, nullptr, collide_convex, collide_cylinder_halfspace},
    {nullptr, nullptr, nullptr, collide_nothing},
};

}  // namespace

ShapeRegistration::ShapeRegistration(ShapeDeclaration declaration, ShapeReader read) noexcept
    : type_(static_cast<ShapeType>(kFirst + shape_count)) {
  if (kFirst + shape_count >= kMostShapeTypes) std::terminate();
  shape_types[shape_count++] = {declaration, read};
}

DetectorRegistration::DetectorRegistration(ShapeType a, ShapeType b, PairFunction function) noexcept {
  detectors[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] = function;
}

std::span<const RegisteredShape> registered_shapes() { return {shape_types.data(), shape_count}; }

PairFunction detector(ShapeType a, ShapeType b) {
  const auto row = static_cast<std::size_t>(a), column = static_cast<std::size_t>(b);
  if (row < kOwn && column < kOwn) return kPairFunctions[row][column];
  if (detectors[row][column] != nullptr) return detectors[row][column];
  return a == ShapeType::kHalfspace ? collide_halfspace_general : collide_general;
}

}  // namespace gravitas::collision
