// The contacts of one pair of bodies as a whole, within the relaxation of contact_impulses.h.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plugin_sdk/math/rotation.h"
#include "workers/solver/sequential/contact_impulses.h"

namespace gravitas {

// Rows of the same two bodies, and the inverse of those that have one.
void ContactImpulses::set_patches(const SolverBodies& bodies) {
  patches_.clear();
  for (std::size_t first = 0; first < rows_.size();) {
    std::size_t end = first + 1;
    bool alike = true;
    for (; end < rows_.size(); ++end) {
      if (rows_[end].body1 != rows_[first].body1 || rows_[end].body2 != rows_[first].body2) break;
      alike = alike && rows_[end].has_friction == rows_[first].has_friction;
    }
    Patch& patch = patches_.emplace_back();
    patch.first = static_cast<std::uint32_t>(first);
    patch.end = static_cast<std::uint32_t>(end);
    const std::size_t width = rows_[first].has_friction ? 3 : 1;
    const std::size_t size = width * (end - first);
    patch.has_whole = alike && end - first > 1 && size <= ContactPatch::kRows;
    if (patch.has_whole) patch.whole = whole_of(patch, bodies);
    patch.is_flat = patch.has_whole && width == 3 && is_flat(patch);
    first = end;
  }
}

// One normal, and no point further than a hundredth of the patch's extent from its plane: what lies
// off it comes out as a small rest that the next sweep sees.
bool ContactImpulses::is_flat(const Patch& patch) const {
  const Row& first = rows_[patch.first];
  double height = 0.0;
  double extent = 0.0;
  for (std::size_t i = patch.first + 1; i < patch.end; ++i) {
    const Row& row = rows_[i];
    // tangents, too: where a number of the normal changes its sign, those of one normal differ
    if ((row.frame - first.frame).squaredNorm() > 1e-18) return false;
    const Vector3 d = row.arm1 - first.arm1;
    height = std::max(height, std::fabs(first.frame.col(0).dot(d)));
    extent = std::max(extent, d.norm());
  }
  return height <= 0.01 * extent;
}

ContactPatch ContactImpulses::whole_of(const Patch& patch, const SolverBodies& bodies) const {
  const auto count = static_cast<int>(patch.end - patch.first);
  const Row* rows = &rows_[patch.first];
  if (!rows[0].has_friction) {
    ContactPatch::Response response = ContactPatch::Response::Zero();
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j <= i; ++j) {
        const Matrix3 world = point_response(bodies[rows[0].body1], rows[i].arm1, rows[j].arm1) +
                              point_response(bodies[rows[0].body2], rows[i].arm2, rows[j].arm2);
        response(i, j) = response(j, i) = rows[i].frame.col(0).dot(world * rows[j].frame.col(0));
      }
    }
    return ContactPatch::of(response, count);
  }
  std::array<ContactPatch::Point, ContactPatch::kPoints> points;
  Vector3 arm1 = Vector3::Zero(), arm2 = Vector3::Zero();
  for (int i = 0; i < count; ++i) {
    points[static_cast<std::size_t>(i)] = {0.5 * (rows[i].arm1 + rows[i].arm2), rows[i].frame};
    arm1 += rows[i].arm1 / count, arm2 += rows[i].arm2 / count;
  }
  ContactPatch::Square mobility = ContactPatch::Square::Zero();
  for (const auto& [body, arm] : {std::pair(rows[0].body1, arm1), std::pair(rows[0].body2, arm2)}) {
    const Matrix3 &turn = bodies[body].inverse_inertia, across = turn * skew(arm);
    mobility.topLeftCorner<3, 3>() += point_response(bodies[body], arm, arm);
    mobility.bottomLeftCorner<3, 3>() += across;
    mobility.topRightCorner<3, 3>() += across.transpose();
    mobility.bottomRightCorner<3, 3>() += turn;
  }
  return ContactPatch::of_points(points, count, mobility);
}

// All contacts of a patch as sticking and arriving at e s; false, with nothing done, if an impulse
// would leave its cone.
bool ContactImpulses::relax_whole(const Patch& patch, double share, const SolverBodies& bodies, BodyMotion& x,
                                  double* change) {
  if (!patch.has_whole) return false;
  const int width = rows_[patch.first].has_friction ? 3 : 1;
  const std::size_t count = patch.end - patch.first;
  ContactPatch::Rows missing = ContactPatch::Rows::Zero();
  bool is_open = true;
  for (std::size_t i = 0; i < count; ++i) {
    const Row& row = rows_[patch.first + i];
    if (row.slides) return false;
    const Vector3 left = Vector3(row.target, 0.0, 0.0) - velocity_of(row, x);
    is_open = is_open && left.x() <= 0.0 && row.impulse.x() == 0.0;
    for (int k = 0; k < width; ++k) missing(width * static_cast<int>(i) + k) = left(k);
  }
  ContactPatch::Rows amounts = ContactPatch::Rows::Zero();
  if (is_open || !patch.whole.solve(missing, &amounts)) return false;
  amounts *= share;

  PatchImpulses impulses;
  for (std::size_t i = 0; i < count; ++i) {
    impulses[i] = rows_[patch.first + i].impulse;
    for (int k = 0; k < width; ++k) impulses[i](k) += amounts(width * static_cast<int>(i) + k);
  }
  if (!is_in_cones(patch, impulses)) {
    if (!patch.is_flat || !spread_friction(patch, &impulses)) return false;
    if (!is_in_cones(patch, impulses)) return false;
  }
  // pushed at once
  const Row& first = rows_[patch.first];
  const SolverBody &one = bodies[first.body1], &two = bodies[first.body2];
  Vector3 force = Vector3::Zero(), moment1 = Vector3::Zero(), moment2 = Vector3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    Row& row = rows_[patch.first + i];
    const Vector3 world = row.frame * (impulses[i] - row.impulse);
    force += world, moment1 += row.arm1.cross(world), moment2 += row.arm2.cross(world);
    row.impulse = impulses[i];
  }
  x[first.body1].linear -= one.inverse_mass * force;
  x[first.body1].angular -= one.inverse_inertia * moment1;
  x[first.body2].linear += two.inverse_mass * force;
  x[first.body2].angular += two.inverse_inertia * moment2;
  *change = std::max(*change, missing.cwiseAbs().maxCoeff());
  return true;
}

bool ContactImpulses::is_in_cones(const Patch& patch, const PatchImpulses& impulses) const {
  for (std::size_t i = 0; i < patch.end - patch.first; ++i) {
    const double allowed = rows_[patch.first + i].static_friction * impulses[i].x();
    if (impulses[i].x() < 0.0 || impulses[i].tail<2>().squaredNorm() > allowed * allowed) return false;
  }
  return true;
}

// Spreads the friction of a flat patch, force F and moment M about the centre of pressure, in
// proportion to the normal impulses: T_i = N_i (F/sum N + M/(sum N d^2) turned d_i), d from that
// centre. Nothing holds a greater part of the cones' strength free. False where a normal impulse is
// negative.
bool ContactImpulses::spread_friction(const Patch& patch, PatchImpulses* impulses) const {
  const std::size_t count = patch.end - patch.first;
  const Matrix3& frame = rows_[patch.first].frame;
  std::array<Eigen::Vector2d, ContactPatch::kRows> place;
  double load = 0.0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d force = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Vector3& impulse = (*impulses)[i];
    if (impulse.x() < 0.0) return false;
    place[i] = frame.rightCols<2>().transpose() * (rows_[patch.first + i].arm1 - rows_[patch.first].arm1);
    load += impulse.x();
    centre += impulse.x() * place[i];
    force += impulse.tail<2>();
  }
  if (!(load > 0.0)) return false;
  centre /= load;
  double moment = 0.0;
  double spread = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d d = place[i] - centre;
    moment += d.x() * (*impulses)[i].z() - d.y() * (*impulses)[i].y();
    spread += (*impulses)[i].x() * d.squaredNorm();
  }
  const double twist = spread > 0.0 ? moment / spread : 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector2d d = place[i] - centre;
    const double normal = (*impulses)[i].x();
    (*impulses)[i].tail<2>() = normal * (force / load + twist * Eigen::Vector2d(-d.y(), d.x()));
  }
  return true;
}

}  // namespace gravitas
