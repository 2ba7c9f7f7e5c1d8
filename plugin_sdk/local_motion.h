// For authors of implicit integrators with inner steps: free motion around the start of an inner step, and its Jacobian.
//
// Around the start (x0, q0, v0, w0) of an inner step the state is y = (x - x0, r, v, w), twelve numbers a movable body, with
// q = exp(r) q0, so that the attitude stays on the group; y' = f(s, y) with s the time since then. Of a body with damping c
// it is what deviates from a motion that is known,
//
//   v_c = v_b + e^(-c s) (v0 - v_b),   x_c = s v_b + (1 - e^(-c s))/c (v0 - v_b)     (w_c, r_c likewise)
//   y = (x - x0 - x_c, r - r_c, v - v_c, w - w_c),     v' = a - c v
//
// with v_b = a0/c, the speed that the acceleration a0 at the start keeps up against damping, cut to the length of v0. So
// damping belongs to the equations, however strong it is, and y' = 0 where a body is free and where it falls at its last
// speed: both are exact, and y is never far greater than v0 asks for, however stiff the forces are.
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
    Eigen::MatrixXd accelerations;  // d(v, w)'/dy, with damping: six rows and twelve columns a body
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
  bool is_in_chart(double elapsed, const Eigen::VectorXd& y) const;
  // Ends an inner step of h at y; the next one starts there.
  void accept(double h, const Eigen::VectorXd& y);
  // After accept(h, y): J is turned with the bodies, which leaves it that of a mechanism that turns as a whole.
  void turn_jacobian();
  // After accept(h, end): what y, `later` than the end and told around the start of that inner step, is around its end.
  Eigen::VectorXd around_end(double later, const Eigen::VectorXd& y) const;

 private:
  using Numbers = Eigen::Matrix<double, kNumbers, 1>;

  // The motion that y deviates from: v_b, w_b, and what damping takes of the velocities at the start. Zero without damping.
  struct Known {
    Twist lasting, fading;
  };
  struct Body {
    std::size_t row;
    BodyState start;  // of the inner step
    Vector3 origin;   // position at the start of the step
    Vector3 moved;    // since then: summed by itself, far from the world's origin it has more digits
    double damping;
    Known known = {};
    // of the inner step before: its length (s), its motion, and what it moved and turned by
    double last_step = 0.0;
    Known last_known = {};
    Vector3 last_moved = Vector3::Zero(), last_turned = Vector3::Zero();
  };
  // Of a movable body: its group, and its place there.
  struct Member {
    Group* group = nullptr;
    std::size_t place = 0;
  };

  // x_c, r_c, v_c, w_c.
  static DampedMotion passed(const Known& known, double damping, double elapsed);
  static BodyState state_of(const Body& body, const Numbers& y, double elapsed);
  void find_known();
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
