// A committed state out of an environment, and back into a new one. What comes back is taken for hostile: every count,
// index and number is checked before anything is used. The columns are read into the second state, which nobody sees,
// and the states are swapped when all is well, as in a commit.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <tuple>

#include "kernel/environment.h"
#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"

namespace gravitas::kernel {
namespace {

std::string at_row(const std::string& what, std::size_t row) { return "row " + std::to_string(row) + " of " + what; }

// Reads columns into a state; returns the first that has another name, type or length than the state's should.
class ColumnReader {
 public:
  // `like`: a state of the same environment.
  ColumnReader(std::span<const SavedColumn> saved, const Model& model, const State& like) : saved_(saved) {
    rows_[static_cast<std::size_t>(StateRows::kBody)] = model.body_count;
    rows_[static_cast<std::size_t>(StateRows::kJoint)] = model.constraint_count;
    rows_[static_cast<std::size_t>(StateRows::kRest)] = like.rested.size();
    rows_[static_cast<std::size_t>(StateRows::kWrench)] = like.rest_wrench.size() / 6;
  }

  std::string read_into(const State& state) {
    state.visit_columns([this](const auto&... column) { read(column...); });
    if (problem_.empty() && next_ != saved_.size()) problem_ = "there are more columns than a state has";
    return problem_;
  }

 private:
  static constexpr std::uint64_t kUnknown = ~std::uint64_t{0};

  void fail(std::string problem) { problem_ = std::move(problem); }

  template <typename T>
  void read(const std::string& name, StateRows rows, std::uint32_t components, const Column<T>& column) {
    if (!problem_.empty()) return;
    const std::span<const T>* numbers = nullptr;
    if (next_ < saved_.size() && saved_[next_].name == name)
      numbers = std::get_if<std::span<const T>>(&saved_[next_].numbers);
    ++next_;
    if (numbers == nullptr) return fail("the column " + name + " is missing, out of order or of another type");
    const std::uint64_t count = numbers->size() / components;
    std::uint64_t& expected = rows_[static_cast<std::size_t>(rows)];
    if (expected == kUnknown) expected = count;
    if (numbers->size() != count * components || count != expected || count > kLargestColumn)
      return fail("the column " + name + " has " + std::to_string(numbers->size()) + " numbers, not " +
                  std::to_string(components) + " for each of " + std::to_string(expected) + " rows");
    if constexpr (std::is_same_v<T, double>)
      if (const std::size_t bad = first_not_finite(*numbers); bad != kNoRow)
        return fail(at_row(name, bad / components) + " is not finite");
    column.assign(*numbers);
  }

  std::span<const SavedColumn> saved_;
  std::size_t next_ = 0;
  std::array<std::uint64_t, 8> rows_ = {0, 0, kUnknown, kUnknown, kUnknown, kUnknown, 0, 0};
  std::string problem_;
};

bool are_flags(std::span<const std::uint32_t> column) {
  return std::ranges::all_of(column, [](std::uint32_t flag) { return flag <= 1; });
}

// Bodies and joints; `initial` is where the bodies that nothing moves must still be.
std::string find_wrong_body(const State& state, const State& initial, const Model& model) {
  if (const std::size_t row = first_not_unit(state.orientation.span(), 4); row != kNoRow)
    return at_row("orientation", row) + " is not of unit length";
  if (!are_flags(state.intact.span())) return "intact is neither 0 nor 1";
  if (!are_flags(state.state_changed.span())) return "state_changed is neither 0 nor 1";
  const std::size_t moved = first_changed_body(model.flags.span(), kMovable | kKinematic, [&] {
    return std::array{ColumnPair{state.position.span(), initial.position.span()},
                      ColumnPair{state.orientation.span(), initial.orientation.span()},
                      ColumnPair{state.linear_velocity.span(), initial.linear_velocity.span()},
                      ColumnPair{state.angular_velocity.span(), initial.angular_velocity.span()}};
  });
  if (moved != kNoRow) return "the immovable body '" + model.body_id[moved] + "' has moved";
  const std::uint32_t sleeper = find_wrong_sleeper(bodies_at_rest(model, state), state.rested.span());
  return sleeper == kNone ? "" : "the body '" + model.body_id[sleeper] + "' sleeps, and may not or moves";
}

// What is remembered of contacts, joints and pairs that touch.
std::string find_wrong_memory(const State& state, const Model& model, bool has_contacts) {
  if (!has_contacts && (state.contact_key.size() > 0 || state.touching.size() > 0))
    return "there are contacts, and nothing can touch";
  const AnswerProblem contacts = check_remembered_contacts(state.contact_body.span(), state.contact_feature.span(),
                                                           state.contact_correction.span(), model.flags.span());
  if (!contacts.text.empty()) return contacts.text;
  for (std::size_t i = 0; i < state.discrepancy_constraint.size(); ++i) {
    const std::uint32_t joint = state.discrepancy_constraint[i];
    if (joint >= model.constraint_count || (i > 0 && joint < state.discrepancy_constraint[i - 1]))
      return at_row("discrepancy_constraint", i) + " is no joint, or out of order";
  }
  const std::string problem = check_pairs(state.touching.span(), model.flags.span()).text;
  if (!problem.empty()) return "of the pairs that touch, " + problem;
  return {};
}

}  // namespace

double Environment::length_of_step(std::uint32_t step) const {
  if (step == 0) return 0.0;
  return step == description_.steps ? description_.last_time_step : description_.time_step;
}

SavedState Environment::saved_state() const {
  SavedState saved{step_count_, length_of_step(step_count_), is_anew_, state_hash_, chain_hash_, figures_, wake_orders_,
                   {}};
  saved.budgets = budgets_;
  front().visit_columns([&](const char* name, StateRows, std::uint32_t, const auto& column) {
    saved.columns.push_back({name, std::span(column.data(), column.size())});
  });
  return saved;
}

// What identifies the state, against the description.
std::string Environment::find_misfit(const SavedState& saved) const {
  if (step_count_ != 0) return "this environment has made steps of its own";
  if (saved.step > description_.steps)
    return "it is the state after step " + std::to_string(saved.step) + ", and the run has " +
           std::to_string(description_.steps);
  if (saved.step_length != length_of_step(saved.step))
    return "the last step before it took " + std::to_string(saved.step_length) + " s, and in this run step " +
           std::to_string(saved.step) + " takes " + std::to_string(length_of_step(saved.step)) +
           " s: a shortened last step can neither be continued nor be made of a whole one";
  for (const double figure : {saved.figures.penetration, saved.figures.joint_error})
    if (!std::isfinite(figure) || figure < 0.0) return "its overlap or joint error is impossible";
  for (const std::uint32_t body : saved.wake_orders)
    if (body >= model_.body_count) return "it wakes a body that there is not";
  if (saved.step == 0 && !(saved.state_hash == state_hash_)) return "it is another initial state";
  return {};
}

std::string Environment::restore(const SavedState& saved) {
  std::string problem = find_misfit(saved);
  if (!problem.empty()) return problem;
  // swaps are made where they were; what was swapped in shortly before is on probation still
  std::set<std::uint32_t> begun;
  for (const SwapRecord& swap : swaps()) begun.insert(std::min(swap.step, saved.step));
  for (std::uint32_t step = saved.step - std::min(saved.step, SlotHost::kProbation); step <= saved.step; ++step)
    begun.insert(step);
  for (const std::uint32_t step : begun)
    for (StageSlot* slot : slots_) slot->begin_step(step);
  problem = ColumnReader(saved.columns, model_, front()).read_into(back());
  if (problem.empty()) problem = find_wrong_body(back(), front(), model_);
  if (problem.empty()) problem = find_wrong_memory(back(), model_, has_contacts());
  if (problem.empty() && !(kernel::state_hash(back()) == saved.state_hash))
    problem = "its poses and velocities are not those of its hash";
  if (!problem.empty()) {
    // the second state as it was
    ColumnReader(saved_state().columns, model_, front()).read_into(back());
    return problem;
  }
  for (const SavedBudget& one : budgets_ = saved.budgets)
    if (Budget* budget = slot_of(one.slot).budget_of(one.target)) *budget = one.budget;
  std::swap(front_, back_);
  is_idle_ = false;
  wake_orders_ = saved.wake_orders;
  step_count_ = saved.step;
  is_anew_ = saved.is_anew;
  figures_ = saved.figures;
  state_hash_ = saved.state_hash;
  chain_hash_ = saved.chain_hash;
  return {};
}

}  // namespace gravitas::kernel
