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
// those of velocities are made of the wrenches' Jacobian where it can be had (wrench_jacobian.h), else of differences:
// twelve derivatives a body of the largest group of bodies that feel each other (interaction_groups.h).
#pragma once

#include <Eigen/Core>
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
  // Length (s) of an inner step in which the fastest body turns nearly as far as is_in_chart allows; infinite where none
  // turns.
  double longest() const;

  // f(elapsed, y); false where the state is not finite. Throws Refusal where forces refuse it.
  bool evaluate(double elapsed, const Eigen::VectorXd& y, Eigen::VectorXd* f);
  // J where the inner step starts, with f there. Throws Refusal where it cannot be had.
  void differentiate(const Eigen::VectorXd& f);
  // The largest of (m, rad, and relative to speeds at the start above 1 m/s, 1 rad/s) over bodies; infinite where a number is
  // not finite.
  double size_of(const Eigen::VectorXd& change) const;
  // Size of the change in h that comes of rounding alone, where forces answer that of places in the world (of parts of
  // bodies of about 1 m) with velocities at `rate` (1/s).
  double rounding(double h, double rate) const;
  // True while no body has turned by more than 2 rad; the chart ends at 2 pi.
  bool is_in_chart(const Eigen::VectorXd& y) const;
  // Ends an inner step of h at y; the next one starts there.
  void accept(double h, const Eigen::VectorXd& y);
  // After accept(h, y): J is turned with the bodies, which leaves it that of a mechanism that turns as a whole.
  void turn_jacobian(const Eigen::VectorXd& y);
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

}  // namespace gravitas
