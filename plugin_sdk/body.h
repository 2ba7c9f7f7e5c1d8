// What the columns of bodies mean: flags, and names for rows.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/types.h"
#include "schemas/frame/layout.h"

namespace gravitas {

// Bits of the `flags` column. A body without kMovable and kKinematic is immovable: it has inverse mass 0,
// keeps its pose and counts in no sum.
enum BodyFlag : std::uint32_t {
  kMovable = 1U << 0,    // answers to forces, joints and contacts
  kKinematic = 1U << 1,  // moves by its own velocities, whatever pushes it
  kUnbounded = 1U << 2,  // its shape has no bounds (a half-space)
  kHasShape = 1U << 3,   // takes part in collision
  kCanSleep = 1U << 4
};

inline constexpr std::uint32_t kNone = GRAVITAS_NONE;

// Bits of the `flags` column of Force.Wrenches: what is promised of the answer for every other state.
enum ApplicationFlag : std::uint32_t {
  kConstantWrench = 1U << 0,  // the wrench is the same in every state and at every time
  kHasPotential = 1U << 1     // the potential means something; with a constant wrench it is U(x) = U(x0) - f.(x - x0)
};

// Identity of a type name ("Sphere", "Gravity"): FNV-1a, so that it is the same in every plugin and language.
constexpr std::uint64_t type_id(std::string_view name) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

// Row i of a column of vectors or of quaternions (w, x, y, z).
inline Vector3 vector_at(std::span<const double> column, std::size_t row) {
  return {column[3 * row], column[3 * row + 1], column[3 * row + 2]};
}
inline Quaternion quaternion_at(std::span<const double> column, std::size_t row) {
  return {column[4 * row], column[4 * row + 1], column[4 * row + 2], column[4 * row + 3]};
}
inline void set_vector(std::span<double> column, std::size_t row, const Vector3& v) {
  column[3 * row] = v.x(), column[3 * row + 1] = v.y(), column[3 * row + 2] = v.z();
}
inline void set_quaternion(std::span<double> column, std::size_t row, const Quaternion& q) {
  column[4 * row] = q.w(), column[4 * row + 1] = q.x(), column[4 * row + 2] = q.y(), column[4 * row + 3] = q.z();
}

}  // namespace gravitas
