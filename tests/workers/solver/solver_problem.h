// A solver's request that a test writes body by body, and its answer.
//
//   SolverProblem problem;
//   const auto ground = problem.add_immovable();
//   const auto ball = problem.add_body({.inverse_mass = 1.0, ...});
//   problem.make_trial({0, -9.81, 0});           // S* by SemiImplicitEuler, theta 1
//   problem.add_contact({.body1 = ground, .body2 = ball, ...});
//   const SolverAnswer answer = problem.solve(solver);
//
// Columns are named as in solver.proto and may be bent by hand before solve().
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver.h"
#include "schemas/stage_frames.h"

namespace gravitas {

struct SolverAnswer {
  std::vector<double> linear_velocity, angular_velocity, pose_change, discrepancy_impulse, discrepancy_correction,
      contact_impulse, contact_correction, contact_direction, contact_turning;
  std::vector<std::uint32_t> iterations, stop_reason;
  std::vector<double> residual;

  Vector3 velocity(std::size_t body) const { return vector_at(linear_velocity, body); }
  Vector3 turning(std::size_t body) const { return vector_at(angular_velocity, body); }
  Vector3 translation(std::size_t body) const { return vector_at(pose_change, 2 * body); }
  Vector3 rotation(std::size_t body) const { return vector_at(pose_change, 2 * body + 1); }
  Vector3 impulse(std::size_t contact) const { return vector_at(contact_impulse, contact); }
  Vector3 torque_impulse(std::size_t contact) const { return vector_at(contact_turning, contact); }
  Vector3 direction(std::size_t contact) const { return vector_at(contact_direction, contact); }
  bool converged() const { return stop_reason[0] == static_cast<std::uint32_t>(StopReason::kConverged); }
  // All bytes of the answer.
  std::string bytes() const {
    std::string all;
    for (const auto* column :
         {&linear_velocity, &angular_velocity, &pose_change, &discrepancy_impulse, &discrepancy_correction,
          &contact_impulse, &contact_correction, &contact_direction, &contact_turning, &residual})
      all.append(reinterpret_cast<const char*>(column->data()), column->size() * sizeof(double));
    for (const auto* column : {&iterations, &stop_reason})
      all.append(reinterpret_cast<const char*>(column->data()), column->size() * sizeof(std::uint32_t));
    return all;
  }
};

struct TestBody {
  double mass = 1.0;                         // 0: immovable
  Vector3 moments = Vector3::Constant(0.4);  // principal, kg m^2
  Pose pose = {};                            // S_n
  Vector3 linear = Vector3::Zero();          // m/s
  Vector3 angular = Vector3::Zero();         // rad/s, world
  bool kinematic = false;
};

struct TestContact {
  std::uint32_t body1 = 0, body2 = 0;
  Vector3 normal = Vector3::UnitY();
  Vector3 point = Vector3::Zero();
  double depth = 0.0;
  double restitution = 0.0, static_friction = 0.0, dynamic_friction = 0.0, rolling = 0.0, spinning = 0.0,
         perturbation = 0.0;
  std::uint64_t key = 1;
};

class SolverProblem {
 public:
  double time_step = 0.01;
  double theta = 1.0;
  std::vector<std::uint32_t> flags, discrepancy_body, mode, contact_body;
  std::vector<std::uint64_t> contact_key;
  std::vector<double> inverse_mass, inverse_inertia, position, orientation, linear_velocity, angular_velocity,
      trial_position, trial_orientation, trial_linear_velocity, trial_angular_velocity, wrench, point1, point2,
      velocity, correction, axes, lower, upper, compliance, damping, maximum_force, discrepancy_warm_impulse,
      discrepancy_warm_correction, contact_normal, contact_point, contact_depth, contact_material, contact_warm_impulse,
      contact_warm_correction, discrepancy_applied_force, restitution;
  std::vector<TestBody> bodies;

  // S* starts as S_n.
  std::uint32_t add_body(const TestBody& body) {
    const bool pushed = body.mass > 0.0 && !body.kinematic;
    flags.push_back(body.kinematic ? kKinematic : pushed ? kMovable : 0U);
    inverse_mass.push_back(pushed ? 1.0 / body.mass : 0.0);
    append(inverse_inertia, pushed ? Vector3(body.moments.cwiseInverse()) : Vector3::Zero());
    append(position, body.pose.position);
    append(orientation, body.pose.orientation);
    append(linear_velocity, body.linear);
    append(angular_velocity, body.angular);
    append(trial_position, body.pose.position);
    append(trial_orientation, body.pose.orientation);
    append(trial_linear_velocity, body.linear);
    append(trial_angular_velocity, body.angular);
    wrench.insert(wrench.end(), 6, 0.0);
    bodies.push_back(body);
    return static_cast<std::uint32_t>(flags.size() - 1);
  }
  std::uint32_t add_immovable() { return add_body({.mass = 0.0}); }

  // S* of all bodies: velocities from `gravity` for those that are pushed, poses with the new
  // velocities.
  void make_trial(const Vector3& gravity) {
    for (std::uint32_t i = 0; i < flags.size(); ++i) {
      const Vector3 gained = inverse_mass[i] > 0.0 ? Vector3(time_step * gravity) : Vector3::Zero();
      set_trial_velocity(i, bodies[i].linear + gained, bodies[i].angular);
      move_trial(i);
    }
  }
  void set_trial_velocity(std::uint32_t body, const Vector3& linear, const Vector3& angular) {
    set_vector(trial_linear_velocity, body, linear);
    set_vector(trial_angular_velocity, body, angular);
  }
  // The trial pose by the trial velocity.
  void move_trial(std::uint32_t body) {
    set_trial_pose(body, displaced(bodies[body].pose, time_step * trial_twist(body).linear,
                                   time_step * trial_twist(body).angular));
  }
  void set_trial_pose(std::uint32_t body, const Pose& pose) {
    set_vector(trial_position, body, pose.position);
    set_quaternion(trial_orientation, body, pose.orientation);
  }
  Pose trial_pose(std::uint32_t body) const {
    return {vector_at(trial_position, body), quaternion_at(trial_orientation, body)};
  }
  Twist trial_twist(std::uint32_t body) const {
    return {vector_at(trial_linear_velocity, body), vector_at(trial_angular_velocity, body)};
  }

  std::uint32_t add_contact(const TestContact& c) {
    contact_body.insert(contact_body.end(), {c.body1, c.body2});
    append(contact_normal, c.normal);
    append(contact_point, c.point);
    contact_depth.push_back(c.depth);
    contact_key.push_back(c.key);
    contact_material.insert(contact_material.end(), {c.restitution, c.static_friction, c.dynamic_friction, c.rolling,
                                                     c.spinning, c.perturbation});
    contact_warm_impulse.insert(contact_warm_impulse.end(), 3, 0.0);
    contact_warm_correction.push_back(0.0);
    return static_cast<std::uint32_t>(contact_key.size() - 1);
  }

  std::uint32_t add_discrepancy(std::uint32_t body1, std::uint32_t body2, const Discrepancy& d) {
    discrepancy_body.insert(discrepancy_body.end(), {body1, body2});
    append(point1, d.point1);
    append(point2, d.point2);
    append(velocity, d.velocity);
    correction.push_back(d.correction);
    append(axes, d.axes);
    mode.push_back(d.modes);
    append(lower, d.lower);
    append(upper, d.upper);
    append(compliance, d.compliance);
    append(damping, d.damping);
    append(maximum_force, d.maximum_force);
    append(discrepancy_warm_impulse, Vector3::Zero());
    append(discrepancy_warm_correction, Vector3::Zero());
    append(discrepancy_applied_force, Vector3::Zero());
    restitution.push_back(d.restitution);
    return static_cast<std::uint32_t>(mode.size() - 1);
  }

  // Points of two bodies that coincided at the world point `anchor` at S_n, as they are at S*.
  Discrepancy joint_at(std::uint32_t body1, std::uint32_t body2, const Vector3& anchor) const {
    Discrepancy d;
    d.point1 = at_trial(body1, anchor);
    d.point2 = at_trial(body2, anchor);
    return d;
  }
  Vector3 at_trial(std::uint32_t body, const Vector3& point) const {
    return body == kNone ? point : carried(point, bodies[body].pose, trial_pose(body));
  }
  // The pose that the answer commits.
  Pose committed(const SolverAnswer& answer, std::uint32_t body) const {
    return displaced(trial_pose(body), answer.translation(body), answer.rotation(body));
  }

  // Sums over the bodies that are pushed.
  Vector3 momentum(std::span<const double> linear) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < flags.size(); ++i)
      if (inverse_mass[i] > 0.0) sum += bodies[i].mass * vector_at(linear, i);
    return sum;
  }
  // About the origin, at S*.
  Vector3 turning_momentum(std::span<const double> linear, std::span<const double> angular) const {
    Vector3 sum = Vector3::Zero();
    for (std::uint32_t i = 0; i < flags.size(); ++i)
      if (inverse_mass[i] > 0.0)
        sum += angular_momentum(bodies[i].mass, bodies[i].moments, trial_pose(i),
                                {vector_at(linear, i), vector_at(angular, i)});
    return sum;
  }
  double energy(std::span<const double> linear, std::span<const double> angular) const {
    double sum = 0.0;
    for (std::uint32_t i = 0; i < flags.size(); ++i)
      if (inverse_mass[i] > 0.0)
        sum += kinetic_energy(bodies[i].mass, bodies[i].moments, trial_pose(i).orientation,
                              {vector_at(linear, i), vector_at(angular, i)});
    return sum;
  }

  // `Solver` has solve(request, reply).
  template <typename Solver>
  SolverAnswer solve(Solver&& solver) const {
    using Request = stage::SolverSolveRequest;
    using Reply = stage::SolverSolveReply;
    gravitas_column columns[Request::kColumnCount] = {column(time_step),
                                                      column(theta),
                                                      column(flags),
                                                      column(inverse_mass),
                                                      column(inverse_inertia),
                                                      column(position),
                                                      column(orientation),
                                                      column(linear_velocity),
                                                      column(angular_velocity),
                                                      column(trial_position),
                                                      column(trial_orientation),
                                                      column(trial_linear_velocity),
                                                      column(trial_angular_velocity),
                                                      column(wrench),
                                                      column(discrepancy_body),
                                                      column(point1),
                                                      column(point2),
                                                      column(velocity),
                                                      column(correction),
                                                      column(axes),
                                                      column(mode),
                                                      column(lower),
                                                      column(upper),
                                                      column(compliance),
                                                      column(damping),
                                                      column(maximum_force),
                                                      column(discrepancy_warm_impulse),
                                                      column(discrepancy_warm_correction),
                                                      column(contact_body),
                                                      column(contact_normal),
                                                      column(contact_point),
                                                      column(contact_depth),
                                                      column(contact_key),
                                                      column(contact_material),
                                                      column(contact_warm_impulse),
                                                      column(contact_warm_correction),
                                                      column(discrepancy_applied_force),
                                                      column(restitution)};
    SolverAnswer a;
    a.linear_velocity.resize(3 * flags.size());
    a.angular_velocity.resize(3 * flags.size());
    a.pose_change.resize(6 * flags.size());
    a.discrepancy_impulse.resize(3 * mode.size());
    a.discrepancy_correction.resize(3 * mode.size());
    a.contact_impulse.resize(3 * contact_key.size());
    a.contact_correction.resize(contact_key.size());
    a.contact_direction.resize(3 * contact_key.size());
    a.contact_turning.resize(3 * contact_key.size());
    a.iterations.resize(1);
    a.residual.resize(1);
    a.stop_reason.resize(1);
    gravitas_reply_column reply[Reply::kColumnCount] = {room(a.linear_velocity),
                                                        room(a.angular_velocity),
                                                        room(a.pose_change),
                                                        room(a.discrepancy_impulse),
                                                        room(a.discrepancy_correction),
                                                        room(a.contact_impulse),
                                                        room(a.contact_correction),
                                                        room(a.contact_direction),
                                                        room(a.iterations),
                                                        room(a.residual),
                                                        room(a.stop_reason),
                                                        room(a.contact_turning)};
    solver.solve(Request(columns), Reply(reply));
    return a;
  }

 private:
  static void append(std::vector<double>& to, const Vector3& v) { to.insert(to.end(), {v.x(), v.y(), v.z()}); }
  static void append(std::vector<double>& to, const Quaternion& q) {
    to.insert(to.end(), {q.w(), q.x(), q.y(), q.z()});
  }
  static gravitas_column column(const double& value) { return {&value, 1}; }
  template <typename T>
  static gravitas_column column(const std::vector<T>& values) {
    return {values.data(), values.size()};
  }
  template <typename T>
  static gravitas_reply_column room(std::vector<T>& values) {
    return {values.data(), values.size(), 0};
  }
};

// Discrepancy whose axes are given as columns.
inline Quaternion axes_along(const Vector3& first) {
  const auto [second, third] = orthonormal_basis(first);
  Matrix3 axes;
  axes << first, second, third;
  return to_quaternion(axes);
}

}  // namespace gravitas
