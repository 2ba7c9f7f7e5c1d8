// What an environment does once, before its first step: start its hosts, bind its joints, ask for the forces.
#include <algorithm>
#include <stdexcept>

#include "kernel/environment.h"

namespace gravitas::kernel {
namespace {

EnvironmentDescription checked(EnvironmentDescription description) {
  const std::string problem = description.validate();
  if (!problem.empty()) throw std::invalid_argument(problem);
  return description;
}

}  // namespace

Environment::Environment(EnvironmentDescription description, const HostStarter& starter)
    : description_(checked(std::move(description))),
      plan_(make_plan(&description_)),
      model_(&arena_, description_),
      data_(&arena_, model_, description_),
      validator_(arena_, model_, description_.check_physics_every),
      margin_(contact_margin(model_.bound)),
      activity_(description_.sleep),
      space_(Slot::kSpace, description_.space),
      collision_(Slot::kCollision, description_.collision),
      constraint_(Slot::kConstraint, description_.constraint),
      force_(Slot::kForce, description_.force),
      solver_(Slot::kSolver, description_.solver),
      integrator_(Slot::kIntegrator, description_.integrator),
      trial_columns_(ids(data_.derivative_time, data_.derivative_position, data_.derivative_orientation,
                         data_.derivative_linear_velocity, data_.derivative_angular_velocity,
                         data_.derivative_question)),
      answer_columns_(ids(told_wrench(), data_.jacobian_body, data_.jacobian)) {
  for (const DiscrepancyAnswer& answer : data_.discrepancy_answers) discrepancy_reply_.push_back(answer.ids());
  const bool has_inner_steps = description_.simulator >= Simulator::kBisection || description_.substeps > 1 ||
                               !description_.switches.empty() || model_.constraint_count > 0;
  const std::size_t states = description_.accuracy > 0.0 ? kSpareState + 1 : has_inner_steps ? 3 : 2;
  while (states_.size() < states) states_.emplace_back(&arena_, description_);
  arena_.seal();
  model_.write(description_);
  for (const State& state : states_) state.write(description_);
  data_.margin[0] = margin_;
  data_.theta[0] = description_.integrator.plugins.empty() ? 0.5 : description_.integrator.plugins[0].declaration.theta;
  start_slots(starter);
  for (const ConstraintGroup& group : model_.constraint_groups) bind(group);
  ask_constant_forces();
  count_jacobian_blocks();
  state_hash_ = kernel::state_hash(front());
  chain_hash_ = gravitas::chain_hash({}, state_hash_);
}

Environment::~Environment() {
  for (StageSlot* slot : slots_) slot->drain();
}

void Environment::start_slots(const HostStarter& starter) {
  for (StageSlot* slot : slots_) slot->find_hosts(slots_, description_.threads, starter);
  check_fallbacks();
  for (StageSlot* slot : slots_) slot->start(this, &faults_);
  for (StageSlot* slot : slots_) slot->finish_start();
}

// Joints are bound in the initial state, whenever it is that their plugin comes.
void Environment::bind(const ConstraintGroup& group) {
  for (std::uint32_t row = 0; row < group.body.size(); ++row) {
    const auto& bound_at = model_.constraints[group.row[row / 2]].bound_at;
    const bool has_body = group.body[row] != kNone;
    const Pose pose = bound_at ? bound_at->at(row % 2) : has_body ? description_.bodies[group.body[row]].pose : Pose{};
    group.bind_body[row] = has_body ? row : kNone;
    set_vector(group.bind_position.span(), row, Vector3(pose.position.array() + 0.0));  // one zero, as in the state
    set_quaternion(group.bind_orientation.span(), row, Quaternion((pose.orientation.coeffs().array() + 0.0).matrix()));
  }
  const auto request = ids(group.type, group.bind_body, group.parameter_begin, group.parameter, group.bind_position,
                           group.bind_orientation, group.is_kept);
  const auto reply = ids(group.bound_begin, group.bound);
  const StageCall call{stage::Method::kConstraintBind, group.target, request, reply};
  ask(Stage::kConstrain, &constraint_, call, nullptr,
      [&](const auto& answer) { return validator_.bound(answer, group); });
}

// Forces are asked in the initial state. If all say that it is their answer for ever, their host is let go.
void Environment::ask_constant_forces() {
  if (!force_.is_running()) return;
  ask_forces();
  sum_wrenches();

  wrench_is_constant_ = !description_.asks_forces;
  std::ranges::fill(data_.impulse.span(), 0.0);
  for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
    const ForceGroup& group = model_.force_groups[g];
    const ForceAnswer& answer = data_.force_answers[g];
    for (std::size_t i = 0; i < group.row.size(); ++i) {
      wrench_is_constant_ &= (answer.flags[i] & kConstantWrench) != 0;
      for (std::size_t k = 0; k < 6; ++k) {
        data_.impulse[6 * group.application[2 * i + 1] + k] += answer.impulse[6 * i + k];
        has_impulses_ |= answer.impulse[6 * i + k] != 0.0;
      }
    }
  }
  if (!wrench_is_constant_) return remember_wrenches();
  force_.stop();
  std::erase_if(plan_.slots, [](const PlannedSlot& planned) { return planned.slot == Slot::kForce; });
  plan_.left_out.push_back({"force", "all forces are constant: asked once at the start"});
}

}  // namespace gravitas::kernel
