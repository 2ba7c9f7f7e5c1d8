#include "plugin_sdk/shifted_jacobian.h"

#include <array>

namespace gravitas {
namespace {

constexpr Eigen::Index kRates = 6;

struct Complex {
  double real, imaginary;
};
Complex product(const Complex& a, const Complex& b) {
  return {a.real * b.real - a.imaginary * b.imaginary, a.real * b.imaginary + a.imaginary * b.real};
}
Complex inverse(const Complex& a) {
  const double square = a.real * a.real + a.imaginary * a.imaginary;
  return {a.real / square, -a.imaginary / square};
}

}  // namespace

void ShiftedJacobian::factorise(const LocalMotion& motion, double real, double imaginary) {
  parts_ = imaginary == 0.0 ? 1 : 2;
  const Complex shift = {real, imaginary}, slowness = inverse(shift);
  real_ = slowness.real, imaginary_ = slowness.imaginary;
  groups_.resize(motion.groups().size());
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const LocalMotion::Group& from = motion.groups()[g];
    Group& group = groups_[g];
    group.body = &from.body;
    const Eigen::Index size = from.accelerations.rows();
    group.carried.resize(parts_ * size, parts_ * size);
    for (Eigen::Index part = 0; part < parts_; ++part) {
      group.turns[part].clear();
      for (std::size_t m = 0; m < from.body.size(); ++m) {
        const Vector3 half = 0.5 * from.spin[m];
        Complex square = product(shift, shift);
        square.real += half.squaredNorm();
        const Complex second = product(slowness, inverse(square)), first = product(shift, second);
        const auto of = [&](const Complex& c) { return part == 0 ? c.real : c.imaginary; };
        const Matrix3 cross = skew(half);
        group.turns[part].push_back(of(slowness) * Matrix3::Identity() + of(first) * cross +
                                    of(second) * cross * cross);
        const Eigen::Index column = kRates * static_cast<Eigen::Index>(m);
        auto carried = group.carried.block(part * size, column, size, kRates);
        carried.leftCols<3>() = of(slowness) * from.accelerations.middleCols<3>(2 * column);
        carried.rightCols<3>() = from.accelerations.middleCols<3>(2 * column + 3) * group.turns[part].back();
      }
    }
    if (parts_ == 2) {
      group.carried.topRightCorner(size, size) = -group.carried.bottomLeftCorner(size, size);
      group.carried.bottomRightCorner(size, size) = group.carried.topLeftCorner(size, size);
    }
    Eigen::MatrixXd matrix = -group.carried;
    matrix.diagonal().array() += real;
    for (Eigen::Index part = 0; part < parts_; ++part) {
      auto own = matrix.block(part * size, part * size, size, size);
      for (Eigen::Index column = 0; column < size; column += kRates)
        own.middleCols<kRates>(column) -= from.accelerations.middleCols<kRates>(2 * column + kRates);
    }
    if (parts_ == 2) {
      matrix.topRightCorner(size, size).diagonal().array() -= imaginary;
      matrix.bottomLeftCorner(size, size).diagonal().array() += imaginary;
    }
    group.factors.factorise(matrix);
  }
}

void ShiftedJacobian::solve(Eigen::VectorXd* real, Eigen::VectorXd* imaginary) const {
  const std::array<Eigen::VectorXd*, 2> b = {real, imaginary};
  for (const Group& group : groups_) {
    const auto count = static_cast<Eigen::Index>(group.body->size());
    const auto first_of = [&](Eigen::Index m) {
      return LocalMotion::kNumbers * static_cast<Eigen::Index>((*group.body)[static_cast<std::size_t>(m)]);
    };
    Eigen::VectorXd positions(parts_ * kRates * count), rates(positions.size());
    for (Eigen::Index part = 0; part < parts_; ++part) {
      for (Eigen::Index m = 0; m < count; ++m) {
        const Eigen::Index at = kRates * (part * count + m);
        positions.segment<kRates>(at) = b[part]->segment<kRates>(first_of(m));
        rates.segment<kRates>(at) = b[part]->segment<kRates>(first_of(m) + kRates);
      }
    }
    rates += group.carried * positions;
    rates = group.factors.solve(rates);
    positions += rates;
    for (Eigen::Index m = 0; m < count; ++m) {
      const Eigen::Index to = first_of(m), other = kRates * (count + m);
      const auto place = static_cast<std::size_t>(m);
      Eigen::Matrix<double, kRates, 1> carried[2];
      const auto moved = positions.segment<kRates>(kRates * m);
      carried[0] << real_ * moved.head<3>(), group.turns[0][place] * moved.tail<3>();
      if (parts_ == 2) {
        const auto also = positions.segment<kRates>(other);
        carried[0].head<3>() -= imaginary_ * also.head<3>();
        carried[0].tail<3>() -= group.turns[1][place] * also.tail<3>();
        carried[1] << imaginary_ * moved.head<3>() + real_ * also.head<3>(),
            group.turns[1][place] * moved.tail<3>() + group.turns[0][place] * also.tail<3>();
        imaginary->segment<kRates>(to) = carried[1];
        imaginary->segment<kRates>(to + kRates) = rates.segment<kRates>(other);
      }
      real->segment<kRates>(to) = carried[0];
      real->segment<kRates>(to + kRates) = rates.segment<kRates>(kRates * m);
    }
  }
}

}  // namespace gravitas
