// Nothing a plugin answers is used before it has been checked: an answer arrives as Untrusted<StageCall>, and
// only these functions make a Trusted<...> of it, which is what the next stage takes.
//
// Three layers, always: wire (the carrier's: sizes, epoch, digest), structure (rows, ids, order, uniqueness),
// numbers (finite, unit, signs, friction cone). A violation throws StageFault.
#pragma once

#include <cstdint>
#include <utility>

#include "kernel/carrier/carrier.h"
#include "kernel/fault.h"
#include "kernel/model.h"
#include "kernel/state.h"
#include "kernel/step_data.h"

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
struct Contacts {};       // contact_*
struct Bound {};          // bound of a constraint group
struct Discrepancies {};  // discrepancy_answers[group]
struct Solution {};       // solved_*, pose_change, multipliers

class Validator {
 public:
  Validator(const Arena& arena, const Model& model) : arena_(arena), model_(model) {}

  Trusted<Wrenches> wrenches(const Untrusted<StageCall>& answer, const ForceAnswer& columns) const;
  Trusted<TrialState> trial_state(const Untrusted<StageCall>& answer, const StepData& data, const State& start) const;
  Trusted<Pairs> pairs(const Untrusted<StageCall>& answer, const StepData& data) const;
  Trusted<Contacts> contacts(const Untrusted<StageCall>& answer, const StepData& data) const;
  Trusted<Bound> bound(const Untrusted<StageCall>& answer, const ConstraintGroup& group) const;
  Trusted<Discrepancies> discrepancies(const Untrusted<StageCall>& answer, const DiscrepancyAnswer& columns,
                                       std::span<const std::uint32_t> intact) const;
  Trusted<Solution> solution(const Untrusted<StageCall>& answer, const StepData& data) const;
  // The trial state of a derivative request, which comes from a plugin too.
  void derivative_request(const StepData& data) const;

 private:
  void check_structure_and_finiteness(const StageCall& call) const;

  const Arena& arena_;
  const Model& model_;
};

}  // namespace gravitas::kernel
