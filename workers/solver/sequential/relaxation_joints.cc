// Blocks of joint rows: building, factorising, sweeping.
#include "workers/solver/sequential/relaxation_joints.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/end_of_step_rows.h"

namespace gravitas {
namespace {

// Share of a row that must be left of it beside the others, squared.
constexpr double kIndependence = 1e-10;

double inverse_masses_of(const SolverBodies& bodies, std::uint32_t body1, std::uint32_t body2) {
  return bodies[body1].inverse_mass + bodies[body2].inverse_mass;
}

}  // namespace

RelaxationDiscrepancy relaxation_discrepancy(const Discrepancy& discrepancy, std::uint32_t body1, std::uint32_t body2,
                                             bool is_only_point, const SolverBodies& bodies, double correction_factor) {
  RelaxationDiscrepancy r;
  r.body1 = body1;
  r.body2 = body2;
  r.is_only_point = is_only_point;
  r.beta = correction_factor * discrepancy.correction;
  const SolverBody& one = bodies[body1];
  const SolverBody& two = bodies[body2];
  const Vector3 start_error = error_in_axes_at(discrepancy, one.trial, two.trial, one.start, two.start);
  const Vector3 middle = 0.5 * (discrepancy.point1 + discrepancy.point2);
  const Matrix3 axes = to_rotation_matrix(discrepancy.axes);
  const bool angular = discrepancy.is_angular();
  r.slop = angular ? 1e-9 : closing_slop(middle, one, two);
  r.length = angular ? std::max(one.gyration(), two.gyration()) : 1.0;
  const Vector3 apart =
      is_only_point ? half_of_locked(discrepancy, axes, axes.transpose() * (discrepancy.point2 - discrepancy.point1))
                    : Vector3(Vector3::Zero());
  for (int i = 0; i < 3; ++i) {
    const auto place = static_cast<std::size_t>(i);
    const Vector3 axis = axes.col(i);
    r.axes[place] = joint_axis_state(discrepancy, i, axis, start_error);
    r.directions[place] = angular ? ConstraintDirection::about(axis, one, two)
                                  : ConstraintDirection::through(middle - apart, middle + apart, axis, one, two);
  }
  return r;
}

JointEnd end_of(const Discrepancy& discrepancy, const RelaxationDiscrepancy& at_trial, const SolverBodies& turned,
                const BodyMotion& displacement) {
  const SolverBody &one = turned[at_trial.body1], &two = turned[at_trial.body2];
  const Twist &change1 = displacement[at_trial.body1], &change2 = displacement[at_trial.body2];
  const auto body_end = [](const SolverBody& body, const Twist& change) {
    EndBody end;
    end.pose = displaced(body.trial, change.linear, change.angular);
    end.turn = to_rotation_matrix(exp_rotation(change.angular));
    return end;
  };
  EndJoint joint;
  joint.discrepancy = discrepancy;
  joint.axes = to_rotation_matrix(discrepancy.axes);
  joint.is_only_point = at_trial.is_only_point;
  move_joint(one, two, body_end(one, change1), body_end(two, change2), change2.angular - change1.angular, &joint);
  JointEnd end;
  end.is_linear = !discrepancy.is_angular();
  end.is_radial = discrepancy.is_radial();
  if (discrepancy.is_swing()) end.angle = joint.errors[0] + held_angle(discrepancy);
  end.arm1 = discrepancy.is_radial() ? joint.own_arm1() : joint.arm1;
  end.arm2 = discrepancy.is_radial() ? joint.own_arm2() : joint.arm2;
  for (std::size_t k = 0; k < 3; ++k) {
    end.directions[k] = with_turns(joint.directions[k], one.inverse_inertia, two.inverse_inertia);
    end.errors[k] = joint.errors[static_cast<Eigen::Index>(k)];
  }
  return end;
}

void RelaxationJoints::build(const SolverBodies& bodies, const std::vector<RelaxationDiscrepancy>& discrepancies,
                             const Laws& laws, const Multipliers& warm) {
  rows_.clear();
  blocks_.clear();
  left_out_.clear();
  std::size_t end = 0;
  for (std::size_t first = 0; first < discrepancies.size(); first = end) {
    const RelaxationDiscrepancy& d = discrepancies[first];
    for (end = first; end < discrepancies.size(); ++end)
      if (discrepancies[end].body1 != d.body1 || discrepancies[end].body2 != d.body2) break;
    if (!bodies[d.body1].is_pushed() && !bodies[d.body2].is_pushed()) continue;

    collect(discrepancies, laws, first, end, warm);
    Block block;
    block.body1 = d.body1;
    block.body2 = d.body2;
    block.first = static_cast<std::uint32_t>(rows_.size());
    const double inverse_masses = inverse_masses_of(bodies, d.body1, d.body2);
    factorise(block, inverse_masses);
    orthogonalise(block, inverse_masses);
    block.end = static_cast<std::uint32_t>(rows_.size());
    if (block.end > block.first) blocks_.push_back(block);
  }
}

// The active laws of discrepancies first ... end, into rigid_ and others_.
void RelaxationJoints::collect(const std::vector<RelaxationDiscrepancy>& discrepancies, const Laws& laws,
                               std::size_t first, std::size_t end, const Multipliers& warm) {
  rigid_.clear();
  others_.clear();
  for (std::size_t i = first; i < end; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t place = 3 * i + axis;
      if (!laws[place].is_active()) continue;
      Row row;
      row.own = row.solved = discrepancies[i].directions[axis];
      row.law = laws[place];
      row.length = discrepancies[i].length;
      row.place = static_cast<std::uint32_t>(place);
      double lambda = warm[place];
      if (!row.law.has_lower) lambda = std::min(lambda, 0.0);
      if (!row.law.has_upper) lambda = std::max(lambda, 0.0);
      row.multiplier = std::clamp(lambda, -row.law.bound, row.law.bound);
      (row.law.is_rigid() ? rigid_ : others_).push_back(row);
    }
  }
}

// Appends the independent rigid rows and sets the inverse of their J M^-1 J^T.
void RelaxationJoints::factorise(Block& block, double inverse_masses) {
  const std::size_t count = rigid_.size();
  factor_.assign(count, {});
  pivot_.assign(count, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    const double diagonal = rigid_[i].own.product(rigid_[i].own, inverse_masses);
    rigid_[i].response = diagonal;
    pivot_[i] = diagonal > 0.0 && std::isfinite(1.0 / diagonal) ? 1.0 : 0.0;
  }
  std::array<std::size_t, kBlock> kept{};
  for (; block.rigid < kBlock; ++block.rigid) {
    const auto largest = std::max_element(pivot_.begin(), pivot_.end());
    if (largest == pivot_.end() || *largest < kIndependence) break;
    const auto chosen = static_cast<std::size_t>(largest - pivot_.begin());
    const auto column = static_cast<std::size_t>(block.rigid);
    const double root = std::sqrt(*largest);
    pivot_[chosen] = 0.0;
    kept[column] = chosen;
    rows_.push_back(rigid_[chosen]);
    for (std::size_t i = 0; i < count; ++i) {
      if (pivot_[i] == 0.0) continue;
      double entry = rigid_[i].own.product(rigid_[chosen].own, inverse_masses) /
                     std::sqrt(rigid_[i].response * rigid_[chosen].response);
      for (std::size_t k = 0; k < column; ++k) entry -= factor_[i][k] * factor_[chosen][k];
      factor_[i][column] = entry / root;
      pivot_[i] = std::max(0.0, pivot_[i] - factor_[i][column] * factor_[i][column]);
    }
    factor_[chosen][column] = root;
  }

  // inverse = S L^-T L^-1 S, S the scaling of the rows
  using Matrix = Eigen::Matrix<double, kBlock, kBlock>;
  Matrix lower_inverse = Matrix::Zero();
  for (int column = 0; column < block.rigid; ++column) {
    for (int row = column; row < block.rigid; ++row) {
      const auto& l = factor_[kept[static_cast<std::size_t>(row)]];
      double entry = row == column ? 1.0 : 0.0;
      for (int k = column; k < row; ++k) entry -= l[static_cast<std::size_t>(k)] * lower_inverse(k, column);
      lower_inverse(row, column) = entry / l[static_cast<std::size_t>(row)];
    }
  }
  block.inverse = Matrix::Zero();
  for (int i = 0; i < block.rigid; ++i) {
    for (int j = 0; j < block.rigid; ++j) {
      double entry = 0.0;
      for (int k = std::max(i, j); k < block.rigid; ++k) entry += lower_inverse(k, i) * lower_inverse(k, j);
      const double scale =
          rigid_[kept[static_cast<std::size_t>(i)]].response * rigid_[kept[static_cast<std::size_t>(j)]].response;
      block.inverse(i, j) = entry / std::sqrt(scale);
    }
  }
  leave_out(kept, inverse_masses, &block);
}

// The rigid rows that are not kept, and what they bore to those that are.
void RelaxationJoints::leave_out(const std::array<std::size_t, kBlock>& kept, double inverse_masses, Block* block) {
  const auto rigid = static_cast<std::size_t>(block->rigid);
  block->first_left_out = static_cast<std::uint32_t>(left_out_.size());
  for (std::size_t i = 0; i < rigid_.size(); ++i) {
    const Row& row = rigid_[i];
    if (!(row.response > 0.0) || std::find(kept.begin(), kept.begin() + block->rigid, i) != kept.begin() + block->rigid)
      continue;
    LeftOut& left = left_out_.emplace_back();
    left = {block->body1, block->body2, row.own, row.law.lower_target,
            row.length,   row.place,    {},      std::sqrt(row.response)};
    // what a drive bears moves the bodies, what a lock bears does not
    const auto drives = [](const Row& any) { return any.law.is_velocity_only; };
    if (drives(row) || std::any_of(rows_.end() - block->rigid, rows_.end(), drives)) continue;
    for (std::size_t k = 0; k < rigid; ++k) {
      double combination = 0.0;
      for (std::size_t j = 0; j < rigid; ++j)
        combination += block->inverse(static_cast<int>(k), static_cast<int>(j)) *
                       row.own.product(rows_[block->first + j].own, inverse_masses);
      Row& to = rows_[block->first + k];
      to.multiplier += combination * row.multiplier;
      left.share[k] = combination * std::sqrt(to.response) / left.scale;
    }
  }
  block->end_left_out = static_cast<std::uint32_t>(left_out_.size());
}

// mu = C y, (C^T C) y = what the kept rows bear alone, C the kept rows and the shares of the others.
void RelaxationJoints::share_out(const Block& block, Multipliers* multipliers) const {
  using Numbers = Eigen::Matrix<double, kBlock, 1>;
  Eigen::Matrix<double, kBlock, kBlock> square = Eigen::Matrix<double, kBlock, kBlock>::Identity();
  for (std::uint32_t i = block.first_left_out; i < block.end_left_out; ++i) {
    const auto share = Numbers::Map(left_out_[i].share.data());
    square += share * share.transpose();
  }
  Numbers alone = Numbers::Zero();
  const auto scale_of = [&](int k) { return std::sqrt(rows_[block.first + static_cast<std::uint32_t>(k)].response); };
  for (int k = 0; k < block.rigid; ++k)
    alone[k] = rows_[block.first + static_cast<std::uint32_t>(k)].multiplier * scale_of(k);
  const Numbers y = square.llt().solve(alone);
  for (int k = 0; k < block.rigid; ++k)
    (*multipliers)[rows_[block.first + static_cast<std::uint32_t>(k)].place] = y[k] / scale_of(k);
  for (std::uint32_t i = block.first_left_out; i < block.end_left_out; ++i)
    (*multipliers)[left_out_[i].place] = y.dot(Numbers::Map(left_out_[i].share.data())) / left_out_[i].scale;
}

// Appends the other rows, made M-orthogonal to the rigid ones.
void RelaxationJoints::orthogonalise(Block& block, double inverse_masses) {
  const std::size_t base = block.first;
  for (Row& row : others_) {
    const double full = row.own.product(row.own, inverse_masses);
    if (!(full > 0.0) || !std::isfinite(1.0 / full)) continue;
    std::array<double, kBlock> coupling{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(block.rigid); ++i)
      coupling[i] = rows_[base + i].own.product(row.own, inverse_masses);
    for (int i = 0; i < block.rigid; ++i) {
      double share = 0.0;
      for (int j = 0; j < block.rigid; ++j) share += block.inverse(i, j) * coupling[static_cast<std::size_t>(j)];
      row.share[static_cast<std::size_t>(i)] = share;
      row.solved.subtract(share, rows_[base + static_cast<std::size_t>(i)].own);
    }
    const double left = row.solved.product(row.solved, inverse_masses);
    // what gives way beside a lock or a drive has its impulse, which that bears
    if (!(left > kIndependence * full) && !(row.law.gamma > 0.0)) continue;
    row.response = std::max(0.0, left) + row.law.gamma;
    rows_.push_back(row);
  }
}

double RelaxationJoints::relax_rigid(const Block& block, double share, double w1, double w2, Twist& x1, Twist& x2) {
  double change = 0.0;
  std::array<double, kBlock> residual{};
  for (std::size_t i = 0; i < static_cast<std::size_t>(block.rigid); ++i) {
    const Row& row = rows_[block.first + i];
    residual[i] = row.law.lower_target - row.own.along(x1, x2);
    change = std::max(change, std::fabs(residual[i]) * row.length);
  }
  for (int i = 0; i < block.rigid; ++i) {
    double amount = 0.0;
    for (int j = 0; j < block.rigid; ++j) amount += block.inverse(i, j) * residual[static_cast<std::size_t>(j)];
    amount *= share;
    Row& row = rows_[block.first + static_cast<std::size_t>(i)];
    row.multiplier += amount;
    row.own.push(amount, w1, w2, x1, x2);
  }
  return change;
}

double RelaxationJoints::relax_others(const Block& block, double share, double w1, double w2, Twist& x1, Twist& x2) {
  double change = 0.0;
  for (std::size_t i = block.first + static_cast<std::size_t>(block.rigid); i < block.end; ++i) {
    Row& row = rows_[i];
    const double value = row.own.along(x1, x2) + row.law.gamma * row.multiplier;
    double relaxed = relaxed_multiplier(row.law, row.multiplier, value, row.response);
    const double whole = relaxed - row.multiplier;
    // a share of the step, then onto what is allowed: a share of the way there would never let go
    if (share < 1.0) relaxed = relaxed_multiplier(row.law, row.multiplier, value, row.response / share);
    const double amount = relaxed - row.multiplier;
    if (amount == 0.0) continue;
    row.multiplier = relaxed;
    row.solved.push(amount, w1, w2, x1, x2);
    // what J' pushes through the lock is the lock's multiplier
    for (int k = 0; k < block.rigid; ++k)
      rows_[block.first + static_cast<std::size_t>(k)].multiplier -= row.share[static_cast<std::size_t>(k)] * amount;
    const double moved = (row.response - row.law.gamma) * whole;
    change = std::max(change, std::fabs(moved) * row.length);
  }
  return change;
}

double RelaxationJoints::relax(std::size_t number, double share, const SolverBodies& bodies, BodyMotion& x) {
  const Block& block = blocks_[number];
  const double w1 = bodies[block.body1].inverse_mass;
  const double w2 = bodies[block.body2].inverse_mass;
  Twist& x1 = x[block.body1];
  Twist& x2 = x[block.body2];
  const double rigid = relax_rigid(block, share, w1, w2, x1, x2);
  return std::max(rigid, relax_others(block, share, w1, w2, x1, x2));
}

double RelaxationJoints::error_of(std::size_t number, const BodyMotion& x) const {
  const Block& block = blocks_[number];
  double error = 0.0;
  for (std::size_t i = block.first; i < block.end; ++i) {
    const Row& row = rows_[i];
    const double value = row.own.along(x[block.body1], x[block.body2]);
    if (i < block.first + static_cast<std::size_t>(block.rigid)) {
      error = std::max(error, std::fabs(row.law.lower_target - value) * row.length);
      continue;
    }
    const double relaxed =
        relaxed_multiplier(row.law, row.multiplier, value + row.law.gamma * row.multiplier, row.response);
    error = std::max(error, (row.response - row.law.gamma) * std::fabs(relaxed - row.multiplier) * row.length);
  }
  return error;
}

void RelaxationJoints::append_multipliers(std::vector<double>* to) const {
  for (const Row& row : rows_) to->push_back(row.multiplier);
}

void RelaxationJoints::append_responses(std::vector<double>* to) const {
  for (const Row& row : rows_) to->push_back(row.response);
}

const double* RelaxationJoints::take_multipliers(const double* from) {
  for (Row& row : rows_) row.multiplier = *from++;
  return from;
}

void RelaxationJoints::push_all(const SolverBodies& bodies, BodyMotion& x) const {
  for (const Block& block : blocks_) {
    for (std::size_t i = block.first; i < block.end; ++i) {
      if (rows_[i].multiplier == 0.0) continue;
      rows_[i].own.push(rows_[i].multiplier, bodies[block.body1].inverse_mass, bodies[block.body2].inverse_mass,
                        x[block.body1], x[block.body2]);
    }
  }
}

void RelaxationJoints::push_velocity_only(const SolverBodies& bodies, double factor, BodyMotion& x) const {
  for (const Block& block : blocks_) {
    for (std::size_t i = block.first; i < block.end; ++i) {
      const Row& row = rows_[i];
      if (!row.law.is_velocity_only || row.multiplier == 0.0) continue;
      // the rows' inertia may be that of another place
      const SolverBody &one = bodies[block.body1], &two = bodies[block.body2];
      with_turns(row.own, one.inverse_inertia, two.inverse_inertia)
          .push(factor * row.multiplier, one.inverse_mass, two.inverse_mass, x[block.body1], x[block.body2]);
    }
  }
}

bool RelaxationJoints::has_velocity_only_impulse() const {
  return std::any_of(rows_.begin(), rows_.end(),
                     [](const Row& row) { return row.law.is_velocity_only && row.multiplier != 0.0; });
}

double RelaxationJoints::largest_violation(const BodyMotion& x, bool is_solved) const {
  double largest = 0.0;
  for (const Block& block : blocks_) {
    for (std::size_t i = block.first; i < block.end; ++i) {
      const Row& row = rows_[i];
      const double given_way = is_solved ? row.law.gamma * row.multiplier : 0.0;
      const double value = row.own.along(x[block.body1], x[block.body2]) + given_way;
      double violation = 0.0;
      if (row.law.has_lower) violation = std::max(violation, row.law.lower_target - value);
      if (row.law.has_upper) violation = std::max(violation, value - row.law.upper_target);
      largest = std::max(largest, violation * row.length);
    }
  }
  return largest;
}

double RelaxationJoints::largest_left_out(const BodyMotion& x) const {
  double largest = 0.0;
  for (const LeftOut& row : left_out_)
    largest = std::max(largest, std::fabs(row.own.along(x[row.body1], x[row.body2]) - row.target) * row.length);
  return largest;
}

double RelaxationJoints::largest_motion(const BodyMotion& x) const {
  double largest = 0.0;
  for (const Block& block : blocks_) {
    const Twist& x1 = x[block.body1];
    const Twist& x2 = x[block.body2];
    for (std::size_t i = block.first; i < block.end; ++i) {
      largest = std::max(largest, rows_[i].own.size_along(x1, x2) * rows_[i].length);
    }
  }
  return largest;
}

void RelaxationJoints::clear_multipliers() {
  for (Row& row : rows_) row.multiplier = 0.0;
}

void RelaxationJoints::scale(double share) {
  for (Row& row : rows_) row.multiplier *= share;
}

void RelaxationJoints::take_drives(const Multipliers& multipliers) {
  for (Row& row : rows_)
    if (row.law.is_unbounded_drive()) row.multiplier = multipliers[row.place];
}

void RelaxationJoints::store(Multipliers& multipliers) const {
  std::fill(multipliers.begin(), multipliers.end(), 0.0);
  for (const Row& row : rows_) multipliers[row.place] = row.multiplier;
  for (const Block& block : blocks_)
    if (block.first_left_out < block.end_left_out) share_out(block, &multipliers);
}

void RelaxationJoints::exempt_driven(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                                     std::vector<double>& factor) const {
  for (const Block& block : blocks_)
    for (std::size_t i = block.first; i < block.end; ++i)
      if (rows_[i].law.may_do_work() && rows_[i].multiplier != 0.0) factor[group[owner_of(block, bodies)]] = 1.0;
}

void RelaxationJoints::scale(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                             const std::vector<double>& factor) {
  for (const Block& block : blocks_)
    for (std::size_t i = block.first; i < block.end; ++i) rows_[i].multiplier *= factor[group[owner_of(block, bodies)]];
}

}  // namespace gravitas
