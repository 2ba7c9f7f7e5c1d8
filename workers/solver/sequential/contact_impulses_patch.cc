// The contacts of one pair of bodies as a whole, within the relaxation of contact_impulses.h.
#include <algorithm>
#include <cmath>

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
    if ((row.frame.col(0) - first.frame.col(0)).squaredNorm() > 1e-18) return false;
    const Vector3 d = row.arm1 - first.arm1;
    height = std::max(height, std::fabs(first.frame.col(0).dot(d)));
    extent = std::max(extent, d.norm());
  }
  return height <= 0.01 * extent;
}

ContactPatch ContactImpulses::whole_of(const Patch& patch, const SolverBodies& bodies) const {
  const int width = rows_[patch.first].has_friction ? 3 : 1;
  const auto count = static_cast<int>(patch.end - patch.first);
  ContactPatch::Response response = ContactPatch::Response::Zero();
  for (int i = 0; i < count; ++i) {
    const Row& at = rows_[patch.first + static_cast<std::size_t>(i)];
    for (int j = 0; j <= i; ++j) {
      const Row& from = rows_[patch.first + static_cast<std::size_t>(j)];
      const Matrix3 world =
          point_response(bodies[at.body1], at.arm1, from.arm1) + point_response(bodies[at.body2], at.arm2, from.arm2);
      const Matrix3 part = at.frame.transpose() * world * from.frame;
      response.block(width * i, width * j, width, width) = part.topLeftCorner(width, width);
      response.block(width * j, width * i, width, width) = part.topLeftCorner(width, width).transpose();
    }
  }
  return ContactPatch::of(response, width * count);
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
  for (std::size_t i = 0; i < count; ++i) {
    Row& row = rows_[patch.first + i];
    push(row, impulses[i] - row.impulse, bodies, x);
    row.impulse = impulses[i];
  }
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
