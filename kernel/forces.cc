// Stage::kForce: wrenches of a state, summed per body in the order of the scene.
#include <algorithm>

#include "kernel/environment.h"

namespace gravitas::kernel {

std::span<const ColumnId> Environment::trial_columns() const { return trial_columns_; }

void Environment::ask_forces(const Column<double>& position, const Column<double>& orientation,
                             const Column<double>& linear_velocity, const Column<double>& angular_velocity) {
  for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
    const ForceGroup& group = model_.force_groups[g];
    const ForceAnswer& answer = data_.force_answers[g];
    const auto request = ids(data_.derivative_time, group.type, group.parameter_begin, group.parameter,
                             group.application, model_.mass, model_.geometry_position, model_.geometry_orientation,
                             position, orientation, linear_velocity, angular_velocity, model_.body_shape,
                             model_.shape_type, model_.shape_parameter_begin, model_.shape_parameter);
    const auto reply = ids(answer.wrench, answer.impulse, answer.potential, answer.flags);
    const StageCall call{stage::Method::kForceWrenches, group.target, request, reply};
    ask(Stage::kForce, &force_, call, nullptr, [&](const auto& got) { return validator_.wrenches(got, answer); });
  }
}

void Environment::sum_wrenches() {
  const std::span<double> sum = data_.wrench.span();
  std::ranges::fill(sum, 0.0);
  if (model_.force_groups.size() == 1) {
    const std::span<const double> wrench = data_.force_answers[0].wrench.span();
    for (std::size_t i = 0; i < model_.application_body.size(); ++i)
      for (std::size_t k = 0; k < 6; ++k) sum[6 * model_.application_body[i] + k] += wrench[6 * i + k];
    return;
  }
  // several plugins: walk all applications in the scene's order
  std::vector<std::size_t>& next = next_in_group_;
  next.assign(model_.force_groups.size(), 0);
  for (std::uint32_t row = 0; row < model_.application_count; ++row) {
    for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
      const ForceGroup& group = model_.force_groups[g];
      if (next[g] == group.row.size() || group.row[next[g]] != row) continue;
      const std::span<const double> wrench = data_.force_answers[g].wrench.span();
      for (std::size_t k = 0; k < 6; ++k) sum[6 * model_.application_body[row] + k] += wrench[6 * next[g] + k];
      ++next[g];
      break;
    }
  }
}

void Environment::begin_attempt(bool counts) {
  attempt_counts_ = counts;
  validator_.begin_integration();
  if (!counts) return;
  start_wrench_known_ = false;
  pushed_.clear();
}

void Environment::evaluate() {
  validator_.derivative_request(data_);
  follow_motion(data_.derivative_time[0], data_.derivative_position, data_.derivative_orientation,
                data_.derivative_linear_velocity, data_.derivative_angular_velocity);
  if (!wrench_is_constant_) {
    // the end of a step may be the time of a jump
    data_.derivative_time[0] = std::clamp(data_.derivative_time[0], asked_from_, asked_until_);
    ask_forces(data_.derivative_position, data_.derivative_orientation, data_.derivative_linear_velocity,
               data_.derivative_angular_velocity);
    sum_wrenches();
    if (sleepers_ > 0 && attempt_counts_) look_for_pushes();
  }
  if (knows_reactions()) ask_reactions();
  validator_.note_wrench(told_wrench());
  if (start_wrench_known_ || !attempt_counts_ || !has_reactions()) return;
  std::ranges::copy(data_.wrench.span(), data_.start_wrench.data());
  start_wrench_known_ = true;
}

double Environment::potential_energy() {
  double sum = 0.0;
  bool asked = false;
  for (std::size_t g = 0; g < model_.force_groups.size(); ++g) {
    const ForceGroup& group = model_.force_groups[g];
    const ForceAnswer& answer = data_.force_answers[g];
    for (std::size_t i = 0; i < group.row.size(); ++i) {
      if ((answer.flags[i] & kHasPotential) == 0) continue;
      const bool constant = (answer.flags[i] & kConstantWrench) != 0;
      if (!constant && !asked && force_.is_running()) {
        data_.derivative_time[0] = time();
        ask_forces(front().position, front().orientation, front().linear_velocity, front().angular_velocity);
        asked = true;
      }
      if (!constant) {
        sum += answer.potential[i];
        continue;
      }
      // a constant force has a potential that falls along it
      const std::uint32_t body = group.application[2 * i + 1];
      const Vector3 moved = vector_at(front().position.span(), body) - description_.bodies[body].pose.position;
      sum += initial_potential_[group.row[i]] -
             Vector3(answer.wrench[6 * i], answer.wrench[6 * i + 1], answer.wrench[6 * i + 2]).dot(moved);
    }
  }
  return sum;
}

}  // namespace gravitas::kernel
