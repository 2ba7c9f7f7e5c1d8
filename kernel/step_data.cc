#include "kernel/step_data.h"

#include <algorithm>

#include "plugin_sdk/solver.h"

namespace gravitas::kernel {

DiscrepancyAnswer::DiscrepancyAnswer(Arena* arena, std::uint64_t rows) {
  const auto numbers = [&](std::uint64_t components) { return Column<double>(arena, 0, rows * components); };
  constraint = Column<std::uint32_t>(arena, 0, rows);
  point1 = numbers(3), point2 = numbers(3), velocity = numbers(3), correction = numbers(1), axes = numbers(4);
  mode = Column<std::uint32_t>(arena, 0, rows);
  lower = numbers(3), upper = numbers(3), compliance = numbers(3), damping = numbers(3), maximum_force = numbers(3);
  restitution = numbers(1), desired_acceleration = numbers(3);
}

std::vector<ColumnId> DiscrepancyAnswer::ids() const {
  return {constraint.id(),  point1.id(),
          point2.id(),      velocity.id(),
          correction.id(),  axes.id(),
          mode.id(),        lower.id(),
          upper.id(),       compliance.id(),
          damping.id(),     maximum_force.id(),
          restitution.id(), desired_acceleration.id()};
}

DiscrepancyColumns DiscrepancyAnswer::columns() const {
  return {point1.span(),
          point2.span(),
          velocity.span(),
          correction.span(),
          axes.span(),
          mode.span(),
          lower.span(),
          upper.span(),
          compliance.span(),
          damping.span(),
          maximum_force.span(),
          restitution.span(),
          desired_acceleration.span()};
}

void DiscrepancyAnswer::resize(std::uint64_t rows) const {
  constraint.resize(rows), mode.resize(rows), correction.resize(rows), restitution.resize(rows), axes.resize(4 * rows);
  for (const Column<double>* column :
       {&point1, &point2, &velocity, &lower, &upper, &compliance, &damping, &maximum_force, &desired_acceleration})
    column->resize(3 * rows);
}

void DiscrepancyAnswer::copy_row(std::size_t row, const DiscrepancyAnswer& source, std::size_t source_row) const {
  mode[row] = source.mode[source_row];
  correction[row] = source.correction[source_row];
  restitution[row] = source.restitution[source_row];
  std::copy_n(&source.axes[4 * source_row], 4, &axes[4 * row]);
  const auto copy = [&](const Column<double>& from, const Column<double>& to) {
    std::copy_n(&from[3 * source_row], 3, &to[3 * row]);
  };
  copy(source.point1, point1), copy(source.point2, point2), copy(source.velocity, velocity);
  copy(source.lower, lower), copy(source.upper, upper), copy(source.compliance, compliance);
  copy(source.damping, damping), copy(source.maximum_force, maximum_force);
  copy(source.desired_acceleration, desired_acceleration);
}

StepData::StepData(Arena* arena, const Model& model, const EnvironmentDescription& d) {
  const std::uint64_t n = model.body_count;
  const bool has_joints = model.constraint_count > 0;
  const bool has_shapes = d.space.plugins.size() > 0 && d.collision.plugins.size() > 0;
  const bool has_reactions = has_joints || has_shapes;
  // columns of stages that the plan leaves out take no room
  const auto bodies = [&](std::uint64_t components) { return Column<double>(arena, n * components, 0); };
  const auto bodies_if = [&](bool needed, std::uint64_t components) {
    return Column<double>(arena, needed ? n * components : 0, 0);
  };
  const std::uint64_t contacts = has_shapes ? std::max<std::uint64_t>(16, 8 * n) : 0;
  const auto contact_numbers = [&](std::uint64_t components) {
    return Column<double>(arena, 0, contacts * components);
  };

  time = Column<double>(arena, 1, 0), time_step = Column<double>(arena, 1, 0), theta = Column<double>(arena, 1, 0);
  margin = Column<double>(arena, 1, 0);
  wrench_is_constant = Column<std::uint32_t>(arena, 1, 0);
  const bool can_sleep = d.sleep.energy > 0.0;
  flags = can_sleep ? Column<std::uint32_t>(arena, n, 0) : model.flags;
  inverse_mass = can_sleep ? bodies(1) : model.inverse_mass;
  inverse_inertia = can_sleep ? bodies(3) : model.inverse_inertia;

  const bool is_smooth = d.simulator == Simulator::kSmooth && has_joints;
  const bool has_forces = model.application_count > 0 || is_smooth;
  start_linear_velocity = bodies_if(has_forces, 3), start_angular_velocity = bodies_if(has_forces, 3);
  derivative_time = Column<double>(arena, 1, 0);
  derivative_position = bodies_if(has_forces, 3), derivative_orientation = bodies_if(has_forces, 4);
  derivative_linear_velocity = bodies_if(has_forces, 3), derivative_angular_velocity = bodies_if(has_forces, 3);
  derivative_question = Column<std::uint32_t>(arena, 1, 0), jacobian_blocks = Column<std::uint32_t>(arena, 1, 0);
  block_body = Column<std::uint32_t>(arena, 0, 0), jacobian_body = Column<std::uint32_t>(arena, 0, 0);
  block = Column<double>(arena, 0, 0), jacobian = Column<double>(arena, 0, 0);
  for (const ForceGroup& group : model.force_groups) {
    const std::uint64_t rows = group.application.size() / 2;
    ForceAnswer& answer = force_answers.emplace_back();
    answer.wrench = Column<double>(arena, 6 * rows, 0), answer.impulse = Column<double>(arena, 6 * rows, 0);
    answer.potential = Column<double>(arena, rows, 0);
    answer.flags = Column<std::uint32_t>(arena, rows, 0);
  }
  wrench = bodies(6), no_wrench = bodies(6), impulse = bodies_if(has_forces, 6),
  start_wrench = bodies_if(has_reactions, 6);

  kinematic_acceleration = bodies_if(is_smooth, 6), reaction = bodies_if(is_smooth, 6);
  wrench_with_reactions = bodies_if(is_smooth, 6);
  held_position = bodies_if(is_smooth, 3), held_orientation = bodies_if(is_smooth, 4);
  no_velocity = bodies_if(is_smooth, 3);
  reaction_residual = Column<double>(arena, 1, 0);

  trial_time = Column<double>(arena, 1, 0);
  trial_position = bodies(3), trial_orientation = bodies(4), trial_linear_velocity = bodies(3);
  trial_angular_velocity = bodies(3);
  error_estimate = Column<double>(arena, 1, 0);
  next_plugin_state = Column<double>(arena, 0, 8);  // a plugin that needs more room is asked twice

  lower = bodies_if(has_shapes, 3), upper = bodies_if(has_shapes, 3);
  pair = Column<std::uint32_t>(arena, 0, 2 * contacts);
  const bool has_impacts = has_shapes && d.simulator == Simulator::kContinuous;
  displacement = bodies_if(has_impacts, 3), rotation = bodies_if(has_impacts, 3);
  target_gap = Column<double>(arena, 1, 0), impact_pair = Column<std::uint32_t>(arena, 0, has_impacts ? contacts : 0);
  for (Column<double>* column : {&impact_fraction, &impact_normal, &impact_point, &impact_depth})
    *column = Column<double>(arena, 0, has_impacts ? 3 * contacts : 0);
  contact_pair = Column<std::uint32_t>(arena, 0, contacts), contact_feature = Column<std::uint32_t>(arena, 0, contacts);
  contact_normal = contact_numbers(3), contact_point = contact_numbers(3), contact_depth = contact_numbers(1);
  contact_relative_velocity = contact_numbers(3);
  contact_body = Column<std::uint32_t>(arena, 0, 2 * contacts),
  touching = Column<std::uint32_t>(arena, 0, 2 * contacts);
  contact_key = Column<std::uint64_t>(arena, 0, contacts);
  contact_material = contact_numbers(kMaterialColumns);
  contact_warm_impulse = contact_numbers(3), contact_warm_correction = contact_numbers(1);

  std::uint64_t rows = 0;
  for (const ConstraintGroup& group : model.constraint_groups) {
    const std::uint64_t joints = group.type.size();
    rows += 8 * joints;
    group_intact.emplace_back(arena, joints, 0);
    discrepancy_answers.emplace_back(arena, 8 * joints);
  }
  discrepancies = DiscrepancyAnswer(arena, rows);
  for (DiscrepancyAnswer* one : {&held_joints, &start_joints}) *one = DiscrepancyAnswer(arena, is_smooth ? rows : 0);
  discrepancy_body = Column<std::uint32_t>(arena, 0, 2 * rows);
  for (Column<double>* column : {&discrepancy_force, &held_force, &wanted_along, &none_along, &discrepancy_warm_impulse,
                                 &discrepancy_warm_correction, &discrepancy_impulse, &discrepancy_correction})
    *column = Column<double>(arena, 0, 3 * rows);

  solved_linear_velocity = bodies_if(has_reactions, 3), solved_angular_velocity = bodies_if(has_reactions, 3);
  pose_change = bodies_if(has_reactions, 6), contact_correction = contact_numbers(1);
  contact_impulse = contact_numbers(3), contact_direction = contact_numbers(3), contact_turning = contact_numbers(3);
  iterations = Column<std::uint32_t>(arena, 1, 0), stop_reason = Column<std::uint32_t>(arena, 1, 0);
  residual = Column<double>(arena, 1, 0);
}

}  // namespace gravitas::kernel
