// Integrator `DormandPrince54`: the Runge-Kutta pair of Dormand and Prince of orders 5 and 4 in the group chart
// (motion_stages.h), with error control. A step is made of inner steps of its own choice, the last of which ends on the
// step's boundary; the result is the one of order 5. The error of an inner step is estimated as
//
//   e = h sum_i (b_i - b^_i) k_i,
//   E = max over bodies of |e_x| / (1 m), |e_r| / (1 rad), |e_v| / max(1 m/s, |v|), |e_w| / max(1 rad/s, |w|)
//
// and the inner step is accepted where E <= Accuracy; the next one is 0.9 h E^(-0.17) E_before^(0.04) long (E over
// Accuracy), by between 0.2 and 5 times. So Accuracy bounds the error of an inner step, not that of the end, which
// gathers them. The answer's error_estimate is the largest E / Accuracy of the step.
// Sources: Dormand, Prince, J. Comput. Appl. Math. 6 (1980) 19; Hairer, Norsett, Wanner, Solving ODEs I, II.4, IV.2.
// Six derivatives an inner step and one more a step. Damping as in motion_stages.h. Stability: explicit, so that a
// stiff force (h sqrt(k/m) > 3) costs as many inner steps as it takes; see Radau. Known failure: energy drifts by
// what the accuracy lets through. Refused, with the body's number: what no inner step can follow.
#include <algorithm>
#include <array>
#include <cmath>

#include "plugin_sdk/error_control.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/motion_stages.h"

namespace gravitas {
namespace {

constexpr std::size_t kStages = 7;
constexpr std::array<double, kStages> kNodes = {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0};
constexpr double kWeights[kStages][kStages - 1] = {
    {},
    {1.0 / 5.0},
    {3.0 / 40.0, 9.0 / 40.0},
    {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
    {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
    {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
    {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0}};
constexpr std::array<double, kStages> kError = {71.0 / 57600.0,      0.0,          -71.0 / 16695.0, 71.0 / 1920.0,
                                                -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};

constexpr double kSafety = 0.9, kSlowest = 0.2, kFastest = 5.0;
constexpr double kExponent = 0.17, kMemory = 0.04;

class DormandPrince54 final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "DormandPrince54",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Runge-Kutta pair of Dormand and Prince, order 5, with error control.",
            .capabilities = {"order=5"},
            .properties = {accuracy_property(1e-8)},
            .theta = 0.5};
  }
  explicit DormandPrince54(PropertyCursor settings) : accuracy_(settings.number()) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    stages_.begin(request, &derivatives, kStages);
    const double whole = request.time_step();
    double done = 0.0, inner = whole, before = 1.0, worst = 0.0;
    bool has_first = false;
    while (done < whole) {
      host.mark_progress();
      const double h = std::min(inner, whole - done);
      const double error = attempt(h, &has_first) / accuracy_;
      if (error <= 1.0) {
        worst = std::max(worst, error);
        stages_.advance(kStages - 1, h);
        done = h == whole - done ? whole : done + h;
        inner = h * factor(error, before);
        before = std::max(error, 1e-4);
        continue;
      }
      inner = h * std::min(1.0, std::isfinite(error) ? factor(error, 1.0) : 0.1);
      require_inner_step(inner, whole);
    }
    for_each_body(request, reply, [&](std::size_t i, const BodyState&) { return stages_.start(i); });
    reply.error_estimate().set(worst);
  }

 private:
  // The largest scaled error of an inner step, infinite where a stage is not finite.
  double attempt(double h, bool* has_first) {
    for (std::size_t stage = *has_first ? 1 : 0; stage < kStages; ++stage) {
      if (!stages_.evaluate(stage, kWeights[stage], kNodes, h)) {
        if (stage == 0) throw Refusal("the state is not finite");
        return HUGE_VAL;
      }
      *has_first = true;
    }
    double largest = 0.0;
    for (std::size_t i = 0; i < stages_.size(); ++i) {
      if (!stages_.is_movable(i)) continue;
      const auto error = stages_.weighted(i, kError, h);
      const Twist& twist = stages_.start(i).twist;
      for (const double e :
           {error.velocity.norm(), error.turn.norm(), error.linear.norm() / std::max(1.0, twist.linear.norm()),
            error.angular.norm() / std::max(1.0, twist.angular.norm())})
        largest = e <= largest ? largest : e;
      if (!std::isfinite(largest)) return HUGE_VAL;
    }
    return largest;
  }

  // By how much the next step is longer.
  static double factor(double error, double before) {
    if (error == 0.0) return kFastest;
    const double wanted = kSafety * math::pow(error, -kExponent) * math::pow(before, kMemory);
    return std::clamp(wanted, kSlowest, kFastest);
  }

  double accuracy_;
  MotionStages<GroupChart> stages_;  // scratch
  std::vector<double> room_;         // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::DormandPrince54)
