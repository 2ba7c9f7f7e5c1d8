// Joints that break. One that would bear more than its BreakingForce or its BreakingTorque, or come open beyond its
// BreakingThreshold, bears nothing in the inner step that would ask for it, which is solved again without it: with its
// impulse, a thread would stop a truck. The most overloaded is the first to go, since that may relieve others; of joints
// that contradict each other the weakest. Where many break, more go at once.
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "plugin_sdk/joint_load.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

constexpr double kTorn = 1e150;    // N or N m, what one bears that is pulled apart: over whatever bound finite
constexpr std::size_t kToOne = 8;  // joints that have broken in the step, to one more that goes with the next

}  // namespace

bool Environment::write_what_joints_bear(const Trusted<TrialState>& trial, std::optional<Trusted<Solution>> solution) {
  while (solution) {
    const std::size_t before = broken_.size();
    write_solution(*solution);
    if (broken_.size() == before) return true;
    // without what has broken, which may have borne something as the step began
    if (knows_reactions() && may_jump_at_start()) find_start_velocities();
    solution = react(knows_reactions() ? integrate() : trial, true);
  }
  return false;
}

// Joint errors at S_{n+1}, and what is overloaded.
void Environment::update_joints() {
  std::ranges::copy(front().intact.span(), back().intact.data());
  for (const std::uint32_t joint : broken_) back().intact[joint] = 0;
  const bool contradicts = tells_contradiction(static_cast<StopReason>(data_.stop_reason[0]));
  std::vector<std::pair<double, std::uint32_t>> overloaded;  // by how much of what it bears, and joint
  const DiscrepancyAnswer& d = data_.discrepancies;
  const DiscrepancyColumns columns = d.columns();
  const std::span<const double> reactions = knows_reactions() ? data_.held_force.span() : std::span<double>();
  const auto body = [&](std::uint32_t i) {
    if (i == kNone) return JointBody{};
    return JointBody{pose_of(data_.trial_position, data_.trial_orientation, i),
                     pose_of(back().position, back().orientation, i), model_.inverse_mass[i],
                     vector_at(model_.inverse_inertia.span(), i), pose_of(front().position, front().orientation, i)};
  };
  for (std::size_t row = 0; row < columns.size();) {
    const std::size_t first = row;
    const std::uint32_t joint = d.constraint[first];
    const ConstraintDescription& description = model_.constraints[joint];
    while (row < columns.size() && d.constraint[row] == joint) ++row;
    const JointBody one = body(description.body1), two = body(description.body2);
    const JointRows rows{columns, data_.discrepancy_impulse.span(), first, row, reactions};
    // an impact at a stop of `Smooth` has an inner step of its own
    const double h = knows_reactions() ? length_of_step(step_count_ + 1) : data_.time_step[0];
    const auto share = [](double of, double most) { return most > 0.0 ? of / most : 0.0; };
    const double force = description.breaking_force, torque = description.breaking_torque;
    const double threshold = description.breaking_threshold;
    const bool may_tear = force > 0.0 || torque > 0.0;
    const JointLoad load = may_tear ? joint_load(rows, one, h) : JointLoad{};
    const bool is_torn = contradicts && may_tear && is_pulled_apart(rows, one, two);
    const double overload =
        std::max({share(is_torn ? kTorn : load.force, force), share(is_torn ? kTorn : load.torque, torque),
                  threshold > 0.0 ? opening(rows, one, two, h) / threshold : 0.0});
    if (overload > 1.0) overloaded.emplace_back(-overload, joint);
    figures_.joint_error = std::max(figures_.joint_error, joint_error(rows, one, two));
  }
  const std::size_t at_once = std::min(overloaded.size(), 1 + broken_.size() / kToOne);
  std::ranges::sort(overloaded);
  for (std::size_t i = 0; i < at_once; ++i) broken_.push_back(overloaded[i].second);
}

}  // namespace gravitas::kernel
