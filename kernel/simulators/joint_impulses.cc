// What an integrator asks of the joints that keeps to them while it goes (plugin_sdk/integrator.h, place_impulses): how they
// have to push where the last derivative was asked for, so that the bodies come to where joints want them.
//
// Both answers are reactions of bodies at rest in the poses of that derivative, J M^-1 W = -e, where e are errors of place,
// or of velocity, instead of accelerations.
#include <algorithm>

#include "kernel/environment.h"
#include "plugin_sdk/joint_locks.h"

namespace gravitas::kernel {

void Environment::find_joint_impulses() {
  const auto last = [&]() -> const DiscrepancyAnswer& {
    return last_joints_ == LastJoints::kHeld ? data_.held_joints : data_.discrepancies;
  };
  if (!knows_reactions() || last_joints_ == LastJoints::kNone || !are_locks(last().columns()))
    return told_wrench().resize(0);
  // that question asks the joints anew
  if (last_joints_ == LastJoints::kFresh && is_asked(DerivativeQuestion::kPlaceImpulses)) {
    std::swap(data_.discrepancies, data_.held_joints);
    last_joints_ = LastJoints::kHeld;
  }
  const DiscrepancyAnswer& joints = last();
  if (!find_wanted_moves(joints)) return told_wrench().resize(0);
  data_.none_along.resize(3 * joints.mode.size()), std::ranges::fill(data_.none_along.span(), 0.0);
  data_.discrepancy_force.resize(3 * joints.mode.size());
  data_.block_body.resize(0), data_.block.resize(0);
  data_.start_joints.resize(0);  // what holds always needs none
  const DiscrepancyAnswer& none = data_.start_joints;
  const auto request =
      ids(model_.flags, model_.inverse_mass, model_.inertia, model_.inverse_inertia, model_.damping,
          data_.held_position, data_.held_orientation, data_.no_velocity, data_.no_velocity, data_.no_wrench,
          data_.no_wrench, data_.discrepancy_body, joints.point1, joints.point2, data_.none_along, joints.correction,
          joints.axes, joints.mode, joints.lower, joints.upper, joints.compliance, joints.damping, joints.maximum_force,
          data_.block_body, data_.block, data_.held_position, data_.held_orientation, data_.no_velocity,
          data_.no_velocity, data_.time_step, data_.wanted_along, none.point1, none.point2, none.velocity, none.axes,
          none.mode, none.lower, none.upper, none.compliance, none.damping, none.desired_acceleration);
  const auto reply = ids(told_wrench(), data_.discrepancy_force, data_.reaction_residual);
  ask(Stage::kSolve, &solver_, {stage::Method::kSolverReactions, 0, request, reply}, nullptr,
      [&](const auto& answer) { return validator_.reactions(answer); });
}

// What the bodies are to be moved by, or their velocities changed by, along the axes of joints. False: that is unknown.
bool Environment::find_wanted_moves(const DiscrepancyAnswer& joints) {
  data_.wanted_along.resize(3 * joints.mode.size());
  if (is_asked(DerivativeQuestion::kPlaceImpulses)) {
    ask_discrepancies(data_.derivative_time, data_.derivative_position, data_.derivative_orientation,
                      data_.derivative_linear_velocity, data_.derivative_angular_velocity);
    if (!find_lock_errors(joints.columns(), data_.discrepancies.columns(), data_.wanted_along.span())) return false;
  } else {
    find_lock_velocity_errors(
        joints.columns(), data_.discrepancy_body.span(),
        {data_.held_position.span(), data_.derivative_linear_velocity.span(), data_.derivative_angular_velocity.span()},
        data_.wanted_along.span());
  }
  for (double& along : data_.wanted_along.span()) along = -along;
  return true;
}

}  // namespace gravitas::kernel
