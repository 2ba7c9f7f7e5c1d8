#include "workers/collision/standard/flat_faces.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "workers/collision/standard/narrow_phase.h"

namespace gravitas::collision {
namespace {

// Sine of the angle within which a feature is turned to a face: as where features are laid over each other.
constexpr double kTurnedTo = 0.2;
// Half extent of the box that stands for a face, of the shape's radius: none of its other sides is a way out.
constexpr double kBoxOfRadius = 4.0;
// Of the shape's least half extent: how far behind an open mesh its centre still counts as before it.
constexpr double kBehindOfThinnest = 0.5;
constexpr double kStraight = 1e-9;  // sine of an angle that is none
// The corners of a feature, and where each came in.
constexpr std::size_t kMostPoints = 2 * gravitas::Contour::kCapacity;

// The turn that brings the axis nearest to `up` there by the shortest way: none if that is an axis, so that a face along the
// mesh's axes is a side of a box along them.
Quaternion turn_to(const Vector3& up) {
  // the first of those that are as near but for rounding: all triangles of a face have one box
  const double least = up.cwiseAbs().maxCoeff() - 1e-6;
  Eigen::Index nearest = 0;
  while (std::fabs(up[nearest]) < least) ++nearest;
  const Vector3 axis = (up[nearest] < 0.0 ? -1.0 : 1.0) * Vector3::Unit(nearest);
  const Vector3 cross = axis.cross(up);
  return Quaternion(1.0 + axis.dot(up), cross.x(), cross.y(), cross.z()).normalized();
}

// Of p, over the triangle along its unit normal.
bool is_over(const std::array<Vector3, 3>& x, const Vector3& normal, const Vector3& p, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3 edge = x[(k + 1) % 3] - x[k];
    const double inside = normal.dot(edge.cross(p - x[k]));
    if (!(inside >= 0.0) && !(inside * inside <= tolerance * tolerance * edge.squaredNorm())) return false;
  }
  return true;
}

bool is_inner_edge(const TriangleMesh& mesh, std::uint32_t t, std::size_t edge) {
  const std::uint32_t neighbour = mesh.neighbour(t, static_cast<int>(edge));
  return neighbour != TriangleMesh::kNone && mesh.flat_face(neighbour) == mesh.flat_face(t);
}

// Of a corner inside the face, or on a straight part of its border.
bool is_inner_corner(const TriangleMesh& mesh, std::uint32_t t, std::size_t corner) {
  const std::uint32_t vertex = mesh.triangles()[t][corner];
  std::array<Vector3, 2> border;
  std::size_t count = 0;
  for (const std::uint32_t around : mesh.ring(vertex)) {
    if (mesh.flat_face(around) != mesh.flat_face(t)) continue;
    const TriangleMesh::Triangle& own = mesh.triangles()[around];
    const std::size_t k = own[0] == vertex ? 0 : (own[1] == vertex ? 1 : 2);
    for (const auto& [edge, end] : {std::pair(k, (k + 1) % 3), std::pair((k + 2) % 3, (k + 2) % 3)}) {
      if (is_inner_edge(mesh, around, edge)) continue;
      if (count == 2) return false;
      border[count++] = mesh.vertices()[own[end]] - mesh.vertices()[vertex];
    }
  }
  if (count < 2) return count == 0;
  return border[0].dot(border[1]) < 0.0 && border[0].cross(border[1]).squaredNorm() <= kStraight * kStraight *
                                                                                           border[0].squaredNorm() *
                                                                                           border[1].squaredNorm();
}

}  // namespace

Box3 OverMesh::box() const {
  Box3 box;
  for (int i = 0; i < 3; ++i) {
    const Vector3 axis = R.row(i).transpose();
    box.upper[i] = X_MC.position[i] + axis.dot(map.support(axis)) + map.rounding();
    box.lower[i] = X_MC.position[i] + axis.dot(map.support(-axis)) - map.rounding();
  }
  return box;
}

bool FlatFaces::lies_in(const Plane& plane, std::uint32_t t) const {
  const double facing = plane.up.dot(mesh_.normal(t));
  if (mesh_.is_closed() && !(facing > 0.0)) return false;
  // first by the normal, which most miss
  if (!(std::fabs(facing) >= 1.0 - 1e-6)) return false;
  const std::array<Vector3, 3> x = mesh_.corners(t);
  return std::all_of(x.begin(), x.end(),
                     [&](const Vector3& corner) { return std::fabs(plane.up.dot(corner - plane.point)) <= level_; });
}

const FlatFaces::Plane* FlatFaces::holding(std::uint32_t t) const {
  for (std::size_t i = 0; i < count_; ++i)
    if (lies_in(planes_[i], t)) return &planes_[i];
  return nullptr;
}

bool FlatFaces::are_over(const Plane& plane, std::span<const Vector3> points) const {
  std::array<bool, kMostPoints> is_covered{};
  std::size_t open = points.size();
  Box3 box;
  for (const Vector3& p : points) box.extend(Vector3(p - plane.up.dot(p - plane.point) * plane.up));
  mesh_.for_each_in(box.widened(level_), [&](std::uint32_t t) {
    if (open == 0 || !lies_in(plane, t)) return;
    const std::array<Vector3, 3> x = mesh_.corners(t);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (is_covered[i] || !is_over(x, mesh_.normal(t), points[i], level_)) continue;
      is_covered[i] = true;
      --open;
    }
  });
  return open == 0;
}

// A face of one triangle under which the shape does not fit tells its contacts itself.
bool FlatFaces::is_small_and_alone(const std::array<Vector3, 3>& x, std::uint32_t t) const {
  for (std::size_t k = 0; k < 3; ++k) {
    if (is_inner_edge(mesh_, t, k)) return false;
    if ((x[(k + 1) % 3] - x[k]).squaredNorm() > over_.map.thinnest() * over_.map.thinnest()) return false;
  }
  return true;
}

// What has sunk in has come in through the face: so has the way from its points to the centre.
Vector3 FlatFaces::entrance(const Vector3& p) const {
  const double depth = -found_.up.dot(p - found_.point), above = found_.up.dot(over_.centre() - found_.point);
  return depth > 0.0 && above > 0.0 ? Vector3(p + depth / (depth + above) * (over_.centre() - p)) : p;
}

bool FlatFaces::find(std::uint32_t t, std::span<const Rest> rests, const Matrix3& R_FM, Manifold* out) {
  if (count_ == planes_.size()) return false;
  const std::array<Vector3, 3> x = mesh_.corners(t);
  if (is_small_and_alone(x, t)) return false;
  const double before = mesh_.normal(t).dot(over_.centre() - x[0]);
  // of a closed mesh the back is inside; an open one that was met in front has it a little behind, too
  const bool is_in_front = before > (mesh_.is_closed() ? 0.0 : -kBehindOfThinnest * over_.map.thinnest());
  if (mesh_.is_closed() && !is_in_front) return false;
  const Vector3 up = is_in_front ? mesh_.normal(t) : Vector3(-mesh_.normal(t));
  const auto height = [&](const Vector3& p) { return up.dot(p - x[0]); };
  const Vector3 lowest = over_.farthest(-up);
  if (!(height(lowest) <= margin_)) return false;
  if (std::any_of(rests.begin(), rests.end(), [&](const Rest& rest) { return !rest.is_along(-(R_FM * up)); }))
    return false;

  // all that is turned to the face
  found_ = {up, lowest - height(lowest) * up, false};
  out->count = 0;
  std::array<Vector3, kMostPoints> points;
  std::size_t count = 0;
  gravitas::Contour contour;
  over_.map.contour(over_.R.transpose() * -up, kTurnedTo, &contour);
  bool is_over_t = is_over(x, mesh_.normal(t), lowest, level_);
  for (std::size_t i = 0; i < contour.count; ++i) {
    const Vector3 p = over_.X_MC.position + over_.R * contour.points[i] - over_.map.rounding() * up;
    if (!(height(p) <= margin_)) continue;
    is_over_t = is_over_t || (height(p) <= height(lowest) + level_ && is_over(x, mesh_.normal(t), p, level_));
    points[count++] = p, points[count++] = entrance(p);
  }
  if (!is_over_t) return false;
  if (!are_over(found_, {points.data(), count})) return true;

  const double half = kBoxOfRadius * over_.map.radius();
  Shape box;
  box.type = ShapeType::kBox;
  box.size = Vector3::Constant(half);
  const Vector3& p = over_.X_MC.position;
  collide(box, {p - (height(p) + half) * up, turn_to(up)}, over_.shape, over_.X_MC, margin_, out);
  // exact pairs have names of 8 bits (features.h): which side of the box stands for the face is none of the contact's
  const bool is_exact = over_.shape.type == ShapeType::kBox || over_.shape.type == ShapeType::kCylinder;
  for (int i = 0; i < out->count; ++i) {
    ContactPoint& contact = out->contacts[static_cast<std::size_t>(i)];
    if (is_exact) contact.feature &= 0xFFU;
    points[static_cast<std::size_t>(i)] = contact.point;
  }
  const bool is_along = out->count > 0 && out->contacts[0].normal.dot(up) >= 1.0 - kStraight;
  if (!is_along || !are_over(found_, {points.data(), static_cast<std::size_t>(out->count)})) out->count = 0;
  return true;
}

bool leads_out_inside_flat_face(const TriangleMesh& mesh, std::uint32_t t, const Vector3& n) {
  constexpr double kTouching = 1e-3;  // sine of the angle up to which an edge counts as touching
  const std::array<Vector3, 3> x = mesh.corners(t);
  const std::array<double, 3> height = {n.dot(x[0]), n.dot(x[1]), n.dot(x[2])};
  const double top = *std::max_element(height.begin(), height.end());
  std::array<bool, 3> touches{};
  std::size_t count = 0, first = 0;
  for (std::size_t k = 3; k-- > 0;) {
    touches[k] = height[k] >= top - kTouching * (x[(k + 1) % 3] - x[k]).norm();
    if (touches[k]) ++count, first = k;
  }
  if (count == 3) return true;
  if (count == 1) return is_inner_corner(mesh, t, first);
  return is_inner_edge(mesh, t, touches[0] && touches[2] ? 2 : first);
}

bool is_of_face(std::uint32_t feature) {
  const std::uint32_t code = feature >> 15;
  return code == TriangleMap::kFront || code == TriangleMap::kBack;
}

bool is_inside_flat_face(const TriangleMesh& mesh, std::uint32_t t, bool is_turned, std::uint32_t feature) {
  const std::uint32_t code = feature >> 15;
  if (is_of_face(feature)) return false;
  if ((code & 0x4000U) == 0) return is_inner_corner(mesh, t, code - 1);
  // an edge has the name of the corner where it begins: of a triangle that is seen from its back, the other one
  const std::size_t corner = (code & 0x3FFFU) - 1;
  return is_inner_edge(mesh, t, is_turned ? (corner + 2) % 3 : corner);
}

}  // namespace gravitas::collision
