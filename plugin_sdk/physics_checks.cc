#include "plugin_sdk/physics_checks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

#include "plugin_sdk/body.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/pair_rule.h"

namespace gravitas {
namespace {

// Some thousand roundings of the numbers that a residual is made of.
constexpr double kOfArithmetic = 1e-12;
// Factor on what changes within a step: a sum of several looks at it may overshoot.
constexpr double kChange = 3.0;
// Turns within a step up to which a rotation vector tells which way it went, rad.
constexpr double kLargestTurn = 1.5;

// "position of body 3 is off by 0.5, allowed 1e-09 (why)"; empty if it is within the bound.
std::string off_by(const char* what, std::size_t body, double residual, double bound, const char* why) {
  if (residual <= bound) return {};
  char text[256];
  std::snprintf(text, sizeof text, "%s of body %zu is off by %.3g, allowed %.3g (%s)", what, body, residual, bound,
                why);
  return text;
}

struct StepOfBody {
  Twist start, end;       // v_n, w_n and v*, w*
  Pose from, to;          // of S_n and S*
  double h, damped;       // s; share that damping can take
  double inverse_mass;    // 1/kg
  Vector3 force, torque;  // at the first question
  double force_spread = 0.0, torque_spread = 0.0;
  Vector3 inertia, inverse_inertia;

  // By how much moments differ, of the smallest.
  double unequal() const {
    const double inverse = inverse_inertia.maxCoeff();
    return inverse > 0.0 ? (inertia.maxCoeff() - inertia.minCoeff()) * inverse : 0.0;
  }
  // rad/s^2, at most, by the torque and the gyroscopic term.
  double rate() const { return torque.norm() * inverse_inertia.maxCoeff() + unequal() * start.angular.squaredNorm(); }
};

std::string check_velocities(const StepOfBody& s, std::size_t body) {
  const Vector3 a = s.inverse_mass * s.force;
  const double sizes = s.start.linear.norm() + s.h * a.norm();
  const double spread = kChange * s.h * s.inverse_mass * s.force_spread;
  std::string wrong = off_by("linear_velocity", body, (s.end.linear - s.start.linear - s.h * a).norm(),
                             (s.damped + kOfArithmetic) * sizes + spread, "v_n + h a");
  if (!wrong.empty()) return wrong;

  const Vector3& w = s.start.angular;
  const Vector3 alpha = angular_acceleration(s.from.orientation, w, s.inertia, s.inverse_inertia, s.torque);
  const double inverse = s.inverse_inertia.maxCoeff();
  // what changes while the body turns: a torque that is fixed in it, and the gyroscopic term
  const double unequal = s.unequal(), rate = s.rate();
  const double turn = s.h * (w.norm() + s.h * rate);
  const double turned = unequal > 1e-9 ? turn * (1.0 + unequal) * s.h * rate : 0.0;
  const double turning = kChange * s.h * inverse * s.torque_spread;
  // of torques that forces at points cancel each other's
  const double gyration = std::sqrt(s.inverse_mass * s.inertia.maxCoeff());
  const double cancelled = kOfArithmetic * s.h * inverse * gyration * s.force.norm();
  return off_by(
      "angular_velocity", body, (s.end.angular - w - s.h * alpha).norm(),
      (s.damped + kOfArithmetic) * (w.norm() + s.h * alpha.norm() + s.h * rate) + turned + turning + cancelled,
      "w_n + h alpha");
}

std::string check_pose(const StepOfBody& s, std::size_t body) {
  const Vector3 mean = 0.5 * (s.start.linear + s.end.linear), half = 0.5 * (s.end.linear - s.start.linear);
  const double reach = s.h * (s.start.linear.norm() + s.end.linear.norm()) + s.from.position.norm();
  std::string wrong =
      off_by("position", body, (s.to.position - s.from.position - s.h * mean).norm(),
             s.h * half.norm() + kChange * s.h * s.h * s.inverse_mass * s.force_spread + kOfArithmetic * reach +
                 s.damped * s.h * (s.start.linear.norm() + s.h * s.inverse_mass * s.force.norm()),
             "x_n + h v, v between v_n and v*");
  if (!wrong.empty()) return wrong;

  const double fastest = std::max(s.start.angular.norm(), s.end.angular.norm());
  const double spread = kChange * s.h * s.h * s.inverse_inertia.maxCoeff() * s.torque_spread;
  const double turn = s.h * fastest + spread;
  if (!(turn < kLargestTurn)) return {};
  const Quaternion change = s.to.orientation * s.from.orientation.conjugate();
  if (change.w() < 0.0) return off_by("orientation", body, 2.0, 0.0, "it changed its sign");
  const Vector3 between = 0.5 * s.h * (s.start.angular + s.end.angular);
  const double apart = s.h * (s.end.angular - s.start.angular).norm();
  // on the way a torque and the gyroscopic term may change what they leave at the end
  const double on_the_way = 0.5 * s.h * s.h * s.rate() * (1.0 + turn * (1.0 + s.unequal()));
  return off_by("orientation", body, (log_rotation(change) - between).norm(),
                (0.5 + turn) * apart + on_the_way + spread + turn * turn * turn / 12.0 + kOfArithmetic * (1.0 + turn),
                "the turn by h w, w between w_n and w*");
}

}  // namespace

void WrenchRange::add(std::span<const double> wrench) {
  if (first_.empty()) {
    first_.assign(wrench.begin(), wrench.end());
    spread_.assign(wrench.size() / 3, 0.0);
    return;
  }
  for (std::size_t i = 0; i < spread_.size(); ++i)
    spread_[i] = std::max(spread_[i], (vector_at(wrench, i) - vector_at(first_, i)).norm());
}

std::string check_integration(const stage::IntegratorIntegrateRequest& request, const IntegratedState& answer,
                              const WrenchRange& wrenches) {
  const bool is_constant = request.wrench_is_constant() != 0;
  const bool knows = is_constant || !wrenches.is_empty();
  const std::span<const double> wrench = is_constant ? request.wrench() : wrenches.first();
  for (std::size_t i = 0; i < request.flags().size(); ++i) {
    const std::uint32_t flags = request.flags()[i];
    if ((flags & (kMovable | kKinematic)) == 0) continue;
    StepOfBody s;
    s.h = request.time_step();
    s.start = {vector_at(request.linear_velocity(), i), vector_at(request.angular_velocity(), i)};
    s.end = {vector_at(answer.linear_velocity, i), vector_at(answer.angular_velocity, i)};
    s.from = {vector_at(request.position(), i), quaternion_at(request.orientation(), i)};
    s.to = {vector_at(answer.position, i), quaternion_at(answer.orientation, i)};
    const bool is_pushed = (flags & kMovable) != 0 && (flags & kKinematic) == 0;
    s.damped = is_pushed ? std::min(1.0, request.damping()[i] * s.h) : 0.0;
    s.inverse_mass = is_pushed ? request.inverse_mass()[i] : 0.0;
    s.inertia = vector_at(request.inertia(), i);
    s.inverse_inertia = is_pushed ? vector_at(request.inverse_inertia(), i) : Vector3(Vector3::Zero());
    s.force = s.torque = Vector3::Zero();
    if (is_pushed && knows) s.force = vector_at(wrench, 2 * i), s.torque = vector_at(wrench, 2 * i + 1);
    if (is_pushed && knows && !is_constant)
      s.force_spread = wrenches.force_spread(i), s.torque_spread = wrenches.torque_spread(i);
    std::string wrong = knows || !is_pushed ? check_velocities(s, i) : std::string();
    if (wrong.empty()) wrong = check_pose(s, i);
    if (!wrong.empty()) return wrong;
  }
  return {};
}

// Each pair is one that the rule wants, and there are as many as it wants: they are unique, so they are all of them.
std::string PairCheck::check(const stage::SpacePairsRequest& request, std::span<const std::uint32_t> pair) {
  const PairRule wants(request);
  const auto named = [](const char* what, std::uint32_t a, std::uint32_t b) {
    return std::string("pair (") + std::to_string(a) + ", " + std::to_string(b) + ") " + what;
  };
  for (std::size_t i = 0; i + 1 < pair.size(); i += 2)
    if (!wants(pair[i], pair[i + 1]))
      return named("is there, though the bounds are apart or may not touch", pair[i], pair[i + 1]);

  // sweep along the axis on which the bodies are spread most
  const std::span<const double> lower = request.lower(), upper = request.upper();
  const std::size_t bodies = request.flags().size();
  Vector3 least = Vector3::Constant(std::numeric_limits<double>::infinity()), most = -least;
  for (std::size_t i = 0; i < bodies; ++i) {
    const Vector3 corner = vector_at(lower, i);
    if (!corner.allFinite()) continue;
    least = least.cwiseMin(corner), most = most.cwiseMax(corner);
  }
  Eigen::Index axis = 0;
  (most - least).maxCoeff(&axis);
  const auto k = static_cast<std::size_t>(axis);
  order_.resize(bodies);
  std::iota(order_.begin(), order_.end(), 0U);
  std::ranges::sort(order_, {}, [&](std::uint32_t i) { return std::pair(lower[3 * i + k], i); });
  std::size_t wanted = 0;
  for (std::size_t i = 0; i < bodies; ++i) {
    const double end = upper[3 * order_[i] + k];
    for (std::size_t j = i + 1; j < bodies && lower[3 * order_[j] + k] <= end; ++j) {
      const auto [a, b] = std::minmax(order_[i], order_[j]);
      wanted += wants(a, b) ? 1 : 0;
    }
  }
  if (wanted == pair.size() / 2) return {};
  return counted(pair.size() / 2, "pair is there", "pairs are there") + ", " + counted(wanted, "has", "have") +
         " overlapping bounds";
}

}  // namespace gravitas
