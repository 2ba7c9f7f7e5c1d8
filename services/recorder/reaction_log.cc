#include "services/recorder/reaction_log.h"

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "services/recorder/json.h"

namespace gravitas {
namespace {

// A point of a body at S*, where the step ends.
Vector3 at_end(const kernel::StepData& data, std::uint32_t body, const Vector3& point) {
  if (body == kNone) return point;
  const Pose trial{vector_at(data.trial_position.span(), body), quaternion_at(data.trial_orientation.span(), body)};
  return carried(
      point, trial,
      displaced(trial, vector_at(data.pose_change.span(), 2 * body), vector_at(data.pose_change.span(), 2 * body + 1)));
}

// What a drive does of an impulse along a row's axes. A damper alone is one of the joint's springs.
std::optional<Vector3> drive_of(const Discrepancy& row, const Vector3& along) {
  std::optional<Vector3> drive;
  for (int k = 0; k < 3; ++k)
    if (axis_mode(row.modes, k) == AxisMode::kDriven && row.damping[k] == 0.0)
      drive = drive.value_or(Vector3::Zero()) + row.axes * Vector3(along[k] * Vector3::Unit(k));
  return drive;
}

void put(const Vector3& vector, google::protobuf::RepeatedField<double>* numbers) {
  for (const double number : vector) numbers->Add(number);
}

}  // namespace

ReactionLog::ReactionLog(const std::string& path, const kernel::EnvironmentDescription& description, double interval)
    : description_(description), file_("reactions", path), sampling_(interval) {}

void ReactionLog::begin_again() {
  joints_.clear();
  contacts_.clear();
}

void ReactionLog::add(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  const kernel::StepData& data = inner.data;
  if (inner.number == 0) {
    step_ = environment.step_count() + 1;
    length_ = 0.0;
    joints_.clear();
    contacts_.clear();
  }
  length_ += data.time_step[0];
  add_joints(data);
  for (std::size_t i = 0; i < data.contact_key.size(); ++i) {
    const Vector3 impulse = vector_at(data.contact_impulse.span(), i);
    if (impulse.isZero(0.0)) continue;
    Sum& sum = contacts_[{data.contact_body[2 * i], data.contact_body[2 * i + 1], data.contact_feature[i]}];
    sum.point = vector_at(data.contact_point.span(), i);
    sum.impulse += impulse;
    sum.turn += vector_at(data.contact_turning.span(), i);
  }
}

void ReactionLog::add_joints(const kernel::StepData& data) {
  const DiscrepancyColumns rows = data.discrepancies.columns();
  const bool acts_in_derivatives = description_.simulator == kernel::Simulator::kSmooth;
  std::uint32_t known = kNone;
  bool has_point = false;  // of a row that pushes
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Discrepancy row = rows.at(i);
    const std::uint32_t joint = data.discrepancies.constraint[i];
    Sum& sum = joints_[joint];
    const std::uint32_t body1 = data.discrepancy_body[2 * i], body2 = data.discrepancy_body[2 * i + 1];
    const std::uint32_t turned = body2 == kNone ? body1 : body2;
    const Vector3 point = row.is_angular() ? at_end(data, turned, vector_at(data.trial_position.span(), turned))
                                           : at_end(data, body1, row.point1);
    if (joint != known) has_point = false;
    if (joint != known || (!has_point && !row.is_angular())) sum.point = point;
    has_point = has_point || !row.is_angular();
    known = joint;
    Vector3 along = vector_at(data.discrepancy_impulse.span(), i);
    if (acts_in_derivatives) along += data.time_step[0] * vector_at(data.held_force.span(), i);
    const Vector3 impulse = row.axes * along;
    if (const std::optional<Vector3> drive = drive_of(row, along)) {
      std::optional<Vector3>& all = row.is_angular() ? sum.drive_turn : sum.drive_impulse;
      all = all.value_or(Vector3::Zero()) + *drive;
    }
    if (row.is_angular()) {
      sum.turn += impulse;
    } else {
      sum.impulse += impulse;
      sum.turn += (point - sum.point).cross(impulse);
    }
  }
}

report::v1::Reaction ReactionLog::message(const kernel::Environment& environment, const Sum& sum) const {
  report::v1::Reaction reaction;
  reaction.set_time(environment.time());
  reaction.set_step(step_);
  put(sum.point, reaction.mutable_point());
  put(sum.impulse / length_, reaction.mutable_force());
  put(sum.turn / length_, reaction.mutable_torque());
  if (sum.drive_impulse) put(*sum.drive_impulse / length_, reaction.mutable_drive_force());
  if (sum.drive_turn) put(*sum.drive_turn / length_, reaction.mutable_drive_torque());
  return reaction;
}

std::vector<report::v1::Reaction> ReactionLog::last(const kernel::Environment& environment) const {
  std::vector<report::v1::Reaction> all;
  // nobody was awake, or no step has been made
  if (step_ != environment.step_count()) return all;
  const auto add_body = [&](std::uint32_t body, report::v1::Reaction* reaction) {
    reaction->add_bodies(body == kNone ? std::string() : description_.bodies[body].id);
  };
  for (const auto& [joint, sum] : joints_) {
    report::v1::Reaction& reaction = all.emplace_back(message(environment, sum));
    reaction.set_constraint(description_.constraints[joint].id);
    add_body(description_.constraints[joint].body1, &reaction);
    add_body(description_.constraints[joint].body2, &reaction);
  }
  for (const auto& [contact, sum] : contacts_) {
    report::v1::Reaction& reaction = all.emplace_back(message(environment, sum));
    reaction.set_feature(contact[2]);
    add_body(contact[0], &reaction);
    add_body(contact[1], &reaction);
  }
  return all;
}

void ReactionLog::offer(const kernel::Environment& environment, bool is_last) {
  if (!file_.is_open() || !sampling_.is_due(environment, is_last)) return;
  for (const report::v1::Reaction& reaction : last(environment)) file_.write(to_json(reaction, JsonForm::kLine));
}

}  // namespace gravitas
