#include "services/recorder/reaction_log.h"

#include "plugin_sdk/body.h"
#include "services/recorder/json.h"

namespace gravitas {
namespace {

void put(const Vector3& vector, google::protobuf::RepeatedField<double>* numbers) {
  for (const double number : vector) numbers->Add(number);
}

}  // namespace

ReactionLog::ReactionLog(const std::string& path, const kernel::EnvironmentDescription& description, double interval)
    : description_(description), file_("reactions", path), sampling_(interval) {}

void ReactionLog::begin_again() { sums_.clear(); }

void ReactionLog::add(const kernel::Environment& environment, const kernel::InnerStep& inner) {
  if (inner.number == 0) {
    step_ = environment.step_count() + 1;
    length_ = 0.0;
    sums_.clear();
  }
  length_ += inner.data.time_step[0];
  add_reactions(inner.data, acts_in_derivatives(), false, &sums_);
  if (!inner.weights.empty()) extrapolate_reactions(attempts_, inner.weights, inner.data.flags.span(), &sums_);
}

void ReactionLog::add_attempt(const kernel::StepData& data, std::uint32_t pieces) {
  if (pieces == 1) attempts_.clear();
  attempts_.resize(pieces);
  add_reactions(data, acts_in_derivatives(), true, &attempts_.back());
}

report::v1::Reaction ReactionLog::message(const kernel::Environment& environment, const ReactionSum& sum) const {
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
  for (const auto& [key, sum] : sums_) {
    report::v1::Reaction& reaction = all.emplace_back(message(environment, sum));
    if (key.is_contact)
      reaction.set_feature(key.numbers[2]);
    else
      reaction.set_constraint(description_.constraints[key.numbers[0]].id);
    for (const std::uint32_t body : sum.bodies)
      reaction.add_bodies(body == kNone ? std::string() : description_.bodies[body].id);
  }
  return all;
}

void ReactionLog::offer(const kernel::Environment& environment, bool is_last) {
  if (!file_.is_open() || !sampling_.is_due(environment, is_last)) return;
  for (const report::v1::Reaction& reaction : last(environment)) file_.write(to_json(reaction, JsonForm::kLine));
}

}  // namespace gravitas
