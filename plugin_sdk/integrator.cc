#include "plugin_sdk/integrator.h"

#include <algorithm>
#include <string>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

gravitas_column column_of(std::span<const double> numbers) { return {numbers.data(), numbers.size()}; }

std::array<std::span<const double>, 4> columns_of(const TrialColumns& trial) {
  return {trial.position, trial.orientation, trial.linear_velocity, trial.angular_velocity};
}

}  // namespace

void TrialColumns::resize(std::size_t bodies) {
  position.resize(3 * bodies), orientation.resize(4 * bodies);
  linear_velocity.resize(3 * bodies), angular_velocity.resize(3 * bodies);
}

BodyState TrialColumns::at(std::size_t body) const {
  return {{vector_at(position, body), quaternion_at(orientation, body)},
          {vector_at(linear_velocity, body), vector_at(angular_velocity, body)}};
}

void TrialColumns::set(std::size_t body, const BodyState& state) {
  set_vector(position, body, state.pose.position);
  set_quaternion(orientation, body, state.pose.orientation);
  set_vector(linear_velocity, body, state.twist.linear);
  set_vector(angular_velocity, body, state.twist.angular);
}

Derivatives::Derivatives(const stage::IntegratorIntegrateRequest& request, Host& host, std::vector<double>* room)
    : request_(request), host_(host), answer_(*room) {}

std::span<const double> Derivatives::wrenches_at_start() {
  if (request_.wrench_is_constant() != 0) return request_.wrench();
  return ask(DerivativeQuestion::kWrenches, request_.time(),
             {request_.position(), request_.orientation(), request_.linear_velocity(), request_.angular_velocity()});
}

std::span<const double> Derivatives::wrenches(double time, const TrialColumns& trial) {
  if (request_.wrench_is_constant() != 0) return request_.wrench();
  require_finite(trial);
  return ask(DerivativeQuestion::kWrenches, time, columns_of(trial));
}

std::span<const double> Derivatives::forces(double time, const TrialColumns& trial) {
  if (request_.wrench_is_constant() != 0) return request_.wrench();
  require_finite(trial);
  return ask(DerivativeQuestion::kForces, time, columns_of(trial));
}

std::span<const double> Derivatives::place_impulses(double time, const TrialColumns& trial) {
  return ask_impulses(DerivativeQuestion::kPlaceImpulses, time, trial);
}

std::span<const double> Derivatives::velocity_impulses(double time, const TrialColumns& trial) {
  return ask_impulses(DerivativeQuestion::kVelocityImpulses, time, trial);
}

// Wrenches that are constant are those of bodies without joints.
std::span<const double> Derivatives::ask_impulses(DerivativeQuestion question, double time, const TrialColumns& trial) {
  if (request_.wrench_is_constant() != 0) return {};
  require_finite(trial);
  return ask(question, time, columns_of(trial));
}

std::span<const double> Derivatives::wrenches(double time, const TrialColumns& trial, WrenchJacobian* jacobian) {
  jacobian->is_known_ = request_.wrench_is_constant() != 0;
  if (jacobian->is_known_ || request_.jacobian_blocks() == 0) {
    jacobian->bodies_.clear(), jacobian->numbers_.clear();
    return wrenches(time, trial);
  }
  require_finite(trial);
  const std::span<const double> answer = ask(DerivativeQuestion::kWithJacobian, time, columns_of(trial), jacobian);
  jacobian->is_known_ = jacobian->size() > 0;
  return answer;
}

std::span<const double> Derivatives::ask(DerivativeQuestion question, double time,
                                         const std::array<std::span<const double>, 4>& state,
                                         WrenchJacobian* jacobian) {
  answer_.resize(6 * size());
  const auto wanted = static_cast<std::uint32_t>(question);
  const std::array<gravitas_column, 6> asked = {column_of({&time, 1}), column_of(state[0]),
                                                column_of(state[1]),   column_of(state[2]),
                                                column_of(state[3]),   gravitas_column{&wanted, 1}};
  std::array<gravitas_reply_column, 3> answer = {{{answer_.data(), answer_.size(), 0}, {}, {}}};
  if (jacobian != nullptr) {
    const std::size_t blocks = request_.jacobian_blocks();
    jacobian->bodies_.resize(2 * blocks), jacobian->numbers_.resize(kBlockNumbers * blocks);
    answer[1] = {jacobian->bodies_.data(), jacobian->bodies_.size(), 0};
    answer[2] = {jacobian->numbers_.data(), jacobian->numbers_.size(), 0};
  }
  host_.derivative(asked.data(), answer.data());
  if (wanted >= kFirstOfImpulses && answer[0].count == 0) return {};
  if (answer[0].count != answer_.size()) throw std::runtime_error("the derivative has the wrong size");
  require_finite(answer_, 6, "wrench");
  if (jacobian == nullptr) return answer_;
  if (answer[2].count != kBlockNumbers / 2 * answer[1].count)
    throw std::runtime_error("the Jacobian has the wrong size");
  jacobian->bodies_.resize(answer[1].count), jacobian->numbers_.resize(answer[2].count);
  for (const std::uint32_t body : jacobian->bodies_)
    if (body >= size()) throw std::runtime_error("the Jacobian names a body that does not exist");
  if (const std::size_t index = first_not_finite(jacobian->numbers_); index != kNoRow)
    throw Refusal("the Jacobian of the wrench of body " + std::to_string(jacobian->body(index / kBlockNumbers)) +
                  " is not finite: forces, or the properties of the one that acts there, overflow");
  return answer_;
}

void Derivatives::require_finite(const TrialColumns& trial) const {
  require_finite(trial.position, 3, "trial position");
  require_finite(trial.orientation, 4, "trial attitude");
  require_finite(trial.linear_velocity, 3, "trial velocity");
  require_finite(trial.angular_velocity, 3, "trial angular velocity");
}

void Derivatives::require_finite(std::span<const double> column, std::size_t components, const char* what) const {
  const std::size_t index = first_not_finite(column);
  if (index != kNoRow)
    throw Refusal("the " + std::string(what) + " of body " + std::to_string(index / components) +
                  " is not finite: its state, forces, inertia, damping or the time step overflow");
}

Acceleration Derivatives::acceleration(std::size_t body, const BodyState& state,
                                       std::span<const double> wrenches) const {
  const Vector3 force = vector_at(wrenches, 2 * body), torque = vector_at(wrenches, 2 * body + 1);
  return {request_.inverse_mass()[body] * force,
          angular_acceleration(state.pose.orientation, state.twist.angular, vector_at(request_.inertia(), body),
                               vector_at(request_.inverse_inertia(), body), torque)};
}

Vector3 Derivatives::angular_kick(std::size_t body, const Quaternion& orientation, const Vector3& torque) const {
  return angular_acceleration(orientation, Vector3::Zero(), vector_at(request_.inertia(), body),
                              vector_at(request_.inverse_inertia(), body), torque);
}

bool Derivatives::has_gyroscopic_term(std::size_t body) const {
  const Vector3 moments = vector_at(request_.inertia(), body);
  return moments.minCoeff() < moments.maxCoeff() && vector_at(request_.inverse_inertia(), body).minCoeff() > 0.0;
}

Turning Derivatives::turned(std::size_t body, const Turning& start, double time) const {
  if (has_gyroscopic_term(body))
    return gravitas::turned_freely(start, vector_at(request_.inertia(), body),
                                   vector_at(request_.inverse_inertia(), body), time);
  const Pose turned = displaced({Vector3::Zero(), start.orientation}, Vector3::Zero(), time * start.angular_velocity);
  return {turned.orientation, start.angular_velocity};
}

Vector3 Derivatives::carried(std::size_t body, const Vector3& angular_velocity, const Quaternion& from,
                             const Quaternion& to) const {
  if (!has_gyroscopic_term(body)) return angular_velocity;
  const Vector3 moments = vector_at(request_.inertia(), body);
  const Vector3 momentum = from * moments.cwiseProduct(from.conjugate() * angular_velocity);
  return to * (to.conjugate() * momentum).cwiseQuotient(moments);
}

BodyState Derivatives::start(std::size_t body) const { return detail::state_at(request_, body); }

double damped_distance(double damping, double time_step) {
  const double share = damping * time_step;
  // below, the difference loses digits, and its series ends within 2^-53
  if (share > 0.5) return (time_step - damped_time(damping, time_step)) / damping;
  double sum = 1.0;
  for (int n = 16; n > 2; --n) sum = 1.0 - share / n * sum;
  return 0.5 * time_step * time_step * sum;
}

DampedMotion damped_motion(const Twist& start, const Acceleration& acceleration, double damping, double time_step) {
  const double kept = damping_factor(damping, time_step), slowed = damped_time(damping, time_step);
  const double distance = damped_distance(damping, time_step);
  return {slowed * start.linear + distance * acceleration.linear,
          slowed * start.angular + distance * acceleration.angular,
          {kept * start.linear + slowed * acceleration.linear, kept * start.angular + slowed * acceleration.angular}};
}

namespace detail {

bool StateColumns::resize(const stage::IntegratorIntegrateReply& reply, std::size_t bodies) {
  position = reply.position().resize(3 * bodies);
  orientation = reply.orientation().resize(4 * bodies);
  linear_velocity = reply.linear_velocity().resize(3 * bodies);
  angular_velocity = reply.angular_velocity().resize(3 * bodies);
  return position.size() == 3 * bodies && orientation.size() == 4 * bodies && linear_velocity.size() == 3 * bodies &&
         angular_velocity.size() == 3 * bodies;
}

void StateColumns::require_finite() const {
  std::size_t body = kNoRow;
  const auto look = [&](std::span<const double> column, std::size_t components) {
    const std::size_t index = first_not_finite(column);
    if (index != kNoRow) body = std::min(body, index / components);
  };
  look(position, 3), look(orientation, 4), look(linear_velocity, 3), look(angular_velocity, 3);
  if (body != kNoRow)
    throw Refusal(
        "body " + std::to_string(body) +
        " comes to a state that is not finite: its state, forces, inertia, damping or the time step overflow");
}

BodyState keep_moving(const BodyState& state, double time_step) {
  BodyState moved = state;
  moved.pose = displaced(state.pose, time_step * state.twist.linear, time_step * state.twist.angular);
  return moved;
}

}  // namespace detail
}  // namespace gravitas
