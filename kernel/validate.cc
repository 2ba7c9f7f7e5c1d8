#include "kernel/validate.h"

#include <algorithm>
#include <array>
#include <string>

#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/derivative_question.h"

namespace gravitas::kernel {
namespace {

[[noreturn]] void bad_numbers(const std::string& text) {
  throw StageFault(FaultKind::kBadNumbers, "numbers", "its answer is wrong: " + text);
}

void require(const AnswerProblem& problem) {
  if (problem.text.empty()) return;
  if (!problem.is_structure) bad_numbers(problem.text);
  throw StageFault(FaultKind::kBadStructure, "structure", "its answer is wrong: " + problem.text);
}

// Throws if the check of the physics has found something.
void require_physics(const std::string& problem) {
  if (!problem.empty()) throw StageFault(FaultKind::kBadPhysics, "physics", "its answer breaks a law: " + problem);
}

std::string at_row(const char* what, std::size_t row) { return std::string(what) + " of row " + std::to_string(row); }

}  // namespace

void Validator::check_structure_and_finiteness(const StageCall& call) const {
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> request, reply;
  for (std::size_t i = 0; i < call.request.size(); ++i) request[i] = arena_.count(call.request[i]);
  for (std::size_t i = 0; i < call.reply.size(); ++i) reply[i] = arena_.count(call.reply[i]);
  const stage::MethodInfo& method = call.info();
  require({true, rows_.check(call.method, {request.data(), call.request.size()}, {reply.data(), call.reply.size()})});
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    if (method.reply[i].type != stage::ElementType::kF64) continue;
    const std::size_t index = first_not_finite({reinterpret_cast<const double*>(arena_.data(call.reply[i])), reply[i]});
    if (index != kNoRow)
      bad_numbers(at_row(method.reply[i].name, index / method.reply[i].components) + " is not finite");
  }
}

Trusted<Wrenches> Validator::wrenches(const Untrusted<StageCall>& answer, const ForceAnswer& columns) const {
  check_structure_and_finiteness(answer.value_);
  require(check_wrench_flags(columns.flags.span()));
  return Trusted<Wrenches>({});
}

Trusted<Wrenches> Validator::jacobians(const Untrusted<StageCall>& answer, const Column<std::uint32_t>& bodies,
                                       std::uint64_t most) const {
  check_structure_and_finiteness(answer.value_);
  require(check_block_rows(answer.value_.info().reply[0].name, bodies.span(), model_.body_count, most));
  return Trusted<Wrenches>({});
}

Trusted<TrialState> Validator::trial_state(const Untrusted<StageCall>& answer, const StepData& data,
                                           const State& start) const {
  check_structure_and_finiteness(answer.value_);
  if (const std::size_t row = first_not_unit(data.trial_orientation.span(), 4); row != kNoRow)
    bad_numbers(at_row("orientation", row) + " is not of unit length");
  const std::size_t moved = first_changed_body(data.flags.span(), kMovable | kKinematic, [&] {
    return std::array{ColumnPair{data.trial_position.span(), start.position.span()},
                      ColumnPair{data.trial_orientation.span(), start.orientation.span()},
                      ColumnPair{data.trial_linear_velocity.span(), start.linear_velocity.span()},
                      ColumnPair{data.trial_angular_velocity.span(), start.angular_velocity.span()}};
  });
  if (moved != kNoRow) bad_numbers("it moved the immovable body '" + model_.body_id[moved] + "'");
  if (samples_physics_) {
    const auto columns = plain_columns(arena_, answer.value_.request);
    require_physics(check_integration(stage::IntegratorIntegrateRequest(columns.data()),
                                      {data.trial_position.span(), data.trial_orientation.span(),
                                       data.trial_linear_velocity.span(), data.trial_angular_velocity.span()},
                                      told_));
  }
  return Trusted<TrialState>({});
}

void Validator::derivative_request(const StepData& data) const {
  for (const Column<double>* column : {&data.derivative_time, &data.derivative_position, &data.derivative_orientation,
                                       &data.derivative_linear_velocity, &data.derivative_angular_velocity})
    if (first_not_finite(column->span()) != kNoRow)
      bad_numbers("it asked for a derivative in a state that is not finite");
  if (data.derivative_question[0] > static_cast<std::uint32_t>(DerivativeQuestion::kVelocityImpulses))
    bad_numbers("it asked a question that there is not");
}

Trusted<Pairs> Validator::pairs(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  require(check_pairs(data.pair.span(), model_.flags.span()));
  if (samples_physics_) {
    const auto columns = plain_columns(arena_, answer.value_.request);
    require_physics(pair_check_.check(stage::SpacePairsRequest(columns.data()), data.pair.span()));
  }
  return Trusted<Pairs>({});
}

Trusted<Impacts> Validator::impacts(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  require(check_impact_rows(data.impact_pair.span(), data.impact_fraction.span(), data.impact_normal.span(),
                            data.pair.size() / 2));
  return Trusted<Impacts>({});
}

Trusted<Contacts> Validator::contacts(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  require(check_contact_rows(data.contact_pair.span(), data.contact_feature.span(), data.contact_normal.span(),
                             data.pair.size() / 2));
  if (samples_physics_) {
    const auto columns = plain_columns(arena_, answer.value_.request);
    require_physics(check_contacts(stage::CollisionManifoldsRequest(columns.data()),
                                   {data.contact_pair.span(), data.contact_normal.span(), data.contact_point.span(),
                                    data.contact_depth.span(), data.contact_relative_velocity.span()}));
  }
  return Trusted<Contacts>({});
}

Trusted<Bound> Validator::bound(const Untrusted<StageCall>& answer, const ConstraintGroup& group) const {
  check_structure_and_finiteness(answer.value_);
  require(check_bound_begin(group.bound_begin.span(), group.bound.size()));
  return Trusted<Bound>({});
}

Trusted<Discrepancies> Validator::discrepancies(const Untrusted<StageCall>& answer, const DiscrepancyAnswer& columns,
                                                std::span<const std::uint32_t> intact) const {
  check_structure_and_finiteness(answer.value_);
  require(check_discrepancy_rows(columns.constraint.span(), intact, columns.columns()));
  return Trusted<Discrepancies>({});
}

Trusted<Reactions> Validator::reactions(const Untrusted<StageCall>& answer) const {
  check_structure_and_finiteness(answer.value_);
  return Trusted<Reactions>({});
}

Trusted<Solution> Validator::solution(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  const std::size_t pushed = first_changed_body(data.flags.span(), kMovable, [&] {
    return std::array{ColumnPair{data.solved_linear_velocity.span(), data.trial_linear_velocity.span()},
                      ColumnPair{data.solved_angular_velocity.span(), data.trial_angular_velocity.span()}};
  });
  const std::span<const double> change = data.pose_change.span();
  for (std::size_t i = 0; i < model_.body_count; ++i)
    if (i == pushed || ((data.flags[i] & kMovable) == 0 && std::ranges::count(change.subspan(6 * i, 6), 0.0) != 6))
      bad_numbers("it pushed the body '" + model_.body_id[i] + "', which nothing can push");

  SolutionColumns solution = {
      data.solved_linear_velocity.span(), data.solved_angular_velocity.span(), data.pose_change.span(),
      data.discrepancy_impulse.span(),    data.discrepancy_correction.span(),  data.contact_impulse.span(),
      data.contact_correction.span(),     data.contact_direction.span(),       data.contact_turning.span()};
  solution.stop_reason = data.stop_reason[0];
  require(check_multipliers(solution, data.contact_material.span(), data.discrepancies.mode.span()));
  if (samples_physics_) {
    const auto columns = plain_columns(arena_, answer.value_.request);
    require_physics(solution_check_.check(stage::SolverSolveRequest(columns.data()), solution));
  }
  return Trusted<Solution>({});
}

}  // namespace gravitas::kernel
