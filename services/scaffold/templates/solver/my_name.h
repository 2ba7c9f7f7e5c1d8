// Projected Gauss-Seidel, free of the plugin interface, so that my_name_test.cc can call it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace plain {

using gravitas::BodyMotion;
using gravitas::ConstraintDirection;
using gravitas::JointLaw;

// `Bodies`, below: gravitas::SolverBodies, or whatever has SolverBody by the number of its row.

// One scalar row: with x the velocities (or displacements) of the bodies and lambda the row's multiplier,
//
//   x = x_0 + M^-1 J^T lambda,   y = J x + gamma lambda
//   y >= lower, lambda > 0 only where equal;   y <= upper, lambda < 0 only where equal;   |lambda| <= bound
//
// A lock has both sides with one target, a contact's normal the lower one (plugin_sdk/solver/joint_laws.h).
struct Row {
  std::uint32_t body1 = 0, body2 = 0;
  ConstraintDirection direction = {};  // J, and M^-1 J^T
  JointLaw law = {};
  double multiplier = 0.0;  // warm start before, answer after
  double response = 0.0;    // J M^-1 J^T + gamma
  double displaces = 0.0;   // share of the multiplier that moves the pose as well
};

// Coulomb friction of `count` rows from `first` on, which have no law of their own:
//
//   |lambda| <= coefficient lambda_N;   J x = 0, or lambda of that size against J x
//
// lambda_N is the multiplier of the row `normal`: the law is that of the projection lambda = P(lambda - J x/r) on the disc,
// for any r that is no less than the largest response of the rows.
struct Friction {
  std::size_t normal = 0, first = 0, count = 2;
  double coefficient = 0.0;
  double response = 0.0;
};

struct Problem {
  std::vector<Row> rows;
  std::vector<Friction> frictions;

  void clear() { rows.clear(), frictions.clear(); }

  // Appends a row, and tells whether it can do anything: rows that push nobody are left out.
  template <typename Bodies>
  bool add(Row row, const Bodies& bodies) {
    const double masses = bodies[row.body1].inverse_mass + bodies[row.body2].inverse_mass;
    row.response = row.direction.product(row.direction, masses) + row.law.gamma;
    if (!(row.response > 0.0) || !std::isfinite(1.0 / row.response)) return false;
    rows.push_back(row);
    return true;
  }
};

struct Ending {
  std::uint32_t sweeps = 0;
  double change = 0.0;  // the largest of a row's value in the last sweep
  bool converged = true;
};

template <typename Bodies>
void push(const Row& row, double amount, const Bodies& bodies, BodyMotion* x) {
  row.direction.push(amount, bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass, (*x)[row.body1],
                     (*x)[row.body2]);
}

// Makes one row right, the others as they are; the change of its value.
template <typename Bodies>
double relax(Row* row, const Bodies& bodies, BodyMotion* x) {
  const double value = row->direction.along((*x)[row->body1], (*x)[row->body2]) + row->law.gamma * row->multiplier;
  const double relaxed = gravitas::relaxed_multiplier(row->law, row->multiplier, value, row->response);
  const double amount = relaxed - row->multiplier;
  if (amount == 0.0) return 0.0;
  row->multiplier = relaxed;
  push(*row, amount, bodies, x);
  return std::fabs(row->response * amount);
}

// The same of the rows of a friction.
template <typename Bodies>
double relax(const Friction& friction, const Bodies& bodies, std::vector<Row>* rows, BodyMotion* x) {
  double wanted[3] = {}, square = 0.0;
  for (std::size_t k = 0; k < friction.count; ++k) {
    const Row& row = (*rows)[friction.first + k];
    wanted[k] = row.multiplier - row.direction.along((*x)[row.body1], (*x)[row.body2]) / friction.response;
    square += wanted[k] * wanted[k];
  }
  const double size = std::sqrt(square), most = friction.coefficient * (*rows)[friction.normal].multiplier;
  const double share = size > most ? most / size : 1.0;
  double change = 0.0;
  for (std::size_t k = 0; k < friction.count; ++k) {
    Row& row = (*rows)[friction.first + k];
    const double amount = share * wanted[k] - row.multiplier;
    if (amount == 0.0) continue;
    row.multiplier += amount;
    push(row, amount, bodies, x);
    change = std::max(change, std::fabs(friction.response * amount));
  }
  return change;
}

// Sweeps over all rows until none changes by more than rounding, or `most_sweeps` are done. Converges linearly: the slower,
// the longer chains and piles are and the more their masses differ. `progress` is called after every sweep.
template <typename Bodies, typename Progress>
Ending solve(const Bodies& bodies, std::uint32_t most_sweeps, Problem* problem, BodyMotion* x, Progress&& progress) {
  constexpr double kRounding = 1e-14;
  Ending ending;
  // of what the rows begin with, speeds of the warm start among them: it may have to be taken back whole
  double size = 0.0;
  for (const Row& row : problem->rows) {
    size = std::max(size, std::fabs(row.multiplier) * row.response);
    size = std::max(size, row.direction.size_along((*x)[row.body1], (*x)[row.body2]));
    if (row.law.has_lower) size = std::max(size, std::fabs(row.law.lower_target));
    if (row.law.has_upper) size = std::max(size, std::fabs(row.law.upper_target));
  }
  for (Row& row : problem->rows)
    if (row.multiplier != 0.0) push(row, row.multiplier, bodies, x);
  // friction begins within its bounds
  for (const Friction& friction : problem->frictions) relax(friction, bodies, &problem->rows, x);
  while (!problem->rows.empty() && ending.sweeps < most_sweeps) {
    ++ending.sweeps;
    ending.change = 0.0;
    for (Row& row : problem->rows)
      if (row.law.is_active()) ending.change = std::max(ending.change, relax(&row, bodies, x));
    for (const Friction& friction : problem->frictions)
      ending.change = std::max(ending.change, relax(friction, bodies, &problem->rows, x));
    progress();
    if (ending.change <= kRounding * size) return ending;
  }
  ending.converged = problem->rows.empty();
  return ending;
}

}  // namespace plain
