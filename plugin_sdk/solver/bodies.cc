// Reading the bodies of a request, and the rows that push two of them.
#include "plugin_sdk/solver/bodies.h"

#include <algorithm>
#include <limits>
#include <span>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {

double SolverBody::gyration() const { return radius_of_gyration(inverse_mass, inverse_inertia.trace() / 3.0); }

void SolverBodies::load(const stage::SolverSolveRequest& request) {
  const std::size_t rows = request.flags().size();
  bodies_.clear();
  bodies_.resize(rows + 1);
  for (std::size_t i = 0; i < rows; ++i) {
    SolverBody& body = bodies_[i];
    body.start = {vector_at(request.position(), i), quaternion_at(request.orientation(), i)};
    body.trial = {vector_at(request.trial_position(), i), quaternion_at(request.trial_orientation(), i)};
    body.start_velocity = {vector_at(request.linear_velocity(), i), vector_at(request.angular_velocity(), i)};
    body.trial_velocity = {vector_at(request.trial_linear_velocity(), i),
                           vector_at(request.trial_angular_velocity(), i)};
    const std::uint32_t flags = request.flags()[i];
    if ((flags & kMovable) == 0 || (flags & kKinematic) != 0) continue;
    body.inverse_mass = request.inverse_mass()[i];
    body.inverse_inertia = world_inverse_inertia(body.trial.orientation, vector_at(request.inverse_inertia(), i));
  }
  const std::span<const std::uint32_t> touching = request.contact_body();
  for (std::size_t k = 0; k < touching.size(); ++k) {
    const bool is_known = k >= 2 && touching[k - 2] == touching[k];  // contacts of a pair follow each other
    if (is_known || touching[k] == kNone) continue;
    SolverBody& body = bodies_[touching[k]];
    body.way = {body.trial.position - body.start.position,
                log_rotation(body.trial.orientation * body.start.orientation.conjugate())};
  }
}

SolverBodies SolverBodies::subset(const std::vector<std::uint32_t>& rows) const {
  SolverBodies some;
  some.bodies_.reserve(rows.size());
  for (const std::uint32_t row : rows) some.bodies_.push_back(bodies_[row]);
  return some;
}

void SolverBodies::turn(const BodyMotion& displacement) {
  for (std::size_t i = 0; i < count(); ++i) {
    if (displacement[i].angular.isZero(0.0)) continue;
    const Matrix3 turn = to_rotation_matrix(exp_rotation(displacement[i].angular));
    Matrix3& inverse = bodies_[i].inverse_inertia;
    inverse = turn * inverse * turn.transpose();
  }
}

SolverBodies SolverBodies::with_immovable_twins() const {
  SolverBodies all = *this;
  all.bodies_.insert(all.bodies_.end(), bodies_.begin(), bodies_.end());
  for (std::size_t i = bodies_.size(); i < all.bodies_.size(); ++i) {
    all.bodies_[i].inverse_mass = 0.0;
    all.bodies_[i].inverse_inertia.setZero();
  }
  return all;
}

ConstraintDirection ConstraintDirection::through(const Vector3& point, const Vector3& axis, const SolverBody& body1,
                                                 const SolverBody& body2) {
  return through(point, point, axis, body1, body2);
}

ConstraintDirection ConstraintDirection::through(const Vector3& point1, const Vector3& point2, const Vector3& axis,
                                                 const SolverBody& body1, const SolverBody& body2) {
  ConstraintDirection d;
  d.linear = axis;
  d.angular1 = axis.cross(point1 - body1.trial.position);
  d.angular2 = (point2 - body2.trial.position).cross(axis);
  d.turn1 = body1.inverse_inertia * d.angular1;
  d.turn2 = body2.inverse_inertia * d.angular2;
  return d;
}

ConstraintDirection ConstraintDirection::about(const Vector3& axis, const SolverBody& body1, const SolverBody& body2) {
  ConstraintDirection d;
  d.angular1 = -axis;
  d.angular2 = axis;
  d.turn1 = body1.inverse_inertia * d.angular1;
  d.turn2 = body2.inverse_inertia * d.angular2;
  return d;
}

void ConstraintDirection::subtract(double share, const ConstraintDirection& other) {
  linear -= share * other.linear;
  angular1 -= share * other.angular1;
  angular2 -= share * other.angular2;
  turn1 -= share * other.turn1;
  turn2 -= share * other.turn2;
}

Matrix3 point_response(const SolverBody& body, const Vector3& at, const Vector3& from) {
  return body.inverse_mass * Matrix3::Identity() - skew(at) * body.inverse_inertia * skew(from);
}

double closing_slop(const Vector3& point, const SolverBody& body1, const SolverBody& body2) {
  double arm = 0.0;
  double coordinates = point.cwiseAbs().maxCoeff();
  for (const SolverBody* body : {&body1, &body2}) {
    if (!body->is_pushed()) continue;
    arm = std::max(arm, (point - body->trial.position).norm());
    coordinates = std::max(coordinates, body->trial.position.cwiseAbs().maxCoeff());
  }
  return 1e-9 * arm + 8.0 * std::numeric_limits<double>::epsilon() * coordinates;
}

}  // namespace gravitas
