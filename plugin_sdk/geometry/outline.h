// Lines and boxes that show a shape: what debug geometry is made of.
//
// Lengths in m, in the frame that the pose puts the shape into.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/geometry/support_map.h"
#include "plugin_sdk/math/pose.h"

namespace gravitas {

using LineSegment = std::array<Vector3, 2>;

// Chords of a full circle: every point that is drawn lies on the surface, the chord's middle is 0.9 % of the radius
// inside.
inline constexpr std::uint32_t kChords = 24;

// Edges of flat faces, each once, in the order of the faces; those of all triangles of a mesh, flush ones included.
// Round shapes by circles and lines along their sides; a half-space by the square of its surface that reaches to
// `extent` along x and z, and its middle lines. Children of a compound one after the other.
void append_outline(const SceneShape& shape, const Pose& pose, double extent, std::vector<LineSegment>* lines);

// Of a convex shape of which nothing else is known: its support points round the three axes.
void append_outline(const SupportMap& map, const Pose& pose, std::vector<LineSegment>* lines);

// A node of a tree over the parts of a shape.
struct OutlineNode {
  std::uint32_t depth = 0;
  Pose pose;  // of the box: its centre and its axes
  Vector3 half_extents = Vector3::Zero();
};

// The trees of meshes, a parent before its children; nothing for other shapes.
void append_tree(const SceneShape& shape, const Pose& pose, std::vector<OutlineNode>* nodes);

}  // namespace gravitas
