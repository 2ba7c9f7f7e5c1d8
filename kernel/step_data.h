// What one step works out on its way: scratch columns, written by the named stage, void after commit.
#pragma once

#include <cstdint>
#include <vector>

#include "kernel/arena.h"
#include "kernel/model.h"
#include "plugin_sdk/discrepancy.h"

namespace gravitas::kernel {

// Answers of Force.Wrenches, a row per application of the group.
struct ForceAnswer {
  Column<double> wrench, impulse, potential;
  Column<std::uint32_t> flags;
};

// Answers of Constraint.Discrepancies, and the same columns merged over all groups in the scene's order.
struct DiscrepancyAnswer {
  DiscrepancyAnswer() = default;
  DiscrepancyAnswer(Arena* arena, std::uint64_t rows);
  std::vector<ColumnId> ids() const;
  DiscrepancyColumns columns() const;
  void resize(std::uint64_t rows) const;
  // Copies a row of another answer into a row of this one.
  void copy_row(std::size_t row, const DiscrepancyAnswer& source, std::size_t source_row) const;

  Column<std::uint32_t> constraint;
  Column<double> point1, point2, velocity, correction, axes;
  Column<std::uint32_t> mode;
  Column<double> lower, upper, compliance, damping, maximum_force, restitution, desired_acceleration;
};

struct StepData {
  StepData(Arena* arena, const Model& model, const EnvironmentDescription& description);

  // Scalars of the step: a row each. Written at its start.
  Column<double> time, time_step, theta, margin;
  Column<std::uint32_t> wrench_is_constant;
  // Of bodies, as this step has them: who sleeps is immovable. Written at its start; the model's where nothing sleeps.
  Column<std::uint32_t> flags;
  Column<double> inverse_mass, inverse_inertia;

  // Velocities at the start of the step: those of S_n plus instantaneous impulses. Written at its start, and
  // only in a step that has such impulses.
  Column<double> start_linear_velocity, start_angular_velocity;

  // Trial state of a derivative request, and its time. Written by the carrier of Stage::kIntegrate.
  Column<double> derivative_time, derivative_position, derivative_orientation, derivative_linear_velocity,
      derivative_angular_velocity;
  Column<std::uint32_t> derivative_question;
  // Stage::kForce: answers per group; sum per body (6); impulses per body (6), asked once.
  std::vector<ForceAnswer> force_answers;
  Column<double> wrench, impulse;
  Column<double> no_wrench;  // zeros, for who is to ask for derivatives
  // How many blocks there may be, what a plugin answers, and all of them, where they are asked for.
  Column<std::uint32_t> jacobian_blocks, block_body, jacobian_body;
  Column<double> block, jacobian;
  // Wrenches at S_n for the solver, which may differ from the last ones that the integrator asked for.
  Column<double> start_wrench;

  // Simulator Smooth: accelerations of kinematic bodies, what the joints answer, and the wrenches with it. Written by
  // Stage::kSolve inside kIntegrate; held_force: the last discrepancy_force of the integration that counts.
  Column<double> kinematic_acceleration, reaction, discrepancy_force, held_force, reaction_residual,
      wrench_with_reactions;
  // joint_impulses.cc: joints (once others are asked) and poses of the last derivative, what they shall do, and what is none.
  DiscrepancyAnswer held_joints, start_joints;  // the second: start_joints.cc
  Column<double> held_position, held_orientation, no_velocity, wanted_along, none_along;

  // Stage::kIntegrate: S*, and its time.
  Column<double> trial_time, trial_position, trial_orientation, trial_linear_velocity, trial_angular_velocity,
      error_estimate, next_plugin_state;

  // Stage::kBound.
  Column<double> lower, upper;

  // Stage::kBroadPhase.
  Column<std::uint32_t> pair;

  // Times of impact: how the bodies get from S_n to S*, the gap that counts, and the answer.
  Column<double> displacement, rotation, target_gap;
  Column<std::uint32_t> impact_pair;
  Column<double> impact_fraction, impact_normal, impact_point, impact_depth;

  // Stage::kNarrowPhase, and what the kernel looks up for each contact.
  Column<std::uint32_t> contact_pair, contact_feature;
  Column<double> contact_normal, contact_point, contact_depth, contact_relative_velocity;
  Column<std::uint32_t> contact_body;
  Column<std::uint64_t> contact_key;
  Column<double> contact_material, contact_warm_impulse, contact_warm_correction;

  // Stage::kCommit: pairs of them that touch.
  Column<std::uint32_t> touching;

  // Stage::kConstrain.
  std::vector<Column<std::uint32_t>> group_intact;
  std::vector<DiscrepancyAnswer> discrepancy_answers;
  DiscrepancyAnswer discrepancies;
  Column<std::uint32_t> discrepancy_body;
  Column<double> discrepancy_warm_impulse, discrepancy_warm_correction;

  // Stage::kSolve.
  Column<double> solved_linear_velocity, solved_angular_velocity, pose_change;
  Column<double> discrepancy_impulse, discrepancy_correction;
  Column<double> contact_impulse, contact_correction, contact_direction, contact_turning;
  Column<std::uint32_t> iterations, stop_reason;
  Column<double> residual;
};

}  // namespace gravitas::kernel
