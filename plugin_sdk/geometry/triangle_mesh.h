// Triangle meshes: cleaned and joined up when they are made, with a tree of boxes for every question about places.
//
// Lengths in m, in the mesh's own frame. The same input gives the same mesh, bit for bit.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

// An axis-aligned box; holds nothing until it is extended.
struct Box3 {
  Vector3 lower = Vector3::Constant(std::numeric_limits<double>::infinity());
  Vector3 upper = Vector3::Constant(-std::numeric_limits<double>::infinity());

  void extend(const Vector3& p) { lower = lower.cwiseMin(p), upper = upper.cwiseMax(p); }
  void extend(const Box3& b) { lower = lower.cwiseMin(b.lower), upper = upper.cwiseMax(b.upper); }
  Vector3 centre() const { return 0.5 * (lower + upper); }
  Vector3 half_extents() const { return 0.5 * (upper - lower); }
  bool overlaps(const Box3& b) const {
    return (lower.array() <= b.upper.array()).all() && (b.lower.array() <= upper.array()).all();
  }
  Box3 widened(double by) const { return {lower - Vector3::Constant(by), upper + Vector3::Constant(by)}; }
  // of p from the box, squared; 0 inside
  double squared_distance(const Vector3& p) const {
    return (lower - p).cwiseMax(p - upper).cwiseMax(0.0).squaredNorm();
  }
};

struct MeshOptions {
  std::uint32_t maximum_depth = 48;     // of the tree
  std::uint32_t minimum_node_size = 4;  // a node with no more triangles is not divided
};

class TriangleMesh {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFF;
  using Triangle = std::array<std::uint32_t, 3>;

  // Equal vertices become one; triangles without area are dropped and counted. Nothing, and in *why the vertex or
  // triangle (from 0) and what is wrong with it, if a vertex is not finite, an index is none of a vertex, or no
  // triangle is left. A mesh that is closed and inside out is turned round.
  static std::optional<TriangleMesh> make(std::span<const Vector3> vertices, std::span<const Triangle> triangles,
                                          const MeshOptions& options, std::string* why);

  const std::vector<Vector3>& vertices() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  std::array<Vector3, 3> corners(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }
  // Unit, on the side from which the corners run counter-clockwise.
  const Vector3& normal(std::uint32_t triangle) const { return normals_[triangle]; }
  // The triangle across the edge from corner k to corner k + 1; kNone at a border and where more than two meet.
  std::uint32_t neighbour(std::uint32_t triangle, int edge) const {
    return neighbours_[triangle][static_cast<std::size_t>(edge)];
  }
  // The flat face that a triangle is part of, by the lowest of its triangles: those that are joined over edges and lie in the
  // plane of that one, to rounding.
  std::uint32_t flat_face(std::uint32_t triangle) const { return flat_faces_[triangle]; }
  // The triangles round a vertex, ascending.
  std::span<const std::uint32_t> ring(std::uint32_t vertex) const {
    return std::span(rings_).subspan(ring_begin_[vertex], ring_begin_[vertex + 1] - ring_begin_[vertex]);
  }
  // Every edge has two triangles that run along it in opposite ways: the mesh bounds a solid, its normals outward.
  bool is_closed() const { return is_closed_; }
  std::size_t dropped() const { return dropped_; }
  const MeshOptions& options() const { return options_; }
  const Box3& box() const { return nodes_[0].box; }

  // A node's children are `first` and `first` + 1, or, where count > 0, its triangles are count entries of order()
  // from `first`.
  struct Node {
    Box3 box;
    std::uint32_t first;
    std::uint32_t count;
  };
  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<std::uint32_t>& order() const { return order_; }

  // Calls visit(triangle) for every triangle whose box overlaps `box`, in a fixed order.
  template <typename Visit>
  void for_each_in(const Box3& box, const Visit& visit) const;

  struct Nearest {
    std::uint32_t triangle = kNone;
    Vector3 point = Vector3::Zero();
    double signed_distance = 0.0;  // m, < 0 on the side of the solid; the sign means something if the mesh is closed
    // Unit, the way in which that grows; on the surface, where it has none, the mean normal round the nearest place.
    Vector3 outward = Vector3::UnitY();
  };
  Nearest nearest(const Vector3& p) const;

  struct Hit {
    double distance;  // along the ray, in units of its direction's length
    std::uint32_t triangle;
  };
  // The first triangle that the ray origin + t direction, 0 <= t <= limit, meets from either side.
  std::optional<Hit> cast_ray(const Vector3& origin, const Vector3& direction, double limit) const;

 private:
  TriangleMesh() = default;
  void join();
  void find_flat_faces();
  void build_tree();

  std::vector<Vector3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<Vector3> normals_;
  std::vector<std::array<std::uint32_t, 3>> neighbours_;
  std::vector<std::uint32_t> flat_faces_;
  std::vector<std::uint32_t> ring_begin_;
  std::vector<std::uint32_t> rings_;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> order_;
  MeshOptions options_;
  std::size_t dropped_ = 0;
  bool is_closed_ = false;
};

template <typename Visit>
void TriangleMesh::for_each_in(const Box3& box, const Visit& visit) const {
  // as deep as the tree may be: MeshOptions are held to it
  std::array<std::uint32_t, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (!node.box.overlaps(box)) continue;
    if (node.count == 0) {
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      const std::uint32_t triangle = order_[node.first + i];
      Box3 own;
      for (const Vector3& corner : corners(triangle)) own.extend(corner);
      if (own.overlaps(box)) visit(triangle);
    }
  }
}

}  // namespace gravitas
