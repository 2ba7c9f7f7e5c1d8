#include "workers/collision/standard/moving_pairs.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/geometry/support_map_buffer.h"
#include "plugin_sdk/math/rotation.h"
#include "workers/collision/standard/composite_pairs.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {
namespace {

constexpr double kMostPieces = 256.0;

MovingSolid solid_of(const SupportMap* map, const MovingBody& body) {
  return {map, body.geometry, body.start, body.motion};
}

// The convex hull of a mesh: the farthest of its vertices, by its tree.
class MeshHullMap final : public SupportMap {
 public:
  MeshHullMap(const TriangleMesh& mesh, double radius) : mesh_(mesh) {
    radius_ = radius;
    thinnest_ = mesh.box().half_extents().maxCoeff();
    centre_ = mesh.box().centre();
  }
  Vector3 support(const Vector3& d) const override {
    double best = -std::numeric_limits<double>::infinity();
    std::uint32_t farthest = 0;
    std::array<std::uint32_t, 128> stack;
    std::size_t depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const TriangleMesh::Node& node = mesh_.nodes()[stack[--depth]];
      if (!(reach(node.box, d) > best)) continue;
      if (node.count == 0) {
        const std::uint32_t near = node.first, far = node.first + 1;
        const bool is_first = reach(mesh_.nodes()[near].box, d) >= reach(mesh_.nodes()[far].box, d);
        stack[depth++] = is_first ? far : near;
        stack[depth++] = is_first ? near : far;
        continue;
      }
      for (std::uint32_t i = 0; i < node.count; ++i) {
        for (const std::uint32_t v : mesh_.triangles()[mesh_.order()[node.first + i]]) {
          const double along = d.dot(mesh_.vertices()[v]);
          if (along > best) best = along, farthest = v;
        }
      }
    }
    return mesh_.vertices()[farthest];
  }

 private:
  // of a box along d, rounded up
  static double reach(const Box3& box, const Vector3& d) {
    const double far = d.cwiseAbs().dot(box.lower.cwiseAbs().cwiseMax(box.upper.cwiseAbs()));
    return d.cwiseProduct(box.lower).cwiseMax(d.cwiseProduct(box.upper)).sum() + 1e-15 * far;
  }
  const TriangleMesh& mesh_;
};

// ---- meshes

// The earliest impact so far, and the part of the interval in which an earlier one could be.
struct Search {
  double target_gap;
  TimeSpan span;
  std::optional<Impact> best;

  void offer(const std::optional<Impact>& impact) {
    if (!impact || (best && !(impact->fraction < best->fraction))) return;
    best = impact, span.end = impact->fraction;
  }
};

Pose placed(const MovingBody& body, double time) {
  return compose(moved(body.start, body.motion, time), body.geometry);
}

// Calls look(pose of `other` in the mesh, how far it moves from there within the piece) for one piece of the interval
// after the other, until one has an impact.
template <typename Look>
void for_each_piece(const MovingBody& mesh, const MovingBody& other, double travel, double size, Search* search,
                    const Look& look) {
  const double wanted = std::ceil(travel / size);
  const double pieces = wanted <= kMostPieces ? std::max(wanted, 1.0) : kMostPieces;
  for (double i = 0.0; i < pieces; i += 1.0) {
    const double begin = i / pieces, end = (i + 1.0) / pieces, middle = 0.5 * (begin + end);
    if (search->best && search->best->fraction <= begin) return;
    search->span = {begin, search->best ? std::min(end, search->best->fraction) : end};
    look(relative(placed(mesh, middle), placed(other, middle)), (0.5 / pieces) * travel * (1.0 + 1e-12));
  }
}

// The overlap of a closed mesh with what has this point inside, as it starts.
void look_inside(const TriangleMesh& mesh, const MovingBody& body, const Vector3& point_W, bool is_reversed,
                 Search* search) {
  if (!mesh.is_closed()) return;
  const Pose X_WM = compose(body.start, body.geometry);
  const Vector3 point = inverse_transform_point(X_WM, point_W);
  if (!(mesh.box().squared_distance(point) == 0.0)) return;
  const TriangleMesh::Nearest nearest = mesh.nearest(point);
  if (!(nearest.signed_distance < 0.0)) return;
  const Vector3 out = X_WM.orientation * nearest.outward;
  search->offer(Impact{0.0, is_reversed ? Vector3(-out) : out, transform_point(X_WM, 0.5 * (nearest.point + point)),
                       -nearest.signed_distance});
}

Impact reversed(Impact impact) {
  impact.normal = -impact.normal;
  return impact;
}

Box3 box_of(const SupportMap& map, const Pose& pose) {
  const Matrix3 R = to_rotation_matrix(pose.orientation);
  Box3 box;
  for (int i = 0; i < 3; ++i) {
    const Vector3 axis = R.row(i).transpose();
    box.upper[i] = pose.position[i] + axis.dot(map.support(axis)) + map.rounding();
    box.lower[i] = pose.position[i] + axis.dot(map.support(-axis)) - map.rounding();
  }
  return box;
}

void move_mesh_convex(const TriangleMesh& mesh, const MovingBody& mesh_body, const SupportMap& map,
                      const MovingBody& body, bool is_reversed, Search* search) {
  look_inside(mesh, mesh_body, transform_point(compose(body.start, body.geometry), map.centre()), is_reversed, search);
  const MovingSolid solid = solid_of(&map, body);
  const double travel = greatest_travel(solid, {nullptr, mesh_body.geometry, mesh_body.start, mesh_body.motion});
  const double rounding = 1e-12 * (mesh.box().half_extents().maxCoeff() + map.radius());
  for_each_piece(mesh_body, body, travel, 2.0 * map.radius(), search, [&](const Pose& X_MC, double way) {
    mesh.for_each_in(box_of(map, X_MC).widened(way + search->target_gap + rounding), [&](std::uint32_t t) {
      const TriangleMap triangle(mesh.corners(t), mesh.normal(t));
      const std::optional<Impact> impact =
          gravitas::first_impact(solid_of(&triangle, mesh_body), solid, search->target_gap, search->span);
      search->offer(impact && is_reversed ? reversed(*impact) : impact);
    });
  });
}

void move_mesh_mesh(const Shape& a, const MovingBody& body_a, const Shape& b, const MovingBody& body_b,
                    Search* search) {
  const TriangleMesh &mesh_a = *a.mesh, &mesh_b = *b.mesh;
  look_inside(mesh_a, body_a, transform_point(compose(body_b.start, body_b.geometry), mesh_b.vertices()[0]), false,
              search);
  look_inside(mesh_b, body_b, transform_point(compose(body_a.start, body_a.geometry), mesh_a.vertices()[0]), true,
              search);
  const MeshHullMap hull_a(mesh_a, bounding_radius(a)), hull_b(mesh_b, bounding_radius(b));
  const double travel = greatest_travel(solid_of(&hull_b, body_b), solid_of(&hull_a, body_a));
  // pieces short against the triangles, of which pairs are tried
  const double size = 0.25 * std::min(hull_a.thinnest(), hull_b.thinnest());
  const double rounding = 1e-12 * (hull_a.radius() + hull_b.radius());
  for_each_piece(body_a, body_b, travel, size, search, [&](const Pose& X_AB, double way) {
    const double near = way + search->target_gap + rounding;
    const Matrix3 R = to_rotation_matrix(X_AB.orientation);
    const Vector3 half = R.cwiseAbs().transpose() * mesh_a.box().half_extents();
    const Vector3 middle = R.transpose() * (mesh_a.box().centre() - X_AB.position);
    mesh_b.for_each_in(Box3{middle - half, middle + half}.widened(near), [&](std::uint32_t tb) {
      const TriangleMap triangle_b(mesh_b.corners(tb), mesh_b.normal(tb));
      Box3 own;
      for (const Vector3& corner : mesh_b.corners(tb)) own.extend(X_AB.position + R * corner);
      mesh_a.for_each_in(own.widened(near), [&](std::uint32_t ta) {
        const TriangleMap triangle_a(mesh_a.corners(ta), mesh_a.normal(ta));
        search->offer(gravitas::first_impact(solid_of(&triangle_a, body_a), solid_of(&triangle_b, body_b),
                                             search->target_gap, search->span));
      });
    });
  });
}

// ---- all shapes

void move_parts(const Shape& a, const MovingBody& body_a, const Shape& b, const MovingBody& body_b, Search* search) {
  const auto child_of = [](const MovingBody& body, const Pose& child) {
    return MovingBody{compose(body.geometry, child), body.start, body.motion};
  };
  if (a.compound != nullptr) {
    for (const CompoundShape::Child& child : a.compound->children)
      move_parts(child.shape, child_of(body_a, child.pose), b, body_b, search);
    return;
  }
  if (b.compound != nullptr) {
    for (const CompoundShape::Child& child : b.compound->children)
      move_parts(a, body_a, child.shape, child_of(body_b, child.pose), search);
    return;
  }
  search->span = {0.0, search->best ? search->best->fraction : 1.0};
  if (a.mesh != nullptr && b.mesh != nullptr) {
    move_mesh_mesh(a, body_a, b, body_b, search);
    return;
  }
  SupportMapBuffer buffer_a, buffer_b;
  const bool meets_halfspace = a.type == ShapeType::kHalfspace || b.type == ShapeType::kHalfspace;
  if (!meets_halfspace && a.mesh != nullptr) {
    move_mesh_convex(*a.mesh, body_a, support_map_of(b, &buffer_b), body_b, false, search);
  } else if (!meets_halfspace && b.mesh != nullptr) {
    move_mesh_convex(*b.mesh, body_b, support_map_of(a, &buffer_a), body_a, true, search);
  } else {
    std::optional<MeshHullMap> hull_a, hull_b;
    const auto map_of = [](const Shape& shape, SupportMapBuffer* buffer,
                           std::optional<MeshHullMap>* hull) -> const SupportMap* {
      if (shape.type == ShapeType::kHalfspace) return nullptr;
      if (shape.mesh != nullptr) return &hull->emplace(*shape.mesh, bounding_radius(shape));
      return &support_map_of(shape, buffer);
    };
    search->offer(gravitas::first_impact(solid_of(map_of(a, &buffer_a, &hull_a), body_a),
                                         solid_of(map_of(b, &buffer_b, &hull_b), body_b), search->target_gap,
                                         search->span));
  }
}

}  // namespace

std::optional<Impact> first_impact(const Shape& a, const MovingBody& body_a, const Shape& b, const MovingBody& body_b,
                                   double target_gap) {
  Search search{target_gap, {}, std::nullopt};
  move_parts(a, body_a, b, body_b, &search);
  return search.best;
}

std::optional<RayHit> cast_ray(const Shape& shape, const Pose& X_WS, const Ray& ray) {
  const Ray own = ray_in(X_WS, ray);
  std::optional<RayHit> hit;
  if (shape.scene != nullptr) {
    hit = gravitas::cast_ray(*shape.scene, own);
  } else if (shape.map != nullptr) {
    hit = gravitas::cast_ray(*shape.map, own);
  } else {
    SceneShape primitive;
    primitive.kind = shape.type == ShapeType::kHalfspace ? SceneShape::Kind::kHalfspace : kind_of(shape.type);
    primitive.size = shape.size;
    hit = gravitas::cast_ray(primitive, own);
  }
  if (hit) *hit = hit_from(X_WS, *hit);
  return hit;
}

}  // namespace gravitas::collision
