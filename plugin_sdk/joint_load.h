// What a step leaves of a joint: how far it is open where the step ended, and what held it together.
#pragma once

#include <cstddef>
#include <span>

#include "plugin_sdk/discrepancy.h"

namespace gravitas {

// The default is the world: nothing moves or pushes it.
struct JointBody {
  Pose trial, next;  // centre of mass at S* and S_{n+1}, world
  double inverse_mass = 0.0;
  Vector3 inverse_moments = Vector3::Zero();  // principal, 1/(kg m^2)
  Pose start;                                 // at S_n
};

// Rows [first, end) of one joint, with the impulses (N s, along each row's axes) that the solver answered, and the forces (N)
// that acted beside them where the joint is in the derivative.
struct JointRows {
  const DiscrepancyColumns& rows;
  std::span<const double> impulses;
  std::size_t first, end;
  std::span<const double> forces = {};
};

// How far the joint is open at S_{n+1}, m, or rad for angular rows: joint_error() of the worst.
double joint_error(const JointRows& joint, const JointBody& body1, const JointBody& body2);

struct JointLoad {
  double force = 0.0;   // norm of the sum of what pushed, N
  double torque = 0.0;  // norm of the sum of what turned, about the joint's first point at S_{n+1}, N m
};

JointLoad joint_load(const JointRows& joint, const JointBody& body1, double time_step);

// How far a discrepancy would have come open in the step without the impulse (N s, world) that held it, m:
// |impulse| h / m_eff, with m_eff the mass that the bodies at S* show along it; rad for the angular twin, with moments.
double held_back(const Discrepancy& discrepancy, const Vector3& impulse, const JointBody& body1, const JointBody& body2,
                 double time_step);

// What a breaking threshold is compared with, m: the most that a row of the joint is open at S_{n+1}, or was held back. Turns
// count by the larger radius of gyration of the two bodies.
double opening(const JointRows& joint, const JointBody& body1, const JointBody& body2, double time_step);

// Where joints contradict each other no force holds them, and none is told: is this joint one of those that a step has opened,
// by a share of the ways of its bodies?
bool is_pulled_apart(const JointRows& joint, const JointBody& body1, const JointBody& body2);

}  // namespace gravitas
