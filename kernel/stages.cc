// The stages between S_n and the solver's answer: each asks its slot and checks what comes back.
#include <algorithm>
#include <utility>

#include "kernel/environment.h"
#include "plugin_sdk/contact_key.h"
#include "plugin_sdk/math/motion.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
void Environment::book_call(Stage stage, StageSlot* slot, std::uint64_t start, const CallTimes& times) {
  const std::uint64_t end = lap_ns();
  // what failed before it is no measure of how long a call takes, nor what others took in derivatives
  const std::uint64_t total = lap_between(times.begin != 0 ? times.begin : start, end);
  const std::uint64_t own = total - (stage == Stage::kIntegrate ? std::min(total, std::exchange(nested_ns_, 0)) : 0);
  check_begin_ns_ = end - times.check;
  profile_[static_cast<std::size_t>(stage)].add(lap_between(start, end));
  if (slot->description().hosting == Hosting::kDirect &&
      static_cast<double>(own) > 1e9 * slot->description().deadline) {
    std::uint64_t& longest = overrun_ns_[static_cast<std::size_t>(stage)];
    longest = std::max(longest, own);
  }
  if (times.compute > 0) transport_[static_cast<std::size_t>(stage)].add(total - std::min(total, times.compute));
  slot->note_duration(own);
}

void Environment::book_check(Stage stage) {
  lap_ns_ = lap_ns();
  validation_[static_cast<std::size_t>(stage)].add(lap_between(check_begin_ns_, lap_ns_));
}

std::vector<std::string> Environment::warnings() {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < overrun_ns_.size(); ++i)
    if (overrun_ns_[i] > 0)
      lines.push_back(std::string("stage ") + kStageNames[i] + " took " + std::to_string(overrun_ns_[i] / 1'000'000) +
                      " ms in a call, longer than its deadline; direct hosting cannot interrupt it");
  if (const auto [turn, body] = std::exchange(turned_far_, {}); turn > 0.0) lines.push_back(why_turned_far(turn, body));
  if (const auto [share, step] = std::exchange(taken_by_joints_, {}); share > 0.0)
    lines.push_back(why_joints_took(share, step));
  if (const auto [n, step] = std::exchange(refused_trials_, {}); n > 0) lines.push_back(why_shortened(n, step));
  for (StageSlot* slot : slots_)
    for (const std::string& complaint : slot->take_complaints())
      lines.push_back(std::string("worker of slot ") + slot_name(slot->which()) + ": " + complaint);
  return lines;
}

Pose Environment::pose_of(const Column<double>& position, const Column<double>& orientation, std::uint32_t body) const {
  return body == kNone ? Pose{} : Pose{vector_at(position.span(), body), quaternion_at(orientation.span(), body)};
}

Trusted<TrialState> Environment::integrate(bool may_be_refused) {
  const Column<double>& wrench = data_.wrench_is_constant[0] != 0 ? data_.wrench : data_.no_wrench;
  const auto request =
      ids(data_.time, data_.time_step, data_.wrench_is_constant, data_.flags, data_.inverse_mass, model_.inertia,
          data_.inverse_inertia, model_.damping, wrench, front().position, front().orientation, start_linear_velocity(),
          start_angular_velocity(), front().plugin_state, front().state_changed, data_.jacobian_blocks);
  const auto reply = ids(data_.trial_position, data_.trial_orientation, data_.trial_linear_velocity,
                         data_.trial_angular_velocity, data_.error_estimate, data_.next_plugin_state);
  StageCall call{stage::Method::kIntegratorIntegrate, 0, request, reply};
  call.may_be_refused = may_be_refused;
  DerivativeSource* derivatives = data_.wrench_is_constant[0] != 0 ? nullptr : this;
  const auto trial = ask(Stage::kIntegrate, &integrator_, call, derivatives,
                         [&](const auto& answer) { return validator_.trial_state(answer, data_, front()); });
  data_.trial_time[0] = inner_end_time();
  follow_motion(data_.trial_time[0], data_.trial_position, data_.trial_orientation, data_.trial_linear_velocity,
                data_.trial_angular_velocity);
  return trial;
}

void Environment::follow_motion(double time, const Column<double>& position, const Column<double>& orientation,
                                const Column<double>& linear_velocity, const Column<double>& angular_velocity) const {
  for (const auto& [body, curve] : model_.curves) {
    const MotionCurve::State state = curve.at(time);
    set_vector(position.span(), body, state.pose.position);
    set_quaternion(orientation.span(), body, state.pose.orientation);
    set_vector(linear_velocity.span(), body, state.twist.linear);
    set_vector(angular_velocity.span(), body, state.twist.angular);
  }
}

// World bounds at S*, widened so that pairs up to the margin apart overlap.
Bounds Environment::trial_bounds(std::uint32_t body) const {
  return widened(bounds_of(model_.bound[body], pose_of(data_.trial_position, data_.trial_orientation, body)),
                 0.5 * data_.margin[0]);
}

void Environment::bound_bodies(const Trusted<TrialState>&) {
  const std::uint64_t start = lap_ns();
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    const Bounds bounds = trial_bounds(i);
    set_vector(data_.lower.span(), i, bounds.lower);
    set_vector(data_.upper.span(), i, bounds.upper);
  }
  profile_[static_cast<std::size_t>(Stage::kBound)].add(lap_between(start, lap_ns()));
}

// How the bodies get from S_n to S*, and bounds of all that they pass.
void Environment::bound_motions(const Trusted<TrialState>&, double length) {
  const std::uint64_t start = lap_ns();
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    const Pose from = pose_of(front().position, front().orientation, i);
    const Pose to = pose_of(data_.trial_position, data_.trial_orientation, i);
    const Motion motion = motion_between(
        from, to,
        0.5 * length *
            (vector_at(start_angular_velocity().span(), i) + vector_at(data_.trial_angular_velocity.span(), i)));
    set_vector(data_.displacement.span(), i, motion.displacement);
    set_vector(data_.rotation.span(), i, motion.rotation);
    const Bounds bounds = widened(swept_bounds(model_.bound[i], from, to, motion.rotation), 0.5 * margin_);
    set_vector(data_.lower.span(), i, bounds.lower);
    set_vector(data_.upper.span(), i, bounds.upper);
  }
  profile_[static_cast<std::size_t>(Stage::kBound)].add(lap_between(start, lap_ns()));
}

Trusted<Pairs> Environment::find_pairs() {
  const auto request = ids(data_.lower, data_.upper, model_.flags, model_.filter_group, model_.filter_mask);
  const auto reply = ids(data_.pair);
  const auto pairs = ask(Stage::kBroadPhase, &space_, {stage::Method::kSpacePairs, 0, request, reply}, nullptr,
                         [&](const auto& answer) { return validator_.pairs(answer, data_); });
  if (sleepers_ > 0) leave_out_sleepers();
  if (arbiter_ != nullptr) data_.pair.resize(arbiter_->keep_allowed(*this, data_.pair.span()));
  return pairs;
}

void Environment::leave_empty(std::span<const ColumnId> reply) {
  for (const ColumnId column : reply) arena_.set_count(column, 0);
}

void Environment::find_impacts(const Trusted<Pairs>&) {
  const auto request =
      ids(data_.target_gap, model_.shape_hash, model_.shape_type, model_.shape_parameter_begin, model_.shape_parameter,
          model_.body_shape, model_.geometry_position, model_.geometry_orientation, front().position,
          front().orientation, data_.displacement, data_.rotation, data_.pair);
  const auto reply =
      ids(data_.impact_pair, data_.impact_fraction, data_.impact_normal, data_.impact_point, data_.impact_depth);
  if (data_.pair.size() == 0 && collision_.may_be_spared()) return leave_empty(reply);
  ask(Stage::kNarrowPhase, &collision_, {stage::Method::kCollisionTimesOfImpact, 0, request, reply}, nullptr,
      [&](const auto& answer) { return validator_.impacts(answer, data_); });
}

Trusted<Contacts> Environment::find_contacts(const Trusted<Pairs>&) {
  const auto request =
      ids(data_.margin, model_.shape_hash, model_.shape_type, model_.shape_parameter_begin, model_.shape_parameter,
          model_.body_shape, model_.geometry_position, model_.geometry_orientation, data_.trial_position,
          data_.trial_orientation, data_.trial_linear_velocity, data_.trial_angular_velocity, data_.pair);
  const auto reply = ids(data_.contact_pair, data_.contact_feature, data_.contact_normal, data_.contact_point,
                         data_.contact_depth, data_.contact_relative_velocity);
  if (data_.pair.size() == 0 && collision_.may_be_spared()) {
    leave_empty(reply);
    return Validator::unchecked<Trusted<Contacts>>();
  }
  const StageCall call{stage::Method::kCollisionManifolds, 0, request, reply};
  return ask(Stage::kNarrowPhase, &collision_, call, nullptr,
             [&](const auto& answer) { return validator_.contacts(answer, data_); });
}

// Bodies, material row, key and warm start of each contact. Both this step's contacts and the remembered ones
// are in the order (a, b, feature), so one walk matches them.
void Environment::look_up_contacts(const Trusted<Contacts>&) {
  const std::size_t count = data_.contact_pair.size();
  data_.contact_body.resize(2 * count);
  data_.contact_key.resize(count);
  data_.contact_material.resize(kMaterialColumns * count);
  data_.contact_warm_impulse.resize(3 * count);
  data_.contact_warm_correction.resize(count);
  const State& old = front();
  std::size_t o = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t a = data_.pair[2 * data_.contact_pair[i]], b = data_.pair[2 * data_.contact_pair[i] + 1];
    const std::uint32_t feature = data_.contact_feature[i];
    data_.contact_body[2 * i] = a;
    data_.contact_body[2 * i + 1] = b;
    const double* material =
        &model_.material_pairs[kMaterialColumns * (model_.material[a] * model_.material_count + model_.material[b])];
    std::copy_n(material, kMaterialColumns, &data_.contact_material[kMaterialColumns * i]);

    const std::array<std::uint32_t, 3> identity = {a, b, feature};
    const auto remembered = [&](std::size_t row) {
      return std::array{old.contact_body[2 * row], old.contact_body[2 * row + 1], old.contact_feature[row]};
    };
    while (o < old.contact_key.size() && remembered(o) < identity) ++o;
    const bool known = o < old.contact_key.size() && remembered(o) == identity;
    data_.contact_key[i] = known ? old.contact_key[o] : new_contact_key(a, b, feature, step_count_, inner_);
    data_.contact_warm_correction[i] = known ? old.contact_correction[o] : 0.0;
    set_vector(data_.contact_warm_impulse.span(), i,
               known ? vector_at(old.contact_impulse.span(), o) : Vector3::Zero());
  }
  if (arbiter_ != nullptr) arbiter_->mix_materials(data_.contact_body.span(), data_.contact_material.span());
}

void Environment::ask_discrepancies(const Column<double>& time, const Column<double>& position,
                                    const Column<double>& orientation, const Column<double>& linear_velocity,
                                    const Column<double>& angular_velocity) {
  for (std::size_t g = 0; g < model_.constraint_groups.size(); ++g) {
    const ConstraintGroup& group = model_.constraint_groups[g];
    const Column<std::uint32_t>& intact = data_.group_intact[g];
    for (std::size_t i = 0; i < group.row.size(); ++i)
      intact[i] = front().intact[group.row[i]] != 0 && !has_broken(group.row[i]) && !sleeps(group.row[i]) ? 1 : 0;
    const auto request = ids(time, data_.time_step, group.type, group.body, group.bound_begin, group.bound, intact,
                             position, orientation, linear_velocity, angular_velocity, data_.inverse_mass,
                             data_.inverse_inertia, start_angular_velocity(), data_.time);
    const std::vector<ColumnId>& reply = discrepancy_reply_[g];
    const StageCall call{stage::Method::kConstraintDiscrepancies, group.target, request, reply};
    ask(Stage::kConstrain, &constraint_, call, nullptr, [&](const auto& answer) {
      return validator_.discrepancies(answer, data_.discrepancy_answers[g], intact.span());
    });
  }
  merge_discrepancies();
}

// All groups' discrepancies in the order of the scene's joints, with their bodies and warm start.
void Environment::merge_discrepancies() {
  const DiscrepancyAnswer& merged = data_.discrepancies;
  std::size_t count = 0;
  for (const DiscrepancyAnswer& answer : data_.discrepancy_answers) count += answer.constraint.size();
  merged.resize(count);
  data_.discrepancy_body.resize(2 * count);
  data_.discrepancy_warm_impulse.resize(3 * count);
  data_.discrepancy_warm_correction.resize(3 * count);
  std::vector<std::size_t>& next = next_in_group_;
  next.assign(model_.constraint_groups.size(), 0);
  const State& old = front();
  std::size_t row = 0, o = 0;
  for (std::uint32_t joint = 0; joint < model_.constraint_count; ++joint) {
    const ConstraintDescription& description = model_.constraints[joint];
    const std::size_t first = row;
    for (std::size_t g = 0; g < model_.constraint_groups.size(); ++g) {
      const DiscrepancyAnswer& answer = data_.discrepancy_answers[g];
      const ConstraintGroup& group = model_.constraint_groups[g];
      for (; next[g] < answer.constraint.size() && group.row[answer.constraint[next[g]]] == joint; ++next[g], ++row) {
        merged.copy_row(row, answer, next[g]);
        merged.constraint[row] = joint;
        data_.discrepancy_body[2 * row] = description.body1;
        data_.discrepancy_body[2 * row + 1] = description.body2;
      }
    }
    // a joint that answers with another number of discrepancies than last time starts cold
    std::size_t remembered = 0;
    while (o < old.discrepancy_constraint.size() && old.discrepancy_constraint[o] < joint) ++o;
    while (o + remembered < old.discrepancy_constraint.size() && old.discrepancy_constraint[o + remembered] == joint)
      ++remembered;
    const bool warm = remembered == row - first;
    for (std::size_t i = first; i < row; ++i) {
      const std::size_t source = o + (i - first);
      set_vector(data_.discrepancy_warm_impulse.span(), i,
                 warm ? vector_at(old.discrepancy_impulse.span(), source) : Vector3::Zero());
      set_vector(data_.discrepancy_warm_correction.span(), i,
                 warm ? vector_at(old.discrepancy_correction.span(), source) : Vector3::Zero());
    }
  }
}

Trusted<Solution> Environment::solve() {
  const DiscrepancyAnswer& joints = data_.discrepancies;
  const Column<double>& wrench = wrench_is_constant_ ? data_.wrench : data_.start_wrench;
  const auto request =
      ids(data_.time_step, data_.theta, data_.flags, data_.inverse_mass, data_.inverse_inertia, front().position,
          front().orientation, start_linear_velocity(), start_angular_velocity(), data_.trial_position,
          data_.trial_orientation, data_.trial_linear_velocity, data_.trial_angular_velocity, wrench,
          data_.discrepancy_body, joints.point1, joints.point2, joints.velocity, joints.correction, joints.axes,
          joints.mode, joints.lower, joints.upper, joints.compliance, joints.damping, joints.maximum_force,
          data_.discrepancy_warm_impulse, data_.discrepancy_warm_correction, data_.contact_body, data_.contact_normal,
          data_.contact_point, data_.contact_depth, data_.contact_key, data_.contact_material,
          data_.contact_warm_impulse, data_.contact_warm_correction, data_.held_force, joints.restitution);
  const auto reply =
      ids(data_.solved_linear_velocity, data_.solved_angular_velocity, data_.pose_change, data_.discrepancy_impulse,
          data_.discrepancy_correction, data_.contact_impulse, data_.contact_correction, data_.contact_direction,
          data_.iterations, data_.residual, data_.stop_reason, data_.contact_turning);
  // a solver answers a row per discrepancy and contact: make room, so that it is not asked twice
  const std::size_t discrepancies = joints.mode.size(), contacts = data_.contact_key.size();
  for (const Column<double>* column : {&data_.discrepancy_impulse, &data_.discrepancy_correction})
    column->resize(3 * discrepancies);
  for (const Column<double>* column : {&data_.contact_impulse, &data_.contact_direction, &data_.contact_turning})
    column->resize(3 * contacts);
  data_.contact_correction.resize(contacts);
  if (discrepancies + contacts == 0 && solver_.may_be_spared()) {
    // without joints and contacts S* stands
    data_.solved_linear_velocity.assign(data_.trial_linear_velocity);
    data_.solved_angular_velocity.assign(data_.trial_angular_velocity);
    data_.pose_change.resize(6 * model_.body_count);
    std::ranges::fill(data_.pose_change.span(), 0.0);
    data_.iterations[0] = data_.stop_reason[0] = 0;
    data_.residual[0] = 0.0;
    return Validator::unchecked<Trusted<Solution>>();
  }
  return ask(Stage::kSolve, &solver_, {stage::Method::kSolverSolve, 0, request, reply}, nullptr,
             [&](const auto& answer) { return validator_.solution(answer, data_); });
}

}  // namespace gravitas::kernel
