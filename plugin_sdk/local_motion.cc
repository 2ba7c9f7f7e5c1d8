#include "plugin_sdk/local_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "plugin_sdk/interaction_groups.h"
#include "plugin_sdk/motion_stages.h"

namespace gravitas {
namespace {

constexpr double kLargestInnerTurn = 2.0;  // rad in an inner step: the chart ends at 2 pi
constexpr double kShareOfTurn = 0.9;
constexpr double kDifference = 1e-7;

Eigen::Index first_number(std::size_t body) { return static_cast<Eigen::Index>(body) * LocalMotion::kNumbers; }

double difference(const BodyState& start, Eigen::Index number) {
  if (number < 3) return kDifference * (1.0 + 1e-2 * start.pose.position.norm());
  if (number < 6) return kDifference;
  const Vector3& velocity = number < 9 ? start.twist.linear : start.twist.angular;
  return kDifference * std::max(1.0, velocity.norm());
}

}  // namespace

void LocalMotion::begin(const stage::IntegratorIntegrateRequest& request, Derivatives* derivatives) {
  request_ = &request, derivatives_ = derivatives;
  done_ = 0.0;
  bodies_.clear(), groups_.clear();
  const std::size_t count = derivatives->size();
  trial_.resize(count);
  std::vector<std::size_t> place(count);
  for (std::size_t i = 0; i < count; ++i) {
    trial_.set(i, derivatives->start(i));
    if ((request.flags()[i] & kMovable) == 0) continue;
    place[i] = bodies_.size();
    const double damping = request.damping()[i];
    const bool in_halves = damping * request.time_step() > 1.0;
    BodyState start = derivatives->start(i);
    const double kept = in_halves ? damping_factor(damping, 0.5 * request.time_step()) : 1.0;
    start.twist = {kept * start.twist.linear, kept * start.twist.angular};
    bodies_.push_back({i, start, start.pose.position, Vector3::Zero(), in_halves ? 0.0 : damping, kept});
  }
  if (bodies_.empty()) return;
  ask_jacobian();
  for (const std::vector<std::size_t>& rows : jacobian_.is_known()
                                                  ? interaction_groups(request, jacobian_)
                                                  : interaction_groups(request, derivatives, request.time(), trial_)) {
    Group& group = groups_.emplace_back();
    for (const std::size_t row : rows) group.body.push_back(place[row]);
    const auto size = static_cast<Eigen::Index>(rows.size()) * kNumbers;
    group.accelerations.resize(size / 2, size);
    group.spin.resize(rows.size());
  }
  const auto all = first_number(bodies_.size());
  rate_.resize(all), shifted_.resize(all), start_.resize(all);
  start_inner_step();
}

void LocalMotion::start_inner_step() {
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    start_.segment<kNumbers>(first_number(b)) << Vector3::Zero(), Vector3::Zero(), bodies_[b].start.twist.linear,
        bodies_[b].start.twist.angular;
}

void LocalMotion::write(const stage::IntegratorIntegrateReply& reply) const {
  std::size_t next = 0;
  for_each_body(*request_, reply, [&](std::size_t, const BodyState&) {
    const Body& body = bodies_[next++];
    return BodyState{body.start.pose, {body.kept * body.start.twist.linear, body.kept * body.start.twist.angular}};
  });
}

BodyState LocalMotion::state_of(const Body& body, const Numbers& y, double elapsed) const {
  const double slowed = damping_factor(body.damping, elapsed);
  return {displaced(body.start.pose, y.segment<3>(0), y.segment<3>(3)),
          {slowed * y.segment<3>(6), slowed * y.segment<3>(9)}};
}

void LocalMotion::carry_kinematic(double elapsed) {
  for (std::size_t i = 0; i < derivatives_->size(); ++i)
    if ((request_->flags()[i] & (kMovable | kKinematic)) == kKinematic)
      trial_.set(i, detail::keep_moving(derivatives_->start(i), done_ + elapsed));
}

bool LocalMotion::evaluate(double elapsed, const Eigen::VectorXd& y, Eigen::VectorXd* f) {
  if (!y.allFinite()) return false;
  carry_kinematic(elapsed);
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    trial_.set(bodies_[b].row, state_of(bodies_[b], y.segment<kNumbers>(first_number(b)), elapsed));
  const std::span<const double> wrenches = derivatives_->wrenches(request_->time() + done_ + elapsed, trial_);
  f->resize(y.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const BodyState state = trial_.at(bodies_[b].row);
    const Acceleration a = derivatives_->acceleration(bodies_[b].row, state, wrenches);
    const double grown = damping_factor(bodies_[b].damping, -elapsed);
    const Vector3 turned = y.segment<3>(first_number(b) + 3);
    f->segment<kNumbers>(first_number(b)) << state.twist.linear, rotation_vector_rate(turned, state.twist.angular),
        grown * a.linear, grown * a.angular;
  }
  return true;
}

void LocalMotion::turn_jacobian(const Eigen::VectorXd& y) {
  for (Group& group : groups_) {
    for (std::size_t m = 0; m < group.body.size(); ++m) {
      const Matrix3 turned = to_rotation_matrix(exp_rotation(y.segment<3>(first_number(group.body[m]) + 3)));
      const auto place = static_cast<Eigen::Index>(m);
      for (Eigen::Index k = 0; k < 2; ++k) {
        auto rows = group.accelerations.middleRows<3>(6 * place + 3 * k);
        rows = (turned * rows).eval();
      }
      for (Eigen::Index k = 0; k < 4; ++k) {
        auto columns = group.accelerations.middleCols<3>(kNumbers * place + 3 * k);
        columns = (columns * turned.transpose()).eval();
      }
      group.spin[m] = bodies_[group.body[m]].start.twist.angular;
    }
  }
}

void LocalMotion::differentiate(const Eigen::VectorXd& f) {
  for (Group& group : groups_)
    for (std::size_t m = 0; m < group.body.size(); ++m) group.spin[m] = bodies_[group.body[m]].start.twist.angular;
  if (jacobian_.is_known() && done_ > 0.0) ask_jacobian();
  if (jacobian_.is_known()) {
    compose();
  } else {
    take_differences(f);
  }
}

void LocalMotion::take_differences(const Eigen::VectorXd& f) {
  Eigen::Index columns = 0;
  for (const Group& group : groups_) columns = std::max(columns, group.accelerations.cols());
  for (Eigen::Index k = 0; k < columns; ++k) {
    // one number of each group at once
    shifted_ = start_;
    for (const Group& group : groups_) {
      if (k >= group.accelerations.cols()) continue;
      const std::size_t b = group.body[static_cast<std::size_t>(k / kNumbers)];
      shifted_[first_number(b) + k % kNumbers] += difference(bodies_[b].start, k % kNumbers);
    }
    if (!evaluate(0.0, shifted_, &rate_)) throw Refusal("the state is not finite");
    for (Group& group : groups_) {
      if (k >= group.accelerations.cols()) continue;
      const Eigen::Index at = first_number(group.body[static_cast<std::size_t>(k / kNumbers)]) + k % kNumbers;
      const double by = shifted_[at] - start_[at];
      for (std::size_t m = 0; m < group.body.size(); ++m) {
        const Eigen::Index first = first_number(group.body[m]) + 6;
        group.accelerations.block<6, 1>(6 * static_cast<Eigen::Index>(m), k) =
            (rate_.segment<6>(first) - f.segment<6>(first)) / by;
      }
    }
  }
}

// At the start of an inner step.
void LocalMotion::ask_jacobian() {
  carry_kinematic(0.0);
  for (const Body& body : bodies_) trial_.set(body.row, body.start);
  const std::span<const double> wrenches = derivatives_->wrenches(request_->time() + done_, trial_, &jacobian_);
  wrenches_.assign(wrenches.begin(), wrenches.end());
}

// J from the Jacobian of the wrenches.
void LocalMotion::compose() {
  member_.assign(derivatives_->size(), {});
  for (Group& group : groups_) {
    group.accelerations.setZero();
    for (std::size_t m = 0; m < group.body.size(); ++m) {
      const Body& body = bodies_[group.body[m]];
      group.accelerations.block<6, kNumbers>(6 * static_cast<Eigen::Index>(m), first_number(m)) = acceleration_jacobian(
          body.start.pose.orientation, body.start.twist.angular, vector_at(request_->inertia(), body.row),
          vector_at(request_->inverse_inertia(), body.row), vector_at(wrenches_, 2 * body.row + 1));
      member_[body.row] = {&group, m};
    }
  }
  for (std::size_t i = 0; i < jacobian_.size(); ++i) {
    const std::uint32_t row = jacobian_.body(i);
    const Member &pushed = member_[row], &by = member_[jacobian_.by(i)];
    if (pushed.group == nullptr || by.group == nullptr) continue;  // what nothing pushes
    if (pushed.group != by.group) throw Refusal("the blocks of the Jacobian are not those of the start of the step");
    pushed.group->accelerations.block<6, kNumbers>(6 * static_cast<Eigen::Index>(pushed.place),
                                                   first_number(by.place)) +=
        accelerated_block(bodies_[pushed.group->body[pushed.place]].start.pose.orientation,
                          request_->inverse_mass()[row], vector_at(request_->inverse_inertia(), row), jacobian_[i]);
  }
}

double LocalMotion::size_of(const Eigen::VectorXd& change) const {
  if (!change.allFinite()) return HUGE_VAL;
  double largest = 0.0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Numbers e = change.segment<kNumbers>(first_number(b));
    const Twist& twist = bodies_[b].start.twist;
    for (const double part :
         {e.segment<3>(0).norm(), e.segment<3>(3).norm(), e.segment<3>(6).norm() / std::max(1.0, twist.linear.norm()),
          e.segment<3>(9).norm() / std::max(1.0, twist.angular.norm())})
      largest = std::max(largest, part);
  }
  return largest;
}

double LocalMotion::rounding(double h, double rate) const {
  double largest = 0.0;
  for (const Body& body : bodies_) {
    const Twist& twist = body.start.twist;
    const double slower = std::max(1.0, std::min(twist.linear.norm(), twist.angular.norm()));
    largest = std::max(largest, (1.0 + body.start.pose.position.norm()) * rate * std::max(h, 1.0 / slower));
  }
  return std::numeric_limits<double>::epsilon() * largest;
}

double LocalMotion::longest() const {
  double fastest = 0.0;
  for (const Body& body : bodies_) fastest = std::max(fastest, body.start.twist.angular.norm());
  return kShareOfTurn * kLargestInnerTurn / fastest;
}

bool LocalMotion::is_in_chart(const Eigen::VectorXd& y) const {
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (!(y.segment<3>(first_number(b) + 3).norm() <= kLargestInnerTurn)) return false;
  return true;
}

Eigen::VectorXd LocalMotion::around_end(double h, const Eigen::VectorXd& end, const Eigen::VectorXd& y) const {
  Eigen::VectorXd around(y.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Numbers e = end.segment<kNumbers>(first_number(b)), at = y.segment<kNumbers>(first_number(b));
    const Vector3 turn =
        log_rotation(shorter_arc(exp_rotation(at.segment<3>(3)) * exp_rotation(e.segment<3>(3)).conjugate()));
    around.segment<kNumbers>(first_number(b)) << at.segment<3>(0) - e.segment<3>(0), turn,
        damping_factor(bodies_[b].damping, h) * at.segment<6>(6);
  }
  return around;
}

void LocalMotion::accept(double h, const Eigen::VectorXd& y) {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Body& body = bodies_[b];
    Numbers end = y.segment<kNumbers>(first_number(b));
    // what underflows changes no sign
    for (double& number : end)
      if (std::fabs(number) < std::numeric_limits<double>::min()) number = 0.0;
    body.start = state_of(body, end, h);
    body.moved += end.segment<3>(0);
    if (!body.moved.isZero(0.0)) body.start.pose.position = body.origin + body.moved;
  }
  done_ = h == request_->time_step() - done_ ? request_->time_step() : done_ + h;
  start_inner_step();
}

}  // namespace gravitas
