// The bodies of a solver's request as rows need them: both states, inverse masses at the trial pose, and one more body for
// the world, so that no row has to ask whether a body is there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/pose.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// Distance of 1 to the next number.
inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

struct SolverBody {
  double inverse_mass = 0.0;                  // 1/kg; 0 where nothing pushes the body
  Matrix3 inverse_inertia = Matrix3::Zero();  // world, at the trial pose, 1/(kg m^2)
  Pose start;                                 // S_n
  Pose trial;                                 // S*
  Twist start_velocity;
  Twist trial_velocity;
  Twist way;  // from S_n to S*; of bodies that touch

  bool is_pushed() const { return inverse_mass > 0.0 || !inverse_inertia.isZero(0.0); }
  double gyration() const;  // radius_of_gyration() of dynamics.h, m
};

// Displacement or velocity of every body, by the number of its row; the last is the world's, and
// stays zero.
using BodyMotion = std::vector<Twist>;

class SolverBodies {
 public:
  // Precondition: the request passed check_solver_request(). Bodies that are not movable, or
  // kinematic, get inverse mass and moments 0 whatever the columns say.
  void load(const stage::SolverSolveRequest& request);

  // Some of them, in the order of their rows; the last row must be the world's.
  SolverBodies subset(const std::vector<std::uint32_t>& rows) const;
  // These, and after them (the world included) each again as a body that nothing pushes, in the same order.
  SolverBodies with_immovable_twins() const;

  // Turns the world inertia to where a displacement from the trial pose leaves the bodies.
  void turn(const BodyMotion& displacement);
  void set_inverse_inertia(std::uint32_t row, const Matrix3& inverse) { bodies_[row].inverse_inertia = inverse; }

  // Without the world.
  std::size_t count() const { return bodies_.size() - 1; }
  // The row itself, or that of the world for kNone.
  std::uint32_t row(std::uint32_t body) const { return body == kNone ? static_cast<std::uint32_t>(count()) : body; }
  const SolverBody& operator[](std::uint32_t row) const { return bodies_[row]; }

 private:
  std::vector<SolverBody> bodies_;
};

// One scalar row J = [-linear, angular1, linear, angular2] with M^-1 J^T for the two turns.
struct ConstraintDirection {
  Vector3 linear = Vector3::Zero();
  Vector3 angular1 = Vector3::Zero();
  Vector3 angular2 = Vector3::Zero();
  Vector3 turn1 = Vector3::Zero();  // I1^-1 angular1
  Vector3 turn2 = Vector3::Zero();  // I2^-1 angular2

  // Along a unit axis through a point (world) that both bodies are pushed at.
  static ConstraintDirection through(const Vector3& point, const Vector3& axis, const SolverBody& body1,
                                     const SolverBody& body2);
  // Each body is pushed at a point of its own.
  static ConstraintDirection through(const Vector3& point1, const Vector3& point2, const Vector3& axis,
                                     const SolverBody& body1, const SolverBody& body2);
  // About a unit axis.
  static ConstraintDirection about(const Vector3& axis, const SolverBody& body1, const SolverBody& body2);

  // J x for velocities or displacements of the two bodies.
  double along(const Twist& x1, const Twist& x2) const {
    return linear.dot(x2.linear - x1.linear) + angular1.dot(x1.angular) + angular2.dot(x2.angular);
  }
  // Of the speeds that along() is the difference of.
  double size_along(const Twist& x1, const Twist& x2) const {
    return linear.norm() * (x1.linear.norm() + x2.linear.norm()) + angular1.norm() * x1.angular.norm() +
           angular2.norm() * x2.angular.norm();
  }
  // this M^-1 other^T
  double product(const ConstraintDirection& other, double inverse_masses) const {
    return inverse_masses * linear.dot(other.linear) + angular1.dot(other.turn1) + angular2.dot(other.turn2);
  }
  // x += M^-1 J^T amount
  void push(double amount, double inverse_mass1, double inverse_mass2, Twist& x1, Twist& x2) const {
    x1.linear -= (inverse_mass1 * amount) * linear;
    x1.angular += amount * turn1;
    x2.linear += (inverse_mass2 * amount) * linear;
    x2.angular += amount * turn2;
  }
  // this -= share * other
  void subtract(double share, const ConstraintDirection& other);
};

// J_a M^-1 J_b^T of rows with bodies and directions, by what their bodies share.
template <typename Row, typename Bodies>
double coupling(const Row& a, const Row& b, const Bodies& bodies) {
  const bool one_one = a.body1 == b.body1, one_two = a.body1 == b.body2, two_one = a.body2 == b.body1,
             two_two = a.body2 == b.body2;
  if (!(one_one || one_two || two_one || two_two)) return 0.0;
  const ConstraintDirection &da = a.direction, &db = b.direction;
  const double along = da.linear.dot(db.linear);
  double sum = 0.0;
  if (one_one) sum += bodies[a.body1].inverse_mass * along + da.angular1.dot(db.turn1);
  if (one_two) sum += da.angular1.dot(db.turn2) - bodies[a.body1].inverse_mass * along;
  if (two_one) sum += da.angular2.dot(db.turn1) - bodies[a.body2].inverse_mass * along;
  if (two_two) sum += bodies[a.body2].inverse_mass * along + da.angular2.dot(db.turn2);
  return sum;
}

// Velocity (of a point, world) that an impulse at the arm `from` of a body gives the end of its arm
// `at`, per unit of the impulse: 1/m - [at] I^-1 [from].
Matrix3 point_response(const SolverBody& body, const Vector3& at, const Vector3& from);

// Gap up to which a contact or a limit counts as closed, m: 1e-9 of the longest arm at which it
// holds a body that can be pushed, and eight units of rounding of the coordinates.
double closing_slop(const Vector3& point, const SolverBody& body1, const SolverBody& body2);

// What impulses gained or lost the bodies they act on, J. `size` sums the magnitudes of what cancels in `work`: an elastic
// impact's work is the difference of two large numbers.
struct Gain {
  double work = 0.0;
  double size = 0.0;

  void add(double more_work, double more_size) {
    work += more_work;
    size += more_size;
  }
  // More than rounding.
  bool is_real() const { return work > 1e-13 * size; }
  // Enough of one contact for its restitution to be lowered.
  bool is_to_blame() const { return work > 1e-10 * size; }
};

}  // namespace gravitas
