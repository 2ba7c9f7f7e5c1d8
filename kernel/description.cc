#include "kernel/description.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/slots.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

bool is_unit(const Quaternion& q) { return std::fabs(q.squaredNorm() - 1.0) <= kUnitTolerance; }

std::string validate_body(const EnvironmentDescription& d, const BodyDescription& body) {
  const std::string who = "body '" + body.id + "': ";
  const bool finite = body.pose.position.allFinite() && body.twist.linear.allFinite() &&
                      body.twist.angular.allFinite() && body.geometry.position.allFinite() &&
                      std::isfinite(body.mass) && body.inertia.allFinite() && std::isfinite(body.damping) &&
                      body.bound.centre.allFinite() && body.bound.half_extents.allFinite();
  if (!finite) return who + "a number is not finite";
  if (!is_unit(body.pose.orientation) || !is_unit(body.geometry.orientation) || !is_unit(body.bound.orientation))
    return who + "an orientation is not a unit quaternion";
  if ((body.flags & kMovable) != 0 && (body.flags & kKinematic) != 0) return who + "it is both movable and kinematic";
  if ((body.flags & kMovable) != 0 && !(body.mass > 0.0 && body.inertia.minCoeff() > 0.0))
    return who + "a movable body needs positive mass and moments of inertia";
  if (body.damping < 0.0) return who + "negative damping";
  if (!body.motion.empty()) {
    if ((body.flags & kKinematic) == 0) return who + "it follows a motion and is not kinematic";
    const std::string problem = MotionCurve::find_problem(body.motion);
    if (!problem.empty()) return who + "motion: " + problem;
  }
  if (((body.flags & kHasShape) != 0) != (body.shape != kNone)) return who + "shape and flags disagree";
  if (body.shape != kNone && body.shape >= d.shapes.size()) return who + "there is no such shape";
  if (body.material >= d.material_count) return who + "there is no such material";
  for (const std::uint32_t force : body.forces)
    if (force >= d.forces.size()) return who + "there is no such force";
  return {};
}

std::string validate_joint(const EnvironmentDescription& d, const ConstraintDescription& joint) {
  const std::string who = "constraint '" + joint.id + "': ";
  const auto exists = [&](std::uint32_t body) { return body == kNone || body < d.bodies.size(); };
  if (!exists(joint.body1) || !exists(joint.body2)) return who + "there is no such body";
  if (joint.body1 == joint.body2) return who + "it binds a body to itself";
  if (joint.plugin >= d.constraint.plugins.size()) return who + "no plugin serves its type";
  for (const double most : {joint.breaking_threshold, joint.breaking_force, joint.breaking_torque})
    if (!(most >= 0.0)) return who + "negative breaking threshold";
  return {};
}

}  // namespace

bool is_same_plugin(const PluginChoice& a, const PluginChoice& b) {
  return a.library == b.library && a.command == b.command && a.address == b.address && a.settings == b.settings;
}

std::string why_apart(const std::vector<PluginChoice>& plugins) {
  const auto is_apart = [&](const PluginChoice& one) {
    return !one.command.empty() || one.address != plugins[0].address;
  };
  if (plugins.size() < 2 || std::ranges::none_of(plugins, is_apart)) return {};
  return "a command or an address serves one plugin, and this process would hold others besides";
}

void SlotDescription::end_attachment() {
  const auto has_address = [](const PluginChoice& one) { return !one.address.empty(); };
  if (!attached || std::ranges::any_of(plugins, has_address)) return;
  attached = false;
}

const char* hosting_name(Hosting hosting) {
  constexpr const char* kNames[] = {"direct", "shm", "grpc"};
  return kNames[static_cast<std::uint32_t>(hosting)];
}

SlotDescription& EnvironmentDescription::slot(Slot which) {
  SlotDescription* const all[] = {&space, &collision, &constraint, &force, &solver, &integrator};
  return *all[static_cast<std::uint32_t>(which) - static_cast<std::uint32_t>(Slot::kSpace)];
}

const SlotDescription& EnvironmentDescription::slot(Slot which) const {
  return const_cast<EnvironmentDescription*>(this)->slot(which);
}

std::string EnvironmentDescription::validate() const {
  if (!(time_step > 0.0) || !std::isfinite(time_step)) return "the time step must be positive";
  if (!(last_time_step > 0.0) || !(last_time_step <= time_step * (1.0 + 1e-9))) return "the last time step is longer";
  if (substeps == 0) return "a step has one inner step at least";
  if (!(accuracy >= 0.0) || (accuracy > 0.0 && simulator != Simulator::kContinuous))
    return "the accuracy must be positive, and is of Continuous alone";
  if (!(sleep.energy >= 0.0) || !(sleep.time >= 0.0)) return "the energy or the time of sleep is negative";
  if (material_count == 0 || material_pairs.size() != std::size_t{material_count} * material_count * kMaterialColumns)
    return "the table of material pairs has the wrong size";
  for (const double number : material_pairs)
    if (!std::isfinite(number) || number < 0.0) return "the table of material pairs has an impossible number";
  for (const ForceDescription& one : forces)
    if (one.plugin >= force.plugins.size()) return "force '" + one.id + "': no plugin serves its type";
  for (std::size_t i = 0; i < switches.size(); ++i)
    if (!std::isfinite(switches[i]) || (i > 0 && !(switches[i] > switches[i - 1])))
      return "times of switches must rise";
  for (const BodyDescription& body : bodies)
    if (std::string problem = validate_body(*this, body); !problem.empty()) return problem;
  for (const ConstraintDescription& joint : constraints)
    if (std::string problem = validate_joint(*this, joint); !problem.empty()) return problem;
  for (const Slot which : kSlots)
    if (!(slot(which).deadline > 0.0 && slot(which).deadline <= kAttachedDeadline))
      return std::string("the deadline of slot ") + slot_name(which) + " must be in (0, 1e8] s";
  return {};
}

}  // namespace gravitas::kernel
