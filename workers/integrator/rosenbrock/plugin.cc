// Integrator `Rosenbrock`: linearly implicit, L-stable, order 4 with an embedded method of order 3, for stiff forces.
// With the state y around the start of an inner step, y' = f(s, y), J = df/dy (local_motion.h) and f_s at the start, in the
// variables u of Hairer and Wanner,
//
//   (1/(g h) - J) u_i = f(alpha_i h, y + sum_j a_ij u_j) + sum_j c_ij/h u_j + g_i h f_s,    i = 1 ... 6,  g = 1/4
//   y' = y + sum_j a_5j u_j + u_5 + u_6                                       error: u_6
//
// the method RODAS, stiffly accurate: stiff, damped motion comes to rest at its balance in one inner step. f_s is a
// difference. The error is scaled and held to Accuracy, and inner steps end on the step's boundary, as in DormandPrince54.
// Stability: A- and L-stable; the test equation's amplification at h k -> inf is 0, so oscillations that the accuracy does
// not resolve are damped away. Known failures: that damping is not physics; of an undamped stiff spring the energy is lost
// as soon as its swing is below Accuracy. Stiff springs that turn with their bodies are straight to the method, so that its
// steps stay short: Radau takes them as they are. Source: Hairer, Wanner, Solving ODEs II, IV.7 and the code RODAS.
#include <algorithm>
#include <array>
#include <cmath>

#include "plugin_sdk/error_control.h"
#include "plugin_sdk/interaction_groups.h"
#include "plugin_sdk/local_motion.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/shifted_jacobian.h"

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
constexpr double kTimeDifference = 1e-6;  // per inner step

class Rosenbrock final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Rosenbrock",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Linearly implicit method RODAS, L-stable, order 4, with error control, for stiff forces.",
            .capabilities = {"order=4"},
            .properties = {accuracy_property(1e-6)},
            .theta = 0.5};
  }
  explicit Rosenbrock(PropertyCursor settings) : accuracy_(settings.number()) { fix_eigen_blocks(); }

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    motion_.begin(request, &derivatives);
    const double whole = request.time_step();
    double inner = whole, worst = 0.0;
    bool has_matrix = false;
    while (motion_.done() < whole && !motion_.is_empty()) {
      host.mark_progress();
      const double most = std::min(inner, motion_.longest());
      require_inner_step(most, whole);
      const double h = std::min(most, whole - motion_.done());
      if (!has_matrix) differentiate(h);
      has_matrix = true;
      const double error = attempt(h) / accuracy_;
      inner =
          h * (std::isfinite(error) ? std::clamp(kSafety * math::pow(std::max(error, 1e-10), -0.25), kSlowest, kFastest)
                                    : kSlowest);
      if (error <= 1.0) {
        worst = std::max(worst, error);
        motion_.accept(h, sum_);
        has_matrix = false;
      }
    }
    motion_.write(reply);
    reply.error_estimate().set(worst);
  }

 private:
  // J and f_s, at the start of an inner step.
  void differentiate(double h) {
    if (!motion_.evaluate(0.0, motion_.start(), &rate_at_start_)) throw Refusal("the state is not finite");
    const double time = kTimeDifference * h;
    motion_.evaluate(time, motion_.start(), &time_rate_);
    time_rate_ = (time_rate_ - rate_at_start_) / time;
    motion_.differentiate(rate_at_start_);
  }

  // The largest scaled error of an inner step, infinite where it cannot be taken; its result in sum_.
  double attempt(double h) {
    factors_.factorise(motion_, 1.0 / (kDiagonal * h));
    for (std::size_t i = 0; i < kStages; ++i) {
      sum_ = motion_.start();
      for (std::size_t j = 0; j < i; ++j) sum_ += kWeights[i][j] * u_[j];
      if (i == 0) {
        rate_ = rate_at_start_;
      } else if (!motion_.evaluate(kNodes[i] * h, sum_, &rate_)) {
        return HUGE_VAL;
      }
      for (std::size_t j = 0; j < i; ++j) rate_ += kCouplings[i][j] / h * u_[j];
      if (kTimeShares[i] != 0.0) rate_ += kTimeShares[i] * h * time_rate_;
      u_[i] = rate_;
      factors_.solve(&u_[i]);
    }
    sum_ += u_[kStages - 1];
    return sum_.allFinite() && motion_.is_in_chart(h, sum_) ? motion_.size_of(u_[kStages - 1]) : HUGE_VAL;
  }

  double accuracy_;
  // scratch: states y, rates f, and the stages
  LocalMotion motion_;
  ShiftedJacobian factors_;
  Eigen::VectorXd rate_, rate_at_start_, time_rate_, sum_;
  std::array<Eigen::VectorXd, kStages> u_;
  std::vector<double> room_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Rosenbrock)
