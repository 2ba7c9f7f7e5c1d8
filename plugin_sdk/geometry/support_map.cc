#include "plugin_sdk/geometry/support_map.h"

#include <algorithm>
#include <cmath>
#include <new>

#include "plugin_sdk/geometry/lane_points.h"
#include "plugin_sdk/geometry/support_map_buffer.h"

namespace gravitas {
namespace {

double radial_of(const Vector3& d) { return std::sqrt(d.x() * d.x() + d.z() * d.z()); }

class PointMap final : public SupportMap {
 public:
  explicit PointMap(double radius) { rounding_ = radius_ = thinnest_ = radius; }
  Vector3 support(const Vector3&) const override { return Vector3::Zero(); }
};

// A capsule: the segment from -half to half along y, rounded.
class SegmentMap final : public SupportMap {
 public:
  SegmentMap(double radius, double half) : half_(half) {
    rounding_ = thinnest_ = radius;
    radius_ = radius + half;
  }
  Vector3 support(const Vector3& d) const override { return Vector3(0.0, std::copysign(half_, d.y()), 0.0); }
  void contour(const Vector3& n, double sine, Contour* out) const override {
    out->count = 0;
    const bool is_line = std::fabs(n.y()) <= sine;
    if (is_line || n.y() > 0.0) out->add(Vector3(0.0, half_, 0.0), 1);
    if (is_line || n.y() <= 0.0) out->add(Vector3(0.0, -half_, 0.0), 2);
    out->code = is_line ? 3 : out->codes[0];
  }

 private:
  double half_;
};

class BoxMap final : public SupportMap {
 public:
  explicit BoxMap(const Vector3& half) : half_(half) {
    radius_ = std::sqrt(half.squaredNorm());
    thinnest_ = half.minCoeff();
  }
  Vector3 support(const Vector3& d) const override {
    return {std::copysign(half_.x(), d.x()), std::copysign(half_.y(), d.y()), std::copysign(half_.z(), d.z())};
  }
  // Codes 0 … 5: faces +x -x +y -y +z -z; 8 … 15: vertices by the signs of their coordinates; from 16: edges by their
  // axis and the vertex with the lesser signs.
  void contour(const Vector3& n, double sine, Contour* out) const override {
    out->count = 0;
    const Vector3 vertex = support(n);
    Eigen::Index steepest = 0, flattest = 0;
    int flat = 0;
    for (int i = 0; i < 3; ++i) flat += std::fabs(n[i]) <= sine ? 1 : 0;
    n.cwiseAbs().maxCoeff(&steepest);
    n.cwiseAbs().minCoeff(&flattest);
    if (flat == 0) {
      out->add(vertex, out->code = vertex_code(vertex));
      return;
    }
    if (flat == 1) {
      Vector3 other = vertex;
      other[flattest] = -other[flattest];
      out->add(vertex, vertex_code(vertex));
      out->add(other, vertex_code(other));
      out->code = 16 + 8 * static_cast<std::uint32_t>(flattest) + std::min(out->codes[0], out->codes[1]) - 8;
      return;
    }
    const Eigen::Index u = (steepest + 1) % 3, v = (steepest + 2) % 3;
    const double side = n[steepest] < 0.0 ? -1.0 : 1.0;
    out->normal = side * Vector3::Unit(steepest);
    out->code = static_cast<std::uint32_t>(2 * steepest) + (side < 0.0 ? 1 : 0);
    constexpr std::array<std::array<double, 2>, 4> kCorners = {{{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
    for (std::size_t i = 0; i < 4; ++i) {
      const auto& signs = kCorners[side > 0.0 ? i : 3 - i];
      Vector3 corner = half_;
      corner[steepest] *= side, corner[u] *= signs[0], corner[v] *= signs[1];
      out->add(corner, vertex_code(corner));
    }
  }

 private:
  static std::uint32_t vertex_code(const Vector3& vertex) {
    return 8U + (vertex.x() < 0.0 ? 1U : 0U) + (vertex.y() < 0.0 ? 2U : 0U) + (vertex.z() < 0.0 ? 4U : 0U);
  }
  Vector3 half_;
};

// Corners of the polygon that stands for a round end, beside the point farthest along n.
constexpr std::array<std::array<double, 2>, 12> kRound = {{{1, 0},
                                                           {0.86602540378443865, 0.5},
                                                           {0.5, 0.86602540378443865},
                                                           {0, 1},
                                                           {-0.5, 0.86602540378443865},
                                                           {-0.86602540378443865, 0.5},
                                                           {-1, 0},
                                                           {-0.86602540378443865, -0.5},
                                                           {-0.5, -0.86602540378443865},
                                                           {0, -1},
                                                           {0.5, -0.86602540378443865},
                                                           {0.86602540378443865, -0.5}}};

// The round end at height y that faces up (+1) or down (-1): twelve points of its rim, fixed in the body, and the one
// farthest along n where there is one. Codes from `first`.
void add_round_end(double y, double radius, double up, const Vector3& n, std::uint32_t first, Contour* out) {
  out->normal = Vector3(0.0, up, 0.0);
  out->code = first;
  const double radial = radial_of(n);
  const double x = radial > 1e-9 ? n.x() / radial : 0.0, z = radial > 1e-9 ? n.z() / radial : 0.0;
  // seen from above, z to x is counter-clockwise about y
  for (std::size_t k = 0; k < 12; ++k) {
    const std::size_t i = up > 0.0 ? k : (12 - k) % 12, next = up > 0.0 ? (k + 1) % 12 : (23 - k) % 12;
    const auto place = [&](std::size_t j) { return Vector3(radius * kRound[j][1], y, radius * kRound[j][0]); };
    const Vector3 here = place(i), there = place(next);
    out->add(here, first + 1 + static_cast<std::uint32_t>(i));
    if (!(radial > 1e-9)) continue;
    const Vector3 farthest(radius * x, y, radius * z);
    const bool is_between = up * (here.cross(farthest)).y() > 1e-6 * radius * radius &&
                            up * (farthest.cross(there)).y() > 1e-6 * radius * radius;
    if (is_between) out->add(farthest, first + 13);
  }
}

class CylinderMap final : public SupportMap {
 public:
  CylinderMap(double radius, double half) : across_(radius), half_(half) {
    radius_ = std::sqrt(radius * radius + half * half);
    thinnest_ = std::min(radius, half);
  }
  Vector3 support(const Vector3& d) const override {
    const double radial = radial_of(d), scale = radial > 0.0 ? across_ / radial : 0.0;
    return {scale * d.x(), std::copysign(half_, d.y()), scale * d.z()};
  }
  void contour(const Vector3& n, double sine, Contour* out) const override {
    out->count = 0;
    const bool is_bottom = n.y() < 0.0;
    if (radial_of(n) <= sine) {
      add_round_end(is_bottom ? -half_ : half_, across_, is_bottom ? -1.0 : 1.0, n, is_bottom ? 32 : 16, out);
      return;
    }
    const Vector3 place = support(Vector3(n.x(), 0.0, n.z()));
    if (std::fabs(n.y()) <= sine || !is_bottom) out->add(Vector3(place.x(), half_, place.z()), 1);
    if (std::fabs(n.y()) <= sine || is_bottom) out->add(Vector3(place.x(), -half_, place.z()), 2);
    out->code = out->count == 2 ? 3 : out->codes[0];
  }

 private:
  double across_;
  double half_;
};

class ConeMap final : public SupportMap {
 public:
  ConeMap(double radius, double half) : across_(radius), half_(half) {
    radius_ = std::sqrt(radius * radius + half * half);
    thinnest_ = 0.5 * std::min(radius, half);
    centre_ = Vector3(0.0, -0.5 * half, 0.0);
  }
  Vector3 support(const Vector3& d) const override {
    const double radial = radial_of(d);
    if (half_ * d.y() > across_ * radial - half_ * d.y()) return {0.0, half_, 0.0};
    const double scale = radial > 0.0 ? across_ / radial : 0.0;
    return {scale * d.x(), -half_, scale * d.z()};
  }
  void contour(const Vector3& n, double sine, Contour* out) const override {
    out->count = 0;
    const double radial = radial_of(n);
    if (n.y() < 0.0 && radial <= sine) {
      add_round_end(-half_, across_, -1.0, n, 16, out);
      return;
    }
    // n against the line from the apex to the rim, whose direction is (r, -h) in its half-plane
    const double slant = std::sqrt(across_ * across_ + 4.0 * half_ * half_);
    const double along = (across_ * radial - 2.0 * half_ * n.y()) / slant;
    const double scale = radial > 0.0 ? across_ / radial : 0.0;
    const bool is_line = std::fabs(along) <= sine;
    if (is_line || along < 0.0) out->add(Vector3(0.0, half_, 0.0), 1);
    if (is_line || along >= 0.0) out->add(Vector3(scale * n.x(), -half_, scale * n.z()), 2);
    out->code = is_line ? 3 : out->codes[0];
  }

 private:
  double across_;
  double half_;
};

class PolyhedronMap final : public SupportMap {
 public:
  explicit PolyhedronMap(const ConvexPolyhedron& polyhedron) : polyhedron_(polyhedron) {
    for (const Vector3& v : polyhedron.vertices) {
      vertices_.add(v);
      radius_ = std::max(radius_, v.squaredNorm());
      centre_ += v / static_cast<double>(polyhedron.vertices.size());
    }
    radius_ = std::sqrt(radius_);
    thinnest_ = std::numeric_limits<double>::infinity();
    for (const ConvexPolyhedron::Face& face : polyhedron.faces) {
      normals_.add(face.normal);
      thinnest_ = std::min(thinnest_, 0.5 * (face.offset + (-face.normal).dot(support(-face.normal))));
    }
    find_neighbours();
  }
  Vector3 support(const Vector3& d) const override { return vertex(vertices_.farthest(d)); }

  void contour(const Vector3& n, double sine, Contour* out) const override {
    out->count = 0;
    const std::uint32_t towards = normals_.farthest(n);
    const ConvexPolyhedron::Face& face = polyhedron_.faces[towards];
    if (face.normal.dot(n) >= std::sqrt(1.0 - sine * sine)) {
      const auto loop = polyhedron_.corners_of(face);
      // of a face with very many corners every other one
      const std::size_t stride = 1 + (loop.size() - 1) / Contour::kCapacity;
      for (std::size_t i = 0; i < loop.size(); i += stride) out->add(vertex(loop[i]), 1 + loop[i]);
      out->normal = face.normal;
      out->code = (1 + static_cast<std::uint32_t>(polyhedron_.vertices.size()) + towards) & 0x7FFFU;
      return;
    }
    const std::uint32_t first = vertices_.farthest(n);
    out->add(vertex(first), 1 + first);
    out->code = 1 + first;
    // the edge at the vertex that is most nearly in the plane
    std::uint32_t second = first;
    double least = sine;
    for (std::uint32_t i = neighbour_begin_[first]; i < neighbour_begin_[first + 1]; ++i) {
      const Vector3 edge = vertex(neighbours_[i]) - vertex(first);
      const double falls = std::fabs(edge.dot(n)) / std::sqrt(edge.squaredNorm());
      if (falls <= least) least = falls, second = neighbours_[i];
    }
    if (second == first) return;
    out->add(vertex(second), 1 + second);
    out->code = (std::min(first, second) * 31U + std::max(first, second) * 17U + 1U) & 0x7FFFU;
  }

 private:
  const Vector3& vertex(std::uint32_t i) const { return polyhedron_.vertices[i]; }

  // Every edge runs along two faces in opposite ways, so that each corner's next ones are all its neighbours.
  void find_neighbours() {
    neighbour_begin_.assign(polyhedron_.vertices.size() + 1, 0);
    for (const std::uint32_t corner : polyhedron_.corners) ++neighbour_begin_[corner + 1];
    for (std::size_t i = 1; i < neighbour_begin_.size(); ++i) neighbour_begin_[i] += neighbour_begin_[i - 1];
    neighbours_.resize(polyhedron_.corners.size());
    std::vector<std::uint32_t> place(neighbour_begin_.begin(), neighbour_begin_.end() - 1);
    for (const ConvexPolyhedron::Face& face : polyhedron_.faces) {
      const auto loop = polyhedron_.corners_of(face);
      for (std::size_t i = 0; i < loop.size(); ++i) neighbours_[place[loop[i]]++] = loop[(i + 1) % loop.size()];
    }
  }

  const ConvexPolyhedron& polyhedron_;
  LanePoints vertices_;
  LanePoints normals_;  // of the faces
  std::vector<std::uint32_t> neighbour_begin_;
  std::vector<std::uint32_t> neighbours_;  // of vertex i: from neighbour_begin_[i] to neighbour_begin_[i + 1]
};

}  // namespace

void SupportMap::contour(const Vector3& n, double, Contour* out) const {
  out->count = 0;
  out->code = 1;
  out->add(support(n), 1);
}

namespace {

// make(tag of the class, arguments of its constructor)
template <typename Map>
struct Tag {};
template <typename Make>
SupportMap* make_primitive(SceneShape::Kind kind, const Vector3& size, const Make& make) {
  switch (kind) {
    case SceneShape::Kind::kSphere:
      return make(Tag<PointMap>{}, size.x());
    case SceneShape::Kind::kBox:
      return make(Tag<BoxMap>{}, size);
    case SceneShape::Kind::kCylinder:
      return make(Tag<CylinderMap>{}, size.x(), size.y());
    case SceneShape::Kind::kCapsule:
      return make(Tag<SegmentMap>{}, size.x(), size.y());
    case SceneShape::Kind::kCone:
      return make(Tag<ConeMap>{}, size.x(), size.y());
    default:
      return nullptr;
  }
}

}  // namespace

std::unique_ptr<SupportMap> make_support_map(const SceneShape& shape) {
  if (shape.kind == SceneShape::Kind::kConvexPolyhedron) return std::make_unique<PolyhedronMap>(*shape.polyhedron);
  return std::unique_ptr<SupportMap>(
      make_primitive(shape.kind, shape.size, []<typename Map>(Tag<Map>, const auto&... arguments) -> SupportMap* {
        return new Map(arguments...);  // NOLINT(cppcoreguidelines-owning-memory): taken by the unique_ptr
      }));
}

const SupportMap& SupportMapBuffer::emplace(SceneShape::Kind kind, const Vector3& size) {
  clear();
  map_ = make_primitive(kind, size, [this]<typename Map>(Tag<Map>, const auto&... arguments) -> SupportMap* {
    static_assert(sizeof(Map) <= sizeof room_ && alignof(Map) <= 32);
    return new (static_cast<void*>(room_)) Map(arguments...);
  });
  return *map_;
}

void SupportMapBuffer::clear() {
  if (map_ != nullptr) map_->~SupportMap();
  map_ = nullptr;
}

TriangleMap::TriangleMap(const std::array<Vector3, 3>& corners, const Vector3& normal)
    : corners_(corners), normal_(normal) {
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) {
    radius_ = std::max(radius_, corners[k].squaredNorm());
    shortest = std::min(shortest, (corners[(k + 1) % 3] - corners[k]).squaredNorm());
    centre_ += corners[k] / 3.0;
  }
  radius_ = std::sqrt(radius_);
  thinnest_ = 0.5 * std::sqrt(shortest);
}

Vector3 TriangleMap::support(const Vector3& d) const {
  const double a = d.dot(corners_[0]), b = d.dot(corners_[1]), c = d.dot(corners_[2]);
  return a >= b ? (a >= c ? corners_[0] : corners_[2]) : (b >= c ? corners_[1] : corners_[2]);
}

void TriangleMap::contour(const Vector3& n, double sine, Contour* out) const {
  out->count = 0;
  const double towards = n.dot(normal_);
  if (std::fabs(towards) >= std::sqrt(1.0 - sine * sine)) {
    out->normal = towards < 0.0 ? Vector3(-normal_) : normal_;
    out->code = towards < 0.0 ? kBack : kFront;
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t i = towards < 0.0 ? 2 - k : k;
      out->add(corners_[i], 1 + i);
    }
    return;
  }
  std::array<double, 3> height;
  for (std::size_t k = 0; k < 3; ++k) height[k] = n.dot(corners_[k]);
  const std::size_t first =
      height[0] >= height[1] ? (height[0] >= height[2] ? 0 : 2) : (height[1] >= height[2] ? 1 : 2);
  out->add(corners_[first], 1 + static_cast<std::uint32_t>(first));
  out->code = out->codes[0];
  std::size_t second = first;
  double least = sine;
  for (std::size_t k = 0; k < 3; ++k) {
    if (k == first) continue;
    const double falls = (height[first] - height[k]) / std::sqrt((corners_[first] - corners_[k]).squaredNorm());
    if (falls <= least) least = falls, second = k;
  }
  if (second == first) return;
  out->add(corners_[second], 1 + static_cast<std::uint32_t>(second));
  out->code = 3U + static_cast<std::uint32_t>(first + second);
}

}  // namespace gravitas
