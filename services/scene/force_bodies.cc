#include "services/scene/force_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "plugin_sdk/motion_curve.h"
#include "plugin_sdk/property_value.h"
#include "services/scene/assign.h"

namespace gravitas::scene {
namespace {

constexpr const char* kGravity = "Gravity";

// Calls visit(property, its numbers) for each property of flattened parameters.
template <typename Visit>
void for_each_property(const TypeDeclaration& type, std::vector<double>* parameters, Visit&& visit) {
  std::span<double> rest = *parameters;
  for (const Property& property : type.properties) {
    visit(property, rest.data());
    rest = rest.subspan(flat_size_of(property, rest));
  }
}

const TypeDeclaration* type_of(const kernel::ForceDescription& force, const BuildContext& context) {
  return find_type(context.description.force.plugins[force.plugin].declaration, force.type);
}

// Applies a force to the body that it names, too. One that names it back would be at both of its ends, where the force does
// nothing, whether the body moves or not.
void add_reaction(std::uint32_t force, std::uint32_t row, BuildContext* context) {
  kernel::BodyDescription& body = context->description.bodies[row];
  const v1::Force& written = context->scene.forces().force(static_cast<int>(force));
  // what does not move has dropped its own
  const auto& own = context->environment.space().bodies().body(static_cast<int>(row)).forces();
  if (std::ranges::find(body.forces, force) != body.forces.end() || std::ranges::find(own, written.id()) != own.end()) {
    context->diagnostics->error(
        place_of(written.location()),
        fmt::format(
            "Force \"{0}\" acts between \"{1}\" and itself; allowed: another body, or \"{1}\" without it in its "
            "Forces, which feels the reaction all the same",
            written.id(), body.id));
    return;
  }
  if ((body.flags & kMovable) != 0) body.forces.push_back(force);
}

Vector3 gravity_of(const kernel::BodyDescription& body, const std::vector<kernel::ForceDescription>& forces) {
  Vector3 sum = Vector3::Zero();
  for (const std::uint32_t force : body.forces)
    if (forces[force].type == kGravity) sum += Vector3(forces[force].parameters.data());
  return sum;
}

// The three numbers of a `Gravity` that is absent, or null.
double* absent_gravity(const TypeDeclaration& type, std::vector<double>* parameters) {
  double* found = nullptr;
  for_each_property(type, parameters, [&](const Property& property, double* numbers) {
    if (property.kind == PropertyKind::kVector && property.name == kGravity && std::isnan(numbers[0])) found = numbers;
  });
  return found;
}

void warn_of_no_gravity(std::uint32_t force, const std::string& body, BuildContext* context) {
  const v1::Force& written = context->scene.forces().force(static_cast<int>(force));
  context->diagnostics->warning(place_of(written.location()),
                                written.type() + " \"" + written.id() + "\" has no Gravity, and the body \"" + body +
                                    "\" feels no force of type Gravity either: nothing lifts it");
}

void float_bodies(std::uint32_t force, const TypeDeclaration& type, BuildContext* context) {
  std::vector<kernel::ForceDescription>& forces = context->description.forces;
  const kernel::ForceDescription written = forces[force];
  std::vector<std::pair<Vector3, std::uint32_t>> splits;
  for (kernel::BodyDescription& body : context->description.bodies) {
    const auto applied = std::ranges::find(body.forces, force);
    if (applied == body.forces.end()) continue;
    const Vector3 gravity = gravity_of(body, forces);
    if (gravity.isZero(0.0)) warn_of_no_gravity(force, body.id, context);
    auto split = std::ranges::find(splits, gravity, &std::pair<Vector3, std::uint32_t>::first);
    if (split == splits.end()) {
      const auto row = splits.empty() ? force : static_cast<std::uint32_t>(forces.size());
      if (!splits.empty()) forces.push_back(written);
      std::copy_n(gravity.data(), 3, absent_gravity(type, &forces[row].parameters));
      split = splits.insert(splits.end(), {gravity, row});
    }
    *applied = split->second;
  }
  if (splits.empty()) std::fill_n(absent_gravity(type, &forces[force].parameters), 3, 0.0);
}

// Its velocity is that of its surface: dampers would take it for their end's.
void refuse_belt(std::uint32_t force, std::uint32_t body, BuildContext* context) {
  if (context->description.bodies[body].motion.surface.isZero(0.0)) return;
  const v1::Force& written = context->scene.forces().force(static_cast<int>(force));
  context->diagnostics->error(place_of(written.location()),
                              written.type() + " \"" + written.id() + "\" names the body \"" +
                                  context->description.bodies[body].id +
                                  "\", whose surface runs; allowed: bodies without SurfaceVelocity");
}

}  // namespace

void flatten_force(const TypeDeclaration& type, const v1::Force& force, const IdIndex& bodies, BuildContext* context,
                   std::vector<double>* parameters) {
  std::vector<NamedValue> values = named_values(force.custom_properties());
  for (NamedValue& value : values) {
    const auto declared = std::ranges::find(type.properties, value.name, &Property::name);
    if (declared == type.properties.end() || declared->kind != PropertyKind::kBody) continue;
    if (value.value.kind != PropertyValue::Kind::kText) {
      context->diagnostics->error(value.value.position, force.type() + " \"" + force.id() + "\": " + value.name +
                                                            " is " + shown(value.value) +
                                                            "; allowed: " + allowed_values(*declared));
      return;
    }
    if (const std::string warning = trim_reference(value.name, &value.value.text); !warning.empty())
      context->diagnostics->warning(value.value.position, warning);
    const std::uint32_t row = bodies.find(value.value.text, value.name, value.position, context->diagnostics);
    if (row == kNone) return;
    const TextPosition position = value.value.position;
    value.value = PropertyValue::of(static_cast<double>(row));
    value.value.position = position;
  }
  std::vector<PropertyProblem> problems;
  flatten(type.properties, values, parameters, &problems);
  const TextPosition written = place_of(force.custom_properties().location());
  context->diagnostics->add(problems, written.known() ? written : place_of(force.location()),
                            force.type() + " \"" + force.id() + "\": ");
}

void complete_forces(BuildContext* context) {
  const auto written = static_cast<std::uint32_t>(context->description.forces.size());
  std::set<std::uint32_t> named;
  for (std::uint32_t force = 0; force < written; ++force) {
    const TypeDeclaration& type = *type_of(context->description.forces[force], *context);
    for_each_property(type, &context->description.forces[force].parameters,
                      [&](const Property& property, const double* numbers) {
                        if (property.kind != PropertyKind::kBody || std::isnan(numbers[0])) return;
                        const auto body = static_cast<std::uint32_t>(numbers[0]);
                        named.insert(body);
                        refuse_belt(force, body, context);
                        add_reaction(force, body, context);
                      });
    if (absent_gravity(type, &context->description.forces[force].parameters) != nullptr)
      float_bodies(force, type, context);
  }
  std::set<double> switches;
  for (std::uint32_t i = 0; i < context->description.bodies.size(); ++i) {
    const kernel::BodyDescription& body = context->description.bodies[i];
    for (const std::uint32_t row : body.forces) {
      const kernel::ForceDescription& force = context->description.forces[row];
      const std::vector<double> bends = bends_of(type_of(force, *context)->properties, force.parameters);
      switches.insert(bends.begin(), bends.end());
    }
    // accelerations jump at the rows of a motion, with them what forces between the body and others do and, with Smooth, the
    // accelerations of what is jointed to it
    if (context->description.simulator == kernel::Simulator::kSmooth || named.contains(i))
      for (std::size_t row = 0; row < body.motion.rows.size(); row += MotionTable::kColumns)
        switches.insert(body.motion.rows[row]);
  }
  context->description.switches.assign(switches.begin(), switches.end());
}

}  // namespace gravitas::scene
