// check_contacts() of physics_checks.h: closed forms of the shapes that most bodies have.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

#include "plugin_sdk/body.h"
#include "plugin_sdk/physics_checks.h"

namespace gravitas {
namespace {

// Of the sizes of the shapes, and of the coordinates.
constexpr double kOfSize = 1e-7, kOfCoordinates = 1e-12;
// Normals of spheres and half-spaces, rad; faces that lie on each other, rad.
constexpr double kOfNormal = 1e-6, kFlatContact = 1e-2, kFlushFace = 1e-4;
// Of the sizes: by how much flush surfaces may differ.
constexpr double kOfFlush = 2e-6;
// Share of the overlap that the deepest contact has at least, and of the margin within which one is demanded.
constexpr double kShareOfDeepest = 0.9;
constexpr std::size_t kMostCorners = 4;

enum class Form { kUnknown, kSphere, kBox, kCylinder, kHalfspace };

// A placed shape. Sizes as in the scene: radius; half extents; radius, half height, radius; the half-space is y <= 0.
struct Solid {
  Form form = Form::kUnknown;
  Vector3 size = Vector3::Zero();
  Pose pose;

  bool is_bounded() const { return form != Form::kHalfspace; }
  double extent() const { return is_bounded() ? size.maxCoeff() : 0.0; }
  Vector3 local(const Vector3& direction) const { return pose.orientation.conjugate() * direction; }

  // Signed distance of a point (world) to the surface, exact on both sides.
  double distance(const Vector3& point) const {
    const Vector3 p = local(point - pose.position);
    if (form == Form::kSphere) return p.norm() - size.x();
    if (form == Form::kHalfspace) return p.y();
    Vector3 q = p.cwiseAbs() - size;
    if (form == Form::kCylinder)
      q = Vector3(Eigen::Vector2d(p.x(), p.z()).norm() - size.x(), std::fabs(p.y()) - size.y(), -1e300);
    return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
  }

  // How far the shape reaches from its origin along a unit direction (world). A half-space: only along its normal.
  double support(const Vector3& direction) const {
    const Vector3 d = local(direction);
    if (form == Form::kSphere) return size.x();
    if (form == Form::kHalfspace) return 0.0;
    if (form == Form::kCylinder) return size.x() * Eigen::Vector2d(d.x(), d.z()).norm() + size.y() * std::fabs(d.y());
    return size.dot(d.cwiseAbs());
  }

  Vector3 up() const { return pose.orientation * Vector3::UnitY(); }
  Vector3 corner(unsigned which) const {
    const Vector3 signs((which & 1U) != 0 ? 1.0 : -1.0, (which & 2U) != 0 ? 1.0 : -1.0, (which & 4U) != 0 ? 1.0 : -1.0);
    return transform_point(pose, size.cwiseProduct(signs));
  }
};

// Overlap of two shapes along a unit direction from a to b.
double overlap(const Solid& a, const Solid& b, const Vector3& direction) {
  return a.support(direction) + b.support(-direction) - direction.dot(b.pose.position - a.pose.position);
}

// Smallest overlap of two boxes over the axes that can separate them; not positive where one does.
double overlap_of_boxes(const Solid& a, const Solid& b) {
  const Matrix3 axes_a = a.pose.orientation.toRotationMatrix(), axes_b = b.pose.orientation.toRotationMatrix();
  const Vector3 between = b.pose.position - a.pose.position;
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](const Vector3& axis) {
    const double length = axis.norm();
    if (length < 1e-6) return;
    const Vector3 unit = axis / length;
    least = std::min(least, overlap(a, b, unit.dot(between) < 0.0 ? Vector3(-unit) : unit));
  };
  for (int i = 0; i < 3; ++i) look(axes_a.col(i)), look(axes_b.col(i));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) look(axes_a.col(i).cross(axes_b.col(j)));
  return least;
}

// What a pair must show.
struct Expected {
  double depth = 0.0;        // m
  bool knows_gap = false;    // depth is right where it is negative, too
  bool knows_depth = false;  // and the deepest contact has it
};

std::optional<Expected> expected_of(const Solid& a, const Solid& b) {
  if (a.form == Form::kUnknown || b.form == Form::kUnknown || (!a.is_bounded() && !b.is_bounded())) return std::nullopt;
  if (a.form == Form::kSphere) return Expected{a.size.x() - b.distance(a.pose.position), true, true};
  if (b.form == Form::kSphere) return Expected{b.size.x() - a.distance(b.pose.position), true, true};
  if (!a.is_bounded()) return Expected{overlap(a, b, a.up()), true, true};
  if (!b.is_bounded()) return Expected{overlap(a, b, -b.up()), true, true};
  if (a.form == Form::kBox && b.form == Form::kBox) return Expected{overlap_of_boxes(a, b), false, false};
  return std::nullopt;
}

// Axis of a box that is parallel to the direction, or none.
std::optional<Vector3> face_axis(const Solid& box, const Vector3& direction, double angle) {
  if (box.form == Form::kHalfspace) return box.up();
  const Vector3 d = box.local(direction);
  Eigen::Index axis = 0;
  const double most = d.cwiseAbs().maxCoeff(&axis);
  if (!(most >= 1.0 - 0.5 * angle * angle)) return std::nullopt;
  return Vector3(box.pose.orientation * Vector3::Unit(axis));
}

// Corners of `box`, on the side to which `towards` points, that lie within `other`, or above it by no more than `gap`.
std::size_t corners_within(const Solid& box, const Solid& other, const Vector3& towards, double gap, double slack) {
  if (box.form != Form::kBox) return 0;
  std::size_t count = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const Vector3 corner = box.corner(i);
    if (towards.dot(corner - box.pose.position) <= 0.0) continue;
    const double below = other.support(-towards) - towards.dot(other.pose.position - corner);
    if (below <= slack - gap) continue;
    // looked at from inside the face, so that a gap counts as none
    const Vector3 inside = corner + std::max(0.0, slack - below) * towards + 0.5 * slack * towards;
    if (other.distance(inside) <= -slack || (!other.is_bounded())) ++count;
  }
  return count;
}

class ContactCheck {
 public:
  ContactCheck(const stage::CollisionManifoldsRequest& request, const ContactColumns& answer)
      : request_(request), answer_(answer) {}

  std::string check() {
    std::size_t row = 0;
    const std::size_t pairs = request_.pair().size() / 2;
    for (std::size_t pair = 0; pair < pairs; ++pair) {
      const std::size_t first = row;
      while (row < answer_.pair.size() && answer_.pair[row] == pair) ++row;
      if (!check_pair(pair, first, row)) return wrong_;
    }
    return {};
  }

 private:
  Solid solid_of(std::uint32_t body) const {
    Solid solid;
    const std::uint32_t shape = request_.body_shape()[body];
    const std::uint64_t type = request_.shape_type()[shape];
    const std::uint32_t begin = request_.shape_parameter_begin()[shape];
    const double* p = request_.shape_parameter().data() + begin;
    const std::uint32_t count = request_.shape_parameter_begin()[shape + 1] - begin;
    if (type == type_id("Sphere") && count == 1) solid = {Form::kSphere, Vector3::Constant(p[0]), {}};
    if (type == type_id("Box") && count == 3) solid = {Form::kBox, Vector3(p[0], p[1], p[2]), {}};
    if (type == type_id("Cylinder") && count == 2) solid = {Form::kCylinder, Vector3(p[0], 0.5 * p[1], p[0]), {}};
    if (type == type_id("Halfspace") && count == 0) solid = {Form::kHalfspace, Vector3::Zero(), {}};
    const Pose pose{vector_at(request_.position(), body), quaternion_at(request_.orientation(), body)};
    solid.pose = compose(
        pose, {vector_at(request_.geometry_position(), body), quaternion_at(request_.geometry_orientation(), body)});
    return solid;
  }

  // False, with the reason in wrong_.
  bool is_within(const char* what, std::size_t row, double residual, double bound, const char* law) {
    if (residual <= bound) return true;
    char text[256];
    std::snprintf(text, sizeof text, "%s of contact %zu is off by %.3g, allowed %.3g (%s)", what, row, residual, bound,
                  law);
    wrong_ = text;
    return false;
  }

  bool check_pair(std::size_t pair, std::size_t first, std::size_t end) {
    const std::uint32_t one = request_.pair()[2 * pair], two = request_.pair()[2 * pair + 1];
    const Solid a = solid_of(one), b = solid_of(two);
    const double coordinates = std::max(a.pose.position.cwiseAbs().maxCoeff(), b.pose.position.cwiseAbs().maxCoeff());
    slack_ = kOfSize * std::max(a.extent(), b.extent()) + kOfCoordinates * coordinates;
    deepest_ = -std::numeric_limits<double>::infinity();
    for (std::size_t row = first; row < end; ++row) deepest_ = std::max(deepest_, answer_.depth[row]);
    for (std::size_t row = first; row < end; ++row) {
      if (!check_velocity(row, one, two) || !check_distinct(row, first)) return false;
      const Vector3 normal = vector_at(answer_.normal, row), half = 0.5 * answer_.depth[row] * normal;
      const Vector3 point = vector_at(answer_.point, row);
      // two solids with edges: a point may stand for a patch, beside the face it is measured from
      const auto has_edges = [](Form form) { return form == Form::kBox || form == Form::kCylinder; };
      const bool knows_points = !has_edges(a.form) || !has_edges(b.form);
      if (knows_points &&
          (!check_surface(row, a, point + half, normal) || !check_surface(row, b, point - half, -normal)))
        return false;
      if (a.form == Form::kUnknown || b.form == Form::kUnknown) continue;
      // both are their own mirror images: of an axis' two signs the one with less overlap leads from a to b
      if (a.is_bounded() && b.is_bounded() &&
          !is_within("normal", row, -normal.dot(b.pose.position - a.pose.position), slack_, "from a to b, m"))
        return false;
      if (!is_within("depth", row, answer_.depth[row] - overlap(a, b, normal), slack_, "overlap along the normal, m"))
        return false;
    }
    return check_presence(pair, first, end, a, b);
  }

  bool check_velocity(std::size_t row, std::uint32_t one, std::uint32_t two) {
    const Vector3 point = vector_at(answer_.point, row);
    double sizes = 0.0;
    const auto velocity = [&](std::uint32_t body) {
      const Vector3 linear = vector_at(request_.linear_velocity(), body);
      const Vector3 angular = vector_at(request_.angular_velocity(), body);
      const Vector3 arm = point - vector_at(request_.position(), body);
      sizes += linear.norm() + angular.norm() * (arm.norm() + point.norm());
      return Vector3(linear + angular.cross(arm));
    };
    const Vector3 relative = velocity(two) - velocity(one);
    return is_within("relative_velocity", row, (vector_at(answer_.relative_velocity, row) - relative).norm(),
                     kOfCoordinates * sizes, "v_b - v_a at the point, m/s");
  }

  // A contact that stands twice, under two features.
  bool check_distinct(std::size_t row, std::size_t first) {
    for (std::size_t other = first; other < row; ++other) {
      if (vector_at(answer_.point, other) != vector_at(answer_.point, row)) continue;
      // in a corner each wall has one there
      if (vector_at(answer_.normal, other).dot(vector_at(answer_.normal, row)) < 0.99) continue;
      wrong_ = "contacts " + std::to_string(other) + " and " + std::to_string(row) + " of a pair are at the same point";
      return false;
    }
    return true;
  }

  // A point on the surface, with the normal that leads out there.
  bool check_surface(std::size_t row, const Solid& solid, const Vector3& point, const Vector3& normal) {
    if (solid.form == Form::kUnknown) return true;
    if (!is_within("point or depth", row, std::fabs(solid.distance(point)), slack_, "distance to a surface, m"))
      return false;
    if (solid.form == Form::kHalfspace)
      return is_within("normal", row, (normal - solid.up()).norm(), kOfNormal, "that of the half-space");
    const Vector3 arm = point - solid.pose.position;
    if (solid.form == Form::kSphere)
      return is_within("normal", row, (arm - solid.size.x() * normal).norm(), kOfNormal * solid.size.x() + slack_,
                       "from the centre of the sphere to its surface, m");
    return true;
  }

  bool check_presence(std::size_t pair, std::size_t first, std::size_t end, const Solid& a, const Solid& b) {
    const std::optional<Expected> expected = expected_of(a, b);
    if (!expected) return true;
    const double least = expected->knows_gap ? slack_ - kShareOfDeepest * request_.margin() : slack_;
    if (!(expected->depth > least)) return true;
    char text[160];
    const double shallow = std::min(expected->depth, kShareOfDeepest * expected->depth) - slack_;
    const bool is_too_shallow = expected->knows_depth && deepest_ < shallow;
    if ((first == end || is_too_shallow) && is_over_seam(pair, a, b)) return true;
    if (first == end) {
      std::snprintf(text, sizeof text, "pair %zu overlaps by %.3g m and has no contact", pair, expected->depth);
      wrong_ = text;
      return false;
    }
    if (is_too_shallow) {
      std::snprintf(text, sizeof text, "pair %zu overlaps by %.3g m, its deepest contact by %.3g", pair,
                    expected->depth, deepest_);
      wrong_ = text;
      return false;
    }
    const std::size_t corners = corners_of(first, a, b);
    if (end - first >= std::min(kMostCorners, corners)) return true;
    std::snprintf(text, sizeof text, "pair %zu has %zu contacts where %zu corners lie within", pair, end - first,
                  corners);
    wrong_ = text;
    return false;
  }

  // One of the two touches a third body, and the other has a face along that contact's plane, no higher than it: what slides
  // over bodies that lie flush need not touch the side of the next.
  bool is_over_seam(std::size_t pair, const Solid& a, const Solid& b) const {
    const std::span<const std::uint32_t> bodies = request_.pair();
    const double flush = slack_ + kOfFlush * std::max(a.extent(), b.extent());
    for (std::size_t row = 0; row < answer_.pair.size(); ++row) {
      const std::size_t touching = answer_.pair[row];
      if (touching == pair) continue;
      for (const std::size_t end : {0U, 1U}) {
        const std::uint32_t shared = bodies[2 * touching + end];
        if (shared != bodies[2 * pair] && shared != bodies[2 * pair + 1]) continue;
        const Solid &body = shared == bodies[2 * pair] ? a : b, &other = shared == bodies[2 * pair] ? b : a;
        // out of the third body, whose surface is where the contact's is
        const double depth = answer_.depth[row];
        const Vector3 out = (end == 0 ? -1.0 : 1.0) * vector_at(answer_.normal, row);
        const Vector3 surface = vector_at(answer_.point, row) + 0.5 * depth * out;
        const double tilt = kFlushFace * ((surface - other.pose.position).norm() + other.extent());
        const double top = out.dot(other.pose.position - surface) + other.support(out);
        const double bottom = out.dot(body.pose.position - surface) - body.support(-out);
        if (has_face_along(other, out) && top <= flush + tilt && bottom >= -2.0 * std::max(0.0, depth) - flush - tilt)
          return true;
      }
    }
    return false;
  }

  static bool has_face_along(const Solid& solid, const Vector3& direction) {
    const Vector3 d = solid.local(direction).cwiseAbs();
    if (solid.form == Form::kBox) return d.maxCoeff() >= 1.0 - 0.5 * kFlushFace * kFlushFace;
    return solid.form == Form::kCylinder && d.y() >= 1.0 - 0.5 * kFlushFace * kFlushFace;
  }

  // Corners of a box that lie within a half-space, where a face of it does.
  std::size_t corners_of(std::size_t first, const Solid& a, const Solid& b) const {
    const auto is_flat = [](const Solid& solid) { return solid.form == Form::kBox || solid.form == Form::kHalfspace; };
    // of two boxes a method may show an edge or one corner instead
    if (!is_flat(a) || !is_flat(b) || (a.is_bounded() && b.is_bounded())) return 0;
    const Vector3 normal = vector_at(answer_.normal, first);
    const auto axis_a = face_axis(a, normal, kFlatContact), axis_b = face_axis(b, normal, kFlatContact);
    if (!axis_a || !axis_b) return 0;
    const double gap = kShareOfDeepest * request_.margin();
    return corners_within(a, b, normal, gap, slack_) + corners_within(b, a, -normal, gap, slack_);
  }

  const stage::CollisionManifoldsRequest& request_;
  const ContactColumns& answer_;
  double slack_ = 0.0, deepest_ = 0.0;
  std::string wrong_;
};

}  // namespace

std::string check_contacts(const stage::CollisionManifoldsRequest& request, const ContactColumns& answer) {
  return ContactCheck(request, answer).check();
}

}  // namespace gravitas
