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
    const BodyState start = derivatives->start(i);
    bodies_.push_back({i, start, start.pose.position, Vector3::Zero(), request.damping()[i]});
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
  start_.setZero();
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    if (bodies_[b].damping == 0.0)
      start_.segment<6>(first_number(b) + 6) << bodies_[b].start.twist.linear, bodies_[b].start.twist.angular;
  find_known();
}

void LocalMotion::find_known() {
  if (std::ranges::all_of(bodies_, [](const Body& body) { return body.damping == 0.0; })) return;
  carry_kinematic(0.0);
  for (const Body& body : bodies_) trial_.set(body.row, body.start);
  const std::span<const double> wrenches = derivatives_->wrenches(request_->time() + done_, trial_);
  const auto kept_up = [](const Vector3& acceleration, double damping, const Vector3& velocity) {
    const Vector3 kept = acceleration / damping;
    const double length = kept.norm(), most = velocity.norm();
    if (!std::isfinite(length)) return Vector3(Vector3::Zero());
    return length <= most ? kept : Vector3(most / length * kept);
  };
  for (Body& body : bodies_) {
    if (body.damping == 0.0) continue;
    const Acceleration a = derivatives_->acceleration(body.row, body.start, wrenches);
    const Twist& start = body.start.twist;
    body.known.lasting = {kept_up(a.linear, body.damping, start.linear),
                          kept_up(a.angular, body.damping, start.angular)};
    body.known.fading = {start.linear - body.known.lasting.linear, start.angular - body.known.lasting.angular};
  }
}

DampedMotion LocalMotion::passed(const Known& known, double damping, double elapsed) {
  if (damping == 0.0) return {};
  const double kept = damping_factor(damping, elapsed), slowed = damped_time(damping, elapsed);
  return {elapsed * known.lasting.linear + slowed * known.fading.linear,
          elapsed * known.lasting.angular + slowed * known.fading.angular,
          {known.lasting.linear + kept * known.fading.linear, known.lasting.angular + kept * known.fading.angular}};
}

void LocalMotion::write(const stage::IntegratorIntegrateReply& reply) const {
  std::size_t next = 0;
  for_each_body(*request_, reply, [&](std::size_t, const BodyState&) { return bodies_[next++].start; });
}

BodyState LocalMotion::state_of(const Body& body, const Numbers& y, double elapsed) {
  if (body.damping == 0.0)
    return {displaced(body.start.pose, y.segment<3>(0), y.segment<3>(3)), {y.segment<3>(6), y.segment<3>(9)}};
  const DampedMotion known = passed(body.known, body.damping, elapsed);
  return {displaced(body.start.pose, known.moved + y.segment<3>(0), known.turned + y.segment<3>(3)),
          {known.twist.linear + y.segment<3>(6), known.twist.angular + y.segment<3>(9)}};
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
    const Numbers at = y.segment<kNumbers>(first_number(b));
    const double damping = bodies_[b].damping;
    auto rate = f->segment<kNumbers>(first_number(b));
    if (damping == 0.0) {
      rate << state.twist.linear, rotation_vector_rate(at.segment<3>(3), state.twist.angular), a.linear, a.angular;
      continue;
    }
    const DampedMotion known = passed(bodies_[b].known, damping, elapsed);
    const Twist& lasting = bodies_[b].known.lasting;
    rate << at.segment<3>(6),
        rotation_vector_rate(known.turned + at.segment<3>(3), state.twist.angular) - known.twist.angular,
        a.linear - damping * lasting.linear - damping * at.segment<3>(6),
        a.angular - damping * lasting.angular - damping * at.segment<3>(9);
  }
  return true;
}

void LocalMotion::turn_jacobian() {
  for (Group& group : groups_) {
    for (std::size_t m = 0; m < group.body.size(); ++m) {
      const Matrix3 turned = to_rotation_matrix(exp_rotation(bodies_[group.body[m]].last_turned));
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
      group.accelerations.block<6, 6>(6 * static_cast<Eigen::Index>(m), first_number(m) + 6).diagonal().array() -=
          body.damping;
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

bool LocalMotion::is_in_chart(double elapsed, const Eigen::VectorXd& y) const {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Vector3 known = passed(bodies_[b].known, bodies_[b].damping, elapsed).turned;
    if (!((known + y.segment<3>(first_number(b) + 3)).norm() <= kLargestInnerTurn)) return false;
  }
  return true;
}

Eigen::VectorXd LocalMotion::around_end(double later, const Eigen::VectorXd& y) const {
  Eigen::VectorXd around(y.size());
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = bodies_[b];
    const Numbers at = y.segment<kNumbers>(first_number(b));
    const DampedMotion before = passed(body.last_known, body.damping, body.last_step + later);
    const DampedMotion now = passed(body.known, body.damping, later);
    const Vector3 turn = log_rotation(
        shorter_arc(exp_rotation(before.turned + at.segment<3>(3)) * exp_rotation(body.last_turned).conjugate()));
    around.segment<kNumbers>(first_number(b)) << before.moved + at.segment<3>(0) - body.last_moved - now.moved,
        turn - now.turned, before.twist.linear + at.segment<3>(6) - now.twist.linear,
        before.twist.angular + at.segment<3>(9) - now.twist.angular;
  }
  return around;
}

void LocalMotion::accept(double h, const Eigen::VectorXd& y) {
  // what underflows changes no sign
  const auto flush = [](auto&& numbers) {
    for (double& number : numbers)
      if (std::fabs(number) < std::numeric_limits<double>::min()) number = 0.0;
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    Body& body = bodies_[b];
    Numbers end = y.segment<kNumbers>(first_number(b));
    flush(end);
    const DampedMotion known = passed(body.known, body.damping, h);
    body.last_step = h, body.last_known = body.known;
    body.last_moved = known.moved + end.segment<3>(0), body.last_turned = known.turned + end.segment<3>(3);
    body.start = state_of(body, end, h);
    flush(body.start.twist.linear), flush(body.start.twist.angular);
    body.moved += body.last_moved;
    if (!body.moved.isZero(0.0)) body.start.pose.position = body.origin + body.moved;
  }
  done_ = h == request_->time_step() - done_ ? request_->time_step() : done_ + h;
  if (done_ < request_->time_step()) start_inner_step();
}

}  // namespace gravitas
