// Bodies with joints and contacts for questions to a solver, and its answers.
#pragma once

#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/solver.h"

namespace gravitas::conformance {

// Share of the speeds that meet, also for iterative methods: the problems are small and well conditioned.
constexpr double kAccuracy = 1e-6;
constexpr double kGravity = 9.81;
inline const Vector3 kDown(0.0, -kGravity, 0.0);

struct ConstrainedBody {
  double mass = 1.0;  // 0: immovable
  // Principal, kg m^2; zero: not turned by anything.
  Vector3 moments = Vector3::Constant(0.4);
  Pose pose = {};    // S_n
  Twist twist = {};  // S_n
  bool kinematic = false;
};

struct BodyContact {
  std::uint32_t body1 = 0, body2 = 0;
  Vector3 normal = Vector3::UnitY();  // from body 1 to body 2
  Vector3 point = Vector3::Zero();
  double depth = 0.0;
  double restitution = 0.0, friction = 0.0;
  double rolling_friction = 0.0, spinning_friction = 0.0;  // m
  std::uint64_t key = 1;
  Vector3 warm_impulse = Vector3::Zero();
  double warm_correction = 0.0;
};

struct BodyJoint {
  std::uint32_t body1 = kNone, body2 = 0;
  Discrepancy discrepancy;
  Vector3 warm_impulse = Vector3::Zero();
  Vector3 warm_correction = Vector3::Zero();
};

class Solution {
 public:
  explicit Solution(MessageColumns reply) : reply_(std::move(reply)) {}

  Vector3 velocity(std::size_t body) const { return vector_at(reply_.f64("linear_velocity"), body); }
  Vector3 turning(std::size_t body) const { return vector_at(reply_.f64("angular_velocity"), body); }
  Vector3 translation(std::size_t body) const { return vector_at(reply_.f64("pose_change"), 2 * body); }
  Vector3 rotation(std::size_t body) const { return vector_at(reply_.f64("pose_change"), 2 * body + 1); }
  Vector3 contact_impulse(std::size_t contact) const { return vector_at(reply_.f64("contact_impulse"), contact); }
  Vector3 contact_turning(std::size_t contact) const { return vector_at(reply_.f64("contact_turning"), contact); }
  double contact_correction(std::size_t contact) const { return reply_.f64("contact_correction")[contact]; }
  Vector3 contact_direction(std::size_t contact) const { return vector_at(reply_.f64("contact_direction"), contact); }
  // Along the axes of the discrepancy.
  Vector3 joint_impulse(std::size_t joint) const { return vector_at(reply_.f64("discrepancy_impulse"), joint); }
  Vector3 joint_correction(std::size_t joint) const { return vector_at(reply_.f64("discrepancy_correction"), joint); }

 private:
  MessageColumns reply_;
};

class ConstrainedBodies {
 public:
  double time_step = 0.01;
  double theta = 1.0;
  std::vector<ConstrainedBody> bodies;
  std::vector<Pose> trial_pose;    // S*
  std::vector<Twist> trial_twist;  // S*
  std::vector<Wrench> wrench;
  std::vector<BodyContact> contacts;
  std::vector<BodyJoint> joints;

  // S* is S_n until make_trial().
  std::uint32_t add(const ConstrainedBody& body);
  std::uint32_t add_ground() { return add({.mass = 0.0}); }
  // S* of all bodies that can be pushed: velocities from `gravity`, poses with the new velocities, as theta 1 has it.
  void make_trial(const Vector3& gravity);
  bool is_pushed(std::size_t body) const { return bodies[body].mass > 0.0 && !bodies[body].kinematic; }

  // A ball-and-socket joint of two bodies at a world point of S_n.
  void add_ball_joint(std::uint32_t body1, std::uint32_t body2, const Vector3& point);
  // Where a point of a body at S_n is at S*.
  Vector3 at_trial(std::uint32_t body, const Vector3& point) const;

  MessageColumns request() const;
  // Of the second question, at S_n, without drag and accelerations.
  MessageColumns reactions_request() const;
  // The answer, checked for what the kernel demands of every solution: bodies that nothing can push are left alone,
  // contacts push, and all kinds of friction stay in their bounds.
  Solution ask(Inquiry* inquiry) const;

  // The pose that the answer commits.
  Pose committed(const Solution& solution, std::uint32_t body) const;
  // Velocity of body 2 relative to body 1 at a contact.
  Vector3 relative_velocity(const BodyContact& contact, const std::vector<Twist>& twists) const;
  std::vector<Twist> twists(const Solution& solution) const;
  double energy(const std::vector<Twist>& twists) const;

 private:
  void append_start(MessageColumns* request) const;
  void append_trial(MessageColumns* request) const;
  void append_joints(MessageColumns* request) const;
  void append_contacts(MessageColumns* request) const;
};

}  // namespace gravitas::conformance
