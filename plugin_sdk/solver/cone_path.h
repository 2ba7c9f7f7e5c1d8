// The way from the middle of all laws to a solution: where Newton's steps on the laws themselves do not settle.
//
//   y = q + W lambda;  side:  p w = g, w > 0, (b - p) s = g, s > 0,  y - target = w - s (with an upper target: target - y)
//                      disc:  y_T = -s lambda_T, s (f^2 lambda_N^2 - |lambda_T|^2) = g, s > 0
//
// A scalar row has a side for each of its targets, lambda = p_lower - p_upper, and s only where its bound b is finite; a
// contact's normal is a row with a lower one.
// At g = 0 these are the laws of cone_problem.h (a disc is friction, or the moment of rolling or spinning friction). For
// g > 0 they are smooth and every row has a stiffness of its own, so that rows that depend on each other and ratios of mass
// do no harm. A primal-dual interior-point method: Newton's steps for a g that shrinks by what the last step got done, no
// step further than 99 % of the way to a border.
//
// The way may turn back: Coulomb's law is not monotone. Then friction's share in the normal law is taken as given,
//   w = y_N - target + sum f (sigma - s f lambda_N),
// which makes the problem that of a convex function over cones, whose path never turns (Acary, Cadoux, Lemaréchal and Malick
// 2011; the interior-point form Acary, Armand, Nguyen and Shpakovych 2023), and sigma = |y_T| is found by iteration, with
// steps that double while the error keeps its direction and halve when it turns: a fixed point that repels is left for
// another one.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

class ConePath {
 public:
  // `response` is W, `start` q, of rows that the caller scaled to W_ii of about 1; both must outlive the path.
  ConePath(const Eigen::MatrixXd& response, const Eigen::VectorXd& start) : response_(response), start_(start) {}

  // lower <= y <= upper (infinite: none, at least one is there) with |lambda| <= bound.
  void add_scalar(Eigen::Index row, double lower, double upper, double bound);
  // `count` rows (one or two) bounded by factor times the multiplier of `normal`, a row with a lower target alone; with factor
  // 0 they push nothing.
  void add_disc(Eigen::Index row, int count, Eigen::Index normal, double factor);

  // Whether next() has a guess that it has not made: without discs the problem is convex, and all guesses are the first.
  bool has_next() const { return rounds_ == 0 || !discs_.empty(); }
  // Sets the next guess at a solution and its y: the end of the way itself, then those of the convex problems in turn. The
  // way is followed until multipliers times slacks are below `smallest` squared. Returns the steps that it took, at least
  // 1.
  std::uint32_t next(double smallest, Eigen::VectorXd* lambda, Eigen::VectorXd* y);

 private:
  struct Side {
    Eigen::Index row;
    double sign;  // 1: lower, -1: upper
    double target, bound;
    double push = 0.0, slack = 0.0, excess = 0.0;  // p, w, s
    double push_step = 0.0, slack_step = 0.0, excess_step = 0.0;
    bool is_bounded() const;
    // The change d of sign y is missing(g) - stiffness() times that of p.
    double stiffness() const;
    double missing(double aim, double y) const;
  };
  struct Disc {
    Eigen::Index row, normal;
    int count;
    double factor;
    double slip = 0.0, slip_step = 0.0;  // s
    double shift = 0.0, error = 0.0;     // sigma, and by how much it was off
    double length(const Eigen::VectorXd& of) const { return of.segment(row, count).norm(); }
    // what is left of the bound, squared
    double room(const Eigen::VectorXd& lambda) const {
      const double bound = factor * lambda[normal], used = length(lambda);
      return (bound - used) * (bound + used);
    }
  };

  void enter(Eigen::VectorXd* lambda, Eigen::VectorXd* y);
  double mean_product(const Eigen::VectorXd& lambda) const;
  void linearise(double aim, const Eigen::VectorXd& lambda, const Eigen::VectorXd& y);
  // Sets the steps of sides and slips; returns the share of all steps that stays inside.
  double find_share(double aim, const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, const Eigen::VectorXd& step);
  void shift_slips(const Eigen::VectorXd& y);

  const Eigen::MatrixXd& response_;
  const Eigen::VectorXd& start_;
  std::vector<Side> sides_;  // those of a row in turn
  std::vector<Disc> discs_;
  std::vector<Eigen::Index> none_;  // rows that push nothing
  std::uint32_t rounds_ = 0;
  double relaxation_ = 1.0;
  double load_ = 0.0, speed_ = 0.0;  // of what lambda and y are
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd side_;
};

}  // namespace gravitas
