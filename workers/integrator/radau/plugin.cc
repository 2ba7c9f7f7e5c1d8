// Integrator `Radau`: the implicit Runge-Kutta method Radau IIA of three stages, order 5, with error control, for stiff
// motion that bends: springs and dampers of any stiffness that turn with their bodies, mechanisms under them. With the state
// y around the start of an inner step and y' = f(s, y) (local_motion.h), nodes c = ((4 - 6^1/2)/10, (4 + 6^1/2)/10, 1),
//
//   z_i = h sum_j a_ij f(c_j h, y + z_j),   i = 1 ... 3,      y' = y + z_3.
//
// The stages are found by Newton's method with J = df/dy, kept from one inner step to the next, turned with the bodies,
// while it gains a digit in a round; A^-1 = T diag(g, a +- i b) T^-1 makes one real and one complex system of it
// (ShiftedJacobian). What is stiff turns within a step, too, and J does not: where that would let errors grow from round
// to round, rounds are made in axes that turn steadily with each body (find_turns). They end where what they leave of z
// counts for less than a hundredth of the estimated error and than its power 3/2, which falls as fast as the method's own;
// where they gain little, for less than a hundredth of Accuracy; and where what they change is rounding. With f_0 at the
// start, the error is estimated as
//
//   e = (g/h - J)^-1 (f_0 + (d_1 z_1 + d_2 z_2 + d_3 z_3)/h),
//
// of order 3 and bounded for any stiffness; one above Accuracy is taken again with f(0, y + e) for f_0. It is scaled and
// held to Accuracy, and inner steps end on the step's boundary, as in DormandPrince54; the length that the last one would
// have had is kept in plugin_state for the step to come. Stability: A- and L-stable. Known failure: as for Rosenbrock,
// oscillations that Accuracy does not resolve are damped away. Where nothing is stiff, DormandPrince54 costs a fifth.
// Source: Hairer, Wanner, Solving ODEs II, IV.8 and the code RADAU5.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "plugin_sdk/error_control.h"
#include "plugin_sdk/interaction_groups.h"
#include "plugin_sdk/local_motion.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/shifted_jacobian.h"

namespace gravitas {
namespace {

constexpr std::size_t kStages = 3;
constexpr std::array<double, kStages> kNodes = {0.15505102572168219, 0.64494897427831781, 1.0};
constexpr double kReal = 3.637834252744496;                                         // g
constexpr std::array<double, 2> kComplex = {2.681082873627752, 3.050430199247411};  // a, b
constexpr double kFrom[kStages][kStages] = {{9.1232394870892943e-2, -0.14125529502095421, -3.0029194105147425e-2},
                                            {0.24171793270710702, 0.20412935229379993, 0.38294211275726194},
                                            {0.96604818261509294, 1.0, 0.0}};  // T
constexpr double kInto[kStages][kStages] = {{4.3255798900631554, 0.33919925181580987, 0.54177053993587487},
                                            {-4.1787185915519047, -0.32768282076106239, 0.47662355450055045},
                                            {-0.50287263494578688, 2.5719269498556054, -0.59603920482822493}};
constexpr double kInverse[kStages][kStages] = {{3.2247448713915889, 1.1678400846904056, -0.25319726474218083},
                                               {-3.5678400846904057, 0.77525512860841095, 1.0531972647421808},
                                               {5.5319726474218083, -7.5319726474218083, 5.0}};        // A^-1
constexpr std::array<double, kStages> kError = {-10.048809399827415, 1.3821427331607483, -1.0 / 3.0};  // d

constexpr double kSafety = 0.9, kSlowest = 0.2, kFastest = 8.0;
constexpr double kLonger = 1.1;
constexpr int kMostRounds = 10;
constexpr double kFar = 5.0;          // growth of the second round that ends them
constexpr double kKeeps = 0.1;        // of what is left, that a round may leave for J to be kept
constexpr double kGainsLittle = 0.5;  // of what was left, that a round leaves
constexpr double kAnswered = 12.0;    // most of d(velocity)/d(position) of a stage, per inner step: |A^-1|
constexpr double kOfRounding = 16.0, kNothing = 1e-15, kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kOfEstimate = 1e-2;  // what rounds may leave
constexpr double kOfRejected = 0.1;

class Radau final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Radau",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Implicit method Radau IIA, L-stable, order 5, with error control, for stiff forces that turn.",
            .capabilities = {"order=5", "plugin_state"},
            .properties = {accuracy_property(1e-6)},
            .theta = 0.5};
  }
  explicit Radau(PropertyCursor settings) : accuracy_(settings.number()) { fix_eigen_blocks(); }

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    motion_.begin(request, &derivatives);
    const double whole = request.time_step();
    const double remembered = remembered_inner_step(request.plugin_state(), whole);
    double inner = remembered > 0.0 ? remembered : whole, worst = 0.0;
    double longest = HUGE_VAL;  // for a while after rounds that did not end
    int failures = 0;
    has_rate_ = has_matrix_ = false;
    guess_ = remembered > 0.0 ? Guess::kSmooth : Guess::kNone;
    while (motion_.done() < whole && !motion_.is_empty()) {
      host.mark_progress();
      prepare();
      const double most = std::min(inner, motion_.longest());
      require_inner_step(most, whole);
      const double h = next_inner_step(most, whole - motion_.done());
      if (!find_stages(h)) {
        // an old matrix may be all that is wrong, or a guess; one that led nowhere twice is no better than none
        if (is_fresh_ && guess_ == Guess::kSmooth) {
          guess_ = Guess::kNone;
        } else if (is_fresh_) {
          inner = 0.5 * h;
          longest = 0.7 * h;
          if (++failures > 1) guess_ = Guess::kNone;
        }
        has_matrix_ = is_fresh_;
      } else {
        const double error = error_ / accuracy_;
        const double safety = kSafety * (2 * kMostRounds + 1) / (2 * kMostRounds + rounds_);
        const double factor =
            std::clamp(safety * math::pow(std::max(error, 1e-10), -0.25), kSlowest, error <= 1.0 ? kFastest : 0.9);
        if (error <= 1.0) {
          worst = std::max(worst, error);
          accept(h);
          // a step cut short at a boundary says little of long ones
          inner = std::min(longest, factor < kFastest ? factor * h : std::max(inner, factor * h));
          longest *= kLonger;
          failures = 0;
          continue;
        }
        inner = factor * h;
        has_matrix_ = is_fresh_;
      }
    }
    motion_.write(reply);
    reply.plugin_state().push(inner);
    reply.error_estimate().set(worst);
  }

 private:
  // Of the stages: where the step starts, as it goes on from there, or as the inner step before goes on.
  enum class Guess : std::uint8_t { kNone, kSmooth, kGoesOn };
  using Stages = std::array<Eigen::VectorXd, kStages>;

  // f and J where the inner step starts.
  void prepare() {
    if (!has_rate_ && !motion_.evaluate(0.0, motion_.start(), &rate_at_start_))
      throw Refusal("the state is not finite");
    has_rate_ = true;
    if (has_matrix_) return;
    motion_.differentiate(rate_at_start_);
    has_matrix_ = is_fresh_ = true;
    factored_step_ = 0.0;
  }

  // Stages of an inner step, their error and how the rounds went; false where there are none to be found.
  bool find_stages(double h) {
    if (factored_step_ != h) {
      real_.factorise(motion_, kReal / h);
      complex_.factorise(motion_, kComplex[0] / h, kComplex[1] / h);
      factored_step_ = h;
    }
    find_turns(h);
    guess(h);
    const double placed = motion_.rounding(h, std::min(kAnswered, answers_) / h);
    double last = HUGE_VAL;
    for (rounds_ = 1; rounds_ <= kMostRounds; ++rounds_) {
      const double size = improve(h);
      if (!std::isfinite(size)) return false;
      error_ = estimate(h, rate_at_start_);
      rate_ = size / last;
      const double rounding = kOfRounding * std::max(placed, kEpsilon * motion_.size_of(z_[kStages - 1]));
      if (size <= kNothing || (std::max(size, last) <= rounding && rate_ > kGainsLittle)) {
        rate_ = 0.0;  // it says nothing of J
        if (error_ > accuracy_) estimate_again(h);
        return has_end(h);
      }
      const double last_size = last;
      last = size;
      // the first round straightens what bends: it says nothing of the next ones
      if (rounds_ == 1 || (rounds_ == 2 && rate_ < kFar)) continue;
      if (rate_ >= 1.0) {
        if (size <= rounding) continue;
        // the rounding of accelerations, which may be far more (a light link between heavy bodies): what it leaves is nothing
        return std::max(size, last_size) <= kOfEstimate * accuracy_ && error_ <= accuracy_ && has_end(h);
      }
      const double remains = size * rate_ / (1.0 - rate_);
      if (error_ > accuracy_ && remains <= kOfRejected * error_) estimate_again(h);
      const double allowed =
          error_ <= accuracy_ ? error_ * std::min(kOfEstimate, std::sqrt(error_)) : kOfRejected * error_;
      const double enough = std::max(allowed, kOfEstimate * accuracy_);
      if (remains <= (rate_ > kGainsLittle || rounds_ == kMostRounds ? enough : allowed)) return has_end(h);
      if (remains * math::pow(rate_, kMostRounds - rounds_) > enough) return false;
    }
    return false;
  }

  bool has_end(double h) const {
    return std::isfinite(error_) && motion_.is_in_chart(h, motion_.start() + z_[kStages - 1]);
  }

  // An error that is too large may be that of a stiff transient: its own start is taken for the estimate.
  void estimate_again(double h) {
    shifted_ = motion_.start() + error_vector_;
    if (!motion_.is_in_chart(0.0, shifted_)) return;
    asks_elsewhere_ = true;
    if (!motion_.evaluate(0.0, shifted_, &shifted_rate_)) return;
    error_ = std::min(error_, estimate(h, shifted_rate_));
  }

  // One round for all stages; by how much they changed, infinite where one cannot be taken.
  double improve(double h) {
    asks_elsewhere_ = false;
    for (std::size_t i = 0; i < kStages; ++i) {
      shifted_ = motion_.start() + z_[i];
      const double elapsed = kNodes[i] * h;
      if (!motion_.is_in_chart(elapsed, shifted_) || !motion_.evaluate(elapsed, shifted_, &rates_[i])) return HUGE_VAL;
    }
    for (std::size_t i = 0; i < kStages; ++i) {
      for (std::size_t j = 0; j < kStages; ++j) rates_[i] -= kInverse[i][j] / h * z_[j];
      turn(i, true, &rates_[i]);
    }
    Stages change = combined(kInto, rates_);
    real_.solve(&change[0]);
    complex_.solve(&change[1], &change[2]);
    change = combined(kFrom, change);
    double size = 0.0;
    for (std::size_t i = 0; i < kStages; ++i) {
      if (!change[i].allFinite()) return HUGE_VAL;
      turn(i, false, &change[i]);
      z_[i] += change[i];
      size = std::max(size, motion_.size_of(change[i]));
    }
    return size;
  }

  // With s the rate of the stiffest motion, a round leaves a share h s (h |w|)^2 of an error in axes that stand still, and
  // h |w| in axes that turn with the bodies: those with the lesser share are taken.
  void find_turns(double h) {
    double turn = 0.0, stiffness = 0.0;
    answers_ = 0.0;
    for (std::size_t b = 0; b < motion_.bodies(); ++b)
      turn = std::max(turn, h * motion_.twist_at_start(b).angular.norm());
    for (const LocalMotion::Group& group : motion_.groups()) {
      double positions = 0.0, velocities = 0.0;
      for (Eigen::Index k = 0; k < group.accelerations.cols(); ++k)
        (k % LocalMotion::kNumbers < 6 ? positions : velocities) += group.accelerations.col(k).squaredNorm();
      answers_ = std::max(answers_, h * h * std::sqrt(positions));
      stiffness = std::max(stiffness, h * std::sqrt(velocities) + h * h * std::sqrt(positions));
    }
    turns_.clear();
    if (!(stiffness * turn > 1.0)) return;
    for (const double node : kNodes)
      for (std::size_t b = 0; b < motion_.bodies(); ++b)
        turns_.push_back(to_rotation_matrix(exp_rotation(node * h * motion_.twist_at_start(b).angular)));
  }

  // Into the axes of a stage, or back.
  void turn(std::size_t stage, bool into, Eigen::VectorXd* y) const {
    for (std::size_t b = 0; b < motion_.bodies() && !turns_.empty(); ++b) {
      const Matrix3& by = turns_[stage * motion_.bodies() + b];
      for (Eigen::Index k = 0; k < LocalMotion::kNumbers; k += 3) {
        auto part = y->segment<3>(LocalMotion::kNumbers * static_cast<Eigen::Index>(b) + k);
        part = into ? Vector3(by.transpose() * part) : Vector3(by * part);
      }
    }
  }

  double estimate(double h, const Eigen::VectorXd& rate) {
    error_vector_ = rate;
    for (std::size_t i = 0; i < kStages; ++i) error_vector_ += kError[i] / h * z_[i];
    real_.solve(&error_vector_);
    return error_vector_.allFinite() ? motion_.size_of(error_vector_) : HUGE_VAL;
  }

  // Smooth: s f_0 + s^2/2 J f_0 to that order, and bounded for any stiffness: s R (1 + (g s/2h - 1) (R - 1)) f_0 with
  // R = (1 - h/g J)^-1.
  void guess(double h) {
    const Eigen::VectorXd& start = motion_.start();
    if (guess_ == Guess::kSmooth) {
      mean_rate_ = kReal / h * rate_at_start_;
      real_.solve(&mean_rate_);
      bent_ = kReal / h * mean_rate_;
      real_.solve(&bent_);
      bent_ -= mean_rate_;
    }
    bool is_wild = false;
    for (std::size_t i = 0; i < kStages; ++i) {
      const double s = kNodes[i] * h;
      z_[i].setZero(start.size());
      if (guess_ == Guess::kSmooth) {
        z_[i] = s * (mean_rate_ + (0.5 * kReal * kNodes[i] - 1.0) * bent_);
      } else if (guess_ == Guess::kGoesOn) {
        // Lagrange's polynomial, through 0 at 0 and the stages at their nodes
        const double at = 1.0 + s / last_step_;
        Eigen::VectorXd y = last_start_;
        for (std::size_t j = 0; j < kStages; ++j) {
          double share = at / kNodes[j];
          for (std::size_t k = 0; k < kStages; ++k)
            if (k != j) share *= (at - kNodes[k]) / (kNodes[j] - kNodes[k]);
          y += share * last_z_[j];
        }
        z_[i] = motion_.around_end(s, y) - start;
      }
      is_wild = is_wild || !z_[i].allFinite() || !motion_.is_in_chart(s, start + z_[i]);
    }
    for (std::size_t i = 0; i < kStages && is_wild; ++i) z_[i].setZero();
  }

  void accept(double h) {
    last_step_ = h;
    last_start_ = motion_.start();
    last_z_ = z_;
    // with `Smooth` the last question tells what joints bear
    if (asks_elsewhere_) motion_.evaluate(h, last_start_ + z_[kStages - 1], &shifted_rate_);
    motion_.accept(h, motion_.start() + z_[kStages - 1]);
    has_rate_ = is_fresh_ = false;
    has_matrix_ = rate_ <= kKeeps;
    if (has_matrix_) motion_.turn_jacobian();
    guess_ = Guess::kGoesOn;
    factored_step_ = 0.0;
  }

  static Stages combined(const double (&weights)[kStages][kStages], const Stages& from) {
    Stages to;
    for (std::size_t i = 0; i < kStages; ++i)
      to[i] = weights[i][0] * from[0] + weights[i][1] * from[1] + weights[i][2] * from[2];
    return to;
  }

  double accuracy_;
  // of the call in hand
  LocalMotion motion_;
  ShiftedJacobian real_, complex_;
  double factored_step_ = 0.0;                                     // that they are for
  bool has_rate_ = false, has_matrix_ = false, is_fresh_ = false;  // the matrix: of this inner step's start
  Stages z_, rates_;
  double answers_ = 0.0;        // h times the rate at which velocities answer positions, at most
  std::vector<Matrix3> turns_;  // by stage and body; empty: none
  double error_ = 0.0, rate_ = 0.0;
  int rounds_ = 0;
  Guess guess_ = Guess::kNone;
  double last_step_ = 0.0;  // of the inner step before
  Stages last_z_;
  Eigen::VectorXd last_start_;
  bool asks_elsewhere_ = false;  // than in the stages, last
  Eigen::VectorXd rate_at_start_, shifted_rate_, error_vector_, shifted_, mean_rate_, bent_;
  std::vector<double> room_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Radau)
