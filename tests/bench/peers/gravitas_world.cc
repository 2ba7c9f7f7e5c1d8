// Ours: every slot direct, one thread, each plugin as it is where a scene says no more than its name; of heaps, which are
// swept, with as many sweeps as ODE makes.
#include <algorithm>
#include <limits>
#include <map>
#include <stdexcept>

#include "kernel/environment.h"
#include "plugin_sdk/property_value.h"
#include "tests/bench/peers/engine.h"
#include "tests/kernel/world_builder.h"
#include "tests/turn_between.h"

namespace gravitas::peers {
namespace {

using harness::WorldBuilder;

// The choices of a row.
struct Preset {
  kernel::Simulator simulator;
  std::string integrator, solver;  // folder names
  std::string how;
  std::vector<NamedValue> of_solver = {};
};

const Preset kPlain{kernel::Simulator::kBasic, "semi_implicit_euler", "newton",
                    "`Basic`, `SemiImplicitEuler`, `Newton`"};
// of the solver nothing is left in a plan where nothing can touch
const Preset kAlone{kernel::Simulator::kBasic, "semi_implicit_euler", "newton", "`Basic`, `SemiImplicitEuler`"};
const Preset kSecondOrder{kernel::Simulator::kBasic, "verlet", "newton", "`Basic`, `Verlet`, `Newton`"};
const Preset kTurning{kernel::Simulator::kBasic, "symplectic_splitting", "newton", "`Basic`, `SymplecticSplitting`"};
const Preset kHeap{kernel::Simulator::kBasic,
                   "semi_implicit_euler",
                   "sequential",
                   "`Basic`, `SemiImplicitEuler`, `Sequential`, 20 sweeps",
                   {{.name = "Iterations", .value = PropertyValue::of(20.0)}}};
const Preset kJointed{kernel::Simulator::kSmooth, "rk4", "direct", "`Smooth`, `RK4`, `Direct`"};
const Preset kLocated{kernel::Simulator::kContinuous, "verlet", "newton", "`Continuous`, `Verlet`, `Newton`"};

// By scene; where it is not named, kPlain.
const std::map<std::string, Preset> kPresets = {{"one_body", kAlone},
                                                {"freefall1000", kSecondOrder},
                                                {"freetop", kTurning},
                                                // RK4 is not stable at 1/60 s
                                                {"chain20", kSecondOrder},
                                                {"chain20_at_240", kJointed},
                                                {"bounce", kLocated},
                                                {"slide", kLocated},
                                                {"slide30", kLocated},
                                                {"balls666", kHeap},
                                                {"balls666_at_240", kHeap},
                                                {"pyramid15", kHeap},
                                                {"pile1000", kHeap}};

// With the defaults of all properties that are not given, as a scene has it.
void choose(WorldBuilder* world, Slot slot, const std::string& library, const std::vector<NamedValue>& given = {}) {
  world->plugin(slot, harness::plugin_path(library));
  kernel::PluginChoice& choice = world->description().slot(slot).plugins[0];
  std::vector<PropertyProblem> problems;
  flatten(choice.declaration.properties, given, &choice.settings, &problems);
}

void add_plane(WorldBuilder* world, const Plane& plane) {
  world->ground();
  world->body().pose = {plane.offset * plane.normal, test::turn_between(Vector3::UnitY(), plane.normal)};
}

// Equal shapes are one, as in a scene that names them.
void share_shapes(kernel::EnvironmentDescription* description) {
  std::vector<kernel::ShapeDescription> kept;
  for (kernel::BodyDescription& body : description->bodies) {
    if (body.shape == kNone) continue;
    const kernel::ShapeDescription& own = description->shapes[body.shape];
    const auto same = std::ranges::find_if(
        kept, [&](const auto& other) { return other.type == own.type && other.parameters == own.parameters; });
    body.shape = static_cast<std::uint32_t>(same - kept.begin());
    if (same == kept.end()) kept.push_back(own);
  }
  description->shapes = std::move(kept);
}

WorldBuilder built(const Scene& scene, const Preset& preset) {
  WorldBuilder world(kernel::Hosting::kDirect);
  world.steps(scene.steps, scene.time_step).material({scene.restitution, scene.friction, scene.friction, 0.0});
  choose(&world, Slot::kSpace, "space_dynamic_bvh");
  choose(&world, Slot::kIntegrator, "integrator_" + preset.integrator);
  choose(&world, Slot::kSolver, "solver_" + preset.solver, preset.of_solver);
  world.description().simulator = preset.simulator;
  for (const SceneBody& body : scene.bodies) {
    if (!scene.collides)
      world.point(body.mass, body.inertia, Vector3::Zero());
    else if (body.form == Form::kSphere)
      world.sphere(body.half_sizes.x(), body.mass, Vector3::Zero());
    else
      world.box(body.half_sizes, body.mass, Vector3::Zero());
    world.body().inertia = body.inertia;
    world.body().pose = body.start.pose;
    world.body().twist = body.start.twist;
  }
  for (const Plane& plane : scene.planes) add_plane(&world, plane);
  if (!scene.gravity.isZero()) world.gravity(scene.gravity);
  constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();
  for (const BallJoint& joint : scene.joints)
    world.joint(
        "Spherical", "constraint_spherical", joint.body1, joint.body2,
        {joint.point.x(), joint.point.y(), joint.point.z(), kAbsent, 0, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent});
  share_shapes(&world.description());
  return world;
}

class GravitasWorld final : public World {
 public:
  GravitasWorld(const Scene& scene, const Preset& preset) : environment_(built(scene, preset).description()) {}

  void step() override {
    if (environment_.step() == kernel::StepOutcome::kPaused)
      throw std::runtime_error(environment_.fault()->fault.text());
  }
  BodyState state(std::size_t body) override {
    const kernel::StateView all = environment_.state();
    return {{vector_at(all.position, body), quaternion_at(all.orientation, body)},
            {vector_at(all.linear_velocity, body), vector_at(all.angular_velocity, body)}};
  }

 private:
  kernel::Environment environment_;
};

}  // namespace

Engine gravitas_for(const Scene& scene) {
  const auto found = kPresets.find(scene.name);
  const Preset& preset = found == kPresets.end() ? kPlain : found->second;
  return {"Gravitas", preset.how, [preset](const Scene& s) { return std::make_unique<GravitasWorld>(s, preset); }};
}

}  // namespace gravitas::peers
