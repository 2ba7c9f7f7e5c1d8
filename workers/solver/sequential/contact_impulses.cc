// Rows and sweeps of the velocities at contacts, one contact at a time; whole patches are in
// contact_impulses_patch.cc.
#include "workers/solver/sequential/contact_impulses.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/solver/coulomb_contact.h"

namespace gravitas {
namespace {

constexpr double kNothing = 1e-140;  // N s: its squares are still exact to rounding

}  // namespace

// ---- rows

void ContactImpulses::build(const SolverBodies& bodies, const stage::SolverSolveRequest& request,
                            const std::vector<std::uint8_t>& closed, const std::vector<double>& warm) {
  rows_.clear();
  rolling_.clear();
  for (std::size_t i = 0; i < closed.size(); ++i) {
    if (closed[i] == 0) continue;
    Row& row = rows_.emplace_back();
    row.contact = static_cast<std::uint32_t>(i);
    row.body1 = request.contact_body()[2 * i];
    row.body2 = request.contact_body()[2 * i + 1];
    const Vector3 point = vector_at(request.contact_point(), i);
    const Vector3 to_surface = (0.5 * request.contact_depth()[i]) * vector_at(request.contact_normal(), i);
    row.arm1 = point + to_surface - bodies[row.body1].trial.position;
    row.arm2 = point - to_surface - bodies[row.body2].trial.position;
    const ContactLaw law = contact_law(request, i, bodies[row.body1], bodies[row.body2]);
    row.frame = law.frame;
    row.target = law.target;
    row.dynamic_friction = law.dynamic_friction;
    row.static_friction = law.static_friction;
    row.has_friction = row.static_friction > 0.0;
    set_response(row, bodies);
    set_rolling(row, bodies, law.rolling_friction, law.spinning_friction);

    row.impulse = row.frame.transpose() * vector_at(warm, i);
    row.impulse.x() = std::max(0.0, row.impulse.x());
    const double tangent = row.impulse.tail<2>().norm();
    const double allowed = row.static_friction * row.impulse.x();
    if (tangent > allowed) row.impulse.tail<2>() *= allowed / tangent;
  }
  set_patches(bodies);
}

void ContactImpulses::set_response(Row& row, const SolverBodies& bodies) {
  const Matrix3 world =
      point_response(bodies[row.body1], row.arm1, row.arm1) + point_response(bodies[row.body2], row.arm2, row.arm2);
  const Matrix3 response = row.frame.transpose() * world * row.frame;
  row.response = 0.5 * (response + response.transpose());
  row.disc = FrictionDisc::of(row.response.bottomRightCorner<2, 2>());
  const double determinant = row.response.determinant();
  const double size = row.response.trace();
  row.has_inverse = row.has_friction && determinant > 1e-12 * size * size * size;
  if (row.has_inverse) row.inverse = row.response.inverse();
}

void ContactImpulses::set_rolling(Row& row, const SolverBodies& bodies, double rolling_friction,
                                  double spinning_friction) {
  if (!(rolling_friction > 0.0) && !(spinning_friction > 0.0)) return;
  Rolling rolling;
  set_response(row, bodies, &rolling);
  rolling.rolling_friction = rolling_friction;
  rolling.spinning_friction = spinning_friction;
  rolling.length = std::max(bodies[row.body1].gyration(), bodies[row.body2].gyration());
  row.rolling = static_cast<std::int32_t>(rolling_.size());
  rolling_.push_back(rolling);
}

void ContactImpulses::set_response(const Row& row, const SolverBodies& bodies, Rolling* rolling) {
  const Matrix3 world = bodies[row.body1].inverse_inertia + bodies[row.body2].inverse_inertia;
  const Matrix3 response = row.frame.transpose() * world * row.frame;
  rolling->normal_response = response(0, 0);
  rolling->disc = FrictionDisc::of(response.bottomRightCorner<2, 2>());
}

// ---- velocities and impulses

// Relative velocity of the contact's points, in its frame.
Vector3 ContactImpulses::velocity_of(const Row& row, const BodyMotion& x) const {
  const Twist& one = x[row.body1];
  const Twist& two = x[row.body2];
  return row.frame.transpose() * (two.linear + two.angular.cross(row.arm2) - one.linear - one.angular.cross(row.arm1));
}

Vector3 ContactImpulses::turning_of(const Row& row, const BodyMotion& x) const {
  return row.frame.transpose() * (x[row.body2].angular - x[row.body1].angular);
}

void ContactImpulses::push(const Row& row, const Vector3& impulse, const SolverBodies& bodies, BodyMotion& x) const {
  const Vector3 world = row.frame * impulse;
  const SolverBody& one = bodies[row.body1];
  const SolverBody& two = bodies[row.body2];
  x[row.body1].linear -= one.inverse_mass * world;
  x[row.body1].angular -= one.inverse_inertia * row.arm1.cross(world);
  x[row.body2].linear += two.inverse_mass * world;
  x[row.body2].angular += two.inverse_inertia * row.arm2.cross(world);
}

void ContactImpulses::push_turning(const Row& row, const Vector3& impulse, const SolverBodies& bodies,
                                   BodyMotion& x) const {
  const Vector3 world = row.frame * impulse;
  x[row.body1].angular -= bodies[row.body1].inverse_inertia * world;
  x[row.body2].angular += bodies[row.body2].inverse_inertia * world;
}

void ContactImpulses::push_all(const SolverBodies& bodies, BodyMotion& x) const {
  for (const Row& row : rows_) push_row(row, bodies, x);
}

void ContactImpulses::push_row(const Row& row, const SolverBodies& bodies, BodyMotion& x) const {
  if (!row.impulse.isZero(0.0)) push(row, row.impulse, bodies, x);
  if (row.rolling < 0) return;
  const Rolling& rolling = rolling_[static_cast<std::size_t>(row.rolling)];
  if (!rolling.impulse.isZero(0.0)) push_turning(row, rolling.impulse, bodies, x);
}

void ContactImpulses::push_friction(const SolverBodies& bodies, double factor, const std::vector<double>& shares,
                                    BodyMotion& x) const {
  for (const Row& row : rows_) {
    const double part = factor * shares[row.contact];
    const Vector3 tangent(0.0, part * row.impulse.y(), part * row.impulse.z());
    if (!tangent.isZero(0.0)) push(row, tangent, bodies, x);
    if (row.rolling < 0) continue;
    const Rolling& rolling = rolling_[static_cast<std::size_t>(row.rolling)];
    if (!rolling.impulse.isZero(0.0)) push_turning(row, part * rolling.impulse, bodies, x);
  }
}

bool ContactImpulses::has_friction_impulse() const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [](const Row& row) { return row.impulse.y() != 0.0 || row.impulse.z() != 0.0; }) ||
         std::any_of(rolling_.begin(), rolling_.end(),
                     [](const Rolling& rolling) { return !rolling.impulse.isZero(0.0); });
}

double ContactImpulses::largest_violation(const BodyMotion& x) const {
  double largest = 0.0;
  for (const Row& row : rows_) largest = std::max(largest, row.target - velocity_of(row, x).x());
  return largest;
}

double ContactImpulses::largest_motion(const BodyMotion& x) const {
  double largest = 0.0;
  for (const Row& row : rows_) {
    const Twist& one = x[row.body1];
    const Twist& two = x[row.body2];
    largest = std::max(largest, one.linear.norm() + one.angular.norm() * row.arm1.norm() + two.linear.norm() +
                                    two.angular.norm() * row.arm2.norm());
  }
  return largest;
}

void ContactImpulses::clear_multipliers() {
  for (Row& row : rows_) row.impulse.setZero();
  for (Rolling& rolling : rolling_) rolling.impulse.setZero();
}

// ---- relaxation

double ContactImpulses::relax(std::size_t block, double share, const SolverBodies& bodies, BodyMotion& x) {
  const Patch& patch = patches_[block];
  double change = 0.0;
  const bool solved = relax_whole(patch, share, bodies, x, &change);
  for (std::size_t i = patch.first; i < patch.end; ++i) {
    if (!solved) change = std::max(change, relax_row(rows_[i], share, bodies, x));
    if (rows_[i].rolling >= 0) change = std::max(change, relax_rolling(rows_[i], share, bodies, x));
  }
  return change;
}

void ContactImpulses::append_multipliers(std::vector<double>* to) const {
  double* next = append(3 * (rows_.size() + rolling_.size()), to);
  for (const Row& row : rows_) Vector3::Map(next) = row.impulse, next += 3;
  for (const Rolling& rolling : rolling_) Vector3::Map(next) = rolling.impulse, next += 3;
}

void ContactImpulses::append_responses(std::vector<double>* to) const {
  double* next = append(3 * (rows_.size() + rolling_.size()), to);
  for (const Row& row : rows_) Vector3::Map(next).setConstant(row.response.trace() / 3.0), next += 3;
  for (const Rolling& rolling : rolling_) Vector3::Map(next).setConstant(rolling.disc.largest), next += 3;
}

const double* ContactImpulses::take_multipliers(const double* from) {
  for (Row& row : rows_) row.impulse = Vector3::Map(from), from += 3;
  for (Rolling& rolling : rolling_) rolling.impulse = Vector3::Map(from), from += 3;
  return from;
}

double ContactImpulses::error_of(std::size_t block, const BodyMotion& x) const {
  double error = 0.0;
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i) {
    const Row& row = rows_[i];
    const Vector3 velocity = velocity_of(row, x);
    const double missing = row.target - velocity.x();
    if (!(row.impulse.x() > 0.0)) {
      error = std::max(error, missing);
      continue;
    }
    error = std::max(error, std::fabs(missing));
    if (!row.has_friction) continue;
    Eigen::Vector2d slip = velocity.tail<2>();
    const Eigen::Vector2d friction = row.impulse.tail<2>();
    const double allowed = (row.slides ? row.dynamic_friction : row.static_friction) * row.impulse.x();
    if (!(allowed > 0.0)) continue;  // nothing opposes its slip
    // at the cone's rim it may slip against the friction
    if (friction.norm() >= allowed * (1.0 - 1e-9)) {
      const Eigen::Vector2d along = friction.normalized();
      slip -= std::min(0.0, slip.dot(along)) * along;
    }
    error = std::max(error, slip.norm());
  }
  return error;
}

double ContactImpulses::relax_row(Row& row, double share, const SolverBodies& bodies, BodyMotion& x) {
  const Vector3 velocity = velocity_of(row, x);
  // open and leaving: the commonest case costs no more than this
  if (velocity.x() >= row.target && row.impulse.isZero(0.0)) return 0.0;
  Vector3 impulse = relaxed(row, velocity);
  const Vector3 whole = impulse - row.impulse;
  if (whole.isZero(0.0)) return 0.0;
  if (share != 1.0) {
    impulse = row.impulse + share * whole;
    impulse.x() = std::max(0.0, impulse.x());
    const double allowed = (row.slides ? row.dynamic_friction : row.static_friction) * impulse.x();
    const double tangent = impulse.tail<2>().norm();
    if (tangent > allowed) impulse.tail<2>() *= allowed / tangent;
    // of an impulse that goes a share is left, and of that a share: numbers at whose squares no cone holds
    if (impulse.x() < kNothing) impulse.setZero();
  }
  const Vector3 amount = impulse - row.impulse;
  row.impulse = impulse;
  push(row, amount, bodies, x);
  return (row.response * whole).cwiseAbs().maxCoeff();
}

// The impulse that makes this contact right, all others as they are.
Vector3 ContactImpulses::relaxed(const Row& row, const Vector3& velocity) const {
  Vector3 impulse = row.impulse;
  const double mu = row.slides ? row.dynamic_friction : row.static_friction;
  if (row.has_inverse) {
    const Vector3 free_velocity = velocity - row.response * row.impulse;
    if (solve_coulomb_contact(row.response, row.inverse, free_velocity, row.target, mu, &impulse)) return impulse;
  }
  // without friction, or with bodies that cannot move every way: normal row, then friction
  const double missing = row.target - velocity.x();
  impulse.x() = std::max(0.0, impulse.x() + missing / row.response(0, 0));
  if (!row.has_friction) return impulse;
  const Vector3 now = velocity + row.response.col(0) * (impulse.x() - row.impulse.x());
  impulse.tail<2>() = row.disc.updated(impulse.tail<2>(), now.tail<2>(), mu * impulse.x());
  return impulse;
}

double ContactImpulses::relax_rolling(const Row& row, double share, const SolverBodies& bodies, BodyMotion& x) {
  Rolling& rolling = rolling_[static_cast<std::size_t>(row.rolling)];
  const Vector3 turning = turning_of(row, x);
  Vector3 impulse = rolling.impulse;
  if (rolling.normal_response > 0.0) {
    const double bound = rolling.spinning_friction * row.impulse.x();
    impulse.x() = std::clamp(impulse.x() - turning.x() / rolling.normal_response, -bound, bound);
  }
  impulse.tail<2>() =
      rolling.disc.updated(impulse.tail<2>(), turning.tail<2>(), rolling.rolling_friction * row.impulse.x());
  const Vector3 whole = impulse - rolling.impulse;
  if (whole.isZero(0.0)) return 0.0;
  if (share < 1.0) {
    // what the bounds of now leave of the old one
    Vector3 old = rolling.impulse;
    const double spin = rolling.spinning_friction * row.impulse.x();
    const double roll = rolling.rolling_friction * row.impulse.x();
    old.x() = std::clamp(old.x(), -spin, spin);
    if (old.tail<2>().norm() > roll) old.tail<2>() *= roll / old.tail<2>().norm();
    impulse = old + share * (impulse - old);
  }
  const Vector3 amount = impulse - rolling.impulse;
  rolling.impulse = impulse;
  push_turning(row, amount, bodies, x);
  const double response = std::max(rolling.normal_response, rolling.disc.largest);
  return response * whole.norm() * rolling.length;
}

// ---- shock propagation

double ContactImpulses::largest_push() const {
  double largest = 0.0;
  for (const Row& row : rows_) largest = std::max(largest, (row.response * row.impulse).norm());
  return largest;
}

void ContactImpulses::push_block(std::size_t block, const SolverBodies& bodies, BodyMotion& x) const {
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i) push_row(rows_[i], bodies, x);
}

void ContactImpulses::take_block(std::size_t block, const ContactImpulses& from) {
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i) {
    rows_[i].impulse = from.rows_[i].impulse;
    if (rows_[i].rolling < 0) continue;
    const auto place = static_cast<std::size_t>(rows_[i].rolling);
    rolling_[place].impulse = from.rolling_[place].impulse;
  }
}

void ContactImpulses::replace_body(std::size_t block, int side, std::uint32_t offset) {
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i)
    (side == 0 ? rows_[i].body1 : rows_[i].body2) += offset;
}

void ContactImpulses::set_responses(const SolverBodies& bodies) {
  for (Row& row : rows_) {
    set_response(row, bodies);
    if (row.rolling >= 0) set_response(row, bodies, &rolling_[static_cast<std::size_t>(row.rolling)]);
  }
  set_patches(bodies);
}

bool ContactImpulses::let_slide(const BodyMotion& x, double slip) {
  bool any = false;
  for (Row& row : rows_) {
    if (row.slides || !(row.dynamic_friction < row.static_friction)) continue;
    if (row.impulse.x() == 0.0 || velocity_of(row, x).tail<2>().norm() <= slip) continue;
    row.slides = true;
    any = true;
  }
  return any;
}

void ContactImpulses::let_stick() {
  for (Row& row : rows_) row.slides = false;
}

void ContactImpulses::store(SolverSolution* solution) const {
  std::ranges::fill(solution->contact_impulse, 0.0);
  solution->contact_turning.assign(solution->contact_impulse.size(), 0.0);
  for (const Row& row : rows_) {
    set_vector(solution->contact_impulse, row.contact, row.frame * row.impulse);
    set_vector(solution->contact_direction, row.contact, row.frame.col(0));
    if (row.rolling < 0) continue;
    const Rolling& rolling = rolling_[static_cast<std::size_t>(row.rolling)];
    set_vector(solution->contact_turning, row.contact, row.frame * rolling.impulse);
  }
}

// ---- energy

// Work of a contact's impulse and, in `size`, what it is large or small against.
double ContactImpulses::work_of(const Row& row, const BodyMotion& before, const BodyMotion& after, double* size) const {
  const Vector3 start = velocity_of(row, before);
  const Vector3 end = velocity_of(row, after);
  double work = 0.5 * row.impulse.dot(start + end);
  *size = 0.5 * row.impulse.norm() * (start.norm() + end.norm());
  if (row.rolling >= 0) {
    const Vector3& turning = rolling_[static_cast<std::size_t>(row.rolling)].impulse;
    work += 0.5 * turning.dot(turning_of(row, before) + turning_of(row, after));
  }
  return work;
}

void ContactImpulses::add_work(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                               const std::vector<std::uint32_t>& group, std::vector<Gain>& gains) const {
  for (const Row& row : rows_) {
    double size = 0.0;
    const double work = work_of(row, before, after, &size);
    gains[group[owner_of(row, bodies)]].add(work, size);
  }
}

std::uint32_t ContactImpulses::lower_to_arrival(const BodyMotion& before, const BodyMotion& after) {
  std::uint32_t count = 0;
  for (Row& row : rows_) {
    if (!(row.target > 0.0)) continue;
    Gain gain;
    gain.work = work_of(row, before, after, &gain.size);
    if (gravitas::lower_to_arrival(gain, -velocity_of(row, before).x(), &row.target)) ++count;
  }
  return count;
}

void ContactImpulses::mark_sharing(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                                   const std::vector<std::uint32_t>& group, std::vector<bool>* is_some) {
  for (Row& row : rows_) {
    Gain gain;
    gain.work = work_of(row, before, after, &gain.size);
    row.whole_target = row.target;
    row.shares = row.target > 0.0 && gain.is_to_blame();
    if (row.shares) (*is_some)[group[owner_of(row, bodies)]] = true;
  }
}

void ContactImpulses::share_all(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                                const std::vector<bool>& which) {
  for (Row& row : rows_) {
    if (!which[group[owner_of(row, bodies)]]) continue;
    row.whole_target = row.target;
    row.shares = true;
  }
}

std::uint32_t ContactImpulses::share_restitution(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                                                 const std::vector<double>& share) {
  std::uint32_t count = 0;
  for (Row& row : rows_) {
    const double of_group = share[group[owner_of(row, bodies)]];
    if (std::isnan(of_group) || !row.shares || !(row.whole_target > 0.0)) continue;
    row.target = of_group * row.whole_target;
    ++count;
  }
  return count;
}

void ContactImpulses::drop_restitution() {
  for (Row& row : rows_) row.target = 0.0;
}

void ContactImpulses::append_cones(const SolverBodies& bodies, ConeProblem* problem) const {
  for (const Row& row : rows_) {
    ConeContact& cone = problem->contacts.emplace_back();
    cone.first = static_cast<std::uint32_t>(problem->rows.size());
    cone.has_friction = row.has_friction;
    cone.static_friction = row.static_friction, cone.dynamic_friction = row.dynamic_friction;
    const SolverBody &one = bodies[row.body1], &two = bodies[row.body2];
    const Vector3 point1 = one.trial.position + row.arm1, point2 = two.trial.position + row.arm2;
    for (std::uint32_t k = 0; k < cone.count(); ++k) {
      ConeRow& own = problem->rows.emplace_back();
      own.body1 = row.body1, own.body2 = row.body2;
      own.direction = ConstraintDirection::through(point1, point2, row.frame.col(k), one, two);
    }
  }
}

void ContactImpulses::scale(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                            const std::vector<double>& factor) {
  for (Row& row : rows_) {
    const double share = factor[group[owner_of(row, bodies)]];
    row.impulse *= share;
    if (row.rolling >= 0) rolling_[static_cast<std::size_t>(row.rolling)].impulse *= share;
  }
}

bool ContactImpulses::has_restitution() const {
  return std::any_of(rows_.begin(), rows_.end(), [](const Row& row) { return row.target > 0.0; });
}

}  // namespace gravitas
