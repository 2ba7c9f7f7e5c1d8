#include "plugin_sdk/answer_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/solver.h"

namespace gravitas {
namespace {

// Share of an impulse that rounding may put on the wrong side of a bound.
constexpr double kRounding = 1e-9;
constexpr double kSmallest = std::numeric_limits<double>::min();  // below it rounding is no share

std::string at_row(const char* what, std::size_t row) { return std::string(what) + " of row " + std::to_string(row); }

AnswerProblem bad_structure(const char* column, std::size_t row, const char* what) {
  return {true, at_row(column, row) + what};
}

AnswerProblem bad_number(const char* column, std::size_t row, const char* what) {
  return {false, at_row(column, row) + what};
}

AnswerProblem check_unit(std::span<const double> column, std::size_t components, const char* name) {
  const std::size_t row = first_not_unit(column, components);
  return row == kNoRow ? AnswerProblem{} : bad_number(name, row, " is not of unit length");
}

}  // namespace

std::string too_long(const stage::ColumnInfo& column, std::uint64_t count, std::uint64_t capacity) {
  return std::string("column ") + column.name + " is longer than its room: answered " + counted(count, "number") +
         ", room for " + std::to_string(capacity);
}

std::string overfull_column(std::span<const stage::ColumnInfo> infos, const gravitas_reply_column* reply) {
  for (std::size_t i = 0; i < infos.size(); ++i)
    if (reply[i].count > reply[i].capacity) return too_long(infos[i], reply[i].count, reply[i].capacity);
  return {};
}

AnswerProblem check_pairs(std::span<const std::uint32_t> pair, std::span<const std::uint32_t> flags) {
  for (std::size_t i = 0; i < pair.size() / 2; ++i) {
    const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
    if (a >= b || b >= flags.size()) return bad_structure("pair", i, " is not two bodies in order");
    if (((flags[a] | flags[b]) & kMovable) == 0 || (flags[a] & flags[b] & kHasShape) == 0)
      return bad_structure("pair", i, " is two bodies that cannot touch");
    if (i > 0 && !(std::pair(pair[2 * i - 2], pair[2 * i - 1]) < std::pair(a, b)))
      return bad_structure("pair", i, " is not in ascending order, or stands twice");
  }
  return {};
}

AnswerProblem check_remembered_contacts(std::span<const std::uint32_t> body, std::span<const std::uint32_t> feature,
                                        std::span<const double> correction, std::span<const std::uint32_t> flags) {
  const auto contact = [&](std::size_t i) { return std::tuple{body[2 * i], body[2 * i + 1], feature[i]}; };
  for (std::size_t i = 0; i < feature.size(); ++i) {
    if (!check_pairs(body.subspan(2 * i, 2), flags).text.empty())
      return bad_structure("contact_body", i, " is not two bodies that can touch");
    if (i > 0 && !(contact(i - 1) < contact(i)))
      return bad_structure("contact_body", i, " is not in ascending order, or stands twice");
    if (correction[i] < 0.0) return bad_number("contact_correction", i, " is negative");
  }
  return {};
}

AnswerProblem check_block_rows(const char* column, std::span<const std::uint32_t> block_body, std::uint64_t bodies,
                               std::uint64_t most) {
  if (block_body.size() > 2 * most)
    return {true, std::string(column) + " has " + counted(block_body.size() / 2, "row") +
                      ", allowed: " + std::to_string(most)};
  const auto bad = std::ranges::find_if(block_body, [&](std::uint32_t body) { return body >= bodies; });
  if (bad == block_body.end()) return {};
  return bad_structure(column, static_cast<std::size_t>(bad - block_body.begin()) / 2,
                       " names a body that does not exist");
}

AnswerProblem check_wrench_flags(std::span<const std::uint32_t> flags) {
  for (std::size_t i = 0; i < flags.size(); ++i)
    if (flags[i] > (kConstantWrench | kHasPotential)) return bad_structure("flags", i, " has unknown bits");
  return {};
}

AnswerProblem check_bound_begin(std::span<const std::uint32_t> begin, std::uint64_t numbers) {
  if (begin.front() == 0 && begin.back() == numbers && std::ranges::is_sorted(begin)) return {};
  return {true, "bound_begin does not cut up bound"};
}

AnswerProblem check_impact_rows(std::span<const std::uint32_t> pair, std::span<const double> fraction,
                                std::span<const double> normal, std::uint64_t pairs) {
  for (std::size_t i = 0; i < pair.size(); ++i) {
    if (pair[i] >= pairs) return bad_structure("impact_pair", i, " is not one of the pairs asked for");
    if (i > 0 && pair[i - 1] >= pair[i])
      return bad_structure("impact_pair", i, " is not in ascending order, or stands twice");
    if (!(fraction[i] >= 0.0 && fraction[i] <= 1.0)) return bad_number("fraction", i, " is outside 0 … 1");
  }
  return check_unit(normal, 3, "normal");
}

AnswerProblem check_contact_rows(std::span<const std::uint32_t> pair, std::span<const std::uint32_t> feature,
                                 std::span<const double> normal, std::uint64_t pairs) {
  for (std::size_t i = 0; i < pair.size(); ++i) {
    if (pair[i] >= pairs) return bad_structure("contact_pair", i, " is not one of the pairs asked for");
    if (i > 0 && !(std::pair(pair[i - 1], feature[i - 1]) < std::pair(pair[i], feature[i])))
      return bad_structure("contact", i, " is not in ascending order of pair and feature, or stands twice");
  }
  return check_unit(normal, 3, "normal");
}

AnswerProblem check_discrepancy_rows(std::span<const std::uint32_t> constraint, std::span<const std::uint32_t> intact,
                                     const DiscrepancyColumns& rows) {
  for (std::size_t i = 0; i < constraint.size(); ++i) {
    const std::uint32_t joint = constraint[i];
    if (joint >= intact.size() || intact[joint] == 0) return bad_structure("constraint", i, " is no joint that holds");
    if (i > 0 && constraint[i - 1] > joint) return bad_structure("constraint", i, " is out of order");
    if (!is_valid_mode(rows.mode[i])) return bad_structure("mode", i, " is unknown");
    if (!(rows.correction[i] >= 0.0 && rows.correction[i] <= 1.0))
      return bad_number("correction", i, " is outside 0 … 1");
    if (!(rows.restitution[i] >= 0.0 && rows.restitution[i] <= 1.0))
      return bad_number("restitution", i, " is outside 0 … 1");
    for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
      if (rows.lower[k] > rows.upper[k]) return bad_number("lower", i, " lies above upper");
      if (rows.compliance[k] < 0.0 || rows.damping[k] < 0.0 || rows.maximum_force[k] < 0.0)
        return bad_number("compliance, damping or maximum_force", i, " is negative");
    }
  }
  return check_unit(rows.axes, 4, "axes");
}

AnswerProblem check_multipliers(const SolutionColumns& answer, std::span<const double> material,
                                std::span<const std::uint32_t> mode) {
  if (AnswerProblem problem = check_unit(answer.contact_direction, 3, "contact_direction"); !problem.text.empty())
    return problem;
  for (std::size_t i = 0; i < answer.contact_correction.size(); ++i) {
    const Vector3 impulse = vector_at(answer.contact_impulse, i), normal = vector_at(answer.contact_direction, i);
    const double* row = &material[kMaterialColumns * i];
    // found only for what lies outside without it
    const auto tolerance = [&] { return kRounding * impulse.stableNorm() + kSmallest; };
    const double along = normal.dot(impulse);
    if (along < 0.0 && along < -tolerance()) return bad_number("contact_impulse", i, " pulls the bodies together");
    const double friction = std::max(row[kStaticFriction], row[kDynamicFriction]);
    const double across = (impulse - along * normal).norm();
    if (!(across <= friction * along) && across > friction * along + tolerance())
      return bad_number("contact_impulse", i, " leaves the friction cone");
    if (answer.contact_correction[i] < 0.0) return bad_number("contact_correction", i, " is negative");
    const Vector3 turning = vector_at(answer.contact_turning, i);
    if (turning.isZero(0.0)) continue;
    const double spinning = normal.dot(turning), pressed = along + tolerance();
    const double rounding = kRounding * turning.stableNorm() + kSmallest;
    if (std::fabs(spinning) > row[kSpinningFriction] * pressed + rounding)
      return bad_number("contact_turning", i, " spins by more than spinning friction can");
    if ((turning - spinning * normal).norm() > row[kRollingFriction] * pressed + rounding)
      return bad_number("contact_turning", i, " rolls by more than rolling friction can");
  }
  for (std::size_t i = 0; i < mode.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t k = 3 * i + static_cast<std::size_t>(axis);
      if (axis_mode(mode[i], axis) == AxisMode::kUnilateral &&
          (answer.discrepancy_impulse[k] < 0.0 || answer.discrepancy_correction[k] < 0.0))
        return bad_number("discrepancy_impulse", i, " pulls along a one-sided axis");
    }
  }
  return {};
}

}  // namespace gravitas
