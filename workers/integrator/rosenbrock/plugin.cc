// Integrator `Rosenbrock`: linearly implicit, L-stable, order 4 with an embedded method of order 3, for stiff forces.
// Around the start (x0, q0) of an inner step the state is y = (x - x0, r, e^(c s) v, e^(c s) w) with q = exp(r) q0 and s
// the time since then, so that damping c is an integrating factor and the attitude stays on the group; y^. = f(s, y).
// With J = df/dy and f_s at the start, in the variables u of Hairer and Wanner,
//
//   (1/(g h) - J) u_i = f(alpha_i h, y + sum_j a_ij u_j) + sum_j c_ij/h u_j + g_i h f_s,    i = 1 ... 6,  g = 1/4
//   y' = y + sum_j a_5j u_j + u_5 + u_6                                       error: u_6
//
// the method RODAS, stiffly accurate: stiff, damped motion comes to rest at its balance in one inner step. J is made of the
// forces' Jacobian where it can be had (wrench_jacobian.h), else of differences: twelve derivatives a body of the largest
// group of bodies that feel each other (interaction_groups.h). It is dense in a group; f_s is a difference. The error is
// scaled and held to Accuracy, and inner steps end on the step's boundary, as in DormandPrince54. Stability: A- and
// L-stable; the test equation's amplification at h k -> inf is 0, so oscillations that the accuracy does not resolve are damped away. Known failure: that damping is not physics;
// of an undamped stiff spring the energy is lost as soon as its swing is below Accuracy. Damping with c times the time
// step above 1 acts in two halves around the step instead. Source: Hairer, Wanner, Solving ODEs II, IV.7 and the code RODAS.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "plugin_sdk/interaction_groups.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/motion_stages.h"

namespace gravitas {
namespace {

constexpr std::size_t kStages = 6;
constexpr double kDiagonal = 0.25;
constexpr std::array<double, kStages> kNodes = {0.0, 0.386, 0.21, 0.63, 1.0, 1.0};
constexpr std::array<double, kStages> kTimeShares = {0.25, -0.1043, 0.1035, -0.3620000000000023e-1, 0.0, 0.0};
constexpr double kWeights[kStages][kStages - 1] = {
    {},
    {1.544},
    {0.9466785280815826, 0.2557011698983284},
    {3.314825187068521, 2.896124015972201, 0.9986419139977817},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895},
    {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.687886036105895, 1.0}};
constexpr double kCouplings[kStages][kStages - 1] = {
    {},
    {-5.6688},
    {-2.430093356833875, -0.2063599157091915},
    {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
    {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.7089089320616},
    {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054}};

constexpr double kSafety = 0.9, kSlowest = 0.2, kFastest = 5.0;
constexpr double kShortest = 1e-12;   // inner step, per step
constexpr double kLargestTurn = 2.0;  // rad in an inner step: the chart ends at 2 pi
constexpr double kDifference = 1e-7;
constexpr double kTimeDifference = 1e-6;  // per inner step

class Rosenbrock final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Rosenbrock",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Linearly implicit method RODAS, L-stable, order 4, with error control, for stiff forces.",
            .capabilities = {"order=4"},
            .properties = {Property::number("Accuracy", "1")
                               .above(0.0)
                               .at_most(1.0)
                               .defaults_to({1e-6})
                               .means("Largest estimated error of an inner step, in m, rad, and relative to speeds "
                                      "above 1 m/s, 1 rad/s.")},
            .theta = 0.5};
  }
  explicit Rosenbrock(PropertyCursor settings) : accuracy_(settings.number()) { fix_eigen_blocks(); }

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    request_ = &request, derivatives_ = &derivatives;
    done_ = 0.0;
    begin();
    const double whole = request.time_step();
    double inner = whole, worst = 0.0;
    bool has_matrix = false;
    while (done_ < whole && !bodies_.empty()) {
      host.mark_progress();
      const double h = std::min(inner, whole - done_);
      if (!has_matrix) differentiate(h);
      has_matrix = true;
      const double error = attempt(h) / accuracy_;
      inner =
          h * (std::isfinite(error) ? std::clamp(kSafety * math::pow(std::max(error, 1e-10), -0.25), kSlowest, kFastest)
                                    : kSlowest);
      if (error <= 1.0) {
        worst = std::max(worst, error);
        done_ = h == whole - done_ ? whole : done_ + h;
        accept(h);
        has_matrix = false;
      } else if (!(inner > kShortest * whole)) {
        throw Refusal("Accuracy cannot be met by any step: forces are not smooth, or the state overflows");
      }
    }
    std::size_t next = 0;
    for_each_body(request, reply, [&](std::size_t, const BodyState&) {
      const Body& body = bodies_[next++];
      return BodyState{body.start.pose, {body.kept * body.start.twist.linear, body.kept * body.start.twist.angular}};
    });
    reply.error_estimate().set(worst);
  }

 private:
  static constexpr Eigen::Index kNumbers = 12;
  using Numbers = Eigen::Matrix<double, kNumbers, 1>;

  struct Body {
    std::size_t row;
    BodyState start;  // of the inner step
    Vector3 origin;   // position at the start of the step
    Vector3 moved;    // since then: summed by itself, far from the world's origin it has more digits
    double damping;   // within the step
    double kept;      // of the velocities, before and after the step
  };
  // Bodies that feel each other, as places in bodies_.
  struct Group {
    std::vector<std::size_t> body;
    Eigen::MatrixXd matrix;  // J
    Eigen::PartialPivLU<Eigen::MatrixXd> factors;
  };

  // Of a movable body: its group, and its place there.
  struct Member {
    Group* group = nullptr;
    std::size_t place = 0;
  };

  void begin() {
    bodies_.clear(), groups_.clear();
    trial_.resize(derivatives_->size());
    std::vector<std::size_t> place(derivatives_->size());
    for (std::size_t i = 0; i < derivatives_->size(); ++i) {
      trial_.set(i, derivatives_->start(i));
      if ((request_->flags()[i] & kMovable) == 0) continue;
      place[i] = bodies_.size();
      const double damping = request_->damping()[i];
      const bool in_halves = damping * request_->time_step() > 1.0;
      BodyState start = derivatives_->start(i);
      const double kept = in_halves ? damping_factor(damping, 0.5 * request_->time_step()) : 1.0;
      start.twist = {kept * start.twist.linear, kept * start.twist.angular};
      bodies_.push_back({i, start, start.pose.position, Vector3::Zero(), in_halves ? 0.0 : damping, kept});
    }
    ask_jacobian();
    for (const std::vector<std::size_t>& rows :
         jacobian_.is_known() ? interaction_groups(*request_, jacobian_)
                              : interaction_groups(*request_, derivatives_, request_->time(), trial_)) {
      Group& group = groups_.emplace_back();
      for (const std::size_t row : rows) group.body.push_back(place[row]);
      const auto size = static_cast<Eigen::Index>(rows.size()) * kNumbers;
      group.matrix.resize(size, size);
    }
    const auto all = static_cast<Eigen::Index>(bodies_.size()) * kNumbers;
    rate_.resize(all), rate_at_start_.resize(all), time_rate_.resize(all), state_.resize(all), sum_.resize(all);
    for (Eigen::VectorXd& u : u_) u.resize(all);
  }

  static Eigen::Index first_of(std::size_t body) { return static_cast<Eigen::Index>(body) * kNumbers; }

  BodyState state_of(const Body& body, const Numbers& y, double elapsed) const {
    const double slowed = damping_factor(body.damping, elapsed);
    return {displaced(body.start.pose, y.segment<3>(0), y.segment<3>(3)),
            {slowed * y.segment<3>(6), slowed * y.segment<3>(9)}};
  }

  void carry_kinematic(double elapsed) {
    for (std::size_t i = 0; i < derivatives_->size(); ++i)
      if ((request_->flags()[i] & (kMovable | kKinematic)) == kKinematic)
        trial_.set(i, detail::keep_moving(derivatives_->start(i), done_ + elapsed));
  }

  // f at a time after the start of the inner step; false where the state is not finite.
  bool evaluate(double elapsed, const Eigen::VectorXd& y, Eigen::VectorXd* f) {
    if (!y.allFinite()) return false;
    carry_kinematic(elapsed);
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      trial_.set(bodies_[b].row, state_of(bodies_[b], y.segment<kNumbers>(first_of(b)), elapsed));
    const std::span<const double> wrenches = derivatives_->wrenches(request_->time() + done_ + elapsed, trial_);
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const BodyState state = trial_.at(bodies_[b].row);
      const Acceleration a = derivatives_->acceleration(bodies_[b].row, state, wrenches);
      const double grown = damping_factor(bodies_[b].damping, -elapsed);
      const Vector3 turned = y.segment<3>(first_of(b) + 3);
      f->segment<kNumbers>(first_of(b)) << state.twist.linear, rotation_vector_rate(turned, state.twist.angular),
          grown * a.linear, grown * a.angular;
    }
    return true;
  }

  // J of each group and f_s, at the start of an inner step.
  void differentiate(double h) {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      state_.segment<kNumbers>(first_of(b)) << Vector3::Zero(), Vector3::Zero(), bodies_[b].start.twist.linear,
          bodies_[b].start.twist.angular;
    if (!evaluate(0.0, state_, &rate_at_start_)) throw Refusal("the state is not finite");
    const double time = kTimeDifference * h;
    evaluate(time, state_, &time_rate_);
    time_rate_ = (time_rate_ - rate_at_start_) / time;
    if (jacobian_.is_known()) {
      if (done_ > 0.0) ask_jacobian();
      if (jacobian_.is_known()) return compose();
    }

    Eigen::Index columns = 0;
    for (const Group& group : groups_) columns = std::max(columns, group.matrix.cols());
    for (Eigen::Index k = 0; k < columns; ++k) {
      // one number of each group at once
      sum_ = state_;
      for (const Group& group : groups_) {
        if (k >= group.matrix.cols()) continue;
        const std::size_t b = group.body[static_cast<std::size_t>(k / kNumbers)];
        sum_[first_of(b) + k % kNumbers] += difference(bodies_[b], k % kNumbers);
      }
      if (!evaluate(0.0, sum_, &rate_)) throw Refusal("the state is not finite");
      for (Group& group : groups_) {
        if (k >= group.matrix.cols()) continue;
        const Eigen::Index at = first_of(group.body[static_cast<std::size_t>(k / kNumbers)]) + k % kNumbers;
        const double by = sum_[at] - state_[at];
        for (std::size_t m = 0; m < group.body.size(); ++m) {
          const Eigen::Index first = first_of(group.body[m]);
          group.matrix.block<kNumbers, 1>(first_of(m), k) =
              (rate_.segment<kNumbers>(first) - rate_at_start_.segment<kNumbers>(first)) / by;
        }
      }
    }
  }

  // At the start of an inner step.
  void ask_jacobian() {
    carry_kinematic(0.0);
    for (const Body& body : bodies_) trial_.set(body.row, body.start);
    const std::span<const double> wrenches = derivatives_->wrenches(request_->time() + done_, trial_, &jacobian_);
    wrenches_.assign(wrenches.begin(), wrenches.end());
  }

  // J from the Jacobian of the forces.
  void compose() {
    member_.assign(derivatives_->size(), {});
    for (Group& group : groups_) {
      group.matrix.setZero();
      for (std::size_t m = 0; m < group.body.size(); ++m) {
        const Body& body = bodies_[group.body[m]];
        const Vector3& w = body.start.twist.angular;
        auto own = group.matrix.block<kNumbers, kNumbers>(first_of(m), first_of(m));
        own.block<3, 3>(0, 6) = own.block<3, 3>(3, 9) = Matrix3::Identity();
        own.block<3, 3>(3, 3) = 0.5 * skew(w);
        own.bottomRows<6>() = acceleration_jacobian(
            body.start.pose.orientation, w, vector_at(request_->inertia(), body.row),
            vector_at(request_->inverse_inertia(), body.row), vector_at(wrenches_, 2 * body.row + 1));
        member_[body.row] = {&group, m};
      }
    }
    for (std::size_t i = 0; i < jacobian_.size(); ++i) {
      const std::uint32_t row = jacobian_.body(i);
      const Member &pushed = member_[row], &by = member_[jacobian_.by(i)];
      if (pushed.group == nullptr || by.group == nullptr) continue;  // what nothing pushes
      if (pushed.group != by.group)
        throw Refusal("the blocks of the forces' Jacobian are not those of the start of the step");
      pushed.group->matrix.block<6, kNumbers>(first_of(pushed.place) + 6, first_of(by.place)) +=
          accelerated_block(trial_.at(row).pose.orientation, request_->inverse_mass()[row],
                            vector_at(request_->inverse_inertia(), row), jacobian_[i]);
    }
  }

  static double difference(const Body& body, Eigen::Index number) {
    if (number < 3) return kDifference * (1.0 + 1e-2 * body.start.pose.position.norm());
    if (number < 6) return kDifference;
    const Vector3& velocity = number < 9 ? body.start.twist.linear : body.start.twist.angular;
    return kDifference * std::max(1.0, velocity.norm());
  }

  // The largest scaled error of an inner step, infinite where it cannot be taken; its result in sum_.
  double attempt(double h) {
    for (Group& group : groups_)
      group.factors.compute(Eigen::MatrixXd::Identity(group.matrix.rows(), group.matrix.cols()) / (kDiagonal * h) -
                            group.matrix);
    for (std::size_t i = 0; i < kStages; ++i) {
      sum_ = state_;
      for (std::size_t j = 0; j < i; ++j) sum_ += kWeights[i][j] * u_[j];
      if (i == 0) {
        rate_ = rate_at_start_;
      } else if (!evaluate(kNodes[i] * h, sum_, &rate_)) {
        return HUGE_VAL;
      }
      for (std::size_t j = 0; j < i; ++j) rate_ += kCouplings[i][j] / h * u_[j];
      if (kTimeShares[i] != 0.0) rate_ += kTimeShares[i] * h * time_rate_;
      solve(&u_[i]);
    }
    sum_ += u_[kStages - 1];
    return sum_.allFinite() ? error_of(u_[kStages - 1]) : HUGE_VAL;
  }

  void solve(Eigen::VectorXd* u) {
    for (const Group& group : groups_) {
      Eigen::VectorXd part(group.matrix.rows());
      for (std::size_t m = 0; m < group.body.size(); ++m)
        part.segment<kNumbers>(first_of(m)) = rate_.segment<kNumbers>(first_of(group.body[m]));
      part = group.factors.solve(part).eval();
      for (std::size_t m = 0; m < group.body.size(); ++m)
        u->segment<kNumbers>(first_of(group.body[m])) = part.segment<kNumbers>(first_of(m));
    }
  }

  double error_of(const Eigen::VectorXd& error) const {
    double largest = 0.0;
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      const Numbers e = error.segment<kNumbers>(first_of(b)), y = sum_.segment<kNumbers>(first_of(b));
      if (!(y.segment<3>(3).norm() <= kLargestTurn)) return HUGE_VAL;
      const Twist& twist = bodies_[b].start.twist;
      for (const double part :
           {e.segment<3>(0).norm(), e.segment<3>(3).norm(), e.segment<3>(6).norm() / std::max(1.0, twist.linear.norm()),
            e.segment<3>(9).norm() / std::max(1.0, twist.angular.norm())})
        largest = part <= largest ? largest : part;
    }
    return largest;
  }

  void accept(double h) {
    for (std::size_t b = 0; b < bodies_.size(); ++b) {
      Body& body = bodies_[b];
      const Numbers y = sum_.segment<kNumbers>(first_of(b));
      body.start = state_of(body, y, h);
      body.moved += y.segment<3>(0);
      if (!body.moved.isZero(0.0)) body.start.pose.position = body.origin + body.moved;
    }
  }

  double accuracy_;
  const stage::IntegratorIntegrateRequest* request_ = nullptr;  // of the call in hand, as the next
  Derivatives* derivatives_ = nullptr;
  double done_ = 0.0;  // s since the start of the step
  // scratch: states y, rates f, and the stages
  std::vector<Body> bodies_;
  std::vector<Group> groups_;
  Eigen::VectorXd state_, rate_, rate_at_start_, time_rate_, sum_;
  std::array<Eigen::VectorXd, kStages> u_;
  TrialColumns trial_;
  std::vector<double> room_;
  WrenchJacobian jacobian_;  // of the start of the inner step
  std::vector<double> wrenches_;
  std::vector<Member> member_;  // by row
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Rosenbrock)
