// Stage::kForce: wrenches of a state, summed per body in the order of the scene.
#include <algorithm>

#include "kernel/environment.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas::kernel {

void Environment::ask_forces(const Column<double>& position, const Column<double>& orientation,
                             const Column<double>& linear_velocity, const Column<double>& angular_velocity) {
  for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
    const ForceGroup& group = model_.force_groups[g];
    const ForceAnswer& answer = data_.force_answers[g];
    const auto request = force_request(group, position, orientation, linear_velocity, angular_velocity);
    const auto reply = ids(answer.wrench, answer.impulse, answer.potential, answer.flags);
    const StageCall call{stage::Method::kForceWrenches, group.target, request, reply};
    ask(Stage::kForce, &force_, call, nullptr, [&](const auto& got) { return validator_.wrenches(got, answer); });
  }
}

void Environment::ask_forces() {
  data_.derivative_time[0] = time();
  do {
    has_new_forces_ = false;
    try {
      ask_forces(front().position, front().orientation, front().linear_velocity, front().angular_velocity);
    } catch (...) {
      has_new_forces_ = true;
      throw;
    }
  } while (has_new_forces_);
  count_jacobian_blocks();
}

void Environment::sum_wrenches() {
  const std::span<double> sum = data_.wrench.span();
  std::ranges::fill(sum, 0.0);
  for (const Model::Application& one : model_.applications) {
    const double* wrench = &data_.force_answers[one.group].wrench[6 * one.place];
    for (std::size_t k = 0; k < 6; ++k) sum[6 * one.body + k] += wrench[k];
  }
}

bool Environment::is_constant(std::size_t group) const {
  return std::ranges::all_of(data_.force_answers[group].flags.span(),
                             [](std::uint32_t bits) { return (bits & kConstantWrench) != 0; });
}

void Environment::count_jacobian_blocks() {
  std::uint64_t blocks = knows_reactions() ? most_reaction_blocks() : 0;
  // who came in has not said yet what is constant
  bool can_all = !has_new_forces_ && (!knows_reactions() || blocks > 0);
  for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
    const ForceGroup& group = model_.force_groups[g];
    if (is_constant(g)) continue;
    can_all = can_all && has_capability(force_.description().plugins[group.target].declaration, "jacobians");
    blocks += kMostBlocksOfApplication * group.row.size();
  }
  data_.jacobian_blocks[0] = can_all ? static_cast<std::uint32_t>(blocks) : 0;
}

// Asks for blocks of at most `most` pairs of bodies, and puts them behind those before.
void Environment::ask_jacobians(Stage stage, StageSlot* slot, StageCall call, std::uint64_t most) {
  data_.block_body.resize(0), data_.block.resize(0);
  const auto reply = ids(data_.block_body, data_.block);
  call.reply = reply;
  ask(stage, slot, call, nullptr, [&](const auto& got) { return validator_.jacobians(got, data_.block_body, most); });
  const std::size_t pairs = data_.jacobian_body.size(), numbers = data_.jacobian.size();
  data_.jacobian_body.resize(pairs + data_.block_body.size()), data_.jacobian.resize(numbers + data_.block.size());
  std::ranges::copy(data_.block_body.span(), data_.jacobian_body.data() + pairs);
  std::ranges::copy(data_.block.span(), data_.jacobian.data() + numbers);
}

void Environment::ask_jacobians() {
  for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
    const ForceGroup& group = model_.force_groups[g];
    if (is_constant(g)) continue;
    const auto request = force_request(group, data_.derivative_position, data_.derivative_orientation,
                                       data_.derivative_linear_velocity, data_.derivative_angular_velocity);
    ask_jacobians(Stage::kForce, &force_, {stage::Method::kForceJacobians, group.target, request, {}},
                  kMostBlocksOfApplication * group.row.size());
  }
}

void Environment::begin_attempt(bool counts) {
  attempt_counts_ = counts, nested_ns_ = 0, last_joints_ = LastJoints::kNone;
  validator_.begin_integration();
  if (!counts) return;
  start_wrench_known_ = false;
  pushed_.clear(), least_borne_.clear();
}

void Environment::evaluate() {
  const std::uint64_t begin = lap_ns();
  validator_.derivative_request(data_);
  data_.jacobian_body.resize(0), data_.jacobian.resize(0);
  follow_motion(data_.derivative_time[0], data_.derivative_position, data_.derivative_orientation,
                data_.derivative_linear_velocity, data_.derivative_angular_velocity);
  // the end of a step may be the time of a jump
  data_.derivative_time[0] = std::clamp(data_.derivative_time[0], asked_from_, asked_until_);
  told_wrench().resize(6 * model_.body_count);
  const bool wants_wrenches = data_.derivative_question[0] < kFirstOfImpulses;
  wants_wrenches ? find_wrenches() : find_joint_impulses();
  nested_ns_ += lap_between(begin, lap_ns());
}

void Environment::find_wrenches() {
  if (!wrench_is_constant_) {
    ask_forces(data_.derivative_position, data_.derivative_orientation, data_.derivative_linear_velocity,
               data_.derivative_angular_velocity);
    sum_wrenches();
    if (wants_jacobian()) ask_jacobians();
    if (sleepers_ > 0 && attempt_counts_) look_for_pushes();
  }
  if (knows_reactions()) is_asked(DerivativeQuestion::kForces) ? told_wrench().assign(data_.wrench) : ask_reactions();
  // a plugin may have taken over that gives none
  if (data_.jacobian_blocks[0] == 0) data_.jacobian_body.resize(0), data_.jacobian.resize(0);
  validator_.note_wrench(told_wrench());
  if (start_wrench_known_ || !attempt_counts_ || !has_reactions()) return;
  std::ranges::copy(data_.wrench.span(), data_.start_wrench.data());
  start_wrench_known_ = true;
}

double Environment::potential_energy() {
  if (force_.is_running()) ask_forces();
  double sum = 0.0;
  for (const Model::Application& one : model_.applications) {
    const ForceAnswer& answer = data_.force_answers[one.group];
    if ((answer.flags[one.place] & kHasPotential) == 0) continue;
    sum += answer.potential[one.place];
    if (force_.is_running()) continue;
    // asked at the start: the potential of a constant force falls along it
    const Vector3 moved = vector_at(front().position.span(), one.body) - description_.bodies[one.body].pose.position;
    sum -= vector_at(answer.wrench.span(), 2 * one.place).dot(moved);
  }
  return sum;
}

}  // namespace gravitas::kernel
