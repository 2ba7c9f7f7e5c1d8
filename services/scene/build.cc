#include "services/scene/build.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "plugin_sdk/property_value.h"
#include "services/scene/build_bodies.h"
#include "services/scene/build_context.h"
#include "services/scene/build_filter.h"
#include "services/scene/build_materials.h"
#include "services/scene/build_plugins.h"
#include "services/scene/build_shapes.h"
#include "services/scene/force_bodies.h"

namespace gravitas::scene {
namespace {

using v1::Constraint;
using v1::Simulator;
using v1::SimulatorProperties;

constexpr double kStepTolerance = 1e-9;

const v1::Environment* find_environment(const v1::Scene& scene, Diagnostics* diagnostics) {
  if (scene.environment_size() == 0) {
    diagnostics->error(place_of(scene.location()), "the scene has no Environment { … }; required: one");
    return nullptr;
  }
  const v1::Environment& first = scene.environment(0);
  if (scene.environment_size() == 1) return &first;
  const v1::Environment& second = scene.environment(1);
  diagnostics->error(place_of(second.location()),
                     "a second Environment \"" + second.id() + "\"; the first is \"" + first.id() + "\" at " +
                         diagnostics->place_text(place_of(first.location())) + "; allowed: one");
  return nullptr;
}

// Number of steps and length of the last one.
void build_steps(const SimulatorProperties& properties, BuildContext* context) {
  const double time_step = properties.time_step(), duration = properties.duration();
  const double ratio = duration / time_step, whole = std::round(ratio);
  // a quotient of two rounded numbers is off by a rounding or two of its own size
  const double tolerance = std::max(kStepTolerance, 4.0 * std::numeric_limits<double>::epsilon() * ratio);
  // what is far shorter than a step is a step of its own
  const bool is_whole = duration == 0.0 || (whole > 0.0 && std::fabs(ratio - whole) <= tolerance);
  const double steps = is_whole ? whole : std::max(std::ceil(ratio), 1.0);
  if (!(steps <= static_cast<double>(std::numeric_limits<std::uint32_t>::max()))) {
    context->diagnostics->error(place_of(properties, SimulatorProperties::kTimeStepFieldNumber),
                                "Duration " + number_text(duration) + " s in steps of " + number_text(time_step) +
                                    " s is " + number_text(ratio) + " steps; allowed: up to 4294967295");
    return;
  }
  context->description.time_step = time_step;
  context->description.steps = static_cast<std::uint32_t>(steps);
  context->description.last_time_step = is_whole ? time_step : duration - (steps - 1.0) * time_step;
}

void build_simulator(const Simulator& simulator, BuildContext* context) {
  using enum kernel::Simulator;
  static const std::map<std::string, kernel::Simulator> kSimulators = {{"Basic", kBasic},
                                                                       {"Substepping", kSubstepping},
                                                                       {"Bisection", kBisection},
                                                                       {"Continuous", kContinuous},
                                                                       {"Smooth", kSmooth}};
  context->description.simulator = kSimulators.at(simulator.type());
  const SimulatorProperties& properties = simulator.custom_properties();
  if (properties.has_accuracy() && context->description.simulator == kContinuous)
    context->description.accuracy = properties.accuracy();
  else if (properties.has_accuracy() && context->description.simulator != kSmooth)
    context->diagnostics->error(place_of(properties, SimulatorProperties::kAccuracyFieldNumber),
                                "Accuracy belongs to the simulators \"Smooth\" and \"Continuous\"; allowed: Type = "
                                "\"Smooth\", Type = \"Continuous\", or Accuracy in KineticIntegrator { … }");
  context->description.substeps = properties.substeps();
  context->description.sleep = {properties.sleep_energy(), properties.sleep_time()};
  context->description.check_physics_every = properties.check_physics_every();
  build_steps(properties, context);
}

bool names(const v1::Environment& environment, int field, const v1::Component& component) {
  return is_written(environment, field) || is_written(component, v1::Component::kTypeFieldNumber);
}

// As written; where they are not, what the simulator needs for what it promises.
v1::Component integrator_of(const v1::Environment& environment, kernel::Simulator simulator) {
  v1::Component integrator = environment.kinetic_integrator();
  if (names(environment, v1::Environment::kKineticIntegratorFieldNumber, integrator)) return integrator;
  if (simulator == kernel::Simulator::kContinuous || simulator == kernel::Simulator::kBisection)
    integrator.set_type("Verlet");
  if (simulator == kernel::Simulator::kSmooth) integrator.set_type("DormandPrince54");
  return integrator;
}

v1::Component solver_of(const v1::Environment& environment, kernel::Simulator simulator) {
  v1::Component solver = environment.constraint_solver();
  if (simulator == kernel::Simulator::kSmooth &&
      !names(environment, v1::Environment::kConstraintSolverFieldNumber, solver))
    solver.set_type("Direct");
  return solver;
}

// Joints in the derivative of a method of order 1 swing ever further.
void warn_of_first_order(BuildContext* context) {
  const kernel::EnvironmentDescription& d = context->description;
  if (d.simulator != kernel::Simulator::kSmooth || d.constraints.empty() || d.integrator.plugins.empty()) return;
  const std::string& name = d.integrator.plugins[0].declaration.name;
  if (name != "Euler" && name != "SemiImplicitEuler") return;
  context->diagnostics->warning(place_of(context->scene.simulator().location()),
                                "the simulator Smooth with \"" + name +
                                    "\", which is of order 1, gains energy at joints; better: \"DormandPrince54\", "
                                    "\"RK4\", \"Verlet\"");
}

// The Accuracy of Smooth is the integrator's.
void hand_on_accuracy(BuildContext* context) {
  const SimulatorProperties& properties = context->scene.simulator().custom_properties();
  if (!properties.has_accuracy() || context->description.simulator != kernel::Simulator::kSmooth ||
      context->description.integrator.plugins.empty())
    return;
  kernel::PluginChoice& integrator = context->description.integrator.plugins[0];
  const TextPosition place = place_of(properties, SimulatorProperties::kAccuracyFieldNumber);
  std::size_t at = 0;
  for (const Property& property : integrator.declaration.properties) {
    if (property.name != "Accuracy") {
      at += property.flat_size();
      continue;
    }
    for (const auto& own : context->environment.kinetic_integrator().custom_properties().property())
      if (own.name() == "Accuracy")
        context->diagnostics->error(place, "Accuracy stands in KineticIntegrator { … } too; allowed: one of them");
    PropertyValue given = PropertyValue::of(properties.accuracy());
    given.position = place;
    std::vector<double> numbers;
    std::vector<PropertyProblem> problems;
    if (flatten_value(property, given, &numbers, &problems)) integrator.settings[at] = numbers.front();
    context->diagnostics->add(problems, place, "");
    return;
  }
  context->diagnostics->error(
      place, "the integrator \"" + integrator.declaration.name +
                 "\" has no Accuracy; allowed: \"DormandPrince54\", \"DormandPrince853\", \"Rosenbrock\", "
                 "\"Radau\", or a smaller TimeStep instead");
}

void build_forces(const IdIndex& bodies, PluginSelection* plugins, BuildContext* context) {
  for (const v1::Force& force : context->scene.forces().force()) {
    kernel::ForceDescription& description = context->description.forces.emplace_back();
    description.id = force.id();
    description.type = force.type();
    const TypeDeclaration* type = nullptr;
    const TextPosition place = place_of(force, v1::Force::kTypeFieldNumber);
    description.plugin = plugins->serve(Slot::kForce, force.type(), place, &type);
    if (type == nullptr) continue;
    flatten_force(*type, force, bodies, context, &description.parameters);
  }
}

// ---- joints
// ------------------------------------------------------------------------------------------------------

// The row of the body that a joint names, or kNone for the world. False after an error.
bool find_body(const Constraint& joint, int field, const IdIndex& bodies, BuildContext* context, std::uint32_t* row) {
  const bool is_first = field == Constraint::kBody1FieldNumber;
  const std::string& id = is_first ? joint.body1() : joint.body2();
  *row = kNone;
  if (id.empty()) return true;
  *row = bodies.find(id, is_first ? "Body1" : "Body2", place_of(joint, field), context->diagnostics);
  return *row != kNone;
}

void check_bodies(const Constraint& joint, const kernel::ConstraintDescription& description, BuildContext* context) {
  const auto is_movable = [&](std::uint32_t row) {
    return row != kNone && (context->description.bodies[row].flags & kMovable) != 0;
  };
  const auto runs = [&](std::uint32_t row) {
    return row != kNone && !context->description.bodies[row].motion.surface.isZero(0.0);
  };
  std::string wrong;
  if (description.body1 == kNone && description.body2 == kNone) {
    wrong = "joins the world to the world; required: Body1 or Body2";
  } else if (description.body1 == description.body2) {
    wrong = "joins \"" + joint.body1() + "\" to itself; allowed: two bodies, or one and the world";
  } else if (!is_movable(description.body1) && !is_movable(description.body2)) {
    wrong =
        "joins nothing that can be pushed; required: a body that is neither immovable nor "
        "kinematic";
  } else if (runs(description.body1) || runs(description.body2)) {
    wrong = "holds on to a surface that runs; allowed: bodies without SurfaceVelocity, and the world";
  } else {
    return;
  }
  const bool has_second = is_written(joint, Constraint::kBody2FieldNumber);
  context->diagnostics->error(
      place_of(joint, has_second ? Constraint::kBody2FieldNumber : Constraint::kBody1FieldNumber),
      "Constraint \"" + joint.id() + "\" " + wrong);
}

// A joint that changes with time keeps its bodies awake, since nothing else tells when it moves them. What it does to
// accelerations may jump at the rows of its tables, where steps of Smooth end.
void keep_time(const std::vector<double>& times, const kernel::ConstraintDescription& joint,
               kernel::EnvironmentDescription* description) {
  if (times.empty()) return;
  for (const std::uint32_t body : {joint.body1, joint.body2})
    if (body != kNone) description->bodies[body].flags &= ~std::uint32_t{kCanSleep};
  if (description->simulator != kernel::Simulator::kSmooth) return;
  description->switches.insert(description->switches.end(), times.begin(), times.end());
}

void build_constraints(const IdIndex& bodies, PluginSelection* plugins, BuildContext* context) {
  for (const Constraint& joint : context->environment.constraints().constraint()) {
    if (context->diagnostics->full()) return;
    kernel::ConstraintDescription description;
    description.id = joint.id();
    description.type = joint.type();
    description.breaking_threshold = joint.breaking_threshold();
    description.breaking_force = joint.breaking_force();
    description.breaking_torque = joint.breaking_torque();
    const TypeDeclaration* type = nullptr;
    description.plugin =
        plugins->serve(Slot::kConstraint, joint.type(), place_of(joint, Constraint::kTypeFieldNumber), &type);
    const bool has_first = find_body(joint, Constraint::kBody1FieldNumber, bodies, context, &description.body1);
    const bool has_second = find_body(joint, Constraint::kBody2FieldNumber, bodies, context, &description.body2);
    if (has_first && has_second) check_bodies(joint, description, context);
    if (type != nullptr &&
        context->flatten_properties(type->properties, joint.custom_properties(), place_of(joint.location()),
                                    joint.type() + " \"" + joint.id() + '"', &description.parameters))
      keep_time(times_of(type->properties, description.parameters), description, &context->description);
    context->description.constraints.push_back(std::move(description));
  }
  std::vector<double>& switches = context->description.switches;
  std::ranges::sort(switches);
  switches.erase(std::unique(switches.begin(), switches.end()), switches.end());
}

// ---- all of it
// ---------------------------------------------------------------------------------------------------

void build_world(BuildContext* context) {
  const v1::Environment& environment = context->environment;
  Diagnostics* diagnostics = context->diagnostics;
  const bool has_shapes = context->scene.geometries().geometry_size() > 0;
  const bool has_joints = environment.constraints().constraint_size() > 0;
  const bool has_bodies = environment.space().bodies().body_size() > 0;

  const IdIndex geometries("Geometry", context->scene.geometries().geometry(), diagnostics);
  const IdIndex materials("Material", context->scene.materials().material(), diagnostics);
  const IdIndex forces("Force", context->scene.forces().force(), diagnostics);
  const IdIndex bodies("Body", environment.space().bodies().body(), diagnostics);
  const IdIndex joints("Constraint", environment.constraints().constraint(), diagnostics);

  PluginSelection plugins(context);
  plugins.choose(Slot::kSpace, environment.space(), has_shapes);
  const std::vector<Solid> solids = build_shapes(plugins.choose_collision(has_shapes), context);
  build_forces(bodies, &plugins, context);
  build_bodies({geometries, materials, forces, solids}, context);
  if (diagnostics->ok()) complete_forces(context);
  // rows of bodies are complete unless there were too many errors to go on
  if (!diagnostics->full()) build_constraints(bodies, &plugins, context);
  if (!diagnostics->full()) build_filter(bodies, context);
  const kernel::Simulator simulator = context->description.simulator;
  plugins.choose(Slot::kSolver, solver_of(environment, simulator), has_shapes || has_joints);
  plugins.choose(Slot::kIntegrator, integrator_of(environment, simulator), has_bodies);
  if (diagnostics->ok()) {
    hand_on_accuracy(context);
    warn_of_first_order(context);
  }
  plugins.report_unused();
  if (diagnostics->ok()) build_materials(context);
}

}  // namespace

std::optional<kernel::EnvironmentDescription> build(const v1::Scene& scene, Catalog* catalog, Problems* problems) {
  Diagnostics diagnostics(scene, problems);
  const v1::Environment* environment = find_environment(scene, &diagnostics);
  if (environment == nullptr) return std::nullopt;
  BuildContext context{scene, *environment, catalog, &diagnostics, {}};
  context.description.id = environment->id();
  build_simulator(scene.simulator(), &context);
  build_world(&context);
  if (!diagnostics.ok()) return std::nullopt;
  return std::move(context.description);
}

}  // namespace gravitas::scene
