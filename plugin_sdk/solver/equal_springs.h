// Rows of joints seen as springs between their bodies: K = sum of s J^T J over the rows, with J a row's direction and s a
// stiffness. Two questions about rows that depend on each other are least squares with it:
//
//  - what of numbers t at the rows some motion v of the bodies could make: t = J v with sum of s (t - J v)^2 least;
//  - how a load is shared: of all multipliers that push the bodies alike, sum of J^T lambda = f, those of a structure whose
//    joints give way alike, lambda = s J v with K v = f, whose squares over s add up to least. They depend on where the joints
//    are, not on the bodies' masses.
//
// Directions in which rows are off by rounding alone are none: each body is held by springs of its own, too, 1e-11 of the
// stiffest, and what they bear is given to the others again.
//
// K has a body's six freedoms where the matrix of the rows, J M^-1 J^T, has six rows of each joint: in a wall of n x n bricks it
// takes n^4 operations, where the null space of that matrix takes n^6.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/profile_ldlt.h"

namespace gravitas {

class EqualSprings {
 public:
  // Of a row whose unit is `length` m: moments count by way of that length.
  static double stiffness(double length) { return length > 0.0 ? length * length : 1.0; }

  void start(std::size_t bodies);
  // The next row; the order should be one of elimination. Bodies that nothing pushes do not move. One of stiffness 0 is no
  // spring: its numbers stay as they are.
  template <typename Row, typename Bodies>
  void add(const Row& row, const Bodies& bodies, double stiffness) {
    rows_.push_back({stiffness, end_of(row.body1, bodies[row.body1], -row.direction.linear, row.direction.angular1),
                     end_of(row.body2, bodies[row.body2], row.direction.linear, row.direction.angular2)});
  }
  void factorise();

  // t, one number by row, becomes the nearest that motions of the bodies make.
  void fit(std::vector<double>* t) const;
  // The multipliers of equal springs under the load of these, to 1e-8 of it; false, and leaves them, where that cannot be.
  bool share(std::vector<double>* multipliers) const;

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  struct End {
    std::size_t freedom;  // the body's first; kNone: it does not move
    Vector6 direction;
  };
  struct Row {
    double stiffness;
    End one, two;
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  template <typename Body>
  End end_of(std::uint32_t number, const Body& body, const Vector3& linear, const Vector3& angular) {
    if (!body.is_pushed()) return {kNone, Vector6::Zero()};
    if (freedom_[number] == kNone) freedom_[number] = freedoms_, freedoms_ += 6;
    Vector6 direction;
    direction << (body.inverse_mass > 0.0 ? 1.0 : 0.0) * linear,
        turnable(body.inverse_mass, body.inverse_inertia) * angular;
    return {freedom_[number], direction};
  }
  // rad to m at the radius of gyration; none about axes about which nothing turns the body.
  static Matrix3 turnable(double inverse_mass, const Matrix3& inverse_inertia);
  double along(const Row& row, const std::vector<double>& motion) const;
  static void push(const Row& row, double amount, std::vector<double>* load);
  // v, and what of the load is then left.
  std::vector<double> motion_under(std::vector<double>* load) const;

  std::vector<Row> rows_;
  std::vector<std::size_t> freedom_;  // by body
  std::size_t freedoms_ = 0;
  ProfileLdlt factor_;
};

}  // namespace gravitas
