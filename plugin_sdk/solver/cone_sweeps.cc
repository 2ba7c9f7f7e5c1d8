// Sweeps of ConeProblem: block by block, each law alone with all others as they are.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/solver/cone_problem.h"
#include "plugin_sdk/solver/coulomb_contact.h"

namespace gravitas {

ConeProblem::OwnResponse::OwnResponse(const Eigen::MatrixXd& own) : all(own) {
  if (own.rows() < 3) return;
  contact = 0.5 * (own.topLeftCorner<3, 3>() + own.topLeftCorner<3, 3>().transpose());
  const double size = contact.trace();
  has_inverse = contact.determinant() > 1e-12 * size * size * size;
  if (has_inverse) inverse = contact.inverse();
}

void ConeProblem::begin_sweeps() {
  for (const Block& block : blocks_) {
    const auto i = static_cast<Eigen::Index>(block.first);
    own_.emplace_back(response_.block(i, i, block.count, block.count));
  }
  neighbours_.clear();
  for (const Block& block : blocks_) {
    const auto columns = response_.middleCols(block.first, block.count);
    std::vector<RowRange>& ranges = neighbours_.emplace_back();
    for (const Block& other : blocks_) {
      if (columns.middleRows(other.first, other.count).isZero(0.0)) continue;
      if (!ranges.empty() && ranges.back().first + ranges.back().count == other.first) {
        ranges.back().count += other.count;
      } else {
        ranges.push_back({other.first, other.count});
      }
    }
  }
}

// The law of a block alone, with all others as they are.
void ConeProblem::relax(const Block& block, const OwnResponse& own, double* lambda, const double* y) const {
  if (!(own.all(0, 0) > 0.0)) return;
  if (block.contact < 0) {
    lambda[0] = relaxed_multiplier(block.law, lambda[0], y[0], own.all(0, 0));
    return;
  }
  const double target = block.target;
  const Bounds bounds = bounds_of(block);
  if (bounds.turning != 1 && block.count > 1) {
    const Vector3 now(lambda[0], lambda[1], lambda[2]);
    const Vector3 alone = Vector3(y[0], y[1], y[2]) - own.contact * now;
    Vector3 next = now;
    if (!own.has_inverse || !solve_coulomb_contact(own.contact, own.inverse, alone, target, bounds.friction, &next)) {
      next.x() = std::max(0.0, now.x() + (target - y[0]) / own.contact(0, 0));
      const Vector3 moved = Vector3(y[0], y[1], y[2]) + own.contact.col(0) * (next.x() - now.x());
      const double stiffest = own.contact.bottomRightCorner<2, 2>().trace();
      if (stiffest > 0.0) next.tail<2>() -= moved.tail<2>() / stiffest;
      into_disc(bounds.friction * next.x(), &next.y());
    }
    for (int i = 0; i < 3; ++i) lambda[i] = next[i];
  } else {
    lambda[0] = std::max(0.0, lambda[0] + (target - y[0]) / own.all(0, 0));
  }
  if (bounds.turning == 0) return;
  const std::uint32_t k = bounds.turning;
  if (own.all(k, k) > 0.0) lambda[k] -= y[k] / own.all(k, k);
  const double stiffest = own.all(k + 1, k + 1) + own.all(k + 2, k + 2);
  if (stiffest > 0.0) {
    lambda[k + 1] -= y[k + 1] / stiffest;
    lambda[k + 2] -= y[k + 2] / stiffest;
  }
  confine_turning(bounds, lambda[0], lambda + k);
}

void ConeProblem::sweep(Sweeps* sweeps) {
  if (own_.empty()) begin_sweeps();
  sweeps->acceleration.go_ahead(sweeps);
  Eigen::VectorXd &lambda = sweeps->lambda, &y = sweeps->y;
  double change = 0.0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const auto i = static_cast<Eigen::Index>(block.first);
    double before[6];
    std::copy_n(&lambda[i], block.count, before);
    relax(block, own_[b], &lambda[i], &y[i]);
    for (std::uint32_t k = 0; k < block.count; ++k) {
      const double pushed = lambda[i + k] - before[k];
      if (pushed == 0.0) continue;
      change = std::max(change, std::fabs(pushed) * way_of(other_[block.first + k]));
      for (const RowRange& range : neighbours_[b])
        y.segment(range.first, range.count) += pushed * response_.col(i + k).segment(range.first, range.count);
    }
  }
  sweeps->acceleration.note(*sweeps, change);
}

void ConeProblem::Sweeps::start(const Eigen::VectorXd& from, const Eigen::VectorXd& y_from) {
  lambda = from, y = y_from;
  acceleration.forget();
}

void ConeProblem::Sweeps::read(std::vector<double>* state) const {
  state->assign(lambda.begin(), lambda.end());
  state->insert(state->end(), y.begin(), y.end());
}

// Rows are scaled to about 1.
void ConeProblem::Sweeps::read_responses(std::vector<double>* responses) const {
  responses->assign(static_cast<std::size_t>(lambda.size()), 1.0);
}

void ConeProblem::Sweeps::write(const std::vector<double>& state) {
  std::copy_n(state.begin(), lambda.size(), lambda.begin());
  std::copy_n(state.begin() + lambda.size(), y.size(), y.begin());
}

}  // namespace gravitas
