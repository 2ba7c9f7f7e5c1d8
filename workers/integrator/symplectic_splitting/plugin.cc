// Integrator `SymplecticSplitting`: exact free motion and exact kicks in turn, composed to order 2, 4 or 6 (`Order`).
//
//   drift(s):  x += s v,  q and w by the exact free rotor (free_rotor.h), all moments, near-separatrix included
//   kick(s):   v += s f/m,  w += s I_w^-1 tau      at a fixed pose
//   step:      kick(g_1 h/2) drift(g_1 h) kick((g_1 + g_2) h/2) drift(g_2 h) ... drift(g_s h) kick(g_s h/2)
//
// Order 2: s = 1. Order 4: Suzuki's g = (p, p, 1 - 4p, p, p), p = 1/(4 - 4^(1/3)). Order 6: the nine of Kahan and Li,
// Math. Comp. 66 (1997) 1089, s9odr6a. All inner times lie within the step. Derivatives a step: 2, 6, 10, and one more
// to see whether the forces depend on velocity (none where the wrench is constant).
// Under constant forces and no torque one drift is exact and order 2 is taken. Without torque nothing but rounding is
// between the result and the truth, at any step: position, attitude, energy and angular momentum. With forces that depend on position and attitude alone the method is symplectic and symmetric: the
// energy of long runs wanders within O(h^order) and does not drift. Stability: an oscillator is stable up to h w = 2
// (order 2), 2.72 (order 4), 2.53 (order 6).
// With joints that hold by locks alone each pair of kicks and the drift between them are a step of RATTLE, with the free
// rotor as its drift: impulses along the joints' directions before it bring the bodies to where joints want them after it,
//   v' = v + M^-1 (s f/2 + J^T(q) lambda),   (q1, v1) = drift(s)(q, v'),   g(q1) = 0
//   v1 += M^-1 (s f(q1)/2 + J^T(q1) mu),   J(q1) v1 = what joints want
// That is symmetric and symplectic, and so is each composition of it, which has its order. lambda is found by chords with the
// directions before the drift, from what joints bear there: four to eight questions a drift.
// Where a force does depend on velocity, or joints have limits with room, drives, friction or springs, or lambda is not
// found (bodies that turn by more than about half a radian in a drift, poses where rows depend on each other), a kick is one
// Runge-Kutta step in the velocities alone, of order 4 (classical), with order 6 of that (Butcher's), and the whole is not
// symplectic.
// Damping c is part of the drift: s becomes (1 - e^(-c s))/c and velocities shrink by e^(-c s), exact again since a
// free rotor whose momentum decays is one in slowed time. So is then the acceleration f_0/m of the start, and kicks are of what
// forces differ from it by: a damped body falls exactly. Where c h > 1 and the composition has steps back, it drifts along that
// motion undamped in what deviates from it, velocities of which, and those of turning, are slowed in two halves around the step
// instead (order 2 in c h; known failure: a steady torque turns it too slowly, then).
// Source: Hairer, Lubich, Wanner, Geometric Numerical Integration, II.4, V.3, VII.1, VII.5. Butcher, J. Austral. Math. Soc. 4
// (1964) 179: seven stages of order 6.
#include <array>
#include <cmath>
#include <cstring>

#include "plugin_sdk/integrator.h"
#include "plugin_sdk/math/free_rotor.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/place_search.h"

namespace gravitas {
namespace {

constexpr std::array<double, 1> kStrang = {1.0};
constexpr double kSuzuki = 0.41449077179437573714;
constexpr std::array<double, 5> kOrder4 = {kSuzuki, kSuzuki, 1.0 - 4.0 * kSuzuki, kSuzuki, kSuzuki};
constexpr std::array<double, 9> kOrder6 = {0.39216144400731413928,  0.33259913678935943860, -0.70624617255763935981,
                                           0.08221359629355080023,  0.79854399093482996340, 0.08221359629355080023,
                                           -0.70624617255763935981, 0.33259913678935943860, 0.39216144400731413928};

struct RungeKutta {
  std::size_t stages;
  std::array<std::array<double, 7>, 7> a;  // of a stage: shares of the rates before it
  std::array<double, 7> b;
};
constexpr RungeKutta kClassical = {
    4, {{{}, {0.5}, {0.0, 0.5}, {0.0, 0.0, 1.0}}}, {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0}};
constexpr RungeKutta kButcher6 = {
    7,
    {{{},
      {1.0 / 3.0},
      {0.0, 2.0 / 3.0},
      {1.0 / 12.0, 1.0 / 3.0, -1.0 / 12.0},
      {25.0 / 48.0, -55.0 / 24.0, 35.0 / 48.0, 15.0 / 8.0},
      {3.0 / 20.0, -11.0 / 24.0, -1.0 / 8.0, 1.0 / 2.0, 1.0 / 10.0},
      {-261.0 / 260.0, 33.0 / 13.0, 43.0 / 156.0, -118.0 / 39.0, 32.0 / 195.0, 80.0 / 39.0}}},
    {13.0 / 200.0, 0.0, 11.0 / 40.0, 11.0 / 40.0, 4.0 / 25.0, 4.0 / 25.0, 13.0 / 200.0}};

class SymplecticSplitting final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "SymplecticSplitting",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning =
                "Exact free motion and kicks in turn, symplectic, with joints that hold by locks alone, too; order 2, "
                "4 or 6.",
            .capabilities = {"order=4"},
            .properties = {Property::integer("Order").at_least(2).at_most(6).defaults_to({4}).means(
                "Order of the composition: 2, 4 or 6.")},
            .theta = 0.5};
  }
  explicit SymplecticSplitting(PropertyCursor settings) {
    switch (settings.integer()) {
      case 2:
        weights_ = kStrang;
        return;
      case 4:
        weights_ = kOrder4;
        return;
      case 6:
        weights_ = kOrder6;
        return;
      default:
        throw Refusal("Order: allowed are 2, 4 and 6");
    }
  }

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    begin(request, derivatives);
    const std::span<const double> weights = needs_no_composition() ? std::span<const double>(kStrang) : weights_;
    const std::span<const double> start = derivatives.wrenches_at_start();
    start_wrench_.assign(start.begin(), start.end());
    const bool joints_alone_feel_velocity = find_what_feels_velocity(&derivatives);
    if (joints_alone_feel_velocity && keep_to_joints(weights, &derivatives))
      return for_each_body(request, reply, [&](std::size_t i, const BodyState&) { return trial_.at(i); });
    if (joints_alone_feel_velocity) begin(request, derivatives);

    find_steady(start_wrench_);
    slow_halves(0.0);
    double passed = 0.0, before = 0.0;
    for (std::size_t stage = 0; stage < weights.size(); ++stage) {
      kick(&derivatives, stage == 0, passed * h, 0.5 * (before + weights[stage]) * h);
      const double next = stage + 1 == weights.size() ? 1.0 : passed + weights[stage];
      for (std::size_t i = 0; i < size(); ++i) drift(i, passed * h, next * h, weights[stage] * h);
      passed = next;
      before = weights[stage];
      carry_others(passed * h);
    }
    kick(&derivatives, false, h, 0.5 * before * h);
    slow_halves(h);
    for_each_body(request, reply, [&](std::size_t i, const BodyState&) { return trial_.at(i); });
  }

 private:
  void begin(const stage::IntegratorIntegrateRequest& request, const Derivatives& derivatives) {
    request_ = &request;
    trial_.resize(derivatives.size());
    for (std::size_t i = 0; i < derivatives.size(); ++i) trial_.set(i, derivatives.start(i));
  }
  std::size_t size() const { return request_->flags().size(); }
  bool is_movable(std::size_t body) const { return (request_->flags()[body] & kMovable) != 0; }

  // The accelerations of the start that damped bodies drift with.
  void find_steady(std::span<const double> wrenches) {
    steady_.assign(size(), Vector3::Zero());
    for (std::size_t i = 0; i < size(); ++i)
      if (is_movable(i) && request_->damping()[i] != 0.0)
        steady_[i] = request_->inverse_mass()[i] * vector_at(wrenches, 2 * i);
  }
  // Of a damped body under that alone, after the start.
  DampedMotion steady_motion(std::size_t body, double elapsed) const {
    const Vector3 start = vector_at(request_->linear_velocity(), body);
    return damped_motion({.linear = start}, {steady_[body], Vector3::Zero()}, request_->damping()[body], elapsed);
  }

  // Constant forces through the centres of mass: one drift between two kicks is exact.
  bool needs_no_composition() const {
    if (request_->wrench_is_constant() == 0) return false;
    for (std::size_t i = 0; i < size(); ++i)
      if (is_movable(i) && (request_->damping()[i] != 0.0 || !vector_at(request_->wrench(), 2 * i + 1).isZero(0.0)))
        return false;
    return true;
  }

  bool slows_in_halves(std::size_t body) const {
    return weights_.size() > 1 && request_->damping()[body] * request_->time_step() > 1.0;
  }
  void slow_halves(double elapsed) {
    for (std::size_t i = 0; i < size(); ++i) {
      if (!is_movable(i) || !slows_in_halves(i)) continue;
      BodyState state = trial_.at(i);
      const double kept = damping_factor(request_->damping()[i], 0.5 * request_->time_step());
      const Vector3 steady = steady_motion(i, elapsed).twist.linear;
      state.twist = {steady + kept * (state.twist.linear - steady), kept * state.twist.angular};
      trial_.set(i, state);
    }
  }

  // Sets depends_on_velocity_, of all that acts. True where what joints do depends on velocities, and forces do not.
  bool find_what_feels_velocity(Derivatives* derivatives) {
    depends_on_velocity_ = false;
    if (request_->wrench_is_constant() != 0 || size() == 0) return false;
    const auto is_same = [](std::span<const double> a, std::span<const double> b) {
      return std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
    };
    // what joints bear changes with velocities, too, though it be nothing at the start
    const TrialColumns& shifted = shifted_velocities();
    if (is_same(derivatives->wrenches(request_->time(), shifted), start_wrench_)) return false;
    depends_on_velocity_ = true;
    const std::span<const double> forces = derivatives->forces(request_->time(), trial_);
    forces_.assign(forces.begin(), forces.end());
    return is_same(derivatives->forces(request_->time(), shifted), forces_);
  }

  // Other for each body and axis, since a damper feels their difference.
  const TrialColumns& shifted_velocities() {
    TrialColumns& shifted = before_;
    shifted = trial_;
    for (std::vector<double>* column : {&shifted.linear_velocity, &shifted.angular_velocity})
      for (std::size_t k = 0; k < column->size(); ++k) {
        const double share = static_cast<double>(k) / static_cast<double>(column->size());
        (*column)[k] += (1.0 + share * share) * (1.0 + std::fabs((*column)[k]));
      }
    return shifted;
  }

  // The whole step along the joints; false: that cannot be done. forces_: without what joints do.
  bool keep_to_joints(std::span<const double> weights, Derivatives* derivatives) {
    const double h = request_->time_step();
    for (std::size_t i = 0; i < size(); ++i)
      if (is_movable(i) && slows_in_halves(i)) return false;
    find_steady(forces_);  // bodies drift steadily under forces alone
    std::span<const double> wrenches = start_wrench_;
    double passed = 0.0, before = 0.0;
    for (std::size_t stage = 0; stage < weights.size(); ++stage) {
      const double next = stage + 1 == weights.size() ? 1.0 : passed + weights[stage];
      kicks_.assign(size(), {});
      for (std::size_t i = 0; i < size(); ++i)
        if (is_movable(i)) kicks_[i] = scaled(rate(i, wrenches), 0.5 * (before + weights[stage]) * h);
      if (!drift_to_joints(derivatives, passed * h, next * h, weights[stage] * h)) return false;
      passed = next, before = weights[stage];
      wrenches = derivatives->wrenches(request_->time() + passed * h, trial_);
    }
    for (std::size_t i = 0; i < size(); ++i)
      if (is_movable(i)) push(i, trial_.at(i), rate(i, wrenches), 0.5 * before * h);
    const std::span<const double> impulses = derivatives->velocity_impulses(request_->time() + h, trial_);
    if (impulses.empty()) return false;
    for (std::size_t i = 0; i < size(); ++i)
      if (is_movable(i)) push(i, trial_.at(i), change(i, impulses, trial_), 1.0);
    // what joints bear counts as the last question has it: where the step ends
    derivatives->wrenches(request_->time() + h, trial_);
    return true;
  }

  // Drifts from trial_, with kicks_ and what they lack, to where joints want the bodies.
  bool drift_to_joints(Derivatives* derivatives, double from, double to, double s) {
    before_ = trial_;
    drift_all(from, to, s);
    constexpr double kFound = 1e-9;
    PlaceSearch search(kFound);
    for (auto verdict = PlaceSearch::Verdict::kGoOn; verdict != PlaceSearch::Verdict::kFound;) {
      const std::span<const double> impulses = derivatives->place_impulses(request_->time() + to, trial_);
      if (impulses.empty()) return false;
      for (std::size_t i = 0; i < size(); ++i) {
        if (!is_movable(i)) continue;
        const Twist moved = change(i, impulses, before_);
        search.add(size_of(i, moved), s * s * (size_of(i, before_.at(i).twist) + size_of(i, kicks_[i])),
                   size_of(i, {before_.at(i).pose.position, Vector3::Ones()}));
        kicks_[i].linear += moved.linear / s, kicks_[i].angular += moved.angular / s;
      }
      drift_all(from, to, s);
      verdict = search.judge();
      if (verdict == PlaceSearch::Verdict::kNotFound) return false;
    }
    return true;
  }

  // From before_ to trial_.
  void drift_all(double from, double to, double s) {
    for (std::size_t i = 0; i < size(); ++i) {
      if (is_movable(i)) push(i, before_.at(i), kicks_[i], 1.0);
      drift(i, from, to, s);
    }
    carry_others(to);
  }

  // Bodies that are not movable at a time (s) after the start.
  void carry_others(double elapsed) {
    for (std::size_t i = 0; i < size(); ++i)
      if ((request_->flags()[i] & (kMovable | kKinematic)) == kKinematic)
        trial_.set(i, detail::keep_moving(detail::state_at(*request_, i), elapsed));
  }

  // Of position and velocity.
  void drift_linearly(std::size_t body, double from, double to, double s, BodyState* state) const {
    Vector3& v = state->twist.linear;
    const double damping = request_->damping()[body];
    Vector3 moved = s * v;
    if (slows_in_halves(body)) {
      const DampedMotion before = steady_motion(body, from), after = steady_motion(body, to);
      const Vector3 off = v - before.twist.linear;
      moved = (after.moved - before.moved) + s * off;
      v = after.twist.linear + off;
    } else if (damping != 0.0) {
      const DampedMotion motion = damped_motion({.linear = v}, {steady_[body], Vector3::Zero()}, damping, s);
      moved = motion.moved, v = motion.twist.linear;
    }
    state->pose = displaced(state->pose, moved, Vector3::Zero());
  }

  // From a time after the start to another, s apart.
  void drift(std::size_t body, double from, double to, double s) {
    if (!is_movable(body)) return;
    const double damping = slows_in_halves(body) ? 0.0 : request_->damping()[body];
    const double slowed = damped_time(damping, s), kept = damping_factor(damping, s);
    BodyState state = trial_.at(body);
    Vector3& w = state.twist.angular;
    drift_linearly(body, from, to, s, &state);
    const Vector3 inverse_moments = vector_at(request_->inverse_inertia(), body);
    if (inverse_moments.isZero(0.0)) {
      state.pose = displaced(state.pose, Vector3::Zero(), slowed * w);
    } else if (!w.isZero(0.0) && !(inverse_moments.minCoeff() > 0.0)) {
      throw Refusal("body " + std::to_string(body) + " can be turned about some of its axes alone");
    } else {
      const Turning turned =
          turned_freely({state.pose.orientation, w}, vector_at(request_->inertia(), body), inverse_moments, slowed);
      state.pose.orientation = turned.orientation;
      w = turned.angular_velocity;
    }
    w *= kept;
    trial_.set(body, state);
  }

  // Velocities after s seconds of the forces at the poses of trial_, `elapsed` after the start.
  void kick(Derivatives* derivatives, bool at_start, double elapsed, double s) {
    const double time = request_->time() + elapsed;
    const auto ask = [&] { return derivatives->wrenches(time, trial_); };
    if (!depends_on_velocity_) {
      const std::span<const double> wrenches = at_start ? std::span<const double>(start_wrench_) : ask();
      for (std::size_t i = 0; i < size(); ++i)
        if (is_movable(i)) push(i, trial_.at(i), rate(i, wrenches), s);
      return;
    }
    const RungeKutta& method = weights_.size() > kOrder4.size() ? kButcher6 : kClassical;
    before_ = trial_;
    for (std::size_t stage = 0; stage < method.stages; ++stage) {
      const std::span<const double> wrenches = ask();
      rates_[stage].resize(size());
      const bool is_last = stage + 1 == method.stages;
      const std::array<double, 7>& shares = is_last ? method.b : method.a[stage + 1];
      for (std::size_t i = 0; i < size(); ++i) {
        if (!is_movable(i)) continue;
        rates_[stage][i] = rate(i, wrenches);
        Twist sum;
        for (std::size_t k = 0; k <= stage; ++k)
          sum.linear += shares[k] * rates_[k][i].linear, sum.angular += shares[k] * rates_[k][i].angular;
        push(i, before_.at(i), sum, s);
      }
    }
  }

  // Rates of the velocities without the gyroscopic term and the steady acceleration, which belong to the drift.
  Twist rate(std::size_t body, std::span<const double> wrenches) const {
    Twist rate = change(body, wrenches, trial_);
    rate.linear -= steady_[body];
    return rate;
  }
  // M^-1 of a body's six numbers, at its attitude.
  Twist change(std::size_t body, std::span<const double> impulses, const TrialColumns& at) const {
    const Vector3 inverse_moments = vector_at(request_->inverse_inertia(), body);
    const Vector3 turning = vector_at(impulses, 2 * body + 1);
    Twist change{request_->inverse_mass()[body] * vector_at(impulses, 2 * body), Vector3::Zero()};
    if (turning.isZero(0.0)) return change;
    const Quaternion q = quaternion_at(at.orientation, body);
    change.angular = q * inverse_moments.cwiseProduct(q.conjugate() * turning);
    return change;
  }
  double size_of(std::size_t body, const Twist& twist) const {
    return PlaceSearch::size(request_->inverse_mass()[body], vector_at(request_->inertia(), body), twist);
  }
  static Twist scaled(const Twist& twist, double by) { return {by * twist.linear, by * twist.angular}; }
  void push(std::size_t body, const BodyState& from, const Twist& rate, double s) {
    trial_.set(body, {from.pose, {from.twist.linear + s * rate.linear, from.twist.angular + s * rate.angular}});
  }

  std::span<const double> weights_;
  const stage::IntegratorIntegrateRequest* request_ = nullptr;  // of the call in hand
  bool depends_on_velocity_ = false;
  std::vector<double> room_, start_wrench_, forces_;  // scratch
  std::array<std::vector<Twist>, 7> rates_;           // scratch
  std::vector<Twist> kicks_;                          // scratch
  std::vector<Vector3> steady_;                       // scratch
  TrialColumns trial_, before_;                       // scratch: the state as it moves, and before a kick or drift
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::SymplecticSplitting)
