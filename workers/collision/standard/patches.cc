// Extraction of touching features.
#include "workers/collision/standard/patches.h"

#include <cmath>

#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {
namespace {

// the vertex of a box, in its own frame, farthest along d
Vector3 box_vertex(const Shape& box, const Vector3& d) { return support_point(box, d); }

}  // namespace

BoxFace box_face(const FacingShape& box, int axis) {
  const Vector3 outward = box.outward_local();
  const int j = (axis + 1) % 3;
  const int k = (axis + 2) % 3;
  const bool negative = outward[axis] < 0.0;
  const double sign = negative ? -1.0 : 1.0;

  BoxFace face;
  face.plane.normal = sign * box.R.col(axis);
  face.plane.point = box.centre + box.shape.size[axis] * face.plane.normal;
  face.u = box.R.col(j);
  face.v = box.R.col(k);
  face.half_u = box.shape.size[j];
  face.half_v = box.shape.size[k];
  face.code = box_face_code(axis, negative);

  constexpr std::array<double, 4> kSignU = {1.0, -1.0, -1.0, 1.0};
  constexpr std::array<double, 4> kSignV = {1.0, 1.0, -1.0, -1.0};
  for (std::size_t i = 0; i < 4; ++i) {
    Vector3 vertex = Vector3::Zero();
    vertex[axis] = sign * box.shape.size[axis];
    vertex[j] = kSignU[i] * box.shape.size[j];
    vertex[k] = kSignV[i] * box.shape.size[k];
    face.vertices[i] = box.centre + box.R * vertex;
    face.vertex_codes[i] = box_vertex_code(vertex);
    // edge i runs along j for even i, along k for odd i; vertex i lies on it
    face.edge_codes[i] = box_edge_code(i % 2 == 0 ? j : k, vertex);
  }
  return face;
}

BoxFace facing_box_face(const FacingShape& box) {
  int axis = 0;
  box.outward_local().cwiseAbs().maxCoeff(&axis);
  return box_face(box, axis);
}

Cap facing_cap(const FacingShape& cylinder, const Vector3& reference) {
  const Vector3 axis = cylinder.R.col(1);
  const bool bottom = axis.dot(cylinder.outward) < 0.0;
  const Vector3 normal = bottom ? Vector3(-axis) : axis;
  const Vector3 centre = cylinder.centre + cylinder.shape.size.y() * normal;
  return {{centre, normal}, make_rim(centre, axis, cylinder.shape.size.x(), reference), bottom};
}

bool cap_faces(const FacingShape& cylinder) {
  return std::fabs(cylinder.R.col(1).dot(cylinder.outward)) > kCapAlignment;
}

Line facing_line(const FacingShape& shape) {
  const Vector3 outward = shape.outward_local();
  Line line;
  if (shape.is_box()) {
    int axis = 0;
    outward.cwiseAbs().minCoeff(&axis);
    Vector3 end = box_vertex(shape.shape, outward);
    line.code = box_edge_code(axis, end);
    for (std::size_t i = 0; i < 2; ++i) {
      end[axis] = i == 0 ? shape.shape.size[axis] : -shape.shape.size[axis];
      line.ends[i] = shape.centre + shape.R * end;
      line.end_codes[i] = box_vertex_code(end);
    }
    line.direction = shape.R.col(axis);
    line.radius = 0.0;
    return line;
  }
  const Vector3 radial = direction_of(Vector3(outward.x(), 0.0, outward.z()), Vector3::UnitX()).unit;
  const Vector3 half = shape.R.col(1) * shape.shape.size.y();
  const Vector3 middle = shape.centre + shape.R * (shape.shape.size.x() * radial);
  line.ends = {Vector3(middle + half), Vector3(middle - half)};
  line.end_codes = {cylinder_rim_point_code(false), cylinder_rim_point_code(true)};
  line.code = kCylinderSide;
  line.direction = shape.R.col(1);
  line.radius = shape.shape.size.x();
  return line;
}

Contour contour(const FacingShape& shape, double sine) {
  const Vector3 d = shape.outward_local();
  if (shape.is_box()) {
    int flat = 0;
    int steepest = 0;
    int flattest = 0;
    for (int i = 0; i < 3; ++i) flat += std::fabs(d[i]) <= sine ? 1 : 0;
    d.cwiseAbs().maxCoeff(&steepest);
    d.cwiseAbs().minCoeff(&flattest);
    const Vector3 vertex = box_vertex(shape.shape, d);
    if (flat == 0) return {Contour::Kind::kPoint, box_vertex_code(vertex)};
    if (flat == 1) return {Contour::Kind::kLine, box_edge_code(flattest, vertex)};
    return {Contour::Kind::kFace, box_face_code(steepest, d[steepest] < 0.0)};
  }
  if (std::fabs(d.y()) <= sine) return {Contour::Kind::kLine, kCylinderSide};
  const bool bottom = d.y() < 0.0;
  if (d.x() * d.x() + d.z() * d.z() <= sine * sine) {
    return {Contour::Kind::kFace, cylinder_cap_code(bottom)};
  }
  return {Contour::Kind::kPoint, cylinder_rim_point_code(bottom)};
}

}  // namespace gravitas::collision
