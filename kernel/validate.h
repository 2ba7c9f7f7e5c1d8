// Nothing a plugin answers is used before it has been checked: an answer arrives as Untrusted<StageCall>, and
// only these functions make a Trusted<...> of it, which is what the next stage takes.
//
// Four layers: wire (the carrier's), structure (rows, ids, order, uniqueness) and numbers (finite, unit, signs, bounds of
// friction), always; every so many steps physics (plugin_sdk/physics_checks.h). A violation throws StageFault.
#pragma once

#include <cstdint>
#include <utility>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"
#include "kernel/model.h"
#include "kernel/state.h"
#include "kernel/step_data.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/physics_checks.h"

namespace gravitas::kernel {

// An answer that asks for more numbers than this in one column is taken for a fault.
inline constexpr std::uint64_t kLargestColumn = 1ULL << 30;

class Validator;

template <typename T>
class Untrusted {
 public:
  explicit Untrusted(T value) : value_(std::move(value)) {}

 private:
  friend class Validator;
  T value_;
};

// Proof that the columns named by T have been checked in this step.
template <typename T>
class Trusted {
 public:
  const T& operator*() const { return value_; }
  const T* operator->() const { return &value_; }

 private:
  friend class Validator;
  explicit Trusted(T value) : value_(std::move(value)) {}
  T value_;
};

struct Wrenches {};       // force_answers[group]
struct TrialState {};     // trial_*
struct Pairs {};          // pair
struct Impacts {};        // impact_*
struct Contacts {};       // contact_*
struct Bound {};          // bound of a constraint group
struct Discrepancies {};  // discrepancy_answers[group]
struct Reactions {};      // reaction, discrepancy_force
struct Solution {};       // solved_*, pose_change, multipliers

class Validator {
 public:
  // Of an answer that the contract says, so that nobody was asked; and what a missing defence says (self-tests).
  template <typename Checked>
  static Checked unchecked() {
    return Checked({});
  }

  // `check_physics_every` as in the description.
  Validator(const Arena& arena, const Model& model, std::uint32_t check_physics_every)
      : arena_(arena), model_(model), check_physics_every_(check_physics_every) {}

  // Answers are of this step from now on: whether their physics is looked at depends on it alone.
  void begin_step(std::uint32_t step) {
    samples_physics_ = check_physics_every_ > 0 && step % check_physics_every_ == 0;
  }

  Trusted<Wrenches> wrenches(const Untrusted<StageCall>& answer, const ForceAnswer& columns) const;
  Trusted<TrialState> trial_state(const Untrusted<StageCall>& answer, const StepData& data, const State& start) const;
  Trusted<Pairs> pairs(const Untrusted<StageCall>& answer, const StepData& data) const;
  Trusted<Impacts> impacts(const Untrusted<StageCall>& answer, const StepData& data) const;
  Trusted<Contacts> contacts(const Untrusted<StageCall>& answer, const StepData& data) const;
  Trusted<Bound> bound(const Untrusted<StageCall>& answer, const ConstraintGroup& group) const;
  Trusted<Discrepancies> discrepancies(const Untrusted<StageCall>& answer, const DiscrepancyAnswer& columns,
                                       std::span<const std::uint32_t> intact) const;
  Trusted<Wrenches> jacobians(const Untrusted<StageCall>& answer, const Column<std::uint32_t>& bodies,
                              std::uint64_t most) const;
  Trusted<Reactions> reactions(const Untrusted<StageCall>& answer) const;
  Trusted<Solution> solution(const Untrusted<StageCall>& answer, const StepData& data) const;
  // The trial state of a derivative request, which comes from a plugin too.
  void derivative_request(const StepData& data) const;

  // What an integrator is told while it is asked, against which its answer is held.
  void begin_integration() { told_.clear(); }
  void note_wrench(const Column<double>& wrench) {
    if (samples_physics_) told_.add(wrench.span());
  }

 private:
  void check_structure_and_finiteness(const StageCall& call) const;

  const Arena& arena_;
  const Model& model_;
  std::uint32_t check_physics_every_;
  bool samples_physics_ = false;
  WrenchRange told_;
  // scratch
  mutable RowCheck rows_;
  mutable PairCheck pair_check_;
  mutable SolutionCheck solution_check_;
};

}  // namespace gravitas::kernel
