#include "services/survey/surveyor.h"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <string_view>
#include <utility>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/local_bound.h"
#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/slots.h"

namespace gravitas::survey {
namespace {

// Fills the columns of a request that it has.
class Filler {
 public:
  Filler(stage::Method method, MessageColumns* request) : info_(stage::method_info(method)), request_(*request) {}

  void put(std::string_view name, std::span<const double> numbers) {
    if (has(name)) request_.f64(name).assign(numbers.begin(), numbers.end());
  }
  void put(std::string_view name, std::span<const std::uint32_t> numbers) {
    if (has(name)) request_.u32(name).assign(numbers.begin(), numbers.end());
  }
  void put(std::string_view name, std::span<const std::uint64_t> numbers) {
    if (has(name)) request_.u64(name).assign(numbers.begin(), numbers.end());
  }
  bool has(std::string_view name) const {
    return std::ranges::any_of(info_.request, [&](const stage::ColumnInfo& column) { return column.name == name; });
  }

 private:
  const stage::MethodInfo& info_;
  MessageColumns& request_;
};

template <typename T>
std::span<const T> view(const kernel::Column<T>& column) {
  return column.span();
}

}  // namespace

Pose pose_of(const kernel::Environment& environment, std::uint32_t body) {
  const kernel::StateView state = environment.state();
  return {vector_at(state.position, body), quaternion_at(state.orientation, body)};
}

Pose placed(const kernel::Environment& environment, std::uint32_t body) {
  const kernel::Model& model = environment.model();
  return compose(pose_of(environment, body), {vector_at(model.geometry_position.span(), body),
                                              quaternion_at(model.geometry_orientation.span(), body)});
}

Bounds bounds_of(const kernel::Environment& environment, std::uint32_t body, double margin) {
  return widened(gravitas::bounds_of(environment.model().bound[body], pose_of(environment, body)), margin);
}

Surveyor::Surveyor(const kernel::EnvironmentDescription& description, const kernel::HostStarter& starter)
    : description_(description) {
  for (const Slot which : kSlots)
    slots_[static_cast<std::size_t>(which) - 1] =
        std::make_unique<AskedSlot>(which, description.slot(which), description.threads, starter);
}

AskedSlot& Surveyor::slot(Slot which) { return *slots_[static_cast<std::size_t>(which) - 1]; }

Slot Surveyor::slot_of(stage::Method method) {
  std::string service = stage::method_info(method).name;
  service = service.substr(0, service.find('.'));
  service[0] = static_cast<char>(service[0] - 'A' + 'a');
  return *find_slot(service);
}

void Surveyor::follow(const kernel::Decision& decision) {
  slot(decision.slot).replace(decision.target, *decision.plugin, *decision.host);
}

void Surveyor::require(Slot which, const char* capability, const char* what) {
  const AskedSlot& asked = slot(which);
  if (asked.is_empty()) throw NoAnswer(fmt::format("{}: the scene has no plugin in slot {}", what, slot_name(which)));
  if (asked.has_capability(capability)) return;
  throw NoAnswer(
      fmt::format("{}: plugin {} of slot {} has not the capability '{}'; `gravitas plugins` and `gravitas describe` "
                  "show which have",
                  what, asked.description().plugins[0].declaration.name, slot_name(which), capability));
}

MessageColumns Surveyor::request(stage::Method method, const kernel::Environment& environment, double margin) const {
  const kernel::Model& model = environment.model();
  const kernel::StateView state = environment.state();
  MessageColumns request(stage::method_info(method).request);
  Filler filler(method, &request);
  filler.put("time", std::array{environment.time()});
  filler.put("start_time", std::array{environment.time()});
  filler.put("time_step", std::array{environment.time_step()});
  filler.put("flags", view(model.flags));
  filler.put("filter_group", view(model.filter_group));
  filler.put("filter_mask", view(model.filter_mask));
  filler.put("mass", view(model.mass));
  filler.put("inverse_mass", view(model.inverse_mass));
  filler.put("inverse_inertia", view(model.inverse_inertia));
  filler.put("shape_hash", view(model.shape_hash));
  filler.put("shape_type", view(model.shape_type));
  filler.put("shape_parameter_begin", view(model.shape_parameter_begin));
  filler.put("shape_parameter", view(model.shape_parameter));
  filler.put("body_shape", view(model.body_shape));
  filler.put("geometry_position", view(model.geometry_position));
  filler.put("geometry_orientation", view(model.geometry_orientation));
  filler.put("position", state.position);
  filler.put("orientation", state.orientation);
  filler.put("linear_velocity", state.linear_velocity);
  filler.put("angular_velocity", state.angular_velocity);
  filler.put("start_angular_velocity", state.angular_velocity);
  if (!filler.has("lower")) return request;
  std::vector<double>&lower = request.f64("lower"), &upper = request.f64("upper");
  lower.resize(3 * std::size_t{model.body_count});
  upper.resize(lower.size());
  for (std::uint32_t i = 0; i < model.body_count; ++i) {
    const Bounds bounds = bounds_of(environment, i, margin);
    set_vector(lower, i, bounds.lower);
    set_vector(upper, i, bounds.upper);
  }
  return request;
}

AskedSlot::Check contact_check(const MessageColumns& request) {
  return [pairs = request.u32("pair").size() / 2](const MessageColumns& reply) {
    return check_contact_rows(reply.u32("contact_pair"), reply.u32("feature"), reply.f64("normal"), pairs);
  };
}

std::vector<Contact> Surveyor::contacts(const kernel::Environment& environment) {
  const kernel::Model& model = environment.model();
  std::vector<TouchRights> rights;
  for (std::uint32_t i = 0; i < model.body_count; ++i)
    rights.push_back({model.flags[i], model.filter_group[i], model.filter_mask[i]});
  if (!can_any_touch(std::move(rights))) return {};

  const double margin = contact_margin(model.bound);
  const MessageColumns pairs =
      ask(stage::Method::kSpacePairs, request(stage::Method::kSpacePairs, environment, 0.5 * margin),
          [&](const MessageColumns& reply) { return check_pairs(reply.u32("pair"), model.flags.span()); });
  MessageColumns asked = request(stage::Method::kCollisionManifolds, environment);
  asked.f64("margin") = {margin};
  std::vector<std::uint32_t>& wanted = asked.u32("pair") = pairs.u32("pair");
  if (environment.pair_arbiter() != nullptr) wanted.resize(environment.pair_arbiter()->leave_out_forbidden(wanted));
  if (wanted.empty()) return {};
  const MessageColumns reply = ask(stage::Method::kCollisionManifolds, asked, contact_check(asked));
  std::vector<Contact> contacts;
  for (std::size_t i = 0; i < reply.u32("contact_pair").size(); ++i) {
    const std::size_t pair = reply.u32("contact_pair")[i];
    contacts.push_back({asked.u32("pair")[2 * pair], asked.u32("pair")[2 * pair + 1], reply.u32("feature")[i],
                        vector_at(reply.f64("normal"), i), vector_at(reply.f64("point"), i), reply.f64("depth")[i]});
  }
  return contacts;
}

MessageColumns Surveyor::request(stage::Method method, const kernel::Environment& environment,
                                 const kernel::ConstraintGroup& group) const {
  MessageColumns asked = request(method, environment);
  Filler filler(method, &asked);
  filler.put("constraint_type", view(group.type));
  filler.put("constraint_body", view(group.body));
  filler.put("bound_begin", view(group.bound_begin));
  filler.put("bound", view(group.bound));
  for (const std::uint32_t joint : group.row) asked.u32("intact").push_back(environment.is_intact(joint) ? 1 : 0);
  return asked;
}

std::vector<Anchor> Surveyor::anchors(const kernel::Environment& environment) {
  std::vector<Anchor> anchors;
  constexpr stage::Method kAsked = stage::Method::kConstraintDiscrepancies;
  for (const kernel::ConstraintGroup& group : environment.model().constraint_groups) {
    const MessageColumns asked = request(kAsked, environment, group);
    const std::vector<std::uint32_t>& intact = asked.u32("intact");
    const MessageColumns reply =
        slot(Slot::kConstraint).ask(kAsked, group.target, asked, [&](const MessageColumns& answer) {
          return check_discrepancy_rows(answer.u32("constraint"), intact, discrepancy_columns(answer));
        });
    const DiscrepancyColumns rows = discrepancy_columns(reply);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if ((rows.mode[i] & kAngularDiscrepancy) != 0) continue;
      const Vector3 point1 = vector_at(rows.point1, i), point2 = vector_at(rows.point2, i);
      anchors.push_back(
          {group.row[reply.u32("constraint")[i]], point1, point2, joint_error(rows.at(i), point2 - point1)});
    }
  }
  std::ranges::stable_sort(anchors, {}, &Anchor::joint);
  return anchors;
}

std::vector<JointCoordinate> Surveyor::coordinates(const kernel::Environment& environment,
                                                   std::vector<std::string>* missing) {
  std::vector<JointCoordinate> coordinates;
  constexpr stage::Method kAsked = stage::Method::kConstraintCoordinates;
  for (const kernel::ConstraintGroup& group : environment.model().constraint_groups) {
    const PluginDeclaration& plugin = slot(Slot::kConstraint).description().plugins[group.target].declaration;
    if (!has_capability(plugin, "coordinates")) continue;
    const MessageColumns asked = request(kAsked, environment, group);
    const std::vector<std::uint32_t>& intact = asked.u32("intact");
    const auto type_of = [&](std::uint32_t row) -> const TypeDeclaration& {
      return *std::ranges::find(plugin.types, asked.u64("constraint_type")[row],
                                [](const TypeDeclaration& one) { return type_id(one.name); });
    };
    const auto check = [&](const MessageColumns& reply) -> AnswerProblem {
      std::pair<std::uint64_t, std::uint64_t> next{0, 0};
      for (std::size_t i = 0; i < reply.u32("constraint").size(); ++i) {
        const std::uint32_t row = reply.u32("constraint")[i], coordinate = reply.u32("coordinate")[i];
        if (row >= intact.size() || intact[row] == 0) return {true, "constraint names no joint that holds"};
        if (coordinate >= type_of(row).coordinates.size())
          return {true, "coordinate names none that the joint's type declares"};
        if (std::pair<std::uint64_t, std::uint64_t>{row, coordinate} < next)
          return {true, "constraint and coordinate do not ascend"};
        next = {row, coordinate + 1ULL};
      }
      return {};
    };
    const auto is_told = [](const MessageColumns& reply, std::uint32_t row) {
      return std::ranges::binary_search(reply.u32("constraint"), row);
    };
    try {
      const MessageColumns reply = slot(Slot::kConstraint).ask(kAsked, group.target, asked, check);
      for (std::size_t i = 0; i < reply.u32("constraint").size(); ++i) {
        const std::uint32_t row = reply.u32("constraint")[i];
        coordinates.push_back({group.row[row], type_of(row).coordinates[reply.u32("coordinate")[i]].name,
                               reply.f64("value")[i], reply.f64("rate")[i]});
      }
      for (std::uint32_t row = 0; row < intact.size(); ++row) {
        if (intact[row] == 0 || type_of(row).coordinates.empty() || is_told(reply, row)) continue;
        std::string why = fmt::format(
            "coordinates of joints of type {0} that do not say what these are counted from: see `gravitas "
            "describe {0}`",
            type_of(row).name);
        if (std::ranges::find(*missing, why) == missing->end()) missing->push_back(std::move(why));
      }
    } catch (const NoAnswer& reason) {
      missing->emplace_back(reason.what());
    }
  }
  std::ranges::stable_sort(coordinates, {}, &JointCoordinate::joint);
  return coordinates;
}

std::vector<AppliedForce> Surveyor::forces(const kernel::Environment& environment) {
  // every application in the order of the scene
  std::vector<AppliedForce> forces;
  for (std::uint32_t body = 0; body < description_.bodies.size(); ++body)
    for (const std::uint32_t force : description_.bodies[body].forces) forces.push_back({force, body, {}});
  constexpr stage::Method kAsked = stage::Method::kForceWrenches;
  for (const kernel::ForceGroup& group : environment.model().force_groups) {
    MessageColumns asked = request(kAsked, environment);
    Filler filler(kAsked, &asked);
    filler.put("force_type", view(group.type));
    filler.put("force_parameter_begin", view(group.parameter_begin));
    filler.put("force_parameter", view(group.parameter));
    filler.put("application", view(group.application));
    const MessageColumns reply = slot(Slot::kForce).ask(kAsked, group.target, asked, {});
    for (std::size_t i = 0; i < group.row.size(); ++i) {
      const std::span<const double> six = std::span(reply.f64("wrench")).subspan(6 * i, 6);
      forces.at(group.row[i]).wrench = {{six[0], six[1], six[2]}, {six[3], six[4], six[5]}};
    }
  }
  return forces;
}

}  // namespace gravitas::survey
