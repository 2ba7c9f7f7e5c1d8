// Geometries: what the kernel sends to the collision plugin, and what is known of a shape here.
#pragma once

#include <memory>
#include <vector>

#include "plugin_sdk/geometry/scene_shape.h"
#include "services/scene/build_context.h"

namespace gravitas::scene {

// A shape as far as this service knows it: all those of scene_shape_types(). A type that is the plugin's own has no mass
// and no bound here.
struct Solid {
  std::shared_ptr<const SceneShape> shape;  // null: not known
  bool is_good = true;                      // its properties had no error

  bool is_unbounded() const { return shape && shape->is_unbounded(); }
  bool has_mass() const { return shape && !shape->is_unbounded(); }
  // A surface that encloses nothing: its mass is that of a shell.
  bool is_shell() const { return shape && shape->mesh && !shape->mesh->is_closed(); }
};

// The bound that BoundingVolumeType asks for ("" is the default), in the body's frame B.
LocalBound local_bound(const Solid& solid, const std::string& bounding_volume_type, const Pose& X_BG);

// Fills description.shapes, a row per Geometry, and returns what is known of each. `collision` may
// be null if there is no geometry.
std::vector<Solid> build_shapes(const InstalledPlugin* collision, BuildContext* context);

}  // namespace gravitas::scene
