// The change of multipliers that makes many rows right at once, found among the motions of the bodies.
//
//   (W + E) d = r,  W = J M^-1 J^T,  E diagonal > 0
//
// has as many unknowns as rows, three a contact; the motion x = M^-1 J^T d that belongs to it has six a body, and
//
//   (M + J^T E^-1 J) x = J^T E^-1 r,   d = E^-1 (r - J x),
//
// which is factorised (Cholesky) in blocks of six by six within the profile of who meets whom: a stack costs what a band
// does, four contacts of a face little more than one. Bodies are measured in units that make M one (x = C z, C C^T = M^-1),
// so that ratios of mass and infinite inertias do no harm. The difference r - J x is divided by E: with E = 1e-7 rounding
// leaves 1e-9 of a side that some motion meets, up to 1e-5 where rows depend on each other nearly. Steps are repeated.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

class HeldStep {
 public:
  // A system without rows; bodies that nothing pushes have no part in it.
  void start(const SolverBodies& bodies);
  // The row divided by `scale`, with its number in E.
  void add(std::uint32_t body1, std::uint32_t body2, const ConstraintDirection& direction, double scale,
           double softness);
  // False where numbers overflow.
  bool factorise();
  // d of a side, in the order of add(), in its place.
  void solve(std::vector<double>* side);

 private:
  using Numbers = Eigen::Matrix<double, 6, 1>;
  using Block = Eigen::Matrix<double, 6, 6>;
  static constexpr std::uint32_t kNowhere = 0xffffffff;

  // C of a body.
  struct Root {
    double of_mass;
    Matrix3 of_inertia;
  };
  struct Row {
    std::uint32_t place1, place2;
    double softness;
    Numbers part1, part2;  // J C
  };

  Block& block(std::uint32_t row, std::uint32_t column) { return blocks_[begin_[row] + column - first_[row]]; }

  std::vector<std::uint32_t> place_of_body_;
  std::vector<Root> roots_;  // by place
  std::vector<Row> rows_;
  std::vector<std::uint32_t> first_;  // place that each meets, itself or before
  std::vector<std::size_t> begin_;
  std::vector<Block> blocks_;  // of the lower triangle
  std::vector<Numbers> motion_;
};

}  // namespace gravitas
