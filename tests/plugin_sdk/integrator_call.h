// The columns of an Integrator.Integrate call and a host that answers its derivatives, for tests without a plugin library.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/integrator.h"

namespace gravitas::test {

// A request of bodies in random states and room for its reply.
class Step {
 public:
  using Request = stage::IntegratorIntegrateRequest;
  using Reply = stage::IntegratorIntegrateReply;

  explicit Step(std::vector<std::uint32_t> body_flags, std::uint64_t seed = 1) : flags(std::move(body_flags)) {
    conformance::Draw random(seed);
    const std::size_t n = flags.size();
    state.resize(n);
    for (std::size_t i = 0; i < n; ++i) state.set(i, {random.pose(3.0), {random.vector(2.0), random.vector(2.0)}});
    for (std::size_t i = 0; i < n; ++i) {
      const bool movable = (flags[i] & kMovable) != 0;
      inverse_mass.push_back(movable ? 0.5 : 0.0);
      for (const double moment : {1.0, 2.0, 4.0}) {
        inertia.push_back(moment);
        inverse_inertia.push_back(movable ? 1.0 / moment : 0.0);
      }
    }
    damping.assign(n, 0.0);
    wrench.assign(6 * n, 0.0);
    changed.assign(n, 0);
    trial.resize(n);

    using C = Request::Column;
    request_[C::kTime] = request_column_of(time);
    request_[C::kTimeStep] = request_column_of(time_step);
    request_[C::kWrenchIsConstant] = request_column_of(constant);
    request_[C::kFlags] = request_column_of(flags);
    request_[C::kInverseMass] = request_column_of(inverse_mass);
    request_[C::kInertia] = request_column_of(inertia);
    request_[C::kInverseInertia] = request_column_of(inverse_inertia);
    request_[C::kDamping] = request_column_of(damping);
    request_[C::kWrench] = request_column_of(wrench);
    request_[C::kPosition] = request_column_of(state.position);
    request_[C::kOrientation] = request_column_of(state.orientation);
    request_[C::kLinearVelocity] = request_column_of(state.linear_velocity);
    request_[C::kAngularVelocity] = request_column_of(state.angular_velocity);
    request_[C::kStateChanged] = request_column_of(changed);
    request_[C::kJacobianBlocks] = request_column_of(jacobian_blocks);
    const auto room = [](std::vector<double>& numbers) {
      return gravitas_reply_column{numbers.data(), numbers.size(), 0};
    };
    reply_[Reply::kPosition] = room(trial.position);
    reply_[Reply::kOrientation] = room(trial.orientation);
    reply_[Reply::kLinearVelocity] = room(trial.linear_velocity);
    reply_[Reply::kAngularVelocity] = room(trial.angular_velocity);
    reply_[Reply::kErrorEstimate] = room(error_estimate);
  }

  Request request() const { return Request(request_.data()); }
  Reply reply() { return Reply(reply_.data()); }
  std::uint64_t count(Reply::Column column) const { return reply_[column].count; }

  std::vector<double> time = {2.0}, time_step = {0.1};
  std::vector<std::uint32_t> constant = {1}, flags, changed, jacobian_blocks = {0};
  std::vector<double> inverse_mass, inertia, inverse_inertia, damping, wrench;
  TrialColumns state, trial;
  std::vector<double> error_estimate = {7.0};

 private:
  template <typename T>
  static gravitas_column request_column_of(const std::vector<T>& numbers) {
    return {numbers.data(), numbers.size()};
  }

  std::array<gravitas_column, Request::kColumnCount> request_{};
  std::array<gravitas_reply_column, Reply::kColumnCount> reply_{};
};

// A host that answers derivatives by a function of the test and counts the questions.
class Source {
 public:
  using Answer = std::function<std::int32_t(const gravitas_column*, gravitas_reply_column*)>;
  explicit Source(Answer answer) : answer_(std::move(answer)) {
    plain_.context = this;
    plain_.derivative = [](void* context, const gravitas_column* request, gravitas_reply_column* reply) {
      auto* self = static_cast<Source*>(context);
      ++self->asked;
      return self->answer_(request, reply);
    };
  }
  Host& host() { return host_; }
  int asked = 0;

 private:
  Answer answer_;
  gravitas_host plain_{};
  Host host_{&plain_};
};

}  // namespace gravitas::test
