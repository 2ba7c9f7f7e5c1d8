// What a step leaves of a joint: how far it is open where the step ended, and what held it together.
#pragma once

#include <cstddef>
#include <span>

#include "plugin_sdk/discrepancy.h"

namespace gravitas {

struct JointBody {
  Pose trial, next;  // centre of mass at S* and S_{n+1}, world
  double inverse_mass = 0.0;
  Vector3 inverse_moments = Vector3::Zero();  // principal, 1/(kg m^2)
};

struct JointLoad {
  double error = 0.0;  // at S_{n+1}, m, or rad for angular rows
  double force = 0.0;  // norm of the sum of what pushed, N
  // The most that a row would have come open by (held_back() of discrepancy.h), m: what a breaking threshold is compared
  // with where the solver leaves no error (capability `closes_joints`).
  double held = 0.0;
};

// Rows [first, end) of one joint, with the impulses (N s, along each row's axes) that the solver answered.
JointLoad joint_load(const DiscrepancyColumns& rows, std::span<const double> impulses, std::size_t first,
                     std::size_t end, const JointBody& body1, const JointBody& body2, double time_step);

}  // namespace gravitas
