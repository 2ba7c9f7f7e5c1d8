#include "kernel/validate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/physics_checks.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

[[noreturn]] void bad_structure(const std::string& text) {
  throw StageFault(FaultKind::kBadStructure, "structure", "its answer is wrong: " + text);
}

[[noreturn]] void bad_numbers(const std::string& text) {
  throw StageFault(FaultKind::kBadNumbers, "numbers", "its answer is wrong: " + text);
}

// Throws if the check of the physics has found something.
void require_physics(const std::string& problem) {
  if (!problem.empty()) throw StageFault(FaultKind::kBadPhysics, "physics", "its answer breaks a law: " + problem);
}

// The columns of a request as its view takes them.
class RequestColumns {
 public:
  RequestColumns(const Arena& arena, const StageCall& call) {
    for (std::size_t i = 0; i < call.request.size(); ++i)
      columns_[i] = {arena.data(call.request[i]), arena.count(call.request[i])};
  }
  const gravitas_column* data() const { return columns_.data(); }

 private:
  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> columns_;
};

std::string at_row(const char* what, std::size_t row) { return std::string(what) + " of row " + std::to_string(row); }

void require_unit(std::span<const double> column, std::size_t components, const char* what) {
  const std::size_t row = first_not_unit(column, components);
  if (row != kNoRow) bad_numbers(at_row(what, row) + " is not of unit length");
}

// True if a row of two columns has the same bits.
bool same_row(std::span<const double> a, std::span<const double> b, std::size_t row, std::size_t components) {
  return std::memcmp(&a[row * components], &b[row * components], components * sizeof(double)) == 0;
}

}  // namespace

void Validator::check_structure_and_finiteness(const StageCall& call) const {
  std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> request, reply;
  for (std::size_t i = 0; i < call.request.size(); ++i) request[i] = arena_.count(call.request[i]);
  for (std::size_t i = 0; i < call.reply.size(); ++i) reply[i] = arena_.count(call.reply[i]);
  const stage::MethodInfo& method = call.info();
  const std::string problem =
      check_rows(method, {request.data(), call.request.size()}, {reply.data(), call.reply.size()});
  if (!problem.empty()) bad_structure(problem);
  for (std::size_t i = 0; i < call.reply.size(); ++i) {
    if (method.reply[i].type != stage::ElementType::kF64) continue;
    const std::size_t index = first_not_finite({reinterpret_cast<const double*>(arena_.data(call.reply[i])), reply[i]});
    if (index != kNoRow)
      bad_numbers(at_row(method.reply[i].name, index / method.reply[i].components) + " is not finite");
  }
}

Trusted<Wrenches> Validator::wrenches(const Untrusted<StageCall>& answer, const ForceAnswer& columns) const {
  check_structure_and_finiteness(answer.value_);
  for (std::size_t i = 0; i < columns.flags.size(); ++i)
    if (columns.flags[i] > (kConstantWrench | kHasPotential)) bad_structure(at_row("flags", i) + " has unknown bits");
  return Trusted<Wrenches>({});
}

Trusted<TrialState> Validator::trial_state(const Untrusted<StageCall>& answer, const StepData& data,
                                           const State& start) const {
  check_structure_and_finiteness(answer.value_);
  require_unit(data.trial_orientation.span(), 4, "orientation");
  for (std::size_t i = 0; i < model_.body_count; ++i) {
    if ((model_.flags[i] & (kMovable | kKinematic)) != 0) continue;
    if (!same_row(data.trial_position.span(), start.position.span(), i, 3) ||
        !same_row(data.trial_orientation.span(), start.orientation.span(), i, 4) ||
        !same_row(data.trial_linear_velocity.span(), start.linear_velocity.span(), i, 3) ||
        !same_row(data.trial_angular_velocity.span(), start.angular_velocity.span(), i, 3))
      bad_numbers("it moved the immovable body '" + model_.body_id[i] + "'");
  }
  if (samples_physics_) {
    const RequestColumns columns(arena_, answer.value_);
    require_physics(check_integration(stage::IntegratorIntegrateRequest(columns.data()),
                                      {data.trial_position.span(), data.trial_orientation.span(),
                                       data.trial_linear_velocity.span(), data.trial_angular_velocity.span()},
                                      told_));
  }
  return Trusted<TrialState>({});
}

void Validator::derivative_request(const StepData& data) const {
  const auto finite = [](const Column<double>& column) { return first_not_finite(column.span()) == kNoRow; };
  if (!finite(data.derivative_time) || !finite(data.derivative_position) || !finite(data.derivative_orientation) ||
      !finite(data.derivative_linear_velocity) || !finite(data.derivative_angular_velocity))
    bad_numbers("it asked for a derivative in a state that is not finite");
}

Trusted<Pairs> Validator::pairs(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  const std::span<const std::uint32_t> pair = data.pair.span();
  for (std::size_t i = 0; i < pair.size() / 2; ++i) {
    const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
    if (a >= b || b >= model_.body_count) bad_structure(at_row("pair", i) + " is not two bodies in order");
    if (((model_.flags[a] | model_.flags[b]) & kMovable) == 0 || (model_.flags[a] & model_.flags[b] & kHasShape) == 0)
      bad_structure(at_row("pair", i) + " is two bodies that cannot touch");
    if (i > 0 && !(std::make_pair(pair[2 * i - 2], pair[2 * i - 1]) < std::make_pair(a, b)))
      bad_structure(at_row("pair", i) + " is not in ascending order, or stands twice");
  }
  if (samples_physics_) {
    const RequestColumns columns(arena_, answer.value_);
    require_physics(pair_check_.check(stage::SpacePairsRequest(columns.data()), pair));
  }
  return Trusted<Pairs>({});
}

Trusted<Contacts> Validator::contacts(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  const std::uint64_t pairs = data.pair.size() / 2;
  for (std::size_t i = 0; i < data.contact_pair.size(); ++i) {
    if (data.contact_pair[i] >= pairs) bad_structure(at_row("contact_pair", i) + " is not one of the pairs asked for");
    if (i > 0 && !(std::make_pair(data.contact_pair[i - 1], data.contact_feature[i - 1]) <
                   std::make_pair(data.contact_pair[i], data.contact_feature[i])))
      bad_structure(at_row("contact", i) + " is not in ascending order of pair and feature, or stands twice");
  }
  require_unit(data.contact_normal.span(), 3, "normal");
  if (samples_physics_) {
    const RequestColumns columns(arena_, answer.value_);
    require_physics(check_contacts(stage::CollisionManifoldsRequest(columns.data()),
                                   {data.contact_pair.span(), data.contact_normal.span(), data.contact_point.span(),
                                    data.contact_depth.span(), data.contact_relative_velocity.span()}));
  }
  return Trusted<Contacts>({});
}

Trusted<Bound> Validator::bound(const Untrusted<StageCall>& answer, const ConstraintGroup& group) const {
  check_structure_and_finiteness(answer.value_);
  const std::span<const std::uint32_t> begin = group.bound_begin.span();
  if (begin.front() != 0 || begin.back() != group.bound.size() || !std::ranges::is_sorted(begin))
    bad_structure("bound_begin does not cut up bound");
  return Trusted<Bound>({});
}

Trusted<Discrepancies> Validator::discrepancies(const Untrusted<StageCall>& answer, const DiscrepancyAnswer& columns,
                                                std::span<const std::uint32_t> intact) const {
  check_structure_and_finiteness(answer.value_);
  for (std::size_t i = 0; i < columns.constraint.size(); ++i) {
    const std::uint32_t joint = columns.constraint[i];
    if (joint >= intact.size() || intact[joint] == 0)
      bad_structure(at_row("constraint", i) + " is no joint that holds");
    if (i > 0 && columns.constraint[i - 1] > joint) bad_structure(at_row("constraint", i) + " is out of order");
    if (!is_valid_mode(columns.mode[i])) bad_structure(at_row("mode", i) + " is unknown");
    if (!(columns.correction[i] >= 0.0 && columns.correction[i] <= 1.0))
      bad_numbers(at_row("correction", i) + " is outside 0 … 1");
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
      if (columns.lower[k] > columns.upper[k]) bad_numbers(at_row("lower", i) + " lies above upper");
      if (columns.compliance[k] < 0.0 || columns.damping[k] < 0.0 || columns.maximum_force[k] < 0.0)
        bad_numbers(at_row("compliance, damping or maximum_force", i) + " is negative");
    }
  }
  require_unit(columns.axes.span(), 4, "axes");
  return Trusted<Discrepancies>({});
}

Trusted<Reactions> Validator::reactions(const Untrusted<StageCall>& answer) const {
  check_structure_and_finiteness(answer.value_);
  return Trusted<Reactions>({});
}

Trusted<Solution> Validator::solution(const Untrusted<StageCall>& answer, const StepData& data) const {
  check_structure_and_finiteness(answer.value_);
  for (std::size_t i = 0; i < model_.body_count; ++i) {
    if ((model_.flags[i] & kMovable) != 0) continue;
    const std::span<const double> change = data.pose_change.span().subspan(6 * i, 6);
    if (!same_row(data.solved_linear_velocity.span(), data.trial_linear_velocity.span(), i, 3) ||
        !same_row(data.solved_angular_velocity.span(), data.trial_angular_velocity.span(), i, 3) ||
        std::ranges::any_of(change, [](double number) { return number != 0.0; }))
      bad_numbers("it pushed the body '" + model_.body_id[i] + "', which nothing can push");
  }

  require_unit(data.contact_direction.span(), 3, "contact_direction");
  for (std::size_t i = 0; i < data.contact_pair.size(); ++i) {
    const Vector3 impulse = vector_at(data.contact_impulse.span(), i);
    const Vector3 normal = vector_at(data.contact_direction.span(), i);
    const double* material = &data.contact_material[kMaterialColumns * i];
    const double along = normal.dot(impulse);
    const double tolerance = 1e-9 * impulse.norm();
    if (along < -tolerance) bad_numbers(at_row("contact_impulse", i) + " pulls the bodies together");
    const double friction = std::max(material[kStaticFriction], material[kDynamicFriction]);
    if ((impulse - along * normal).norm() > friction * along + tolerance)
      bad_numbers(at_row("contact_impulse", i) + " leaves the friction cone");
    if (data.contact_correction[i] < 0.0) bad_numbers(at_row("contact_correction", i) + " is negative");
  }
  for (std::size_t i = 0; i < data.discrepancies.mode.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t k = 3 * i + static_cast<std::size_t>(axis);
      if (axis_mode(data.discrepancies.mode[i], axis) == AxisMode::kUnilateral &&
          (data.discrepancy_impulse[k] < 0.0 || data.discrepancy_correction[k] < 0.0))
        bad_numbers(at_row("discrepancy_impulse", i) + " pulls along a one-sided axis");
    }
  }
  if (samples_physics_) {
    const RequestColumns columns(arena_, answer.value_);
    require_physics(solution_check_.check(
        stage::SolverSolveRequest(columns.data()),
        {data.solved_linear_velocity.span(), data.solved_angular_velocity.span(), data.pose_change.span(),
         data.discrepancy_impulse.span(), data.discrepancy_correction.span(), data.contact_impulse.span(),
         data.contact_correction.span(), data.contact_direction.span(), data.stop_reason[0]}));
  }
  return Trusted<Solution>({});
}

}  // namespace gravitas::kernel
