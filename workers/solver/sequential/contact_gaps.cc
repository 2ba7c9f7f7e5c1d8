// Rows and sweeps of the pose change at contacts.
#include "workers/solver/sequential/contact_gaps.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/discrepancy.h"

namespace gravitas {

void ContactGaps::build(const SolverBodies& bodies, const stage::SolverSolveRequest& request, double correction_factor,
                        const std::vector<double>& warm) {
  rows_.clear();
  coordinates_ = 0.0;
  for (std::size_t i = 0; i < request.contact_key().size(); ++i) {
    Row row;
    row.body1 = request.contact_body()[2 * i];
    row.body2 = request.contact_body()[2 * i + 1];
    row.contact = static_cast<std::uint32_t>(i);
    const SolverBody& one = bodies[row.body1];
    const SolverBody& two = bodies[row.body2];
    const Vector3 normal = vector_at(request.contact_normal(), i);
    const Vector3 point = vector_at(request.contact_point(), i);
    row.direction = ConstraintDirection::through(point, normal, one, two);
    row.response = row.direction.product(row.direction, one.inverse_mass + two.inverse_mass);
    if (!(row.response > 0.0) || !std::isfinite(1.0 / row.response)) continue;

    row.gap = -request.contact_depth()[i];
    const Vector3 to_surface = (-0.5 * row.gap) * normal;
    const double gap_at_start = normal.dot(carried(point - to_surface, two.trial, two.start) -
                                           carried(point + to_surface, one.trial, one.start));
    row.target = std::min(0.0, (1.0 - correction_factor) * gap_at_start) - row.gap;
    row.slop = closing_slop(point, one, two);
    row.multiplier = std::max(0.0, warm[i]);
    coordinates_ = std::max(coordinates_, point.cwiseAbs().maxCoeff());
    rows_.push_back(row);
  }
  set_patches(bodies);
}

void ContactGaps::push_all(const SolverBodies& bodies, BodyMotion& x) const {
  for (const Row& row : rows_) {
    if (row.multiplier == 0.0) continue;
    row.direction.push(row.multiplier, bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass, x[row.body1],
                       x[row.body2]);
  }
}

double ContactGaps::largest_violation(const BodyMotion& x) const {
  double largest = 0.0;
  for (const Row& row : rows_)
    largest = std::max(largest, row.target - row.direction.along(x[row.body1], x[row.body2]));
  return largest;
}

double ContactGaps::largest_motion(const BodyMotion& x) const {
  double largest = 0.0;
  for (const Row& row : rows_) {
    const Twist& one = x[row.body1];
    const Twist& two = x[row.body2];
    largest =
        std::max(largest, one.linear.norm() + two.linear.norm() + row.direction.angular1.norm() * one.angular.norm() +
                              row.direction.angular2.norm() * two.angular.norm());
  }
  return largest;
}

void ContactGaps::clear_multipliers() {
  for (Row& row : rows_) row.multiplier = 0.0;
}

void ContactGaps::scale(double share) {
  for (Row& row : rows_) row.multiplier *= share;
}

double ContactGaps::relax(std::size_t block, double share, const SolverBodies& bodies, BodyMotion& x) {
  const Patch& patch = patches_[block];
  double change = 0.0;
  if (relax_whole(patch, share, bodies, x, &change)) return change;
  for (std::size_t i = patch.first; i < patch.end; ++i)
    change = std::max(change, relax_row(rows_[i], share, bodies, x));
  return change;
}

void ContactGaps::append_multipliers(std::vector<double>* to) const {
  double* next = append(rows_.size(), to);
  for (const Row& row : rows_) *next++ = row.multiplier;
}

void ContactGaps::append_responses(std::vector<double>* to) const {
  double* next = append(rows_.size(), to);
  for (const Row& row : rows_) *next++ = row.response;
}

const double* ContactGaps::take_multipliers(const double* from) {
  for (Row& row : rows_) row.multiplier = *from++;
  return from;
}

double ContactGaps::error_of(std::size_t block, const BodyMotion& x) const {
  double error = 0.0;
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i) {
    const Row& row = rows_[i];
    const double missing = row.target - row.direction.along(x[row.body1], x[row.body2]);
    error = std::max(error, row.multiplier > 0.0 ? std::fabs(missing) : missing);
  }
  return error;
}

double ContactGaps::relax_row(Row& row, double share, const SolverBodies& bodies, BodyMotion& x) {
  const double missing = row.target - row.direction.along(x[row.body1], x[row.body2]);
  const double relaxed = std::max(0.0, row.multiplier + share * (missing / row.response));
  const double amount = relaxed - row.multiplier;
  if (amount == 0.0) return 0.0;
  row.multiplier = relaxed;
  row.direction.push(amount, bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass, x[row.body1],
                     x[row.body2]);
  return std::fabs(row.response * amount) / std::min(1.0, share);
}

// All rows of a patch as closed; false, with nothing done, if one would have to pull.
bool ContactGaps::relax_whole(const Patch& patch, double share, const SolverBodies& bodies, BodyMotion& x,
                              double* change) {
  if (!patch.has_whole) return false;
  const auto count = static_cast<int>(patch.end - patch.first);
  ContactPatch::Rows missing = ContactPatch::Rows::Zero();
  bool is_open = true;
  for (int i = 0; i < count; ++i) {
    const Row& row = rows_[patch.first + static_cast<std::size_t>(i)];
    missing(i) = row.target - row.direction.along(x[row.body1], x[row.body2]);
    is_open = is_open && missing(i) <= 0.0 && row.multiplier == 0.0;
  }
  ContactPatch::Rows amounts = ContactPatch::Rows::Zero();
  if (is_open || !patch.whole.solve(missing, &amounts)) return false;
  amounts *= share;
  for (int i = 0; i < count; ++i)
    if (rows_[patch.first + static_cast<std::size_t>(i)].multiplier + amounts(i) < 0.0) return false;
  for (int i = 0; i < count; ++i) {
    Row& row = rows_[patch.first + static_cast<std::size_t>(i)];
    row.multiplier += amounts(i);
    row.direction.push(amounts(i), bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass, x[row.body1],
                       x[row.body2]);
    *change = std::max(*change, std::fabs(missing(i)));
  }
  return true;
}

void ContactGaps::set_patches(const SolverBodies& bodies) {
  patches_.clear();
  for (std::size_t first = 0; first < rows_.size();) {
    std::size_t end = first + 1;
    while (end < rows_.size() && rows_[end].body1 == rows_[first].body1 && rows_[end].body2 == rows_[first].body2)
      ++end;
    Patch& patch = patches_.emplace_back();
    patch.first = static_cast<std::uint32_t>(first);
    patch.end = static_cast<std::uint32_t>(end);
    const auto count = static_cast<int>(end - first);
    patch.has_whole = count > 1 && count <= ContactPatch::kRows;
    if (patch.has_whole) {
      ContactPatch::Response response = ContactPatch::Response::Zero();
      const double masses = bodies[rows_[first].body1].inverse_mass + bodies[rows_[first].body2].inverse_mass;
      for (int i = 0; i < count; ++i)
        for (int j = 0; j < count; ++j)
          response(i, j) = rows_[first + static_cast<std::size_t>(i)].direction.product(
              rows_[first + static_cast<std::size_t>(j)].direction, masses);
      patch.whole = ContactPatch::of(response, count);
    }
    first = end;
  }
}

bool ContactGaps::holds(std::size_t block) const {
  return std::any_of(rows_.begin() + patches_[block].first, rows_.begin() + patches_[block].end,
                     [](const Row& row) { return row.gap <= row.slop || row.multiplier > 0.0; });
}

double ContactGaps::largest_push() const {
  double largest = 0.0;
  for (const Row& row : rows_) largest = std::max(largest, row.response * row.multiplier);
  return largest;
}

void ContactGaps::push_block(std::size_t block, const SolverBodies& bodies, BodyMotion& x) const {
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i) {
    const Row& row = rows_[i];
    row.direction.push(row.multiplier, bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass, x[row.body1],
                       x[row.body2]);
  }
}

void ContactGaps::take_block(std::size_t block, const ContactGaps& from) {
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i)
    rows_[i].multiplier = from.rows_[i].multiplier;
}

void ContactGaps::replace_body(std::size_t block, int side, std::uint32_t offset) {
  for (std::size_t i = patches_[block].first; i < patches_[block].end; ++i) {
    Row& row = rows_[i];
    (side == 0 ? row.body1 : row.body2) += offset;
    (side == 0 ? row.direction.turn1 : row.direction.turn2).setZero();
  }
}

void ContactGaps::set_responses(const SolverBodies& bodies) {
  for (Row& row : rows_)
    row.response =
        row.direction.product(row.direction, bodies[row.body1].inverse_mass + bodies[row.body2].inverse_mass);
  set_patches(bodies);
}

void ContactGaps::store(std::vector<double>& multipliers) const {
  std::fill(multipliers.begin(), multipliers.end(), 0.0);
  for (const Row& row : rows_) multipliers[row.contact] = row.multiplier;
}

void ContactGaps::find_closed(const BodyMotion& x, std::vector<std::uint8_t>& closed) const {
  std::fill(closed.begin(), closed.end(), std::uint8_t{0});
  for (const Row& row : rows_) {
    const double gap = row.gap + row.direction.along(x[row.body1], x[row.body2]);
    // what is pushed is closed, however far the sweeps have come
    closed[row.contact] = gap <= row.slop || row.multiplier > 0.0 ? 1 : 0;
  }
}

}  // namespace gravitas
