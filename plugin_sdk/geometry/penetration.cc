#include "plugin_sdk/geometry/penetration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "plugin_sdk/geometry/simplex.h"

namespace gravitas {
namespace {

// A point of a - b, and the point of a that it came from.
struct Difference {
  Vector3 w;
  Vector3 a;
};

Difference difference_along(const PlacedPair& pair, const Vector3& n) {
  const Vector3 a = pair.support_a(n);
  return {a - pair.support_b(n), a};
}

double length_of(const Vector3& v) { return std::sqrt(v.squaredNorm()); }

// The points of the surfaces, from those of the cores and the normal.
Separation with_rounding(const PlacedPair& pair, const Vector3& normal, double core_depth, const Vector3& a,
                         const Vector3& b) {
  return {normal, core_depth + pair.rounding(), a + pair.a.rounding() * normal, b - pair.b.rounding() * normal};
}

// The corners that the search for the distance ends with.
struct Simplex {
  std::array<Difference, 4> corners;
  std::size_t count = 1;
  std::array<double, 4> weight{1.0};  // of the corners' place nearest to the origin
};

// A difference that is nearly nothing, `shortness` of the reach, has no good direction: it is made square to the line or
// triangle that carries it.
Vector3 square_to(std::span<const Difference> carrier, const Vector3& normal, double shortness) {
  constexpr double kShort = 1e-5;
  if (!(shortness < kShort) || carrier.size() < 2) return normal;
  const Vector3 ab = carrier[1].w - carrier[0].w;
  Vector3 square = normal - ab * (ab.dot(normal) / ab.squaredNorm());
  if (carrier.size() == 3) {
    const Vector3 ac = carrier[2].w - carrier[0].w;
    const Vector3 area = ab.cross(ac);
    // of a sliver its edge must do
    if (length_of(area) > kShort * std::max(ab.squaredNorm(), ac.squaredNorm()))
      square = area * (area.dot(normal) / area.squaredNorm());
  }
  const double length = length_of(square);
  return length > 0.9 ? Vector3(square / length) : normal;
}

// ---- overlapping: a polytope inside a - b that grows where it is nearest to the origin

class Polytope {
 public:
  explicit Polytope(const PlacedPair& pair) : pair_(pair), reach_(pair.reach()) {}

  // `simplex`: what the search for the distance ended with.
  Separation expand(const Simplex& simplex) {
    if (!start_from(simplex) && !start()) return flat(simplex);
    for (;;) {
      const std::size_t nearest = nearest_face();
      const Face& face = faces_[nearest];
      if (!(face.height < least_ - kEnough * reach_) || vertex_count_ == kVertices) break;
      const Difference next = difference_along(pair_, face.normal);
      const double h = face.normal.dot(next.w);
      if (h < least_) least_ = h, normal_ = face.normal;
      if (h - face.height <= kEnough * reach_ || is_known(next.w) || !grow(next)) break;
    }
    find_points();
    return with_rounding(pair_, normal_, least_, point_a_, point_b_);
  }

 private:
  static constexpr std::size_t kVertices = 96;
  static constexpr std::size_t kFaces = 4 * kVertices;
  // Of the reach, what may be left of the depth: of a round body of radius r this tilts the normal by sqrt(2 kEnough reach/r),
  // and where it rolls, so small a tilt looks like a flight (1e-10: 7e-5 rad, thousands of them a second).
  static constexpr double kEnough = 1e-12;

  struct Face {
    std::array<std::uint32_t, 3> corner;
    Vector3 normal;
    double height;  // of the plane from the origin; infinite where the face has no normal
  };

  // The tetrahedron that was found to hold the origin, if it is none of a sliver.
  bool start_from(const Simplex& simplex) {
    constexpr double kSliver = 1e-3;
    if (simplex.count < 4) return false;
    const std::array<Difference, 4>& corners = simplex.corners;
    const Vector3 ab = corners[1].w - corners[0].w, ac = corners[2].w - corners[0].w, ad = corners[3].w - corners[0].w;
    const double volume = ab.cross(ac).dot(ad);
    if (!(volume * volume > kSliver * kSliver * ab.squaredNorm() * ac.squaredNorm() * ad.squaredNorm())) return false;
    std::ranges::copy(corners, vertices_.begin());
    add_tetrahedron(volume > 0.0);
    return true;
  }

  // Four corners of a solid, or false with normal_ across what a - b is.
  bool start() {
    const Vector3 centres = pair_.a.centre() - (pair_.p_AB + pair_.R_AB * pair_.b.centre());
    const auto look = [&](const Vector3& n) { return difference_along(pair_, n); };
    const double nothing = 1e-13 * reach_;
    // the longest extent along an axis
    Difference from = look(Vector3::UnitX()), to = look(-Vector3::UnitX());
    for (int i = 1; i < 3; ++i) {
      const Difference f = look(Vector3::Unit(i)), t = look(-Vector3::Unit(i));
      if ((f.w - t.w).squaredNorm() > (from.w - to.w).squaredNorm()) from = f, to = t;
    }
    const Vector3 line = to.w - from.w;
    const double length = length_of(line);
    const auto across = [&](const Vector3& any) {
      // away from a towards b where that is across, so that the answer does not flip
      const Vector3 flat = -centres - any * any.dot(-centres);
      const double size = length_of(flat);
      return size > nothing ? Vector3(flat / size) : any.unitOrthogonal();
    };
    if (!(length > nothing)) {
      const double size = length_of(centres);
      normal_ = size > nothing ? Vector3(-centres / size) : Vector3::UnitY();
      return false;
    }
    // farthest from that line, then from the plane
    const Vector3 u = line / length, v = u.unitOrthogonal(), w = u.cross(v);
    Difference third = from;
    double most = nothing;
    for (const Vector3& n : {v, Vector3(-v), w, Vector3(-w)}) {
      const Difference d = look(n);
      const double off = length_of((d.w - from.w).cross(u));
      if (off > most) most = off, third = d;
    }
    if (!(most > nothing)) {
      normal_ = across(u);
      return false;
    }
    const Vector3 area = line.cross(third.w - from.w);
    const Vector3 n = area / length_of(area);
    const Difference above = look(n), below = look(-n);
    const double up = n.dot(above.w - from.w), down = -n.dot(below.w - from.w);
    if (!(std::max(up, down) > nothing)) {
      normal_ = n.dot(centres) > 0.0 ? Vector3(-n) : n;
      return false;
    }
    vertices_ = {from, to, third, up >= down ? above : below};
    add_tetrahedron(up >= down);
    return true;
  }

  // The faces of the first four vertices, outward; `is_above`: the fourth is on the side from which the others run
  // counter-clockwise.
  void add_tetrahedron(bool is_above) {
    vertex_count_ = 4;
    add_face(0, is_above ? 2 : 1, is_above ? 1 : 2);
    add_face(0, is_above ? 1 : 3, is_above ? 3 : 1);
    add_face(1, is_above ? 2 : 3, is_above ? 3 : 2);
    add_face(2, is_above ? 0 : 3, is_above ? 3 : 0);
  }

  // Of cores that lie in a plane or line together: no depth across it. They meet where the search for their distance ended.
  Separation flat(const Simplex& simplex) const {
    const double depth = normal_.dot(pair_.support_a(normal_) - pair_.support_b(normal_));
    Vector3 place = Vector3::Zero();
    for (std::size_t k = 0; k < simplex.count; ++k) place += simplex.weight[k] * simplex.corners[k].a;
    return with_rounding(pair_, normal_, depth, place, place);
  }

  void add_face(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (face_count_ == kFaces) return;
    const Vector3 &x = vertices_[a].w, &y = vertices_[b].w, &z = vertices_[c].w;
    const Vector3 area = (y - x).cross(z - x);
    const double length = length_of(area);
    Face& face = faces_[face_count_++];
    face.corner = {a, b, c};
    const bool has_normal = length > 1e-26 * reach_ * reach_;
    face.normal = has_normal ? Vector3(area / length) : Vector3::Zero();
    // from the middle of the corners, whose roundings cancel in part
    face.height = has_normal ? face.normal.dot((x + y + z) / 3.0) : std::numeric_limits<double>::infinity();
  }

  std::size_t nearest_face() const {
    std::size_t nearest = 0;
    for (std::size_t i = 1; i < face_count_; ++i)
      if (faces_[i].height < faces_[nearest].height) nearest = i;
    return nearest;
  }

  bool is_known(const Vector3& w) const {
    return std::any_of(vertices_.begin(), vertices_.begin() + static_cast<std::ptrdiff_t>(vertex_count_),
                       [&](const Difference& d) { return d.w == w; });
  }

  // Replaces the faces that see the new point, or have it in their plane, by its fan over their outline. (A flat end
  // whose far triangles stayed would get triangles that are turned over.)
  bool grow(const Difference& next) {
    std::size_t edge_count = 0, kept = 0;
    for (std::size_t i = 0; i < face_count_; ++i) {
      const Face face = faces_[i];
      const bool sees = face.normal.dot(next.w - vertices_[face.corner[0]].w) > -1e-12 * reach_;
      if (!sees) {
        faces_[kept++] = face;
        continue;
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = face.corner[k], to = face.corner[(k + 1) % 3];
        std::size_t twin = 0;
        while (twin < edge_count && !(edges_[twin][0] == to && edges_[twin][1] == from)) ++twin;
        if (twin < edge_count) {
          edges_[twin] = edges_[--edge_count];
        } else if (edge_count < edges_.size()) {
          edges_[edge_count++] = {from, to};
        }
      }
    }
    if (kept == face_count_ || edge_count == 0) return false;
    face_count_ = kept;
    vertices_[vertex_count_] = next;
    for (std::size_t i = 0; i < edge_count; ++i)
      add_face(edges_[i][0], edges_[i][1], static_cast<std::uint32_t>(vertex_count_));
    ++vertex_count_;
    return true;
  }

  // The points at the foot of the normal: of the triangles in its plane the one that comes nearest to it.
  void find_points() {
    const Vector3 foot = least_ * normal_;
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < face_count_; ++i) {
      const Face& face = faces_[i];
      // a triangle at the least height is one of them; others only if they lie in its plane
      if (!(std::fabs(face.height - least_) <= 1e-7 * reach_) || !(face.normal.dot(normal_) > 1.0 - 1e-7)) continue;
      const auto corner = [&](std::size_t k) -> const Difference& { return vertices_[face.corner[k]]; };
      const SimplexPoint place = closest_on_triangle(corner(0).w - foot, corner(1).w - foot, corner(2).w - foot);
      const double off = place.point.squaredNorm();
      if (!(off < nearest)) continue;
      nearest = off;
      point_a_.setZero();
      Vector3 w = Vector3::Zero();
      for (std::size_t k = 0; k < 3; ++k) {
        point_a_ += place.weight[k] * corner(k).a;
        w += place.weight[k] * corner(k).w;
      }
      point_b_ = point_a_ - w;
    }
    if (std::isfinite(nearest)) return;
    point_a_ = pair_.support_a(normal_), point_b_ = point_a_ - foot;
  }

  const PlacedPair& pair_;
  double reach_;
  std::array<Difference, kVertices> vertices_;
  std::size_t vertex_count_ = 0;
  std::array<Face, kFaces> faces_;
  std::size_t face_count_ = 0;
  std::array<std::array<std::uint32_t, 2>, kFaces> edges_;
  double least_ = std::numeric_limits<double>::infinity();
  Vector3 normal_ = Vector3::UnitY();
  Vector3 point_a_ = Vector3::Zero();
  Vector3 point_b_ = Vector3::Zero();
};

// Nothing if the cores overlap or touch.
std::optional<Separation> search_distance(const PlacedPair& pair, double margin, Simplex* out) {
  constexpr int kIterations = 96;
  const double reach = pair.reach(), touching = 1e-11 * reach;
  std::array<Difference, 4>& simplex = out->corners;
  std::size_t& count = out->count;
  count = 1;
  out->weight = {1.0};
  std::array<Vector3, 4> corners;
  Vector3 first = pair.p_AB + pair.R_AB * pair.b.centre() - pair.a.centre();
  if (!(first.squaredNorm() > 0.0)) first = Vector3::UnitY();
  simplex[0] = difference_along(pair, first);
  SimplexPoint closest{simplex[0].w, {1.0}};
  for (int i = 0; i < kIterations; ++i) {
    const double squared = closest.point.squaredNorm(), distance = std::sqrt(squared);
    if (distance <= touching) return std::nullopt;
    const Difference next = difference_along(pair, -closest.point);
    // the supporting plane towards the origin bounds the distance from below
    const double bound = next.w.dot(closest.point) / distance;
    if (bound - pair.rounding() > margin)
      return Separation{-closest.point / distance, pair.rounding() - bound, Vector3::Zero(), Vector3::Zero()};
    if (distance - bound <= 1e-15 * reach + 1e-14 * distance) break;
    bool is_known = false;
    for (std::size_t k = 0; k < count; ++k) is_known = is_known || simplex[k].w == next.w;
    if (is_known) break;
    std::array<Difference, 4> grown = simplex;
    grown[count] = next;
    for (std::size_t k = 0; k <= count; ++k) corners[k] = grown[k].w;
    const SimplexPoint found = closest_on_simplex(std::span(corners.data(), count + 1));
    if (!(found.point.squaredNorm() < squared)) break;
    // a sliver may seem to hold the origin although a plane keeps it out
    if (found.point.isZero(0.0) && bound > 1e-13 * reach) break;
    closest = {found.point, {}};
    std::size_t kept = 0;
    for (std::size_t k = 0; k <= count; ++k) {
      if (!(found.weight[k] > 0.0)) continue;
      simplex[kept] = grown[k];
      closest.weight[kept++] = found.weight[k];
    }
    count = kept;
    out->weight = closest.weight;
    if (count == 4 || count == 0) return std::nullopt;
  }
  const double distance = length_of(closest.point);
  if (distance <= touching) return std::nullopt;
  Vector3 point_a = Vector3::Zero();
  for (std::size_t k = 0; k < count; ++k) point_a += closest.weight[k] * simplex[k].a;
  const Vector3 normal = square_to(std::span(simplex.data(), count), -closest.point / distance, distance / reach);
  return with_rounding(pair, normal, -distance, point_a, point_a - closest.point);
}

}  // namespace

double PlacedPair::reach() const { return a.radius() + b.radius() + length_of(p_AB); }
double PlacedPair::thinnest() const { return std::min(a.thinnest(), b.thinnest()); }

std::optional<Separation> find_distance(const PlacedPair& pair, double margin) {
  Simplex simplex;
  return search_distance(pair, margin, &simplex);
}

Separation find_separation(const PlacedPair& pair, double margin) {
  Simplex simplex;
  const std::optional<Separation> apart = search_distance(pair, margin, &simplex);
  return apart ? *apart : Polytope(pair).expand(simplex);
}

}  // namespace gravitas
