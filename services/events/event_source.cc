#include "services/events/event_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "plugin_sdk/activity.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/joint_load.h"
#include "plugin_sdk/merged_rows.h"
#include "plugin_sdk/slots.h"
#include "services/run/kernel_names.h"

namespace gravitas {
namespace {

// A commit counts as at k / rate within this share of a time step.
constexpr double kRateTolerance = 1e-9;

bool has_pair(std::span<const std::uint32_t> pairs, std::uint32_t a, std::uint32_t b) {
  std::size_t first = 0, last = pairs.size() / 2;
  while (first < last) {
    const std::size_t middle = (first + last) / 2;
    if (std::pair{pairs[2 * middle], pairs[2 * middle + 1]} < std::pair{a, b})
      first = middle + 1;
    else
      last = middle;
  }
  return 2 * first < pairs.size() && pairs[2 * first] == a && pairs[2 * first + 1] == b;
}

std::pair<std::uint32_t, std::uint32_t> bodies_of(const kernel::StepData& data, std::size_t contact) {
  return {data.contact_body[2 * contact], data.contact_body[2 * contact + 1]};
}

Pose pose_of(const kernel::State& state, std::uint32_t body) {
  return {vector_at(state.position.span(), body), quaternion_at(state.orientation.span(), body)};
}

JointBody joint_body(const kernel::InnerStep& inner, std::uint32_t body) {
  const kernel::StepData& data = inner.data;
  JointBody one;
  if (body == kNone) return one;
  one.start = pose_of(inner.before, body), one.next = pose_of(inner.after, body);
  one.trial = {vector_at(data.trial_position.span(), body), quaternion_at(data.trial_orientation.span(), body)};
  one.inverse_mass = data.inverse_mass[body];
  one.inverse_moments = vector_at(data.inverse_inertia.span(), body);
  return one;
}

// The side on which an axis of a limit that gives way was passed in the step: 1 the lower, -1 the upper, 0 none.
double passed_side(const Discrepancy& limit, int axis, const JointBody& body1, const JointBody& body2) {
  const auto error = [&](const Pose& one, const Pose& two) {
    const Vector3 all = error_in_axes_at(limit, body1.trial, body2.trial, one, two);
    return limit.is_radial() && axis == 0 ? all.norm() : (limit.axes * Vector3::Unit(axis)).dot(all);
  };
  const double before = error(body1.start, body2.start), after = error(body1.next, body2.next);
  const bool has_two = axis_mode(limit.modes, axis) == AxisMode::kLimited;
  const double lower = has_two ? limit.lower[axis] : 0.0, upper = has_two ? limit.upper[axis] : kUnlimited;
  return before >= lower && after < lower ? 1.0 : before <= upper && after > upper ? -1.0 : 0.0;
}

}  // namespace

Event swap_event(const kernel::Environment& environment, const kernel::SwapRecord& swap) {
  Event event{EventKind::kSwap, environment.step_count(), environment.time()};
  event.slot = slot_name(swap.slot);
  event.plugin = swap.to;
  event.what = swap_state_name(swap.state);
  event.text = swap.reason;
  return event;
}

// visit(record) for every swap that has got further.
template <typename Visit>
void EventSource::visit_swaps(const kernel::Environment& environment, Visit&& visit) {
  using enum kernel::SwapState;
  std::map<std::pair<Slot, std::uint32_t>, std::uint32_t> ranks;
  for (const kernel::SwapRecord& record : environment.swaps()) {
    const std::uint32_t rank = ranks[{record.slot, record.step}]++;
    if (record.only_compared || record.state == kPreparing || record.state == kShadow) continue;
    const auto [told, is_new] = swaps_.try_emplace({record.slot, record.step, rank}, record.state);
    if (is_new || std::exchange(told->second, record.state) != record.state) visit(record);
  }
}

void EventSource::begin_again(const kernel::Environment& environment) {
  events_.clear();
  ongoing_.clear();
  faults_ = 0;
  swaps_.clear();
  leave_out_swaps(environment);
}

void EventSource::leave_out_past(const kernel::Environment& environment) {
  faults_ = environment.faults().size();
  leave_out_swaps(environment);
}

void EventSource::leave_out_swaps(const kernel::Environment& environment) {
  visit_swaps(environment, [](const kernel::SwapRecord&) {});
}

void EventSource::on_inner_step(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  if (inner.number == 0) {
    events_.clear();
    const bool looks_for_activity = kinds_.has(EventKind::kWake) || kinds_.has(EventKind::kSleep);
    slept_.assign(looks_for_activity ? inner.before.rested.size() : 0, false);
    for (std::size_t i = 0; i < slept_.size(); ++i) slept_[i] = inner.before.rested[i] == kAsleep;
  }
  ongoing_.clear();
  if (kinds_.has(EventKind::kCollisionStart) || kinds_.has(EventKind::kCollisionEnd)) find_changes(environment, inner);
  if (kinds_.has(EventKind::kCollisionOngoing)) find_ongoing(environment, inner);
  if (kinds_.has(EventKind::kLimitStart)) find_limits(environment, inner);
  if (kinds_.has(EventKind::kBreak)) find_breaks(environment, inner);
}

void EventSource::on_commit(const kernel::Environment& environment) {
  for (const Event& event : events_) listener_.on_event(event);
  events_.clear();
  find_activity(environment);
  for (const Event& event : ongoing_) listener_.on_event(event);
  ongoing_.clear();
  tell_incidents(environment);
}

void EventSource::tell_incidents(const kernel::Environment& environment) {
  if (kinds_.has(EventKind::kFault)) find_faults(environment);
  if (kinds_.has(EventKind::kSwap)) find_swaps(environment);
}

Event EventSource::collision(EventKind kind, const kernel::Environment& environment, const kernel::InnerStep& inner,
                             std::size_t* contact) const {
  const auto [a, b] = bodies_of(inner.data, *contact);
  Event event{kind, environment.step_count() + 1, inner.end, a, b};
  double fastest = -1.0;
  for (; *contact < inner.data.contact_key.size() && bodies_of(inner.data, *contact) == std::pair{a, b}; ++*contact) {
    const Vector3 normal = vector_at(inner.data.contact_normal.span(), *contact);
    const Vector3 velocity = vector_at(inner.data.contact_relative_velocity.span(), *contact);
    event.impulse += normal.dot(vector_at(inner.data.contact_impulse.span(), *contact));
    const double approach = std::max(0.0, -normal.dot(velocity));
    if (approach <= fastest) continue;
    fastest = event.relative_speed = approach;
    event.relative_velocity = velocity;
  }
  return event;
}

void EventSource::find_changes(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  std::size_t contact = 0;
  visit_changes(inner.before.touching.span(), inner.after.touching.span(),
                [&](bool starts, std::uint32_t a, std::uint32_t b) {
                  const EventKind kind = starts ? EventKind::kCollisionStart : EventKind::kCollisionEnd;
                  if (!kinds_.has(kind)) return;
                  const std::size_t count = inner.data.contact_key.size();
                  while (starts && contact < count && bodies_of(inner.data, contact) < std::pair{a, b}) ++contact;
                  if (starts && contact < count && bodies_of(inner.data, contact) == std::pair{a, b})
                    events_.push_back(collision(kind, environment, inner, &contact));
                  else
                    events_.push_back({kind, environment.step_count() + 1, inner.end, a, b});
                });
}

// Of the state that the step ends in: what touches there and touched before. Those who sleep are not looked at.
void EventSource::find_ongoing(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  const double tolerance = kRateTolerance * environment.time_step();
  const auto samples = [&](double time) { return std::floor((time + tolerance) * ongoing_rate_); };
  if (samples(inner.end) == samples(environment.time())) return;
  for (std::size_t contact = 0; contact < inner.data.contact_key.size();) {
    const auto [a, b] = bodies_of(inner.data, contact);
    Event event = collision(EventKind::kCollisionOngoing, environment, inner, &contact);
    if (has_pair(inner.before.touching.span(), a, b) && has_pair(inner.after.touching.span(), a, b))
      ongoing_.push_back(std::move(event));
  }
}

// A limit is met by a side that pushes now and did not in the step before, if it closed where the step began, by more than
// rounding, and its impulse changes that rate. So what rests on a limit, or is pressed on it, does not meet it. The rate is along
// the row where the step ends: what swings on a taut rope seems to close, with next to no impulse. One that gives way pushes with
// next to nothing at first: it is met where it is passed.
void EventSource::find_limits(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  constexpr double kRounding = 1e-9, kNothing = 1e-12;  // of the speeds; m or rad in the step
  constexpr double kOfStop = 1e-3;                      // of the rate
  const kernel::StepData& data = inner.data;
  const DiscrepancyColumns columns = data.discrepancies.columns();
  for (std::size_t row = 0; row < columns.size(); ++row) {
    const Discrepancy limit = columns.at(row);
    for (int axis = 0; axis < 3; ++axis) {
      const AxisMode mode = axis_mode(limit.modes, axis);
      if (mode != AxisMode::kUnilateral && !(mode == AxisMode::kLimited && limit.lower[axis] < limit.upper[axis]))
        continue;
      const std::size_t at = 3 * row + static_cast<std::size_t>(axis);
      const double impulse = data.discrepancy_impulse[at], before = data.discrepancy_warm_impulse[at];
      const bool is_soft = limit.compliance[axis] > 0.0;
      if (!is_soft && (impulse == 0.0 || impulse * before > 0.0)) continue;
      const std::uint32_t a = data.discrepancy_body[2 * row], b = data.discrepancy_body[2 * row + 1];
      const auto of = [](std::uint32_t body, std::span<const double> column) {
        return body == kNone ? Vector3(Vector3::Zero()) : Vector3(vector_at(column, body));
      };
      const Vector3 along = limit.axes * Vector3::Unit(axis);
      const JacobianRow jacobian =
          jacobian_row(limit, along, of(a, data.trial_position.span()), of(b, data.trial_position.span()));
      const double ways[] = {jacobian.linear1.dot(of(a, inner.before.linear_velocity.span())),
                             jacobian.angular1.dot(of(a, inner.before.angular_velocity.span())),
                             jacobian.linear2.dot(of(b, inner.before.linear_velocity.span())),
                             jacobian.angular2.dot(of(b, inner.before.angular_velocity.span()))};
      double rate = 0.0, largest = 0.0;
      for (const double way : ways) rate += way, largest = std::max(largest, std::fabs(way));
      const JointBody one = joint_body(inner, a), two = joint_body(inner, b);
      const double side = is_soft ? passed_side(limit, axis, one, two) : impulse;
      if (side == 0.0) continue;
      const double closing = side > 0.0 ? -rate : rate;
      if (!(closing > kRounding * largest && closing * environment.time_step() > kNothing)) continue;
      if (!is_soft && !(held_back(limit, impulse * along, one, two, 1.0) > kOfStop * closing)) continue;
      const std::uint32_t joint = data.discrepancies.constraint[row];
      events_.push_back(
          {EventKind::kLimitStart, environment.step_count() + 1, inner.end, a, b, joint, closing, std::fabs(impulse)});
    }
  }
}

void EventSource::find_breaks(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  for (std::uint32_t joint = 0; joint < inner.after.intact.size(); ++joint) {
    if (inner.before.intact[joint] == inner.after.intact[joint]) continue;
    const kernel::ConstraintDescription& broken = environment.model().constraints[joint];
    events_.push_back({EventKind::kBreak, environment.step_count() + 1, inner.end, broken.body1, broken.body2, joint});
  }
}

void EventSource::find_activity(const kernel::Environment& environment) {
  for (const auto& [kind, sleeps] : {std::pair{EventKind::kWake, false}, {EventKind::kSleep, true}})
    for (std::uint32_t i = 0; i < slept_.size() && kinds_.has(kind); ++i)
      if (slept_[i] != sleeps && environment.is_asleep(i) == sleeps)
        listener_.on_event({kind, environment.step_count(), environment.time(), i});
  slept_.clear();
}

void EventSource::find_faults(const kernel::Environment& environment) {
  for (; faults_ < environment.faults().size(); ++faults_) {
    const kernel::FaultRecord& record = environment.faults()[faults_];
    Event event{EventKind::kFault, record.step, environment.time()};
    event.slot = slot_name(record.fault.slot);
    event.plugin = record.fault.plugin;
    event.what = fault_kind_name(record.fault.kind);
    event.text = record.fault.text() + (record.recovered_by.empty() ? "" : "; answered by: " + record.recovered_by);
    listener_.on_event(event);
  }
}

void EventSource::find_swaps(const kernel::Environment& environment) {
  visit_swaps(environment,
              [&](const kernel::SwapRecord& record) { listener_.on_event(swap_event(environment, record)); });
}

}  // namespace gravitas
