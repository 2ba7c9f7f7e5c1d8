// Integrator `ImplicitMidpoint`: order 2, symmetric, A-stable. With bars for means of both ends, Pi = I w the body
// momentum and forces at (t + h/2, x_bar, q_bar, v_bar, w_bar), q_bar half way between q and q':
//
//   x' = x + h v_bar          v' = v + h f/m
//   q' = q cay(h W),          W = I^-1 (Pi + Pi') / 2,   cay(a) = (1, a/2) / |(1, a/2)|
//   q' Pi' = q Pi + h tau                                                 (world axes)
//
// A free rotor keeps its angular momentum (the last line) and its energy (W.(Pi' - Pi) = 0, since the Cayley map makes
// Pi' - Pi = h Pi_bar x W) to rounding at any step. With forces: energy is kept exactly where the potential is quadratic
// in x and does not turn bodies, to O(h^2) elsewhere, and there it wanders: a body that tumbles on a spring off its centre
// is 1, 2.6 and 3.6 % off after 1000, 4000 and 16,000 s at 1/60 s (Verlet 0.6 % at any time); momentum always.
// With damping c, a = f/m, and D = (1 - e^(-c h))/c for h,
//
//   x' = x + h v_bar          h v_bar = D v + (h - D)/c a          v' = e^(-c h) v + D a
//
// (angular momentum likewise): exact under constant forces and of a free rotor, which turns in slowed time.
// With joints that hold by locks alone, that step is made with forces alone, between two impulses along the joints' directions
// where it begins and ends, as in RATTLE:
//
//   v0 += M^-1 J^T(q0) lambda,   (q1, v1) = step(q0, v0) with g(q1) = 0,   v1 += M^-1 J^T(q1) mu with J(q1) v1 as joints want
//
// which is symmetric as well, keeps the momenta of what only joints hold together, and is the midpoint rule of the reduced
// motion where joints and forces are linear. lambda is found by chords. Where joints have limits with room, drives, friction
// or springs, or forces are so stiff that lambda or the step is not found so (h^2 k/m above about 1), the forces of the
// equations above are those with what joints do, which keeps neither.
// Sources: Simo, Wong, Int. J. Numer. Meth. Eng. 31 (1991) 19; Austin, Krishnaprasad, Wang, J. Comput. Phys. 107 (1993);
// Hairer, Lubich, Wanner, Geometric Numerical Integration, VII.1.
// The equations in (v_bar, W) are solved to rounding: by iteration where that contracts, else by Newton's method with
// the matrix from the wrenches' Jacobian where it can be had (wrench_jacobian.h), else by differences (six derivatives per
// body of the largest group that feels each other, interaction_groups.h). Stability: none is lost at any h k where forces are
// linear; but the method does not damp, so what it does not resolve keeps ringing (Rosenbrock damps). Known failures: a stiff spring
// that turns is given energy, damped or not (1 kg on 1 m at 1e8 N/m, damping ratio 0.3, under gravity at 1/60 s: 0.5 J become
// 41 in a second); attitudes of a body that turns by more than a radian a step lag (tan of the half angle); where no solution is
// found (forces that jump, h |w| in the tens and unequal moments) the step is refused.
#include <algorithm>
#include <cmath>
#include <utility>

#include "plugin_sdk/interaction_groups.h"
#include "plugin_sdk/math/dense_lu.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/place_search.h"

namespace gravitas {
namespace {

constexpr int kMostIterations = 60;
constexpr int kMostNewtonSteps = 30;
// Iteration is given up for Newton's method when a sweep leaves more than this of the last change.
constexpr double kContraction = 0.4;
constexpr double kConverged = 4e-16;
// Below this the change is rounding, if it does not shrink any more.
constexpr double kStagnant = 1e-9;
// As far as this it is where so many steps of Newton's in a row stay below: a light link between heavy bodies feels the rounding
// of what it carries.
constexpr double kNoise = 1e-7;
constexpr int kStepsOfNoise = 8;
// Share of x / h, of 1 rad / h and of the largest velocities that is no less than a body's velocities count, with x the
// largest distance from the origin of bodies that feel each other: kStagnant of it is what doubles resolve of
// places, attitudes and velocities whose differences make the forces, so that stiff systems settle, and bodies that others
// hold at rest.
constexpr double kResolved = 2e-6;
// A Newton step that leaves less than this of the last one goes on with its matrix.
constexpr double kGained = 1e-2;
constexpr int kMostHalvings = 12;
constexpr double kDifference = 1e-7;

// Turn of the Cayley map in body axes.
Quaternion cayley(const Vector3& turn) {
  return normalized(Quaternion(1.0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z()));
}

class ImplicitMidpoint final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "ImplicitMidpoint",
            .version = "1.1",
            .slot = Slot::kIntegrator,
            .meaning =
                "Implicit midpoint rule on the rotation group, order 2, keeps momentum, with joints that hold by locks "
                "alone, too, and the energy of what no force turns.",
            .capabilities = {"order=2"},
            .theta = 0.5};
  }
  explicit ImplicitMidpoint(PropertyCursor) { fix_eigen_blocks(); }

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    request_ = &request, derivatives_ = &derivatives, host_ = &host;
    h_ = request.time_step();
    begin();
    if (!bodies_.empty() && find_step()) {
      for_each_body(request, reply, [&](std::size_t i, const BodyState&) { return trial_.at(i); });
      return;
    }
    std::size_t next = 0;
    for_each_body(request, reply, [&](std::size_t, const BodyState&) { return end_of(next++); });
  }

 private:
  // A movable body and what the equations need of it.
  struct Body {
    std::size_t row;   // of the request
    BodyState start;   // with the velocities that would take a free body as far in h without damping, v D/h
    Vector3 momentum;  // body axes, of these
    Vector3 moments, inverse_moments;
    double inverse_mass;
    double reach;    // of a constant acceleration, in the mean velocity: h/2, or (h - D)/(c h)
    double damping;  // 1/s
    Twist undamped;  // at the start
    Vector3 torque;  // as asked last, in body axes at the start
  };
  // Bodies that feel each other, as places in bodies_.
  struct Group {
    std::vector<std::size_t> body;
    DenseLu factors;

    Eigen::Index size() const { return 6 * static_cast<Eigen::Index>(body.size()); }
    Eigen::Index number(Eigen::Index k) const {
      return 6 * static_cast<Eigen::Index>(body[static_cast<std::size_t>(k / 6)]) + k % 6;
    }
  };
  using Vector6 = Eigen::Matrix<double, 6, 1>;  // v_bar, W
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  using MiddleChange = Eigen::Matrix<double, 12, 6>;
  // Of a body that is pushed: its group, counted from 1, and its place there.
  struct Member {
    std::size_t group = 0, place = 0;
  };

  void begin() {
    bodies_.clear();
    groups_.clear();
    keeps_to_joints_ = false;
    trial_.resize(derivatives_->size());
    for (std::size_t i = 0; i < derivatives_->size(); ++i) {
      if ((request_->flags()[i] & kMovable) == 0) continue;
      const BodyState s = derivatives_->start(i);
      const double damping = request_->damping()[i];
      bodies_.push_back({i, s, Vector3::Zero(), vector_at(request_->inertia(), i),
                         vector_at(request_->inverse_inertia(), i), request_->inverse_mass()[i],
                         damping != 0.0 ? damped_distance(damping, h_) / h_ : 0.5 * h_, damping, s.twist,
                         Vector3::Zero()});
      start_with(s.twist, &bodies_.back());
    }
    carry_others(0.5 * h_);
    unknown_.resize(static_cast<Eigen::Index>(6 * bodies_.size()));
    for (std::size_t b = 0; b < bodies_.size(); ++b) start_from(b);
  }
  void start_with(const Twist& twist, Body* body) const {
    const double share = body->damping != 0.0 ? damped_time(body->damping, h_) / h_ : 1.0;
    body->undamped = twist;
    body->start.twist = {share * twist.linear, share * twist.angular};
    body->momentum = body->moments.cwiseProduct(body->start.pose.orientation.conjugate() * body->start.twist.angular);
  }
  // Bodies that are not movable, at a time (s) after the start.
  void carry_others(double elapsed) {
    for (std::size_t i = 0; i < derivatives_->size(); ++i) {
      const std::uint32_t flags = request_->flags()[i];
      if ((flags & kMovable) != 0) continue;
      const BodyState s = derivatives_->start(i);
      trial_.set(i, (flags & kKinematic) != 0 ? detail::keep_moving(s, elapsed) : s);
    }
  }
  void start_from(std::size_t b) {
    const BodyState& start = bodies_[b].start;
    at(unknown_, b) << start.twist.linear, start.pose.orientation.conjugate() * start.twist.angular;
  }

  static Eigen::VectorBlock<Eigen::VectorXd, 6> at(Eigen::VectorXd& all, std::size_t body) {
    return all.segment<6>(static_cast<Eigen::Index>(6 * body));
  }

  BodyState middle_of(const Body& body, const Vector6& z) const {
    const Vector3 v = z.head<3>(), w = z.tail<3>();
    // half way: the Cayley map of half the tangent of the half angle's half, which normalising the mean gives
    const Quaternion whole = cayley(h_ * w);
    const Quaternion half = normalized(Quaternion(1.0 + whole.w(), whole.x(), whole.y(), whole.z()));
    const Quaternion q = normalized(body.start.pose.orientation * half);
    return {{body.start.pose.position + 0.5 * h_ * v, q}, {v, q * w}};
  }

  // The residual of the equations, in the units of the unknown: guess minus what it leads to.
  Eigen::VectorXd residual(Eigen::VectorXd& guess) {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Body& body = bodies_[b];
      trial_.set(body.row, middle_of(body, at(guess, b)));
    }
    const double middle = request_->time() + 0.5 * h_;
    const std::span<const double> wrenches =
        keeps_to_joints_ ? derivatives_->forces(middle, trial_) : derivatives_->wrenches(middle, trial_);
    Eigen::VectorXd left(guess.size());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      Body& body = bodies_[b];
      const Vector6 z = at(guess, b);
      const Vector3 force = vector_at(wrenches, 2 * body.row), torque = vector_at(wrenches, 2 * body.row + 1);
      const Vector3 v = body.start.twist.linear + body.reach * body.inverse_mass * force;
      body.torque = body.start.pose.orientation.conjugate() * torque;
      at(left, b) << z.head<3>() - v, turning_residual(body, z.tail<3>());
    }
    return left;
  }

  // W - I^-1 (Pi + Pi')/2 with Pi' = cay(h W)^T (Pi + h q^T tau), Pi the momentum in slowed time.
  Vector3 turning_residual(const Body& body, const Vector3& w) const {
    if (body.inverse_moments.isZero(0.0)) return w - body.start.pose.orientation.conjugate() * body.start.twist.angular;
    const Vector3 pushed = body.momentum + 2.0 * body.reach * body.torque;
    const Vector3 end = cayley(h_ * w).conjugate() * pushed;
    return w - 0.5 * body.inverse_moments.cwiseProduct(body.momentum + end);
  }

  // Speeds of a body, at the start and in the middle.
  double linear_speed(std::size_t b) const {
    return unknown_.segment<3>(static_cast<Eigen::Index>(6 * b)).norm() + bodies_[b].start.twist.linear.norm();
  }
  double angular_speed(std::size_t b) const {
    return unknown_.segment<3>(static_cast<Eigen::Index>(6 * b + 3)).norm() + bodies_[b].start.twist.angular.norm();
  }

  // The largest change of a body's velocity, relative to its size at the start and in the middle, or to what can be
  // resolved.
  double size_of(const Eigen::VectorXd& change) const {
    double largest = 0.0;
    const auto add = [&](std::span<const std::size_t> together) {
      double fastest = 0.0, fastest_turn = 1.0 / h_;
      for (const std::size_t b : together) {
        fastest = std::max({fastest, linear_speed(b), bodies_[b].start.pose.position.norm() / h_});
        fastest_turn = std::max(fastest_turn, angular_speed(b));
      }
      for (const std::size_t b : together) {
        const auto i = static_cast<Eigen::Index>(6 * b);
        const double v = linear_speed(b) + kResolved * fastest, w = angular_speed(b) + kResolved * fastest_turn;
        const double dv = change.segment<3>(i).norm(), dw = change.segment<3>(i + 3).norm();
        for (const double share : {dv == 0.0 ? 0.0 : dv / v, dw == 0.0 ? 0.0 : dw / w})
          largest = share <= largest ? largest : share;
      }
    };
    for (const Group& group : groups_) add(group.body);
    for (std::size_t b = 0; groups_.empty() && b < bodies_.size(); ++b) add(std::span(&b, 1));
    return largest;
  }

  // True: the end of the step is in trial_; false: it is end_of() the unknown.
  bool find_step() {
    Eigen::VectorXd first = residual(unknown_);
    if (!derivatives_->place_impulses(request_->time() + 0.5 * h_, trial_).empty()) {
      if (keep_to_joints()) return true;
      begin();
      first = residual(unknown_);
    }
    if (!iterate(std::move(first))) newton();
    return false;
  }

  // From the unknown, whose residual is known; false where that does not contract.
  bool iterate(Eigen::VectorXd change) {
    double last = HUGE_VAL;
    for (int i = 0; i < kMostIterations; ++i) {
      if (i > 0) change = residual(unknown_);
      if (keeps_to_joints_) turn_with_spins(&change);
      if (!change.allFinite()) break;
      unknown_ -= change;
      const double size = size_of(change);
      if (size <= kConverged || (size <= kStagnant && size >= last)) return true;
      if (i > 1 && size > kContraction * last && size > kStagnant) break;
      last = size;
    }
    return false;
  }

  // A residual as the changes of Newton's method where forces stay what they are: spins alone do not contract by themselves.
  void turn_with_spins(Eigen::VectorXd* change) {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Body& body = bodies_[b];
      const Matrix6 own = own_change(body, at(unknown_, b));
      at(*change, b).tail<3>() = own.bottomRightCorner<3, 3>().inverse() * at(*change, b).tail<3>();
    }
  }

  // The whole step between impulses of joints, to trial_; false: that cannot be done.
  bool keep_to_joints() {
    keeps_to_joints_ = true;
    const double end = request_->time() + h_;
    derivatives_->wrenches_at_start();  // directions of the joints are those of the start
    if (!find_start(end)) return false;
    derivatives_->wrenches(end, trial_);
    const std::span<const double> impulses = derivatives_->velocity_impulses(end, trial_);
    if (impulses.empty()) return false;
    for (const Body& body : bodies_) {
      BodyState state = trial_.at(body.row);
      const Acceleration change = derivatives_->kick(body.row, state.pose.orientation, impulses);
      state.twist = {state.twist.linear + change.linear, state.twist.angular + change.angular};
      trial_.set(body.row, state);
    }
    // what joints bear counts as the last question has it: where the step ends
    derivatives_->wrenches(end, trial_);
    return true;
  }

  // The velocities at the start that bring the bodies to where joints want them; they are there in trial_.
  bool find_start(double end) {
    constexpr double kFound =
        1e-6;  // in a pose where rows depend on each other some is left, for the solver at the step's end
    PlaceSearch search(kFound);
    if (!move_without_joints()) return false;
    for (auto verdict = PlaceSearch::Verdict::kGoOn; verdict != PlaceSearch::Verdict::kFound;) {
      const std::span<const double> impulses = derivatives_->place_impulses(end, trial_);
      if (impulses.empty()) return false;
      for (Body& body : bodies_) {
        const Acceleration moved = derivatives_->kick(body.row, body.start.pose.orientation, impulses);
        const auto size = [&](const Twist& twist) { return PlaceSearch::size(body.inverse_mass, body.moments, twist); };
        search.add(size({moved.linear, moved.angular}), h_ * h_ * size(body.start.twist),
                   size({body.start.pose.position, Vector3::Ones()}));
        // what damping leaves of the way
        const double time = damped_time(body.damping, h_);
        start_with({body.undamped.linear + moved.linear / time, body.undamped.angular + moved.angular / time}, &body);
      }
      verdict = search.judge();
      if (verdict == PlaceSearch::Verdict::kNotFound || !move_without_joints()) return false;
    }
    return true;
  }

  // From the starts to trial_, under forces alone.
  bool move_without_joints() {
    carry_others(0.5 * h_);
    if (!iterate(residual(unknown_))) return false;
    for (std::size_t b = 0; b < bodies_.size(); ++b) trial_.set(bodies_[b].row, end_of(b));
    carry_others(h_);
    return true;
  }

  void newton() {
    find_groups();
    // linear around the start's positions first, where a stiff force has its meaning
    if (newton_from(0.0, 1.0) || newton_from(1.0, 1.0) || newton_from(0.0, 0.0)) return;
    throw Refusal("the equations of the midpoint have no solution that can be found; allowed: a shorter time step");
  }

  void find_groups() {
    groups_.clear();
    std::vector<std::size_t> place(derivatives_->size());
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      place[bodies_[b].row] = b;
      trial_.set(bodies_[b].row, bodies_[b].start);
    }
    const double middle = request_->time() + 0.5 * h_;
    derivatives_->wrenches(middle, trial_, &jacobian_);
    member_.assign(derivatives_->size(), {});
    for (const std::vector<std::size_t>& rows : jacobian_.is_known()
                                                    ? interaction_groups(*request_, jacobian_)
                                                    : interaction_groups(*request_, derivatives_, middle, trial_)) {
      Group& group = groups_.emplace_back();
      for (const std::size_t row : rows) {
        member_[row] = {groups_.size(), group.body.size()};
        group.body.push_back(place[row]);
      }
    }
  }

  // From shares of the velocities at the start; false where it does not converge.
  bool newton_from(double linear, double angular) {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      start_from(b);
      at(unknown_, b).head<3>() *= linear;
      at(unknown_, b).tail<3>() *= angular;
    }
    Eigen::VectorXd left = residual(unknown_);
    double last = HUGE_VAL, least = HUGE_VAL;
    int resting = 0;
    Eigen::VectorXd best;
    bool has_matrix = false;
    for (int step = 0; step < kMostNewtonSteps; ++step) {
      host_->mark_progress();
      if (left.size() == 0 || !left.allFinite()) return false;
      // the matrix of a step that gained two digits serves the next
      if (!has_matrix) factor(left);
      const Eigen::VectorXd change = solved(left);
      const double size = size_of(change);
      if (size <= kConverged || (size <= kStagnant && size >= 0.5 * last)) {
        unknown_ -= change;
        return true;
      }
      // one that leaps away again was no place to rest
      resting = size <= kNoise ? resting + 1 : 0;
      if (resting <= 1) least = HUGE_VAL;
      if (resting > 0 && size < least) least = size, best = unknown_ - change;
      if (resting >= kStepsOfNoise) {
        unknown_ = best;
        return true;
      }
      has_matrix = size < kGained * last;
      last = size;
      left = take(change, size);
    }
    return false;
  }

  // Takes the largest of 1, 1/2, 1/4 … of a Newton step after which the same matrix wants a shorter one (Deuflhard, Newton
  // Methods for Nonlinear Problems, 3.3); the whole one where none is such. The residual there, with no numbers where it has
  // none.
  Eigen::VectorXd take(const Eigen::VectorXd& change, double size) {
    const Eigen::VectorXd from = unknown_;
    double share = 1.0;
    for (int halvings = 0; halvings <= kMostHalvings; ++halvings, share *= 0.5) {
      unknown_ = from - share * change;
      if (!unknown_.allFinite()) continue;
      Eigen::VectorXd left = residual(unknown_);
      if (!left.allFinite()) continue;
      if (size <= kStagnant || size_of(solved(left)) <= (1.0 - 0.25 * share) * size) return left;
    }
    unknown_ = from - change;
    return unknown_.allFinite() ? residual(unknown_) : Eigen::VectorXd();
  }

  // The matrix of the residual at the unknown, group by group.
  void factor(const Eigen::VectorXd& left) {
    if (jacobian_.is_known() && compose()) return;
    Eigen::Index columns = 0;
    for (const Group& group : groups_) columns = std::max(columns, group.size());
    std::vector<Eigen::MatrixXd> matrices;
    for (const Group& group : groups_) matrices.emplace_back(group.size(), group.size());
    for (Eigen::Index k = 0; k < columns; ++k) {
      // one number of each group at once
      Eigen::VectorXd shifted = unknown_;
      for (const Group& group : groups_) {
        if (k >= group.size()) continue;
        const Eigen::Index at = group.number(k);
        shifted[at] += shift(bodies_[static_cast<std::size_t>(at / 6)], unknown_.segment<6>(at - at % 6), at % 6);
      }
      const Eigen::VectorXd change = residual(shifted) - left;
      for (std::size_t g = 0; g < groups_.size(); ++g) {
        if (k >= groups_[g].size()) continue;
        const Eigen::Index at = groups_[g].number(k);
        for (Eigen::Index row = 0; row < groups_[g].size(); ++row)
          matrices[g](row, k) = change[groups_[g].number(row)] / (shifted[at] - unknown_[at]);
      }
    }
    for (std::size_t g = 0; g < groups_.size(); ++g) groups_[g].factors.factorise(matrices[g]);
  }

  // From the Jacobian of the forces at the middle; of what else depends on a body's own numbers, differences. False where
  // it cannot be had any more.
  bool compose() {
    for (std::size_t b = 0; b < bodies_.size(); ++b) trial_.set(bodies_[b].row, middle_of(bodies_[b], at(unknown_, b)));
    derivatives_->wrenches(request_->time() + 0.5 * h_, trial_, &jacobian_);
    if (!jacobian_.is_known()) return false;
    std::vector<Eigen::MatrixXd> matrices;
    std::vector<MiddleChange> changes;
    for (const Group& group : groups_) {
      matrices.emplace_back(Eigen::MatrixXd::Zero(group.size(), group.size()));
      for (std::size_t m = 0; m < group.body.size(); ++m)
        matrices.back().block<6, 6>(first_of(m), first_of(m)) =
            own_change(bodies_[group.body[m]], at(unknown_, group.body[m]));
    }
    for (std::size_t b = 0; b < bodies_.size(); ++b) changes.push_back(middle_change(bodies_[b], at(unknown_, b)));
    for (std::size_t i = 0; i < jacobian_.size(); ++i) {
      const Member pushed = member_[jacobian_.body(i)], by = member_[jacobian_.by(i)];
      if (pushed.group == 0 || by.group == 0) continue;  // what nothing pushes
      if (pushed.group != by.group) throw Refusal("the blocks of the Jacobian change within the step");
      const Group& group = groups_[pushed.group - 1];
      const Body& body = bodies_[group.body[pushed.place]];
      const Matrix6 force = jacobian_[i] * changes[group.body[by.place]];
      auto block = matrices[pushed.group - 1].block<6, 6>(first_of(pushed.place), first_of(by.place));
      block.topRows<3>() -= body.reach * body.inverse_mass * force.topRows<3>();
      block.bottomRows<3>() -=
          body.reach * torque_effect(body, at(unknown_, group.body[pushed.place])) * force.bottomRows<3>();
    }
    for (std::size_t g = 0; g < groups_.size(); ++g) groups_[g].factors.factorise(matrices[g]);
    return true;
  }

  // How the state in the middle changes with (v_bar, W).
  MiddleChange middle_change(const Body& body, const Vector6& z) const {
    const BodyState middle = middle_of(body, z);
    MiddleChange change;
    for (Eigen::Index k = 0; k < 6; ++k) {
      Vector6 shifted = z;
      shifted[k] += shift(body, z, k);
      const BodyState other = middle_of(body, shifted);
      change.col(k) << other.pose.position - middle.pose.position,
          log_rotation(other.pose.orientation * middle.pose.orientation.conjugate()),
          other.twist.linear - middle.twist.linear, other.twist.angular - middle.twist.angular;
      change.col(k) /= shifted[k] - z[k];
    }
    return change;
  }

  // Of the residual with the wrench as it was asked last.
  Matrix6 own_change(const Body& body, const Vector6& z) const {
    Matrix6 change = Matrix6::Identity();
    const Vector3 w = z.tail<3>(), here = turning_residual(body, w);
    for (Eigen::Index k = 0; k < 3; ++k) {
      Vector3 shifted = w;
      shifted[k] += shift(body, z, k + 3);
      change.block<3, 1>(3, 3 + k) = (turning_residual(body, shifted) - here) / (shifted[k] - w[k]);
    }
    return change;
  }

  // What a torque makes of W: I^-1 cay(h W)^T q^T.
  Matrix3 torque_effect(const Body& body, const Vector6& z) const {
    const Quaternion back = cayley(h_ * z.tail<3>()).conjugate() * body.start.pose.orientation.conjugate();
    return body.inverse_moments.asDiagonal() * to_rotation_matrix(back);
  }

  // What the middle moves by is to be seen among the roundings of its place or attitude.
  double shift(const Body& body, const Vector6& z, Eigen::Index k) const {
    const double seen = 1e-4 * (k < 3 ? body.start.pose.position.norm() : 1.0) / h_;
    return kDifference * std::max({z.segment<3>(k - k % 3).norm(), 1e-3, seen});
  }
  static Eigen::Index first_of(std::size_t place) { return 6 * static_cast<Eigen::Index>(place); }

  Eigen::VectorXd solved(const Eigen::VectorXd& left) const {
    Eigen::VectorXd change(left.size());
    for (const Group& group : groups_) {
      Eigen::VectorXd part(group.size());
      for (Eigen::Index k = 0; k < group.size(); ++k) part[k] = left[group.number(k)];
      part = group.factors.solve(part);
      for (Eigen::Index k = 0; k < group.size(); ++k) change[group.number(k)] = part[k];
    }
    return change;
  }

  BodyState end_of(std::size_t b) {
    const Body& body = bodies_[b];
    const Vector6 z = at(unknown_, b);
    const Vector3 w = z.tail<3>();
    BodyState end = body.start;
    end.pose.position = displaced(body.start.pose, h_ * z.head<3>(), Vector3::Zero()).position;
    const Quaternion turn = cayley(h_ * w);
    if (!w.isZero(0.0)) end.pose.orientation = normalized(body.start.pose.orientation * turn);
    // 2 I W = Pi + Pi'
    Vector3 v = 2.0 * z.head<3>() - body.start.twist.linear;
    Vector3 momentum = 2.0 * body.moments.cwiseProduct(w) - body.momentum;
    Vector3 steady = body.start.twist.angular;  // of a body that nothing turns
    if (body.damping != 0.0) {
      const double kept = damping_factor(body.damping, h_), slowed = damped_time(body.damping, h_);
      v = kept * body.undamped.linear + slowed / body.reach * (z.head<3>() - body.start.twist.linear);
      // out of slowed time, in axes of the end; 2 reach tau of torques
      const Vector3 free = turn.conjugate() * body.momentum, pushed = momentum - free;
      momentum = kept * h_ / slowed * free;
      if (!body.torque.isZero(0.0)) momentum += 0.5 * slowed / body.reach * pushed;
      steady = kept * body.undamped.angular;
    }
    const Vector3 turning = body.inverse_moments.isZero(0.0)
                                ? steady
                                : Vector3(end.pose.orientation * body.inverse_moments.cwiseProduct(momentum));
    end.twist = {v, turning};
    return end;
  }

  const stage::IntegratorIntegrateRequest* request_ = nullptr;  // of the call in hand, as the next three
  Derivatives* derivatives_ = nullptr;
  Host* host_ = nullptr;
  double h_ = 0.0;
  bool keeps_to_joints_ = false;
  std::vector<Group> groups_;
  std::vector<Body> bodies_;  // scratch, as all that follows
  Eigen::VectorXd unknown_;   // v_bar (m/s, world) and W (rad/s, body) of each
  WrenchJacobian jacobian_;
  std::vector<Member> member_;  // by row
  TrialColumns trial_;
  std::vector<double> room_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::ImplicitMidpoint)
