#include "workers/collision/standard/composite_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "plugin_sdk/geometry/contour_contacts.h"
#include "plugin_sdk/geometry/simplex.h"
#include "plugin_sdk/geometry/support_map_buffer.h"
#include "workers/collision/standard/flat_faces.h"
#include "workers/collision/standard/narrow_phase.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {
namespace {

// Heights over a plane, of the triangle's edges, that count as none.
constexpr double kLevel = 1e-7;
constexpr double kPatchPreference = 0.01;
// A neighbour whose normal is nearer to a contact's than the triangle's own, by this in the cosines, has the contact.
constexpr double kFacesMore = 0.5;
// Cosine of an angle that is none: a contact's normal is that of the face.
constexpr double kOnFace = 1.0 - 1e-12;

// ---- normals of a mesh

enum class NormalKind {
  kOwn,     // in the mesh's normal cone at the triangle's feature
  kFlush,   // not, but the neighbours that stand in its way are flush with the triangle, or rise
  kForeign  // not: a neighbour has the contact, or it points into the solid
};

// What the unit normal n, which leads away from a triangle's feature farthest along it, is to the mesh. `side` is -1 where
// an open mesh is looked at from its back.
NormalKind classify(const TriangleMesh& mesh, std::uint32_t t, const Vector3& n, double side) {
  const std::array<Vector3, 3> x = mesh.corners(t);
  const Vector3 own = side * mesh.normal(t);
  double longest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, (x[(k + 1) % 3] - x[k]).squaredNorm());
  longest = std::sqrt(longest);
  const std::array<double, 3> height = {n.dot(x[0]), n.dot(x[1]), n.dot(x[2])};
  const double top = std::max({height[0], height[1], height[2]});
  std::array<bool, 3> touches{};
  std::size_t count = 0;
  // an edge counts as touching up to a milliradian: the feature's neighbours are those of the edge
  for (std::size_t k = 0; k < 3; ++k) count += (touches[k] = height[k] >= top - 1e-3 * longest) ? 1 : 0;
  if (count == 3) return n.dot(own) > 0.0 ? NormalKind::kOwn : NormalKind::kForeign;

  double facing = n.dot(own);
  bool is_own = true, is_flush = true, has_border = false;
  const auto look = [&](std::uint32_t around) {
    if (around == t) return;
    facing = std::max(facing, n.dot(side * mesh.normal(around)));
    const std::array<Vector3, 3> y = mesh.corners(around);
    for (const Vector3& corner : y) {
      if (n.dot(corner) <= top + kLevel * longest) continue;
      is_own = false;
      is_flush = is_flush && own.dot(corner - x[0]) >= -1e-3 * std::sqrt((corner - x[0]).squaredNorm());
    }
  };
  if (count == 2) {
    const int edge = touches[0] ? (touches[1] ? 0 : 2) : 1;
    const std::uint32_t neighbour = mesh.neighbour(t, edge);
    has_border = neighbour == TriangleMesh::kNone;
    if (!has_border) look(neighbour);
  } else {
    const std::size_t vertex = touches[0] ? 0 : (touches[1] ? 1 : 2);
    for (const std::uint32_t around : mesh.ring(mesh.triangles()[t][vertex])) look(around);
    has_border = !mesh.is_closed();
  }
  if (!(facing > 0.0) && !has_border) return NormalKind::kForeign;
  if (is_own) return NormalKind::kOwn;
  return is_flush && n.dot(own) >= facing - kFacesMore ? NormalKind::kFlush : NormalKind::kForeign;
}

// ---- a triangle and a convex shape, in the frame of the triangle

struct TriangleSide {
  const TriangleMesh& mesh;
  std::uint32_t triangle;
  double side;  // +1 or -1
  Matrix3 R;    // the mesh's axes in the frame of the pair

  Vector3 normal() const { return R * (side * mesh.normal(triangle)); }
  NormalKind kind(const Vector3& n) const { return classify(mesh, triangle, R.transpose() * n, side); }
  // m: of a solid
  double half_thickness() const {
    return mesh.is_closed() ? mesh.box().half_extents().minCoeff() : std::numeric_limits<double>::infinity();
  }
};

// The normal at which a triangle `a` touches the other side of the pair: nothing if it is not for it to say. `other` is
// the triangle on that side, if it is one.
bool choose_normal(const PlacedPair& pair, const TriangleSide& a, const TriangleSide* other, const Separation& least,
                   Vector3* normal, bool* is_least) {
  const double tie = std::max(1e-7 * pair.thinnest(), 1e-14 * pair.reach());
  const auto within = [&](double depth) {
    return least.depth >= depth - tie - kPatchPreference * std::max(depth, 0.0);
  };
  const auto allows = [&](const Vector3& n) {
    return a.kind(n) == NormalKind::kOwn && (other == nullptr || other->kind(-n) == NormalKind::kOwn);
  };
  *is_least = false;
  // faces first, as near as they come to the least
  *normal = a.normal();
  if (within(pair.depth_along(*normal)) && allows(*normal)) return true;
  if (other != nullptr) {
    *normal = -other->normal();
    if (within(pair.depth_along(*normal)) && allows(*normal)) return true;
  }
  *normal = least.normal;
  *is_least = true;
  const NormalKind kind = a.kind(*normal);
  const NormalKind other_kind = other == nullptr ? NormalKind::kOwn : other->kind(-*normal);
  if (kind == NormalKind::kOwn && other_kind == NormalKind::kOwn) return true;
  if (kind == NormalKind::kForeign || other_kind == NormalKind::kForeign) return false;
  *is_least = false;
  *normal = kind == NormalKind::kFlush ? a.normal() : Vector3(-other->normal());
  // what has sunk below the plane by more than half is no longer on it
  const Vector3 arm = pair.p_AB + pair.R_AB * pair.b.centre() - pair.a.centre();
  const bool is_sunk = other == nullptr
                           ? !(normal->dot(arm) > 0.0)
                           : pair.depth_along(*normal) > std::min(a.half_thickness(), other->half_thickness());
  if (is_sunk) return false;
  return allows(*normal);
}

// ---- mesh against convex, half-space and mesh

class Collector {
 public:
  Collector(const Pose& frame, std::uint64_t key, const Parts& parts, double merge, bool is_reversed, ContactList* out)
      : R_(frame.orientation.toRotationMatrix()),
        p_(frame.position),
        key_(key),
        parts_(parts),
        merge_(merge),
        is_reversed_(is_reversed),
        out_(out) {}

  // A contact in the frame, its normal from the mesh to the other.
  void add(std::uint64_t part, const ContactPoint& contact) const {
    out_->collect(key_of_part(key_, part), parts_, moved(contact), merge_);
  }
  void add(std::uint64_t part, const Manifold& manifold) const {
    for (int i = 0; i < manifold.count; ++i) add(part, manifold.contacts[static_cast<std::size_t>(i)]);
  }
  // What lies on a flat face: features keep their names from triangle to triangle.
  void add_on_face(std::uint32_t face, const ContactPoint& contact) const {
    out_->collect_on_face(key_of_part(key_, kFace | face), parts_, moved(contact), merge_);
  }
  void add_on_face(std::uint32_t face, const Manifold& manifold) const {
    for (int i = 0; i < manifold.count; ++i) add_on_face(face, manifold.contacts[static_cast<std::size_t>(i)]);
  }
  // Of a triangle.
  void add(const TriangleMesh& mesh, std::uint32_t t, const Manifold& manifold) const {
    for (int i = 0; i < manifold.count; ++i) {
      const ContactPoint& contact = manifold.contacts[static_cast<std::size_t>(i)];
      if (is_of_face(contact.feature)) {
        add_on_face(mesh.flat_face(t), contact);
      } else {
        add(t, contact);
      }
    }
  }

 private:
  static constexpr std::uint64_t kFace = std::uint64_t{1} << 32;  // beside all numbers of triangles

  ContactPoint moved(const ContactPoint& contact) const {
    ContactPoint moved = contact;
    moved.point = p_ + R_ * contact.point;
    moved.normal = R_ * contact.normal;
    if (is_reversed_) moved.normal = -moved.normal;
    return moved;
  }

  Matrix3 R_;
  Vector3 p_;
  std::uint64_t key_;
  Parts parts_;
  double merge_;
  bool is_reversed_;
  ContactList* out_;
};

// Lays the contacts of a triangle, `a` of its pair, flush with what the bodies rest on (seams.h).
struct Flush {
  const PairRests& rests;
  const Pose& X_FM;  // of the mesh in the frame of the rests
  double length;     // m

  void lay(const PlacedPair& pair, const Fronts& fronts, double margin, Manifold* manifold) const {
    lay_flush(pair, fronts, X_FM, rests, length, margin, manifold);
  }
  // Would it lay contacts along the front?
  bool turns(const PlacedPair& pair, const Vector3& front) const {
    return !flush_normal(pair, {front}, front, X_FM, rests, length).isZero(0.0);
  }
};

// Calls visit(triangle, separation) for every triangle that a ball comes within `margin` of, in a fixed order. Nothing is
// said of the separation where the centre is in the triangle, within rounding.
template <typename Visit>
void for_each_at_ball(const TriangleMesh& mesh, const Vector3& centre, double radius, double margin,
                      const Visit& visit) {
  const double reach = radius + margin, squared_reach = reach * reach;
  std::array<std::uint32_t, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const TriangleMesh::Node& node = mesh.nodes()[stack[--depth]];
    if (node.box.squared_distance(centre) > squared_reach) continue;
    if (node.count == 0) {
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      const std::uint32_t t = mesh.order()[node.first + i];
      const std::array<Vector3, 3> x = mesh.corners(t);
      // across the normal first: most triangles that are near are out of reach there
      const Vector3& up = mesh.normal(t);
      const double h = up.dot(centre), h0 = up.dot(x[0]), h1 = up.dot(x[1]), h2 = up.dot(x[2]);
      if (h - std::max({h0, h1, h2}) > reach || std::min({h0, h1, h2}) - h > reach) continue;
      const Vector3 way = -closest_on_triangle(x[0] - centre, x[1] - centre, x[2] - centre).point;
      const double squared = way.squaredNorm();
      if (squared > squared_reach) continue;
      const double distance = std::sqrt(squared);
      if (!(distance > 1e-11 * (radius + std::sqrt(centre.squaredNorm())))) {
        visit(t, std::nullopt);
        continue;
      }
      const Vector3 n = way / distance;
      visit(t, Separation{n, radius - distance, centre - way, centre - radius * n});
    }
  }
}

void collide_mesh_convex(const TriangleMesh& mesh, const OverMesh& over, const Flush& flush, double margin,
                         const Collector& out) {
  const SupportMap& map = over.map;
  const Matrix3& R = over.R;
  const Pose& X_MC = over.X_MC;
  const Vector3 centre = over.centre();
  const bool is_ball = map.rounding() == map.radius();
  FlatFaces faces(mesh, over, margin);
  // In a concave edge, and deep in small triangles, the shortest way out of each leads into another, and none claims the
  // contact: then all do that are about as shallow as any, along their faces.
  constexpr double kOfShallowest = 2.0;
  double shallowest = std::numeric_limits<double>::infinity();  // along the face of a triangle that claims nothing
  bool is_claimed = false, by_faces = false;
  const auto side_of = [&](std::uint32_t t, const TriangleMap& triangle) {
    const bool is_behind = !mesh.is_closed() && mesh.normal(t).dot(centre - triangle.centre()) < 0.0;
    return TriangleSide{mesh, t, is_behind ? -1.0 : 1.0, Matrix3::Identity()};
  };
  const auto collide_triangle = [&](std::uint32_t t, const std::optional<Separation>& known) {
    const FlatFaces::Plane* const plane = by_faces ? nullptr : faces.holding(t);
    if (plane != nullptr && plane->is_covered) return;
    const TriangleMap triangle(mesh.corners(t), mesh.normal(t));
    const PlacedPair pair{triangle, map, R, X_MC.position};
    Separation least;
    if (plane == nullptr) {
      least = known ? *known : find_separation(pair, margin);
      if (!(least.depth >= -margin)) return;
    }
    const TriangleSide side = side_of(t, triangle);
    const Vector3 up = side.normal();
    const bool is_before = up.dot(centre - triangle.centre()) > 0.0;
    Vector3 normal;
    bool is_least = false;
    Manifold manifold;
    if (by_faces) {
      if (is_before && pair.depth_along(up) <= kOfShallowest * shallowest)
        contacts_along(pair, up, margin, &least, &manifold);
    } else if (plane != nullptr || choose_normal(pair, side, nullptr, least, &normal, &is_least)) {
      if (plane != nullptr) normal = plane->up;
      const FeatureTest is_inside = [&side](std::uint32_t feature) {
        return is_inside_flat_face(side.mesh, side.triangle, side.side < 0.0, feature);
      };
      const bool is_flat = normal.dot(up) > kOnFace;
      contacts_along(pair, normal, margin, is_least ? &least : nullptr, &manifold, is_flat ? is_inside : nullptr);
    }
    flush.lay(pair, {up}, margin, &manifold);
    is_claimed = is_claimed || manifold.count > 0;
    if (manifold.count == 0 && is_before)
      shallowest = std::min(shallowest, std::max(1e-6 * map.radius(), pair.depth_along(up)));
    out.add(mesh, t, manifold);
  };
  // whether the way out of a triangle with the lowest point of the body is that along its face, if others of it have their say
  const auto touches_along_face = [&](std::uint32_t t) {
    const TriangleMap triangle(mesh.corners(t), mesh.normal(t));
    const PlacedPair pair{triangle, map, R, X_MC.position};
    const Separation least = find_separation(pair, margin);
    if (!(least.depth >= -margin)) return false;
    const TriangleSide side = side_of(t, triangle);
    Vector3 normal;
    bool is_least = false;
    return leads_out_inside_flat_face(mesh, t, least.normal) ||
           (choose_normal(pair, side, nullptr, least, &normal, &is_least) && normal.dot(side.normal()) > kOnFace);
  };
  const auto lies_flush = [&](std::uint32_t t) {
    if (flush.rests.are_none()) return false;
    const TriangleMap triangle(mesh.corners(t), mesh.normal(t));
    return flush.turns({triangle, map, R, X_MC.position}, side_of(t, triangle).normal());
  };
  const auto collide_triangles = [&] {
    if (is_ball) {
      for_each_at_ball(mesh, centre, map.radius(), margin, collide_triangle);
    } else {
      mesh.for_each_in(over.box().widened(margin), [&](std::uint32_t t) { collide_triangle(t, std::nullopt); });
    }
  };
  struct Near {
    std::uint32_t triangle;
    std::optional<Separation> known;
  };
  if (is_ball) {
    // planes over which the centre lies first, as far as there is room: most balls are near few triangles
    std::array<Near, 16> near;
    std::size_t count = 0;
    const auto collide_near = [&] {
      for (std::size_t i = 0; i < count; ++i) collide_triangle(near[i].triangle, near[i].known);
      count = 0;
    };
    for_each_at_ball(mesh, centre, map.radius(), margin, [&](std::uint32_t t, const std::optional<Separation>& known) {
      const double facing = known ? known->normal.dot(mesh.normal(t)) : 0.0;
      if ((mesh.is_closed() ? facing : std::fabs(facing)) > kOnFace)
        faces.take(t, facing < 0.0 ? Vector3(-mesh.normal(t)) : mesh.normal(t));
      if (count == near.size()) collide_near();
      near[count++] = {t, known};
    });
    collide_near();
  } else {
    const Matrix3 R_FM = flush.X_FM.orientation.toRotationMatrix();
    mesh.for_each_in(over.box().widened(margin), [&](std::uint32_t t) {
      Manifold manifold;
      if (faces.holding(t) != nullptr || lies_flush(t) || !faces.find(t, flush.rests.of_a, R_FM, &manifold)) return;
      if (manifold.count > 0) {
        faces.take(true);
        is_claimed = true;
        out.add_on_face(mesh.flat_face(t), manifold);
      } else if (touches_along_face(t)) {
        faces.take(false);
      }
    });
    collide_triangles();
  }
  if (!is_claimed && std::isfinite(shallowest)) {
    by_faces = true;
    collide_triangles();
  }
  if (!mesh.is_closed() || !mesh.box().overlaps({centre, centre})) return;
  const TriangleMesh::Nearest nearest = mesh.nearest(centre);
  if (!(nearest.signed_distance < 0.0)) return;
  const Vector3& n = nearest.outward;
  const Vector3 back = X_MC.position + R * map.support(R.transpose() * -n) - map.rounding() * n;
  const double depth = n.dot(nearest.point - back);
  out.add(TriangleMesh::kNone, ContactPoint{0.5 * (nearest.point + back), n, depth, 0});
}

void collide_mesh_halfspace(const TriangleMesh& mesh, const Vector3& up, const Vector3& origin, double margin,
                            const Collector& out) {
  std::array<std::uint32_t, 128> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const TriangleMesh::Node& node = mesh.nodes()[stack[--depth]];
    const double lowest = up.dot(node.box.centre() - origin) - up.cwiseAbs().dot(node.box.half_extents());
    // widened by a rounding: the corner itself is measured below
    if (lowest > margin * (1.0 + 1e-12) + 1e-12 * node.box.half_extents().maxCoeff()) continue;
    if (node.count == 0) {
      stack[depth++] = node.first + 1;
      stack[depth++] = node.first;
      continue;
    }
    for (std::uint32_t i = 0; i < node.count; ++i) {
      const std::uint32_t t = mesh.order()[node.first + i];
      for (const std::uint32_t v : mesh.triangles()[t]) {
        // each vertex by the first of its triangles
        if (mesh.ring(v)[0] != t) continue;
        const Vector3& x = mesh.vertices()[v];
        const double sunk = up.dot(origin - x);
        if (sunk >= -margin) out.add(v, ContactPoint{x + 0.5 * sunk * up, -up, sunk, 0});
      }
    }
  }
}

// How a mesh of which a vertex lies inside a closed one leaves that, over the place nearest to such a vertex, of some of them the
// one that is the least way. `sign` 1: the outer mesh is the first of the pair. Of meshes that do not cross all vertices lie inside
// or none. Infinitely deep if none does.
ContactPoint way_out_of_mesh(const TriangleMesh& outer, const TriangleMesh& inner, const Pose& X_OI, const Pose& X_AO,
                             double sign, bool cross) {
  constexpr std::size_t kTried = 32;  // each is a pass over all vertices
  ContactPoint least;
  least.depth = std::numeric_limits<double>::infinity();
  if (!outer.is_closed()) return least;
  std::size_t tried = 0;
  for (const Vector3& vertex : inner.vertices()) {
    const Vector3 p = transform_point(X_OI, vertex);
    TriangleMesh::Nearest nearest;
    const bool is_inside = outer.box().overlaps({p, p}) && (nearest = outer.nearest(p)).signed_distance < 0.0;
    if (!is_inside && !cross) break;
    if (!is_inside) continue;
    const Vector3& n = nearest.outward;
    Vector3 back = p;
    for (const Vector3& v : inner.vertices())
      if (const Vector3 x = transform_point(X_OI, v); n.dot(x - back) < 0.0) back = x;
    const double depth = n.dot(nearest.point - back);
    if (depth < least.depth)
      least = {transform_point(X_AO, 0.5 * (nearest.point + back)), sign * (X_AO.orientation * n), depth, 0};
    if (++tried == kTried) break;
  }
  return least;
}

void collide_mesh_mesh(const Shape& shape_a, const Shape& shape_b, const Pose& X_AB, const Flush& flush, double margin,
                       const Collector& out) {
  const TriangleMesh &a = *shape_a.mesh, &b = *shape_b.mesh;
  const Matrix3 R = X_AB.orientation.toRotationMatrix();
  const Vector3 centre_a = a.box().centre(), centre_b = X_AB.position + R * b.box().centre();
  // the box of a in b
  const Vector3 half = R.cwiseAbs().transpose() * a.box().half_extents();
  const Vector3 middle = R.transpose() * (centre_a - X_AB.position);
  const Box3 box{middle - half, middle + half};
  bool any = false, near = false, cross = false;
  const double reach = margin + 1e-12 * half.maxCoeff();  // or rounding
  b.for_each_in(box.widened(reach), [&](std::uint32_t tb) {
    std::array<Vector3, 3> corners = b.corners(tb);
    Box3 own;
    for (Vector3& corner : corners) own.extend(corner = X_AB.position + R * corner);
    const TriangleMap triangle_b(corners, R * b.normal(tb));
    a.for_each_in(own.widened(margin), [&](std::uint32_t ta) {
      const TriangleMap triangle_a(a.corners(ta), a.normal(ta));
      const PlacedPair pair{triangle_a, triangle_b, Matrix3::Identity(), Vector3::Zero()};
      const Separation least = find_separation(pair, reach);
      near = near || least.depth >= -reach;
      if (!(least.depth >= -margin)) return;
      cross = cross || least.depth > 0.0;
      const bool a_behind = !a.is_closed() && a.normal(ta).dot(centre_b - triangle_a.centre()) < 0.0;
      const bool b_behind = !b.is_closed() && triangle_b.normal().dot(centre_a - triangle_b.centre()) < 0.0;
      const TriangleSide side_a{a, ta, a_behind ? -1.0 : 1.0, Matrix3::Identity()};
      const TriangleSide side_b{b, tb, b_behind ? -1.0 : 1.0, R};
      Vector3 normal;
      bool is_least = false;
      if (!choose_normal(pair, side_a, &side_b, least, &normal, &is_least)) return;
      Manifold manifold;
      contacts_along(pair, normal, margin, is_least ? &least : nullptr, &manifold);
      flush.lay(pair, {side_a.normal(), side_b.normal()}, margin, &manifold);
      any = any || manifold.count > 0;
      out.add(std::uint64_t{ta} << 32 | tb, manifold);
    });
  });
  if (any) return;
  // triangles tell nothing: convex meshes part as the solids that they are
  const auto part_as_hulls = [&] {
    Manifold manifold;
    if (shape_a.hull != nullptr && shape_b.hull != nullptr)
      collide_support_maps({*shape_a.hull, *shape_b.hull, R, X_AB.position}, 0.0, &manifold);
    out.add(TriangleMesh::kNone, manifold);
    return manifold.count > 0;
  };
  if (cross && part_as_hulls()) return;
  // else one mesh leaves the other by the lesser way
  ContactPoint least = way_out_of_mesh(a, b, X_AB, {}, 1.0, cross);
  const ContactPoint other = way_out_of_mesh(b, a, relative(X_AB, {}), X_AB, -1.0, cross);
  if (other.depth < least.depth) least = other;
  if (std::isfinite(least.depth)) {
    out.add(TriangleMesh::kNone, least);
  } else if (near && !cross) {
    // surfaces that lie in each other
    part_as_hulls();
  }
}

// ---- parts

double merge_distance(const Shape& a, const Shape& b) {
  return 1e-9 * std::min(a.type == ShapeType::kHalfspace ? b.size.x() : a.size.x(),
                         b.type == ShapeType::kHalfspace ? a.size.x() : b.size.x());
}

void collide_parts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, std::uint64_t key,
                   const PairRests& rests, double margin, ContactList* out) {
  const double reach = bounding_radius(a) + bounding_radius(b) + margin;
  if (!((X_WB.position - X_WA.position).squaredNorm() <= reach * reach * (1.0 + 1e-12))) return;
  if (a.compound != nullptr) {
    for (std::size_t i = 0; i < a.compound->children.size(); ++i) {
      const CompoundShape::Child& child = a.compound->children[i];
      PairRests of_child = rests;
      of_child.parts.of_a = key_of_part(rests.parts.of_a, i);
      collide_parts(child.shape, compose(X_WA, child.pose), b, X_WB, key_of_part(key, 2 * i), of_child, margin, out);
    }
  } else if (b.compound != nullptr) {
    for (std::size_t i = 0; i < b.compound->children.size(); ++i) {
      const CompoundShape::Child& child = b.compound->children[i];
      PairRests of_child = rests;
      of_child.parts.of_b = key_of_part(rests.parts.of_b, i);
      collide_parts(a, X_WA, child.shape, compose(X_WB, child.pose), key_of_part(key, 2 * i + 1), of_child, margin,
                    out);
    }
  } else if (a.mesh != nullptr && b.mesh != nullptr) {
    collide_mesh_mesh(a, b, relative(X_WA, X_WB), {rests, X_WA, flush_length(a, b)}, margin,
                      Collector(X_WA, key, rests.parts, merge_distance(a, b), false, out));
  } else if (a.mesh != nullptr || b.mesh != nullptr) {
    const bool is_reversed = a.mesh == nullptr;
    const Shape &mesh = is_reversed ? b : a, &other = is_reversed ? a : b;
    const Pose X_MO = is_reversed ? relative(X_WB, X_WA) : relative(X_WA, X_WB);
    const Pose& X_WM = is_reversed ? X_WB : X_WA;
    const Collector collector(X_WM, key, rests.parts, merge_distance(a, b), is_reversed, out);
    if (other.type == ShapeType::kHalfspace) {
      collide_mesh_halfspace(*mesh.mesh, X_MO.orientation * Vector3::UnitY(), X_MO.position, margin, collector);
    } else {
      SupportMapBuffer buffer;
      PairRests of_mesh_first = rests;
      if (is_reversed) of_mesh_first.swap();
      const OverMesh over{other, support_map_of(other, &buffer), X_MO, X_MO.orientation.toRotationMatrix()};
      collide_mesh_convex(*mesh.mesh, over, {of_mesh_first, X_WM, flush_length(mesh, other)}, margin, collector);
    }
  } else {
    Manifold manifold;
    collide(a, X_WA, b, X_WB, margin, &manifold);
    lay_flush(a, X_WA, b, X_WB, rests, margin, &manifold);
    for (int i = 0; i < manifold.count; ++i)
      out->collect(key, rests.parts, manifold.contacts[static_cast<std::size_t>(i)], merge_distance(a, b));
  }
}

}  // namespace

void collide_composite(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, const PairRests& rests,
                       double margin, ContactList* out) {
  collide_parts(a, X_WA, b, X_WB, 0, rests, margin, out);
}

}  // namespace gravitas::collision
