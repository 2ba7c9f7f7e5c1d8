// Box against box by the 15 separating axes of § 4.3.2.3: the normals of the faces and the cross products of the edges.
//
// One of them has the least depth if the boxes overlap, and then its features meet: a face of one and what of the
// other's facing face lies over it, or two edges. Apart, an axis proves its gap, and the gap is the distance if the
// features that own the axis lie opposite each other. Only where they do not (a vertex off a vertex, off an edge,
// parallel edges), the normal is that of the closest points.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "plugin_sdk/geometry/contact_candidates.h"
#include "plugin_sdk/geometry/penetration.h"
#include "workers/collision/standard/box_axes.h"
#include "workers/collision/standard/contact_axis.h"
#include "workers/collision/standard/convex_pair.h"
#include "workers/collision/standard/features.h"
#include "workers/collision/standard/pair_functions.h"
#include "workers/collision/standard/patch_contacts.h"
#include "workers/collision/standard/polygon_clip.h"

namespace gravitas::collision {
namespace {

constexpr double kNoBound = std::numeric_limits<double>::infinity();

// Faces within this of the plane across an axis of edges lie on each other with all that is not too shallow (cosine).
// Without the rest of them boxes rock from edge to edge.
constexpr double kNearlyFlat = 0.98;

constexpr std::array<int, 3> kNext = {1, 2, 0};
constexpr std::array<int, 3> kAfterNext = {2, 0, 1};

// The shallowest face, the first of those that are equally shallow.
FaceAxis shallowest_of(const Vector3& depths, double tie) {
  FaceAxis best{0, depths[0]};
  for (int i = 1; i < 3; ++i)
    if (depths[i] < best.depth - tie) best = {i, depths[i]};
  return best;
}

// ---- two edges

// The contact along the axis, in a; nothing if the boxes are apart and the closest points of the two lines are not both
// on their edges.
std::optional<ContactPoint> contact_of_edges(const ConvexPair& pair, const EdgeAxis& axis) {
  const Vector3& n = axis.normal;
  Vector3 middle_a = support_point(pair.a, n), middle_b = support_point(pair.b, -(pair.R_AB.transpose() * n));
  const std::uint32_t feature = contact_feature(box_edge_code(axis.i, middle_a), box_edge_code(axis.k, middle_b));
  const double half_a = pair.a.size[axis.i], half_b = pair.b.size[axis.k];
  middle_a[axis.i] = 0.0, middle_b[axis.k] = 0.0;
  const Vector3 on_b = pair.p_AB + pair.R_AB * middle_b;
  const Vector3 v = pair.R_AB.col(axis.k);
  const Vector3 arm = on_b - middle_a;
  const double v_1 = v[kNext[static_cast<std::size_t>(axis.i)]], v_2 = v[kAfterNext[static_cast<std::size_t>(axis.i)]];
  const double uv = v[axis.i], squared = v_1 * v_1 + v_2 * v_2;
  const double along_u = arm[axis.i], along_v = arm.dot(v);
  const double s = (along_u - uv * along_v) / squared;
  const double s_kept = std::clamp(s, -half_a, half_a);
  const double t = uv * s_kept - along_v;
  const double t_kept = std::clamp(t, -half_b, half_b);
  const double beside = rounding_length(pair);
  if (axis.depth < -tie_length(pair) && (std::fabs(s - s_kept) > beside || std::fabs(t - t_kept) > beside))
    return std::nullopt;
  Vector3 place = 0.5 * (middle_a + on_b + t_kept * v);
  place[axis.i] += 0.5 * s_kept;
  const double middle = 0.5 * (n.dot(middle_a) + n.dot(on_b));
  return ContactPoint{place + n * (middle - n.dot(place)), n, axis.depth, feature};
}

// ---- a face

// Two boxes in the frame of x, which has the reference face.
struct Faces {
  const Shape& x;
  const Shape& y;
  Matrix3 R;
  Vector3 p;
  bool x_is_a;
};

// The patch of the reference face and the face of y that is turned most towards it, seen along a normal. Corner i and the
// edge from corner i to the next run round the face of y: (+,+), (-,+), (-,-), (+,-) along its axes u and v.
class FacePatch {
 public:
  // `side`: +1 or -1, the end of x's axis that the face stands at; `normal`: unit, from x to y
  FacePatch(const Faces& faces, int axis, double side, const Vector3& normal, double margin, double tolerance)
      : faces_(faces),
        normal_(normal),
        axis_(axis),
        u_(kNext[static_cast<std::size_t>(axis)]),
        v_(kAfterNext[static_cast<std::size_t>(axis)]),
        side_(side),
        margin_(margin),
        tolerance_(tolerance) {
    Eigen::Index facing = 0;
    faces.R.row(axis).cwiseAbs().maxCoeff(&facing);
    y_axis_ = static_cast<int>(facing);
    y_u_ = kNext[static_cast<std::size_t>(facing)], y_v_ = kAfterNext[static_cast<std::size_t>(facing)];
    y_side_ = side * faces.R(axis, facing) > 0.0 ? -1.0 : 1.0;
    const Vector3& half = faces.y.size;
    y_normal_ = y_side_ * faces.R.col(facing);
    centre_ = faces.p + half[y_axis_] * y_normal_;
    const Vector3 along_u = half[y_u_] * faces.R.col(y_u_), along_v = half[y_v_] * faces.R.col(y_v_);
    const Vector3 plus = along_u + along_v, minus = along_u - along_v;
    corners_ = {Vector3(centre_ + plus), Vector3(centre_ - minus), Vector3(centre_ - plus), Vector3(centre_ + minus)};
    for (std::size_t i = 0; i < 4; ++i) {
      depths_[i] = (faces.x.size[axis] - side * corners_[i][axis]) / std::fabs(normal[axis]);
      corners_[i] += depths_[i] * normal;
    }
  }

  bool is_nearly_flat() const {
    return std::fabs(normal_[axis_]) >= kNearlyFlat && -y_normal_.dot(normal_) >= kNearlyFlat;
  }

  void add_contacts(ContactCandidates* out) const {
    if (!(std::max({depths_[0], depths_[1], depths_[2], depths_[3]}) >= -margin_)) return;
    if (!is_inside()) {
      add_clipped(out);
      return;
    }
    for (std::size_t i = 0; i < 4; ++i)
      if (depths_[i] >= -margin_) add(corners_[i][u_], corners_[i][v_], depths_[i], code_of_x(), corner_of_y(i), out);
  }

 private:
  bool holds(double x, double y) const {
    return std::fabs(x) <= faces_.x.size[u_] && std::fabs(y) <= faces_.x.size[v_];
  }
  // Whether all of y's face that is not too shallow lies over the reference face: then its corners are the contacts.
  bool is_inside() const {
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t next = (i + 1) % 4;
      const bool is_deep = depths_[i] >= -margin_;
      if (is_deep && !holds(corners_[i][u_], corners_[i][v_])) return false;
      if (is_deep == (depths_[next] >= -margin_)) continue;
      const double s = (depths_[i] + margin_) / (depths_[i] - depths_[next]);
      const Vector3 end = corners_[i] + s * (corners_[next] - corners_[i]);
      if (!holds(end[u_], end[v_])) return false;
    }
    return true;
  }

  void add_clipped(ContactCandidates* out) const {
    ClippedPolygon polygon;
    for (std::size_t i = 0; i < 4; ++i) polygon.push({corners_[i][u_], corners_[i][v_], static_cast<int>(i)});
    clip_to_rectangle(faces_.x.size[u_], faces_.x.size[v_], tolerance_, &polygon);
    for (int i = 0; i < polygon.count; ++i) {
      const ClipVertex& vertex = polygon[i];
      const int in = polygon[(i + polygon.count - 1) % polygon.count].line_out;
      const int along = vertex.line_out;
      FeatureCode code_x = code_of_x(), code_y = box_face_code(y_axis_, y_side_ < 0.0);
      // a corner of y, a corner of x, or a crossing of an edge of each
      if (in < kFirstSide && along < kFirstSide) {
        code_y = corner_of_y(static_cast<std::size_t>(along));
      } else if (in >= kFirstSide && along >= kFirstSide) {
        code_x = box_vertex_code(x_corner(rectangle_corner(vertex.x, vertex.y)));
      } else {
        const int x_edge = std::max(in, along) - kFirstSide, y_edge = std::min(in, along);
        code_x = box_edge_code(x_edge % 2 == 0 ? u_ : v_, x_corner(x_edge));
        code_y = box_edge_code(y_edge % 2 == 0 ? y_u_ : y_v_, y_corner(static_cast<std::size_t>(y_edge)));
      }
      const double depth = y_normal_.dot(place(vertex.x, vertex.y) - centre_) / y_normal_.dot(normal_);
      add(vertex.x, vertex.y, depth, code_x, code_y, out);
    }
  }

  void add(double x, double y, double depth, FeatureCode code_x, FeatureCode code_y, ContactCandidates* out) const {
    ContactPoint contact;
    contact.point = place(x, y) - 0.5 * depth * normal_;
    contact.normal = faces_.x_is_a ? normal_ : Vector3(-normal_);
    contact.depth = depth;
    contact.feature = faces_.x_is_a ? contact_feature(code_x, code_y) : contact_feature(code_y, code_x);
    out->add(contact);
  }

  // On the reference face.
  Vector3 place(double x, double y) const {
    Vector3 point;
    point[axis_] = side_ * faces_.x.size[axis_];
    point[u_] = x, point[v_] = y;
    return point;
  }

  static Vector3 face_corner(const Vector3& half, int axis, int u, int v, double side, std::size_t i) {
    Vector3 corner;
    corner[axis] = side * half[axis];
    corner[u] = (i == 0 || i == 3) ? half[u] : -half[u];
    corner[v] = i < 2 ? half[v] : -half[v];
    return corner;
  }
  Vector3 x_corner(int i) const {
    return face_corner(faces_.x.size, axis_, u_, v_, side_, static_cast<std::size_t>(i));
  }
  Vector3 y_corner(std::size_t i) const { return face_corner(faces_.y.size, y_axis_, y_u_, y_v_, y_side_, i); }
  FeatureCode corner_of_y(std::size_t i) const { return box_vertex_code(y_corner(i)); }
  FeatureCode code_of_x() const { return box_face_code(axis_, side_ < 0.0); }

  const Faces& faces_;
  Vector3 normal_;
  int axis_, u_, v_;
  double side_;
  double margin_;
  double tolerance_;
  int y_axis_ = 0, y_u_ = 1, y_v_ = 2;
  double y_side_ = 1.0;
  Vector3 y_normal_;
  Vector3 centre_;
  std::array<Vector3, 4> corners_;  // seen along the normal, on the reference face
  std::array<double, 4> depths_;
};

// ---- the pair

void place(const Matrix3& R, const Vector3& p, Manifold* manifold) {
  for (int i = 0; i < manifold->count; ++i) {
    ContactPoint& contact = manifold->contacts[static_cast<std::size_t>(i)];
    contact.point = p + R * contact.point;
    contact.normal = R * contact.normal;
  }
}

class BoxPair {
 public:
  BoxPair(const BoxAxes& axes, const ConvexPair& pair, const Placement& placement, double margin, Manifold* out)
      : axes_(axes),
        pair_(pair),
        placement_(placement),
        margin_(margin),
        rounding_(rounding_length(pair)),
        candidates_(margin, rounding_, depth_tie(pair)),
        out_(out) {}

  void collide() {
    const Vector3 &depths_a = axes_.depths_a(), &depths_b = axes_.depths_b();
    // a face of a is preferred to one of b, and both to edges
    const double tie = tie_length(pair_);
    const FaceAxis of_a = shallowest_of(depths_a, tie), of_b = shallowest_of(depths_b, tie);
    const bool prefers_b = of_b.depth < of_a.depth - face_preference(pair_, of_a.depth);
    const FaceAxis& face = prefers_b ? of_b : of_a;
    const double shortfall = face_preference(pair_, face.depth);
    EdgeAxis edges = axes_.shallowest_edges(face.depth - shortfall);
    if (edges.depth < -margin_) return;
    if (edges.depth < kNoBound) {
      if (!add_tilted_face(prefers_b, face, edges) && !add_edges(edges)) add_closest(edges.normal);
      return;
    }
    if (add_between(of_a, of_b)) return;
    // As long as its patch is about as deep as the preferred face, a vertex deeper still lies beside it, in touch with
    // nothing. Else the shallowest axis decides.
    if (add_face(prefers_b, face, shortfall)) return;
    const bool least_is_b = of_b.depth < of_a.depth;
    const FaceAxis& least = least_is_b ? of_b : of_a;
    edges = axes_.shallowest_edges(least.depth);
    if (edges.depth < -margin_) return;
    if (edges.depth < kNoBound) {
      if (add_edges(edges)) return;
    } else if (least_is_b != prefers_b && add_face(least_is_b, least, tie)) {
      return;
    }
    const Vector3 normal = edges.depth < least.depth ? edges.normal
                           : least_is_b              ? Vector3(sign_b(least.axis) * pair_.R_AB.col(least.axis))
                                                     : Vector3(sign_a(least.axis) * Vector3::Unit(least.axis));
    if (std::min(edges.depth, least.depth) < -tie) {
      add_closest(normal);
    } else {
      add_features({normal, pair_.depth_along(normal), AxisKind::kFree, -1});
    }
  }

 private:
  // Of the axis that points from a to b.
  double sign_a(int axis) const { return pair_.p_AB[axis] < 0.0 ? -1.0 : 1.0; }
  double sign_b(int axis) const { return axes_.p_AB_B()[axis] < 0.0 ? -1.0 : 1.0; }

  bool add_edges(const EdgeAxis& edges) {
    const std::optional<ContactPoint> contact = contact_of_edges(pair_, edges);
    if (!contact) return false;
    out_->count = 1;
    out_->contacts[0] = *contact;
    place(placement_.R_WA, Vector3::Zero(), out_);
    return true;
  }

  Faces faces_of(bool of_b) const {
    if (of_b) return {pair_.b, pair_.a, pair_.R_AB.transpose(), -axes_.p_AB_B(), false};
    return {pair_.a, pair_.b, pair_.R_AB, pair_.p_AB, true};
  }
  // The end of the axis that faces the other box.
  double side_of(bool of_b, int axis) const { return of_b ? -sign_b(axis) : sign_a(axis); }

  // False if the patch misses the depth of the face by more than `shortfall`.
  bool add_face(bool of_b, const FaceAxis& face, double shortfall) {
    const Faces faces = faces_of(of_b);
    const double side = side_of(of_b, face.axis);
    candidates_.clear();
    FacePatch(faces, face.axis, side, side * Vector3::Unit(face.axis), margin_, rounding_).add_contacts(&candidates_);
    return keep_patch(of_b, face.depth - shortfall);
  }

  // The face along a normal near its own.
  bool add_tilted_face(bool of_b, const FaceAxis& face, const EdgeAxis& edges) {
    const Faces faces = faces_of(of_b);
    const Vector3 normal = of_b ? Vector3(-(pair_.R_AB.transpose() * edges.normal)) : edges.normal;
    const FacePatch patch(faces, face.axis, side_of(of_b, face.axis), normal, margin_, rounding_);
    if (!patch.is_nearly_flat()) return false;
    candidates_.clear();
    patch.add_contacts(&candidates_);
    return keep_patch(of_b, edges.depth - tie_length(pair_));
  }

  bool keep_patch(bool of_b, double least) {
    if (!(candidates_.deepest() >= least)) return false;
    candidates_.reduce_to(out_);
    if (of_b) {
      place(placement_.R_WB, placement_.p_AB_W, out_);
    } else {
      place(placement_.R_WA, Vector3::Zero(), out_);
    }
    return true;
  }

  // Of two faces that are equally shallow because an edge or a corner of one box meets that of the other any direction between
  // would do: the one in the middle, so that what is symmetric stays so. False if one is shallower, or if they lie on each other.
  bool add_between(const FaceAxis& of_a, const FaceAxis& of_b) {
    const double tie = tie_length(pair_);
    const Vector3 normal_a = sign_a(of_a.axis) * Vector3::Unit(of_a.axis);
    const Vector3 sum = normal_a + sign_b(of_b.axis) * pair_.R_AB.col(of_b.axis);
    const double length = sum.norm();  // twice the cosine of half their angle
    if (std::fabs(of_a.depth - of_b.depth) > tie || !(length > 0.0)) return false;
    const Vector3 normal = sum / length;
    const double cosine = normal.dot(normal_a), depth = pair_.depth_along(normal);
    // between the two the same points are the deepest: h is linear there
    if (2.0 * cosine * cosine - 1.0 > kNearlyFlat || std::fabs(depth * cosine - of_a.depth) > tie) return false;
    if (depth < -margin_) return true;
    candidates_.clear();
    add_patch_contacts(pair_, {normal, depth, AxisKind::kFree, -1}, &candidates_);
    return keep_patch(false, depth - tie);
  }

  // Boxes that are apart, by their closest points; along `otherwise` where these are nearer than rounding knows.
  void add_closest(const Vector3& otherwise) {
    SupportMapBuffer buffer_a, buffer_b;
    const PlacedPair placed{support_map_of(pair_.a, &buffer_a), support_map_of(pair_.b, &buffer_b), pair_.R_AB,
                            pair_.p_AB};
    const std::optional<Separation> least = find_distance(placed, margin_);
    const Vector3 normal = least ? least->normal : otherwise;
    const ContactAxis axis{normal, pair_.depth_along(normal), AxisKind::kFree, -1};
    if (!(axis.depth >= -margin_)) return;
    candidates_.clear();
    add_patch_contacts(pair_, axis, &candidates_);
    if (candidates_.deepest() >= axis.depth - tie_length(pair_)) {
      candidates_.reduce_to(out_);
      place(placement_.R_WA, Vector3::Zero(), out_);
    } else {
      add_features(axis);
    }
  }

  void add_features(const ContactAxis& axis) {
    candidates_.clear();
    add_support_contact(pair_, axis, &candidates_);
    candidates_.reduce_to(out_);
    place(placement_.R_WA, Vector3::Zero(), out_);
  }

  const BoxAxes& axes_;
  const ConvexPair& pair_;
  const Placement& placement_;
  double margin_;
  double rounding_;
  ContactCandidates candidates_;
  Manifold* out_;
};

}  // namespace

void collide_box_box(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  out->count = 0;
  const BoxAxes axes(a, b, placement);
  if (std::min(axes.depths_a().minCoeff(), axes.depths_b().minCoeff()) < -margin) return;
  const ConvexPair pair(a, b, axes.R_AB(), axes.p_AB());
  BoxPair(axes, pair, placement, margin, out).collide();
}

}  // namespace gravitas::collision
