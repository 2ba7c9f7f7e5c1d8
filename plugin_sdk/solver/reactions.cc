#include "plugin_sdk/solver/reactions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/end_of_step_rows.h"
#include "plugin_sdk/solver/profile_ldlt.h"
#include "plugin_sdk/solver/request_check.h"

namespace gravitas {
namespace {

struct Body {
  double inverse_mass = 0.0;
  Matrix3 inverse_inertia = Matrix3::Zero();
  Vector3 position = Vector3::Zero();
  Twist velocity, acceleration;

  bool is_pushed() const { return inverse_mass > 0.0 || !inverse_inertia.isZero(0.0); }
  Vector3 velocity_at(const Vector3& arm) const { return velocity.linear + velocity.angular.cross(arm); }
  Vector3 centripetal(const Vector3& arm) const { return velocity.angular.cross(velocity.angular.cross(arm)); }
};

struct Row {
  std::uint32_t body1, body2;
  std::size_t place;  // among the multipliers
  ConstraintDirection direction;
  double gamma;
  double scale;  // root of the diagonal
};

bool holds_always(const Discrepancy& d, int axis) {
  if (d.maximum_force[axis] < kUnlimited) return false;
  switch (axis_mode(d.modes, axis)) {
    case AxisMode::kLocked:
      return d.compliance[axis] == 0.0;
    case AxisMode::kLimited:
      return d.compliance[axis] == 0.0 && d.lower[axis] == d.upper[axis];
    case AxisMode::kDriven:
      return d.damping[axis] == 0.0;
    default:
      return false;
  }
}

class ReactionSolver {
 public:
  explicit ReactionSolver(const stage::SolverReactionsRequest& request) : request_(request) {
    load_bodies();
    load_rows();
    factorise();
  }

  // Multipliers by row. Returns what the rows are missed by.
  double solve() {
    std::vector<double> side(rows_.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Row& row = rows_[i];
      const double along = row.direction.along(bodies_[row.body1].acceleration, bodies_[row.body2].acceleration);
      side[i] = -(row.gamma + along) / row.scale;
    }
    const double missed = factor_.dropped() > 0 ? factor_.make_consistent(&side) : 0.0;
    factor_.solve(&side);
    multipliers_ = std::move(side);
    for (std::size_t i = 0; i < rows_.size(); ++i) multipliers_[i] /= rows_[i].scale;
    return missed;
  }

  void write(double residual, const stage::SolverReactionsReply& reply) const {
    const std::size_t count = bodies_.size() - 1;
    std::vector<Wrench> reactions(count + 1);
    std::vector<double> forces(3 * request_.mode().size(), 0.0);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Row& row = rows_[i];
      const ConstraintDirection& d = row.direction;
      const double force = multipliers_[i];
      if (!std::isfinite(force)) throw Refusal("a reaction is not finite: masses, velocities or forces overflow");
      forces[row.place] = force;
      reactions[row.body1].force -= force * d.linear;
      reactions[row.body1].torque += force * d.angular1;
      reactions[row.body2].force += force * d.linear;
      reactions[row.body2].torque += force * d.angular2;
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Wrench reaction = bodies_[i].is_pushed() ? reactions[i] : Wrench{};
      reply.reaction().push(reaction.force.x(), reaction.force.y(), reaction.force.z(), reaction.torque.x(),
                            reaction.torque.y(), reaction.torque.z());
    }
    for (const double force : forces) reply.discrepancy_force().push(force);
    reply.residual().set(residual);
  }

 private:
  void load_bodies() {
    const std::size_t count = request_.flags().size();
    bodies_.resize(count + 1);
    for (std::size_t i = 0; i < count; ++i) {
      Body& body = bodies_[i];
      const Quaternion q = quaternion_at(request_.orientation(), i);
      body.position = vector_at(request_.position(), i);
      body.velocity = {vector_at(request_.linear_velocity(), i), vector_at(request_.angular_velocity(), i)};
      body.acceleration = {vector_at(request_.acceleration(), 2 * i), vector_at(request_.acceleration(), 2 * i + 1)};
      const std::uint32_t flags = request_.flags()[i];
      if ((flags & kMovable) == 0 || (flags & kKinematic) != 0) continue;
      const Vector3 inverse_moments = vector_at(request_.inverse_inertia(), i);
      body.inverse_mass = request_.inverse_mass()[i];
      body.inverse_inertia = world_inverse_inertia(q, inverse_moments);
      const double drag = request_.drag()[i];
      const Vector3 force = vector_at(request_.wrench(), 2 * i), torque = vector_at(request_.wrench(), 2 * i + 1);
      body.acceleration.linear = body.inverse_mass * force - drag * body.velocity.linear;
      body.acceleration.angular =
          angular_acceleration(q, body.velocity.angular, vector_at(request_.inertia(), i), inverse_moments, torque) -
          drag * body.velocity.angular;
    }
  }

  std::uint32_t row_of(std::uint32_t body) const {
    return body == kNone ? static_cast<std::uint32_t>(bodies_.size() - 1) : body;
  }

  void load_rows() {
    const DiscrepancyColumns columns{request_.point1(),     request_.point2(),       request_.velocity(),
                                     request_.correction(), request_.axes(),         request_.mode(),
                                     request_.lower(),      request_.upper(),        request_.compliance(),
                                     request_.damping(),    request_.maximum_force()};
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const Discrepancy d = columns.at(i);
      const std::uint32_t one = row_of(request_.discrepancy_body()[2 * i]);
      const std::uint32_t two = row_of(request_.discrepancy_body()[2 * i + 1]);
      if (!bodies_[one].is_pushed() && !bodies_[two].is_pushed()) continue;
      const Matrix3 axes = to_rotation_matrix(d.axes);
      for (int axis = 0; axis < 3; ++axis) {
        if (!holds_always(d, axis)) continue;
        Row row = d.is_radial() && axis == 0 ? radial_row(d, one, two) : axis_row(d, axes.col(axis), one, two);
        row.place = 3 * i + static_cast<std::size_t>(axis);
        row.direction = with_turns(row.direction, bodies_[one].inverse_inertia, bodies_[two].inverse_inertia);
        row.scale =
            std::sqrt(row.direction.product(row.direction, bodies_[one].inverse_mass + bodies_[two].inverse_mass));
        if (row.scale > 0.0) rows_.push_back(row);
      }
    }
  }

  Row axis_row(const Discrepancy& d, const Vector3& axis, std::uint32_t one, std::uint32_t two) const {
    const Body &first = bodies_[one], &second = bodies_[two];
    const Vector3 &w1 = first.velocity.angular, &w2 = second.velocity.angular;
    if (d.is_angular()) return {one, two, 0, turning_about(axis), w1.cross(axis).dot(w2 - w1), 0.0};
    // a drive acts where it is in body 1
    const Vector3 at = holds_pose(d) ? d.point2 : d.point1;
    const Vector3 arm1 = at - first.position, arm2 = at - second.position;
    const Vector3 relative = second.velocity_at(arm2) - first.velocity_at(arm1);
    const Vector3 bend = second.centripetal(arm2) - first.centripetal(arm1) - 2.0 * w1.cross(relative);
    return {one, two, 0, direction_at(axis, arm1, arm2), axis.dot(bend), 0.0};
  }

  // Of a rod without length there is no direction: the first axis stands in.
  Row radial_row(const Discrepancy& d, std::uint32_t one, std::uint32_t two) const {
    const Body &first = bodies_[one], &second = bodies_[two];
    const Vector3 error = d.point2 - d.point1;
    const double length = error.norm();
    if (!(length > 0.0)) return axis_row(d, to_rotation_matrix(d.axes).col(0), one, two);
    const Vector3 direction = error / length;
    const Vector3 arm1 = d.point1 - first.position, arm2 = d.point2 - second.position;
    const Vector3 rate = second.velocity_at(arm2) - first.velocity_at(arm1);
    const Vector3 across = rate - direction.dot(rate) * direction;
    const double gamma =
        direction.dot(second.centripetal(arm2) - first.centripetal(arm1)) + across.squaredNorm() / length;
    return {one, two, 0, direction_at(direction, arm1, arm2), gamma, 0.0};
  }

  // Of rows that share a body that can be pushed.
  double coupling(const Row& a, const Row& b) const {
    double sum = 0.0;
    const auto add = [&](std::uint32_t body, double sign_a, const Vector3& turn_a, std::uint32_t other, double sign_b,
                         const Vector3& angular_b) {
      if (body != other || !bodies_[body].is_pushed()) return;
      sum += sign_a * sign_b * bodies_[body].inverse_mass * a.direction.linear.dot(b.direction.linear) +
             turn_a.dot(angular_b);
    };
    const ConstraintDirection &da = a.direction, &db = b.direction;
    add(a.body1, -1.0, da.turn1, b.body1, -1.0, db.angular1);
    add(a.body1, -1.0, da.turn1, b.body2, 1.0, db.angular2);
    add(a.body2, 1.0, da.turn2, b.body1, -1.0, db.angular1);
    add(a.body2, 1.0, da.turn2, b.body2, 1.0, db.angular2);
    return sum;
  }

  void factorise() {
    constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
    std::vector<std::size_t> first_of_body(bodies_.size(), kNowhere), first(rows_.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      first[i] = i;
      for (const std::uint32_t body : {rows_[i].body1, rows_[i].body2}) {
        if (!bodies_[body].is_pushed()) continue;
        first_of_body[body] = std::min(first_of_body[body], i);
        first[i] = std::min(first[i], first_of_body[body]);
      }
    }
    factor_.start(first);
    for (std::size_t i = 0; i < rows_.size(); ++i)
      for (std::size_t j = first[i]; j <= i; ++j)
        factor_.entry(i, j) = coupling(rows_[i], rows_[j]) / (rows_[i].scale * rows_[j].scale);
    factor_.factorise();
  }

  const stage::SolverReactionsRequest& request_;
  std::vector<Body> bodies_;  // the world last
  std::vector<Row> rows_;
  ProfileLdlt factor_;
  std::vector<double> multipliers_;
};

}  // namespace

void solve_reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply) {
  check_reactions_request(request);
  ReactionSolver solver(request);
  const double residual = solver.solve();
  solver.write(residual, reply);
}

}  // namespace gravitas
