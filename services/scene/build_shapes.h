// Geometries: what the kernel sends to the collision plugin, and what is known of a shape here.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/geometry/mass_properties.h"
#include "services/scene/build_context.h"

namespace gravitas::scene {

// A shape in its own frame, as far as this service knows it. Sizes in m.
struct Solid {
  enum class Kind : std::uint32_t {
    kUnknown,   // the plugin's own: no mass, no bound
    kSphere,    // size.x: radius
    kBox,       // size: half extents
    kCylinder,  // size.x: radius, size.y: height; axis y
    kHalfspace
  };
  Kind kind = Kind::kUnknown;
  Vector3 size = Vector3::Zero();
  bool is_good = true;  // its properties had no error

  bool is_unbounded() const { return kind == Kind::kHalfspace; }
  bool has_mass() const { return kind != Kind::kUnknown && kind != Kind::kHalfspace; }
};

// Of a bounded, known shape. Density in kg/m^3, > 0.
MassProperties mass_properties(const Solid& solid, double density);

// The bound that BoundingVolumeType asks for ("" is the default), in the body's frame B.
kernel::LocalBound local_bound(const Solid& solid, const std::string& bounding_volume_type, const Pose& X_BG);

// Fills description.shapes, a row per Geometry, and returns what is known of each. `collision` may
// be null if there is no geometry.
std::vector<Solid> build_shapes(const InstalledPlugin* collision, BuildContext* context);

}  // namespace gravitas::scene
