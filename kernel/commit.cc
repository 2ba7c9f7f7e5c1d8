// Stage::kCommit: the checked answers become S_{n+1} in the second state, the states are swapped, hashes
// follow. Nothing before the swap can be seen from outside.
#include <algorithm>
#include <utility>

#include "kernel/environment.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/merged_rows.h"

namespace gravitas::kernel {
namespace {

void copy(const Column<double>& from, const Column<double>& to) {
  // + 0.0 turns -0 into 0: the sign of a zero must not depend on which stages ran
  std::ranges::transform(from.span(), to.data(), [](double value) { return value + 0.0; });
}

}  // namespace

StepOutcome Environment::step() {
  if (fault_) return StepOutcome::kPaused;
  const std::uint64_t start = lap_ns_ = lap_ns();
  const CommitFigures figures = figures_;
  try {
    if (!is_idle_ || !wake_orders_.empty()) find_sleepers();
    for (StageSlot* slot : slots_) slot->begin_step(step_count_ + 1);
    times_finer_ = 1;
    for (;;) {
      if (has_new_forces_) ask_forces();  // also those of a step that was broken off
      make_inner_steps();
      if (!must_restart_) break;
      return_to_start();
      if (!std::exchange(has_newcomer_, false)) continue;
      times_finer_ = 1;
      find_sleepers();
    }
    finish_step();
  } catch (...) {
    return_to_start();
    has_newcomer_ = false;
    figures_ = figures;
    try {
      throw;
    } catch (const StageFault& fault) {
      fault_ = FaultRecord{step_count_ + 1, fault};
      std::erase_if(budgets_, [&](const SavedBudget& one) { return one.slot == fault.slot; });
    }
    return StepOutcome::kPaused;
  }
  step_profile_.add(lap_between(start, lap_ns_));
  if (commit_listener_ != nullptr) commit_listener_->on_commit(*this);
  return StepOutcome::kCommitted;
}

double Environment::time_of(std::uint32_t step) const {
  const bool is_whole = description_.last_time_step == description_.time_step;
  if (step < description_.steps || step == 0 || is_whole) return step * description_.time_step;
  return (description_.steps - 1) * description_.time_step + description_.last_time_step;
}

StateView Environment::state() const {
  return {front().position.span(), front().orientation.span(), front().linear_velocity.span(),
          front().angular_velocity.span()};
}

void Environment::write_trial(const Trusted<TrialState>&) {
  copy(data_.trial_position, back().position);
  copy(data_.trial_orientation, back().orientation);
  copy(data_.trial_linear_velocity, back().linear_velocity);
  copy(data_.trial_angular_velocity, back().angular_velocity);
  back().plugin_state.assign(data_.next_plugin_state);
  std::ranges::fill(back().state_changed.span(), 0U);
  complete_state();
}

void Environment::write_solution(const Trusted<Solution>&) {
  copy(data_.solved_linear_velocity, back().linear_velocity);
  copy(data_.solved_angular_velocity, back().angular_velocity);
  copy(data_.trial_position, back().position);
  copy(data_.trial_orientation, back().orientation);
  const double *solved_linear = data_.solved_linear_velocity.data(), *linear = data_.trial_linear_velocity.data();
  const double *solved_angular = data_.solved_angular_velocity.data(), *angular = data_.trial_angular_velocity.data();
  const double* const changes = data_.pose_change.data();
  const std::uint32_t *const flags = data_.flags.data(), *const flags_before = model_.flags.data();
  std::uint32_t* const state_changed = back().state_changed.data();
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    const double* const change = changes + 6 * i;
    bool moved = false, differs = flags[i] != flags_before[i];
    for (int k = 0; k < 6; ++k) moved |= change[k] != 0.0;
    for (std::uint32_t k = 3 * i; k < 3 * i + 3; ++k)
      differs |= (solved_linear[k] != linear[k]) | (solved_angular[k] != angular[k]);
    if (moved) {
      const Pose pose = displaced(pose_of(back().position, back().orientation, i),
                                  Vector3(change[0], change[1], change[2]), Vector3(change[3], change[4], change[5]));
      set_vector(back().position.span(), i, pose.position);
      set_quaternion(back().orientation.span(), i, Quaternion((pose.orientation.coeffs().array() + 0.0).matrix()));
    }
    state_changed[i] = moved | differs;
  }
  back().plugin_state.assign(data_.next_plugin_state);
  figures_ = {};
  remember_contacts();
  remember_joints();
  complete_state();
}

void Environment::complete_state() {
  if (model_.constraint_count > 0) update_joints();
  if (has_contacts()) find_touching();
  back().rested.assign(front().rested);
  back().rest_wrench.assign(front().rest_wrench);
}

void Environment::end_inner_step(std::span<const double> weights) {
  if (commit_listener_ != nullptr)
    commit_listener_->on_inner_step(*this, {inner_, data_, front(), back(), inner_end_time(), weights});
  std::swap(front_, back_);
  if (inner_ == 0 && states_.size() > 2) std::swap(back_, start_);
  ++inner_;
}

void Environment::return_to_start() {
  if (inner_ > 0) std::swap(front_, states_.size() > 2 ? start_ : back_);
  inner_ = 0;
  must_restart_ = false;
}

void Environment::finish_step() {
  // begun when the last answer had been checked
  const std::uint64_t start = lap_ns_;
  settle();
  is_idle_ = inner_ == 0;
  if (!is_idle_) state_hash_ = kernel::state_hash(front());
  inner_ = 0;
  is_anew_ = false;
  chain_hash_ = gravitas::chain_hash(chain_hash_, state_hash_);
  // what takes memory may fail: only now the state is S_{n+1}
  ++step_count_;
  wake_orders_.clear();
  budgets_.clear();
  for (StageSlot* slot : slots_)
    for (std::uint32_t row = 0; const Budget* budget = slot->budget_of(row); ++row)
      if (budget->failures > 0) budgets_.push_back({slot->which(), row, *budget});
  lap_ns_ = lap_ns();
  profile_[static_cast<std::size_t>(Stage::kCommit)].add(lap_between(start, lap_ns_));
}

// What is remembered of those who sleep goes on.
void Environment::remember_contacts() {
  const State& old = front();
  const auto key = [](const Column<std::uint32_t>& body, const Column<std::uint32_t>& feature) {
    return [&](std::size_t i) { return std::array{body[2 * i], body[2 * i + 1], feature[i]}; };
  };
  const auto goes_on = [&](std::size_t i) {
    return !is_awake(old.contact_body[2 * i]) && !is_awake(old.contact_body[2 * i + 1]);
  };
  merge_rows(data_.contact_key.size(), key(data_.contact_body, data_.contact_feature),
             sleepers_ > 0 ? old.contact_key.size() : 0, key(old.contact_body, old.contact_feature), goes_on, &merged_);
  copy_rows(merged_, 2, data_.contact_body, old.contact_body, back().contact_body);
  copy_rows(merged_, 1, data_.contact_feature, old.contact_feature, back().contact_feature);
  copy_rows(merged_, 1, data_.contact_key, old.contact_key, back().contact_key);
  copy_rows(merged_, 3, data_.contact_impulse, old.contact_impulse, back().contact_impulse);
  copy_rows(merged_, 1, data_.contact_correction, old.contact_correction, back().contact_correction);
}

void Environment::remember_joints() {
  const State& old = front();
  const Column<std::uint32_t>&now = data_.discrepancies.constraint, &before = old.discrepancy_constraint;
  const auto key = [](const Column<std::uint32_t>& joint) { return [&](std::size_t i) { return joint[i]; }; };
  const auto goes_on = [&](std::size_t i) { return sleeps(before[i]); };
  merge_rows(now.size(), key(now), sleepers_ > 0 ? before.size() : 0, key(before), goes_on, &merged_);
  copy_rows(merged_, 1, now, before, back().discrepancy_constraint);
  copy_rows(merged_, 3, data_.discrepancy_impulse, old.discrepancy_impulse, back().discrepancy_impulse);
  copy_rows(merged_, 3, data_.discrepancy_correction, old.discrepancy_correction, back().discrepancy_correction);
}

double Environment::inner_end_time() const {
  return inner_end_ == length_of_step(step_count_ + 1) ? time_of(step_count_ + 1) : time() + inner_end_;
}

}  // namespace gravitas::kernel
