// For authors of implicit integrators with inner steps: free motion around the start of an inner step, and its Jacobian.
//
// Around the start (x0, q0) of an inner step the state is y = (x - x0, r, e^(c s) v, e^(c s) w), twelve numbers a movable
// body, with q = exp(r) q0 and s the time since then, so that damping c is an integrating factor and the attitude stays on
// the group; y' = f(s, y). Damping with c times the time step above 1 acts in two halves around the step instead.
//
// J = df/dy at s = 0. The rates of positions and attitudes are known in closed form,
//
//   d(x, r)'/d(x, r) = A = (0, 0; 0, [w]/2),     d(x, r)'/d(v, w) = 1,
//
// those of velocities are made of the forces' Jacobian where it can be had (wrench_jacobian.h), else of differences:
// twelve derivatives a body of the largest group of bodies that feel each other (interaction_groups.h).
#pragma once

#include <Eigen/LU>
#include <vector>

#include "plugin_sdk/integrator.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {

class LocalMotion {
 public:
  static constexpr Eigen::Index kNumbers = 12;

  // Bodies that feel each other, as places among the movable ones.
  struct Group {
    std::vector<std::size_t> body;
    std::vector<Vector3> spin;      // w
    Eigen::MatrixXd accelerations;  // d(v, w)'/dy: six rows and twelve columns a body
  };

  // Starts at the request's state. Both must live as long as the step.
  void begin(const stage::IntegratorIntegrateRequest& request, Derivatives* derivatives);
  // The bodies' states at the end of the accepted inner steps, as the answer.
  void write(const stage::IntegratorIntegrateReply& reply) const;

  bool is_empty() const { return bodies_.empty(); }
  // s since the start of the step.
  double done() const { return done_; }
  // y where the inner step starts.
  const Eigen::VectorXd& start() const { return start_; }
  const std::vector<Group>& groups() const { return groups_; }
  std::size_t bodies() const { return bodies_.size(); }
  const Twist& twist_at_start(std::size_t body) const { return bodies_[body].start.twist; }

  // f(elapsed, y); false where the state is not finite.
  bool evaluate(double elapsed, const Eigen::VectorXd& y, Eigen::VectorXd* f);
  // J where the inner step starts, with f there. Throws Refusal where it cannot be had.
  void differentiate(const Eigen::VectorXd& f);
  // The largest of (m, rad, and relative to speeds at the start above 1 m/s, 1 rad/s) over bodies.
  double size_of(const Eigen::VectorXd& change) const;
  // True while no body has turned so far that its chart ends (2 pi).
  bool is_in_chart(const Eigen::VectorXd& y) const;
  // Ends an inner step of h at y; the next one starts there. J is turned with the bodies, which leaves it that of a mechanism
  // that turns as a whole.
  void accept(double h, const Eigen::VectorXd& y);
  // What y would be around the end of an inner step of h.
  Eigen::VectorXd around_end(double h, const Eigen::VectorXd& end, const Eigen::VectorXd& y) const;

 private:
  using Numbers = Eigen::Matrix<double, kNumbers, 1>;

  struct Body {
    std::size_t row;
    BodyState start;  // of the inner step
    Vector3 origin;   // position at the start of the step
    Vector3 moved;    // since then: summed by itself, far from the world's origin it has more digits
    double damping;   // within the step
    double kept;      // of the velocities, before and after the step
  };
  // Of a movable body: its group, and its place there.
  struct Member {
    Group* group = nullptr;
    std::size_t place = 0;
  };

  BodyState state_of(const Body& body, const Numbers& y, double elapsed) const;
  void start_inner_step();
  void carry_kinematic(double elapsed);
  void ask_jacobian();
  void compose();
  void take_differences(const Eigen::VectorXd& f);
  void turn(const Eigen::VectorXd& y, Group* group) const;

  const stage::IntegratorIntegrateRequest* request_ = nullptr;  // of the call in hand, as the next
  Derivatives* derivatives_ = nullptr;
  double done_ = 0.0;
  // scratch
  std::vector<Body> bodies_;
  std::vector<Group> groups_;
  Eigen::VectorXd start_, shifted_, rate_;
  TrialColumns trial_;
  WrenchJacobian jacobian_;  // of the start of the inner step
  std::vector<double> wrenches_;
  std::vector<Member> member_;  // by row
};

// (s - J) z = b for a shift s, 1/s, real or complex. Positions and attitudes are eliminated, so that the matrices have six
// rows a body: with P = (s - A)^-1, b = (p, q) and z = (x, v),
//
//   (s - D - C P) v = q + C P p,    x = P (p + v),    C = dv'/dx, D = dv'/dv.
template <typename Scalar>
class ShiftedJacobian {
 public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  // Call fix_eigen_blocks() once before.
  void factorise(const LocalMotion& motion, Scalar shift) {
    groups_.resize(motion.groups().size());
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const LocalMotion::Group& from = motion.groups()[g];
      Group& group = groups_[g];
      group.body = &from.body;
      group.turns.clear();
      group.carried.resize(from.accelerations.rows(), from.accelerations.rows());
      for (std::size_t m = 0; m < from.body.size(); ++m) {
        const Matrix3 half = 0.5 * skew(from.spin[m]);
        group.turns.push_back((shift * Block::Identity() - half.cast<Scalar>()).inverse());
        const Eigen::Index column = kRates * static_cast<Eigen::Index>(m);
        const auto positions = from.accelerations.template middleCols<kRates>(2 * column);
        group.carried.template middleCols<3>(column) = positions.template leftCols<3>().template cast<Scalar>() / shift;
        group.carried.template middleCols<3>(column + 3) =
            positions.template rightCols<3>().template cast<Scalar>() * group.turns.back();
      }
      Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> matrix = -group.carried;
      for (std::size_t m = 0; m < from.body.size(); ++m) {
        const Eigen::Index column = kRates * static_cast<Eigen::Index>(m);
        matrix.template middleCols<kRates>(column) -=
            from.accelerations.template middleCols<kRates>(2 * column + kRates).template cast<Scalar>();
      }
      matrix.diagonal().array() += shift;
      group.factors.compute(matrix);
    }
    shift_ = shift;
  }

  // In place; b has all bodies' numbers.
  void solve(Vector* b) const {
    for (const Group& group : groups_) {
      const auto count = static_cast<Eigen::Index>(group.body->size());
      Vector positions(kRates * count), rates(kRates * count);
      for (Eigen::Index m = 0; m < count; ++m) {
        const Eigen::Index from = first_of(group, m);
        positions.template segment<kRates>(kRates * m) = b->template segment<kRates>(from);
        rates.template segment<kRates>(kRates * m) = b->template segment<kRates>(from + kRates);
      }
      rates += group.carried * positions;
      rates = group.factors.solve(rates).eval();
      positions += rates;
      for (Eigen::Index m = 0; m < count; ++m) {
        const Eigen::Index to = first_of(group, m);
        b->template segment<3>(to) = positions.template segment<3>(kRates * m) / shift_;
        b->template segment<3>(to + 3) =
            group.turns[static_cast<std::size_t>(m)] * positions.template segment<3>(kRates * m + 3);
        b->template segment<kRates>(to + kRates) = rates.template segment<kRates>(kRates * m);
      }
    }
  }

 private:
  static constexpr Eigen::Index kRates = 6;
  using Block = Eigen::Matrix<Scalar, 3, 3>;

  struct Group {
    const std::vector<std::size_t>* body = nullptr;
    std::vector<Block> turns;                                       // of P, for attitudes
    Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> carried;  // C P
    Eigen::PartialPivLU<Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>> factors;
  };
  static Eigen::Index first_of(const Group& group, Eigen::Index m) {
    return LocalMotion::kNumbers * static_cast<Eigen::Index>((*group.body)[static_cast<std::size_t>(m)]);
  }

  std::vector<Group> groups_;
  Scalar shift_ = 0.0;
};

}  // namespace gravitas
