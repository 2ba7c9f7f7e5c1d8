#include "plugin_sdk/dense_step.h"

#include <algorithm>
#include <cmath>

namespace gravitas {
namespace {

enum Part : std::size_t { kPosition, kTurn, kLinear, kAngular };

// Where they stand among the numbers of a body's start.
constexpr std::size_t kPositionAt = 0, kOrientationAt = 3, kLinearAt = 7, kAngularAt = 10, kAccelerationAt = 13,
                      kTurningAt = 16;

// Is it one time, to rounding?
bool is_same(double time, double other, double length) {
  return std::abs(time - other) <= std::max(1e-9 * length, 1e-15 * std::abs(time));
}

std::array<double, 4> basis(double theta) {
  const double rest = 1.0 - theta;
  return {theta, theta * rest, theta * theta * rest, theta * theta * rest * rest};
}

std::array<double, 4> slope(double theta) {
  const double rest = 1.0 - theta;
  return {1.0, rest - theta, theta * (2.0 * rest - theta), 2.0 * theta * rest * (rest - theta)};
}

}  // namespace

void DenseStep::assign(const stage::IntegratorIntegrateRequest& request, const MotionStages<GroupChart>& stages,
                       std::span<const double> weights, std::span<const double> dense_weights,
                       std::span<const double> nodes, double length) {
  length_ = length;
  elapsed_ = 0.0;
  numbers_.assign(kNumbers * stages.size(), 0.0);
  const std::size_t last = nodes.size() - 1;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (!stages.is_movable(i)) continue;
    double* number = &numbers_[kNumbers * i];
    const auto put = [&number](const auto& vector) { number = std::copy_n(vector.data(), vector.size(), number); };
    const BodyState& start = stages.start(i);
    const Quaternion& q = start.pose.orientation;
    put(start.pose.position), put(Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
    put(start.twist.linear), put(start.twist.angular);
    put(stages.rate(0, i).linear), put(stages.rate(0, i).angular);
    // H k_j of the stages, freed of damping
    std::array<Eigen::Matrix<double, kCoefficient, 1>, 4> c;
    for (auto& coefficient : c) coefficient.setZero();
    for (std::size_t j = 0; j <= last; ++j) {
      const auto& rate = stages.deviation(j, i);
      const double freed = length / damping_factor(request.damping()[i], nodes[j] * length);
      Eigen::Matrix<double, kCoefficient, 1> k;
      k << length * rate.velocity, length * rate.turn, freed * rate.linear, freed * rate.angular;
      const double b = j < last ? weights[j] : 0.0, first = j == 0 ? 1.0 : 0.0, end = j == last ? 1.0 : 0.0;
      c[0] += b * k, c[1] += (first - b) * k, c[2] += (2.0 * b - first - end) * k, c[3] += dense_weights[j] * k;
    }
    for (const auto& coefficient : c) put(coefficient);
  }
}

bool DenseStep::load(const stage::IntegratorIntegrateRequest& request, std::size_t first) {
  const std::span<const double> state = request.plugin_state();
  if (state.size() != first + size(request.flags().size())) return false;
  if (std::ranges::any_of(request.state_changed(), [](std::uint32_t changed) { return changed != 0; })) return false;
  const std::span<const double> own = state.subspan(first);
  if (!std::ranges::all_of(own, [](double number) { return std::isfinite(number); })) return false;
  elapsed_ = own[0], length_ = own[1];
  if (!(elapsed_ >= 0.0 && elapsed_ < length_ && is_same(own[2], request.time(), length_))) return false;
  numbers_.assign(own.begin() + kHead, own.end());
  return true;
}

void DenseStep::save(double time, std::span<double> out) const {
  out[0] = elapsed_, out[1] = length_, out[2] = time;
  std::ranges::copy(numbers_, out.begin() + kHead);
}

Vector3 DenseStep::start(std::size_t body, std::size_t place) const {
  return Vector3::Map(&numbers_[kNumbers * body + place]);
}

Vector3 DenseStep::sum(std::size_t body, std::size_t part, const std::array<double, 4>& weights) const {
  Vector3 total = Vector3::Zero();
  for (std::size_t m = 0; m < 4; ++m)
    total += weights[m] * Vector3::Map(&numbers_[kNumbers * body + kStart + kCoefficient * m + 3 * part]);
  return total;
}

// Where there is no damping all of it is in the coefficients.
DampedMotion DenseStep::known_motion(std::size_t body, double damping, double passed) const {
  const Twist twist = {start(body, kLinearAt), start(body, kAngularAt)};
  if (damping == 0.0) return {.twist = twist};
  return damped_motion(twist, {start(body, kAccelerationAt), start(body, kTurningAt)}, damping, passed);
}

BodyState DenseStep::at(std::size_t body, double damping, double ahead) const {
  const double passed = elapsed_ + ahead, kept = damping_factor(damping, passed);
  const std::array<double, 4> weights = basis(passed / length_);
  const double* q = &numbers_[kNumbers * body + kOrientationAt];
  const DampedMotion known = known_motion(body, damping, passed);
  BodyState state;
  state.pose = {start(body, kPositionAt) + (known.moved + sum(body, kPosition, weights)),
                GroupChart::at(Quaternion(q[0], q[1], q[2], q[3]), known.turned + sum(body, kTurn, weights))};
  state.twist = {known.twist.linear + kept * sum(body, kLinear, weights),
                 known.twist.angular + kept * sum(body, kAngular, weights)};
  return state;
}

Acceleration DenseStep::acceleration(std::size_t body, double damping, double ahead) const {
  const double passed = elapsed_ + ahead, kept = damping_factor(damping, passed) / length_;
  const std::array<double, 4> weights = slope(passed / length_);
  Acceleration rates = {kept * sum(body, kLinear, weights), kept * sum(body, kAngular, weights)};
  if (damping != 0.0) rates.linear += start(body, kAccelerationAt), rates.angular += start(body, kTurningAt);
  return rates;
}

}  // namespace gravitas
