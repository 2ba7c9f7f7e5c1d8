// The laws of ConeProblem: projections, the linear equations of a Newton step, and a sweep.
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "plugin_sdk/solver/cone_problem.h"
#include "plugin_sdk/solver/coulomb_contact.h"

namespace gravitas {
namespace {

using Vector2 = Eigen::Vector2d;

// Added to the diagonal of a step's matrix, whose diagonal is 1: dependent rows stay solvable.
constexpr double kProximal = 1e-10;

double length_of(double a, double b) { return std::sqrt(a * a + b * b); }

// Shortens a vector of two to a radius.
void into_disc(double radius, double* v) {
  const double length = length_of(v[0], v[1]);
  if (length <= radius) return;
  const double share = length > 0.0 ? radius / length : 0.0;
  v[0] *= share, v[1] *= share;
}

}  // namespace

void ConeProblem::project(const Block& block, const double* lambda, const double* y, const double* load,
                          double* projected) const {
  const std::uint32_t r = other_[block.first];
  if (block.contact < 0) {
    const JointLaw& law = rows[r].law;
    const double scale = scale_[r];
    const double to_lower = lambda[0] + (law.lower_target / scale - y[0]);
    const double to_upper = lambda[0] + (law.upper_target / scale - y[0]);
    double to = 0.0;
    if (law.has_lower && to_lower > 0.0) {
      to = to_lower;
    } else if (law.has_upper && to_upper < 0.0) {
      to = to_upper;
    }
    projected[0] = std::clamp(to, -law.bound * scale, law.bound * scale);
    return;
  }
  const ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
  projected[0] = std::max(0.0, lambda[0] + (contact.target / scale_[r] - y[0]));
  const double pressed = load != nullptr ? *load : projected[0];
  std::uint32_t k = 1;
  if (contact.has_friction) {
    projected[1] = lambda[1] - y[1], projected[2] = lambda[2] - y[2];
    into_disc((block.slides ? contact.dynamic_friction : contact.static_friction) * pressed, projected + 1);
    k = 3;
  }
  if (!contact.has_turning) return;
  const double lever = scale_[r + k] / scale_[r];
  const double spin = contact.spinning_friction * lever * pressed;
  projected[k] = std::clamp(lambda[k] - y[k], -spin, spin);
  projected[k + 1] = lambda[k + 1] - y[k + 1], projected[k + 2] = lambda[k + 2] - y[k + 2];
  into_disc(contact.rolling_friction * lever * pressed, projected + k + 1);
}

double ConeProblem::residual_of(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y,
                                const Eigen::VectorXd* loads) const {
  double worst = 0.0;
  for (const Block& block : blocks_) {
    double projected[6];
    project(block, &lambda[block.first], &y[block.first], loads != nullptr ? &(*loads)[block.first] : nullptr,
            projected);
    for (std::uint32_t k = 0; k < block.count; ++k) {
      const std::uint32_t r = other_[block.first + k];
      worst = std::max(worst, std::fabs(lambda[block.first + k] - projected[k]) * scale_[r] * rows[r].length);
    }
  }
  return worst;
}

// matrix d = side, d the change of lambda: every row that is held by its law as y + W' d = target, every other as where
// its law puts it.
void ConeProblem::linearise(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, const Eigen::VectorXd* loads,
                            Eigen::MatrixXd* matrix, Eigen::VectorXd* side) const {
  const auto hold = [&](Eigen::Index i, double missing) {
    matrix->row(i) = response_.row(i);
    (*matrix)(i, i) += kProximal;
    (*side)[i] = missing;
  };
  const auto put = [&](Eigen::Index i, double place) {
    matrix->row(i).setZero();
    (*matrix)(i, i) = 1.0;
    (*side)[i] = place - lambda[i];
  };
  // two rows that slide along z against a radius mu lambda_N:
  //   (1 - K) d + K W' d - mu dir d_N = mu lambda_N dir - lambda,  K = radius/|z| (1 - dir dir^T)
  const auto slide = [&](Eigen::Index i, Eigen::Index normal, double mu, double radius) {
    const Vector2 z(lambda[i] - y[i], lambda[i + 1] - y[i + 1]);
    const double length = z.norm();
    const Vector2 direction = z / length;
    const double share = std::min(1.0, radius / length);
    const Eigen::Matrix2d across = share * (Eigen::Matrix2d::Identity() - direction * direction.transpose());
    for (int a = 0; a < 2; ++a) {
      matrix->row(i + a) = across(a, 0) * response_.row(i) + across(a, 1) * response_.row(i + 1);
      for (int b = 0; b < 2; ++b) (*matrix)(i + a, i + b) += (a == b ? 1.0 : 0.0) - across(a, b) * (1.0 - kProximal);
      if (loads == nullptr) (*matrix)(i + a, normal) -= mu * direction[a];
      (*side)[i + a] = mu * (loads == nullptr ? lambda[normal] : (*loads)[normal]) * direction[a] - lambda[i + a];
    }
  };
  const auto disc = [&](Eigen::Index i, Eigen::Index normal, double mu, double normal_after) {
    const double radius = mu * normal_after;
    const double length = length_of(lambda[i] - y[i], lambda[i + 1] - y[i + 1]);
    if (length <= radius) {
      for (int a = 0; a < 2; ++a) hold(i + a, -y[i + a]);
    } else {
      slide(i, normal, mu, radius);
    }
  };

  for (const Block& block : blocks_) {
    const auto i = static_cast<Eigen::Index>(block.first);
    const std::uint32_t r = other_[block.first];
    double projected[6];
    project(block, &lambda[i], &y[i], loads != nullptr ? &(*loads)[i] : nullptr, projected);
    if (block.contact < 0) {
      const JointLaw& law = rows[r].law;
      const double bound = law.bound * scale_[r];
      const bool is_held = projected[0] != 0.0 && std::fabs(projected[0]) < bound;
      if (is_held || (law.is_equality() && std::fabs(projected[0]) < bound)) {
        hold(i, projected[0] - lambda[i]);
      } else {
        put(i, projected[0]);
      }
      continue;
    }
    const ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
    if (!(projected[0] > 0.0) && loads == nullptr) {
      for (std::uint32_t k = 0; k < block.count; ++k) put(i + k, 0.0);
      continue;
    }
    if (projected[0] > 0.0) {
      hold(i, projected[0] - lambda[i]);
    } else {
      put(i, 0.0);
    }
    const double pressed = loads != nullptr ? (*loads)[i] : projected[0];
    Eigen::Index k = 1;
    if (contact.has_friction) {
      disc(i + 1, i, block.slides ? contact.dynamic_friction : contact.static_friction, pressed);
      k = 3;
    }
    if (!contact.has_turning) continue;
    const double lever = scale_[r + static_cast<std::uint32_t>(k)] / scale_[r];
    const double spin = contact.spinning_friction * lever;
    const double wanted = lambda[i + k] - y[i + k];
    if (std::fabs(wanted) <= spin * pressed) {
      hold(i + k, -y[i + k]);
    } else {
      const double bound = std::copysign(spin, wanted);
      put(i + k, bound * (loads == nullptr ? lambda[i] : pressed));
      if (loads == nullptr) (*matrix)(i + k, i) -= bound;
    }
    disc(i + k + 1, i, contact.rolling_friction * lever, pressed);
  }
}

// False, with nothing done, if the step is not finite.
bool ConeProblem::newton_step(const Eigen::VectorXd* loads, Eigen::VectorXd* lambda, Eigen::VectorXd* y) const {
  const Eigen::Index count = lambda->size();
  Eigen::MatrixXd matrix(count, count);
  Eigen::VectorXd side(count);
  linearise(*lambda, *y, loads, &matrix, &side);
  // rows that stand by themselves go to the right
  std::vector<Eigen::Index> coupled;
  Eigen::VectorXd step = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    bool is_alone = matrix(i, i) == 1.0;
    for (Eigen::Index j = 0; is_alone && j < count; ++j) is_alone = j == i || matrix(i, j) == 0.0;
    if (is_alone) {
      step[i] = side[i];
    } else {
      coupled.push_back(i);
    }
  }
  const auto size = static_cast<Eigen::Index>(coupled.size());
  Eigen::MatrixXd core(size, size);
  Eigen::VectorXd rest(size);
  for (Eigen::Index a = 0; a < size; ++a) {
    const Eigen::Index i = coupled[static_cast<std::size_t>(a)];
    rest[a] = side[i] - matrix.row(i).dot(step);
    for (Eigen::Index b = 0; b < size; ++b) core(a, b) = matrix(i, coupled[static_cast<std::size_t>(b)]);
  }
  if (size > 0) rest = core.partialPivLu().solve(rest);
  if (!rest.allFinite() || !step.allFinite()) return false;
  for (Eigen::Index a = 0; a < size; ++a) step[coupled[static_cast<std::size_t>(a)]] = rest[a];
  *lambda += step;
  *y = start_others_ + response_ * *lambda;
  return true;
}

// The law of a block alone, with all others as they are.
void ConeProblem::relax(const Block& block, const Eigen::MatrixXd& own, double* lambda, const double* y) const {
  if (block.contact < 0) {
    const JointLaw& law = rows[other_[block.first]].law;
    const double scale = scale_[other_[block.first]];
    JointLaw scaled = law;
    scaled.lower_target /= scale, scaled.upper_target /= scale, scaled.bound *= scale;
    if (own(0, 0) > 0.0) lambda[0] = relaxed_multiplier(scaled, lambda[0], y[0], own(0, 0));
    return;
  }
  const std::uint32_t r = other_[block.first];
  const ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
  const double target = contact.target / scale_[r];
  if (!(own(0, 0) > 0.0)) return;
  std::uint32_t k = 1;
  if (contact.has_friction) {
    const double mu = block.slides ? contact.dynamic_friction : contact.static_friction;
    const Matrix3 response = 0.5 * (own.topLeftCorner<3, 3>() + own.topLeftCorner<3, 3>().transpose());
    const Vector3 now(lambda[0], lambda[1], lambda[2]);
    const Vector3 alone = Vector3(y[0], y[1], y[2]) - response * now;
    Vector3 next = now;
    const double size = response.trace();
    const bool has_inverse = response.determinant() > 1e-12 * size * size * size;
    if (!has_inverse || !solve_coulomb_contact(response, response.inverse(), alone, target, mu, &next)) {
      next.x() = std::max(0.0, now.x() + (target - y[0]) / response(0, 0));
      const Vector3 moved = Vector3(y[0], y[1], y[2]) + response.col(0) * (next.x() - now.x());
      const double stiffest = response.bottomRightCorner<2, 2>().trace();
      if (stiffest > 0.0) next.tail<2>() -= moved.tail<2>() / stiffest;
      into_disc(mu * next.x(), &next.y());
    }
    for (int i = 0; i < 3; ++i) lambda[i] = next[i];
    k = 3;
  } else {
    lambda[0] = std::max(0.0, lambda[0] + (target - y[0]) / own(0, 0));
  }
  if (!contact.has_turning) return;
  const double lever = scale_[r + k] / scale_[r];
  const double spin = contact.spinning_friction * lever * lambda[0];
  if (own(k, k) > 0.0) lambda[k] = std::clamp(lambda[k] - y[k] / own(k, k), -spin, spin);
  const double stiffest = own(k + 1, k + 1) + own(k + 2, k + 2);
  if (stiffest > 0.0) {
    lambda[k + 1] -= y[k + 1] / stiffest;
    lambda[k + 2] -= y[k + 2] / stiffest;
  }
  into_disc(contact.rolling_friction * lever * lambda[0], lambda + k + 1);
}

void ConeProblem::sweep(Eigen::VectorXd* lambda, Eigen::VectorXd* y) const {
  for (const Block& block : blocks_) {
    const auto i = static_cast<Eigen::Index>(block.first);
    double before[6];
    std::copy_n(&(*lambda)[i], block.count, before);
    relax(block, response_.block(i, i, block.count, block.count), &(*lambda)[i], &(*y)[i]);
    for (std::uint32_t k = 0; k < block.count; ++k) {
      const double change = (*lambda)[i + k] - before[k];
      if (change != 0.0) *y += change * response_.col(i + k);
    }
  }
}

bool ConeProblem::let_slide(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, double slip) {
  bool any = false;
  for (Block& block : blocks_) {
    if (block.contact < 0 || block.slides || !(lambda[block.first] > 0.0)) continue;
    const ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
    if (!(contact.dynamic_friction < contact.static_friction)) continue;
    if (length_of(y[block.first + 1], y[block.first + 2]) * scale_[other_[block.first]] <= slip) continue;
    block.slides = any = true;
  }
  return any;
}

// Takes away what rounding left outside of the laws.
void ConeProblem::into_cones(Eigen::VectorXd* lambda) const {
  for (const Block& block : blocks_) {
    double* at = &(*lambda)[block.first];
    const std::uint32_t r = other_[block.first];
    if (block.contact < 0) {
      const JointLaw& law = rows[r].law;
      if (!law.has_lower) at[0] = std::min(at[0], 0.0);
      if (!law.has_upper) at[0] = std::max(at[0], 0.0);
      at[0] = std::clamp(at[0], -law.bound * scale_[r], law.bound * scale_[r]);
      continue;
    }
    const ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
    at[0] = std::max(0.0, at[0]);
    std::uint32_t k = 1;
    if (contact.has_friction) {
      into_disc((block.slides ? contact.dynamic_friction : contact.static_friction) * at[0], at + 1);
      k = 3;
    }
    if (!contact.has_turning) continue;
    const double lever = scale_[r + k] / scale_[r];
    const double spin = contact.spinning_friction * lever * at[0];
    at[k] = std::clamp(at[k], -spin, spin);
    into_disc(contact.rolling_friction * lever * at[0], at + k + 1);
  }
}

}  // namespace gravitas
