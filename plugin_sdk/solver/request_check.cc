// The checks of a request, column by column in the order of the message.
#include "plugin_sdk/solver/request_check.h"

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas {
namespace {

constexpr double kUnitTolerance = 1e-6;

[[noreturn]] void refuse(const char* column, std::size_t row, const std::string& why) {
  throw Refusal(std::string(column) + ", row " + std::to_string(row) + ": " + why);
}

template <typename T>
void check_length(const char* column, std::span<const T> values, std::size_t rows, std::size_t components) {
  if (values.size() == rows * components) return;
  throw Refusal(std::string(column) + ": " + counted(values.size(), "number") + " where " + counted(rows, "row") +
                " of " + std::to_string(components) + " belong");
}

// A column of finite numbers, none below `least`.
void check_numbers(const char* column, std::span<const double> values, std::size_t rows, std::size_t components,
                   double least = -kUnlimited, double most = kUnlimited) {
  check_length(column, values, rows, components);
  if (least == -kUnlimited && most == kUnlimited && first_not_finite(values) == kNoRow) return;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double value = values[i];
    if (value >= least && value <= most) continue;
    const std::string text = std::to_string(value);
    refuse(column, i / components, std::isfinite(value) ? text + " is out of range" : text + " is not finite");
  }
}

void check_unit(const char* column, std::span<const double> values, std::size_t rows, std::size_t components) {
  check_numbers(column, values, rows, components);
  for (std::size_t row = 0; row < rows; ++row) {
    double square = 0.0;
    for (std::size_t i = 0; i < components; ++i) square += values[components * row + i] * values[components * row + i];
    const double norm = std::sqrt(square);
    if (!(std::fabs(norm - 1.0) <= kUnitTolerance))
      refuse(column, row, "of norm " + std::to_string(norm) + ", not unit");
  }
}

void check_pairs(const char* column, std::span<const std::uint32_t> values, std::size_t rows, std::size_t bodies,
                 bool may_be_world) {
  check_length(column, values, rows, 2);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] < bodies || (may_be_world && values[i] == kNone)) continue;
    refuse(column, i / 2, "body " + std::to_string(values[i]) + " of " + std::to_string(bodies) + " does not exist");
  }
  for (std::size_t row = 0; row < rows; ++row) {
    if (values[2 * row] == values[2 * row + 1])
      refuse(column, row, "body " + std::to_string(values[2 * row]) + " is paired with itself");
  }
}

template <typename Request>
void check_masses(const Request& r, std::size_t bodies) {
  check_numbers("inverse_mass", r.inverse_mass(), bodies, 1, 0.0);
  check_numbers("inverse_inertia", r.inverse_inertia(), bodies, 3, 0.0);
}

template <typename Request>
void check_state(const Request& r, std::size_t bodies) {
  check_numbers("position", r.position(), bodies, 3);
  check_unit("orientation", r.orientation(), bodies, 4);
  check_numbers("linear_velocity", r.linear_velocity(), bodies, 3);
  check_numbers("angular_velocity", r.angular_velocity(), bodies, 3);
}

void check_bodies(const stage::SolverSolveRequest& r, std::size_t bodies) {
  check_masses(r, bodies);
  check_state(r, bodies);
  check_numbers("trial_position", r.trial_position(), bodies, 3);
  check_unit("trial_orientation", r.trial_orientation(), bodies, 4);
  check_numbers("trial_linear_velocity", r.trial_linear_velocity(), bodies, 3);
  check_numbers("trial_angular_velocity", r.trial_angular_velocity(), bodies, 3);
  check_numbers("wrench", r.wrench(), bodies, 6);
}

// The columns that both questions have. `marks`: what a mode may carry beside what constraints answer.
template <typename Request>
void check_discrepancies(const Request& r, std::size_t bodies, std::uint32_t marks) {
  const std::size_t rows = r.mode().size();
  check_pairs("discrepancy_body", r.discrepancy_body(), rows, bodies, true);
  check_numbers("point1", r.point1(), rows, 3);
  check_numbers("point2", r.point2(), rows, 3);
  check_numbers("velocity", r.velocity(), rows, 3);
  check_numbers("correction", r.correction(), rows, 1, 0.0, 1.0);
  check_unit("axes", r.axes(), rows, 4);
  check_numbers("lower", r.lower(), rows, 3);
  check_numbers("upper", r.upper(), rows, 3);
  check_numbers("compliance", r.compliance(), rows, 3, 0.0);
  check_numbers("damping", r.damping(), rows, 3, 0.0);
  check_numbers("maximum_force", r.maximum_force(), rows, 3, 0.0);
  for (std::size_t row = 0; row < rows; ++row) {
    if (!is_valid_mode(r.mode()[row] & ~marks)) refuse("mode", row, std::to_string(r.mode()[row]) + " is no mode");
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t i = 3 * row + static_cast<std::size_t>(axis);
      if (axis_mode(r.mode()[row], axis) == AxisMode::kLimited && r.lower()[i] > r.upper()[i])
        refuse("lower", row, "above upper along axis " + std::to_string(axis));
    }
  }
}

void check_contacts(const stage::SolverSolveRequest& r, std::size_t bodies) {
  const std::size_t rows = r.contact_key().size();
  check_pairs("contact_body", r.contact_body(), rows, bodies, false);
  check_unit("contact_normal", r.contact_normal(), rows, 3);
  check_numbers("contact_point", r.contact_point(), rows, 3);
  check_numbers("contact_depth", r.contact_depth(), rows, 1);
  check_numbers("contact_material", r.contact_material(), rows, kMaterialColumns, 0.0);
  check_numbers("contact_warm_impulse", r.contact_warm_impulse(), rows, 3);
  check_numbers("contact_warm_correction", r.contact_warm_correction(), rows, 1);
  for (std::size_t row = 0; row < rows; ++row) {
    const double restitution = r.contact_material()[kMaterialColumns * row + kRestitution];
    if (restitution > 1.0) refuse("contact_material", row, "restitution " + std::to_string(restitution) + " above 1");
  }
}

}  // namespace

void check_solver_request(const stage::SolverSolveRequest& request) {
  const double step = request.time_step();
  const double theta = request.theta();
  if (!(step > 0.0 && std::isfinite(step))) refuse("time_step", 0, std::to_string(step) + " is not positive");
  if (!(theta >= 0.0 && theta <= 1.0)) refuse("theta", 0, std::to_string(theta) + " is outside 0 ... 1");
  const std::size_t bodies = request.flags().size();
  check_bodies(request, bodies);
  check_discrepancies(request, bodies, kForcesApplied);
  check_numbers("discrepancy_warm_impulse", request.discrepancy_warm_impulse(), request.mode().size(), 3);
  check_numbers("discrepancy_warm_correction", request.discrepancy_warm_correction(), request.mode().size(), 3);
  check_numbers("discrepancy_applied_force", request.discrepancy_applied_force(), request.mode().size(), 3);
  check_numbers("restitution", request.restitution(), request.mode().size(), 1, 0.0, 1.0);
  check_contacts(request, bodies);
}

void check_reactions_request(const stage::SolverReactionsRequest& r) {
  const std::size_t bodies = r.flags().size();
  check_masses(r, bodies);
  check_numbers("inertia", r.inertia(), bodies, 3, 0.0);
  check_numbers("drag", r.drag(), bodies, 1, 0.0);
  check_state(r, bodies);
  check_numbers("wrench", r.wrench(), bodies, 6);
  check_numbers("acceleration", r.acceleration(), bodies, 6);
  check_discrepancies(r, bodies, 0);
  check_numbers("desired_acceleration", r.desired_acceleration(), r.mode().size(), 3);
  if (!(r.time_step() > 0.0 && std::isfinite(r.time_step())))
    refuse("time_step", 0, std::to_string(r.time_step()) + " is not positive");
  check_numbers("start_position", r.start_position(), bodies, 3);
  check_unit("start_orientation", r.start_orientation(), bodies, 4);
  check_numbers("start_linear_velocity", r.start_linear_velocity(), bodies, 3);
  check_numbers("start_angular_velocity", r.start_angular_velocity(), bodies, 3);
  if (!r.start_mode().empty()) check_length("start_mode", r.start_mode(), r.mode().size(), 1);
  const std::size_t rows = r.start_mode().size();
  check_numbers("start_point1", r.start_point1(), rows, 3);
  check_numbers("start_point2", r.start_point2(), rows, 3);
  check_numbers("start_velocity", r.start_velocity(), rows, 3);
  check_unit("start_axes", r.start_axes(), rows, 4);
  check_numbers("start_lower", r.start_lower(), rows, 3);
  check_numbers("start_upper", r.start_upper(), rows, 3);
  check_numbers("start_compliance", r.start_compliance(), rows, 3, 0.0);
  check_numbers("start_damping", r.start_damping(), rows, 3, 0.0);
  check_numbers("start_acceleration", r.start_acceleration(), rows, 3);
  for (std::size_t row = 0; row < rows; ++row)
    if (!is_valid_mode(r.start_mode()[row]))
      refuse("start_mode", row, std::to_string(r.start_mode()[row]) + " is no mode");
  check_length("block_body", r.block_body(), r.block().size() / kBlockNumbers, 2);
  check_numbers("block", r.block(), r.block_body().size() / 2, kBlockNumbers);
  for (std::size_t i = 0; i < r.block_body().size(); ++i)
    if (r.block_body()[i] >= bodies) refuse("block_body", i / 2, "a body that does not exist");
}

}  // namespace gravitas
