// What a service hands to the kernel to make an environment: everything resolved to numbers and indices, no
// file format, no formula. services/scene makes it from a scene; tests make it by hand.
//
// Poses are those of the centre of mass with principal axes (§ 2.3.2.2); properties of shapes, forces and joints
// are flattened as plugin_sdk/property.h says.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin_sdk/activity.h"
#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/local_bound.h"
#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/motion_curve.h"
#include "plugin_sdk/plugin.h"

namespace gravitas::kernel {

enum class Hosting : std::uint32_t {
  kDirect,        // in the kernel's process
  kSharedMemory,  // in a worker process, data in shared memory
  kGrpc,          // in a worker process, data as gRPC messages
};

// "direct", "shm", "grpc".
const char* hosting_name(Hosting hosting);

struct PluginChoice {
  PluginDeclaration declaration;
  std::string library;           // path of the shared library
  std::vector<double> settings;  // values of the plugin's own properties
  // Instead of the library, whatever the slot's hosting, gRPC to a worker: one that this shell command starts, given
  // `--listen ADDRESS`, or one that listens at this address already and serves all plugins that name it, in order.
  std::string command = {};
  std::string address = {};
  // What takes over when nothing else helps, with the same types; null: nothing.
  std::shared_ptr<const PluginChoice> fallback = nullptr;

  bool is_elsewhere() const { return !command.empty() || !address.empty(); }
};

// True if the same answers.
bool is_same_plugin(const PluginChoice& a, const PluginChoice& b);

// Why one process cannot hold these; empty if it can.
std::string why_apart(const std::vector<PluginChoice>& plugins);

// Deadline of a worker that stops in a debugger, s.
inline constexpr double kAttachedDeadline = 1e8;

// What stands between a failing worker and the truth; each can be missing, for a campaign's self-test only.
struct Defences {
  bool structure = true, numbers = true, physics = true;  // checks of the answers
  bool replay = true;                                     // a failed call is answered by somebody else
  bool digest = true, epoch = true, deadline = true;      // shm alone: of frames; late answers; answers that never come
};

struct SlotDescription {
  Hosting hosting = Hosting::kSharedMemory;
  double deadline = 2.0;       // s, for one call, counted from the last mark of progress
  bool attached = false;       // a worker that somebody started by hand; see kAttachedDeadline
  std::uint32_t standbys = 1;  // workers that wait, warm, to take over from one that fails; none if direct
  static constexpr std::uint32_t kBudget = 5;
  std::uint32_t failures = kBudget;  // at so many, each soon after the other, others take over; see slot_host.h
  // Slots that name the same process, and are hosted alike outside of this one, share it and its standbys; deadline,
  // standbys and failures are those of the first.
  std::string process = {};
  std::vector<PluginChoice> plugins;  // one; for force and constraint a list; empty: nothing needs the slot
  Defences defences = {};

  // True if the hosting of one of its plugins is the slot's: what answers by gRPC whatever that is takes no neighbours along.
  bool is_hosted_as(const PluginChoice& plugin) const { return !plugin.is_elsewhere() || plugins.size() == 1; }

  // Whoever takes over from a worker that was started by hand has a deadline again.
  void end_attachment();
  double call_deadline() const { return attached ? kAttachedDeadline : deadline; }
};

struct ShapeDescription {
  std::string id;
  std::string type;  // "Sphere"
  std::vector<double> parameters;
};

struct BodyDescription {
  std::string id;
  std::uint32_t flags = kMovable;     // BodyFlag bits
  double mass = 1.0;                  // kg; 0 if immovable
  Vector3 inertia = Vector3::Ones();  // principal moments, kg m^2; 0 if immovable
  double damping = 0.0;               // 1/s
  Pose pose;                          // of the centre of mass, world
  Twist twist;                        // world
  MotionTable motion;                 // of a kinematic body: the way of its geometry; else empty
  std::uint32_t shape = kNone;        // row of `shapes`
  Pose geometry;                      // of the shape's frame in the body's
  LocalBound bound;
  std::uint32_t material = 0;  // row of `materials`
  std::uint64_t filter_group = 1, filter_mask = ~0ULL;
  std::vector<std::uint32_t> forces;  // rows of `forces`, in the scene's order
};

struct ForceDescription {
  std::string id;
  std::string type;
  std::vector<double> parameters;
  std::uint32_t plugin = 0;  // which of the force slot's plugins serves the type
};

struct ConstraintDescription {
  std::string id;
  std::string type;
  std::vector<double> parameters;
  std::uint32_t body1 = kNone, body2 = kNone;          // kNone: the world
  double breaking_threshold = 0.0;                     // joint error, m; 0: never
  double breaking_force = 0.0, breaking_torque = 0.0;  // N, N m; 0: never
  std::uint32_t plugin = 0;                            // which of the constraint slot's plugins serves the type
  // Poses of its bodies in which it is bound; absent: the initial ones. A joint of a scene that was edited has others.
  std::optional<std::array<Pose, 2>> bound_at = {};
  bool is_kept = false;  // it held its bodies before an edit
};

// How a step is made of stages (simulators/).
enum class Simulator : std::uint32_t { kBasic, kSubstepping, kSmooth, kBisection, kContinuous };

struct EnvironmentDescription {
  std::string id;
  Simulator simulator = Simulator::kBasic;
  std::uint32_t substeps = 1;     // equal inner steps of a step
  double accuracy = 0.0;          // of kContinuous: estimated error of a part of a step, as of DormandPrince54; 0: any
  SleepRule sleep;                // when islands fall asleep (plugin_sdk/activity.h)
  double time_step = 1.0 / 60.0;  // s
  // Number of steps of the whole run and the length of the last one (s), which may be shorter.
  std::uint32_t steps = 600;
  double last_time_step = 1.0 / 60.0;

  std::vector<ShapeDescription> shapes;
  std::uint32_t material_count = 1;
  // Row a * material_count + b: kMaterialColumns numbers (plugin_sdk/solver.h), symmetric.
  std::vector<double> material_pairs = std::vector<double>(6, 0.0);
  std::vector<BodyDescription> bodies;
  std::vector<ForceDescription> forces;
  // In each step, though all may say at the start that their wrenches are constant: whoever answered before them did not.
  bool asks_forces = false;
  // Times at which forces or motions jump or bend, s, rising: inner steps end there, and ask forces on their own side.
  std::vector<double> switches;
  std::vector<ConstraintDescription> constraints;

  SlotDescription space, collision, constraint, force, solver, integrator;
  std::uint32_t threads = 1;  // of each host's parallel_for
  // Every so many steps, answers are held against laws of physics (plugin_sdk/physics_checks.h); 0: never.
  std::uint32_t check_physics_every = 0;

  SlotDescription& slot(Slot which);
  const SlotDescription& slot(Slot which) const;

  // Finds the first thing that is not as this header says (index out of range, non-finite number, quaternion not
  // unit, negative mass, …) and names it; empty if all is well.
  std::string validate() const;
};

}  // namespace gravitas::kernel
