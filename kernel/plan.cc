#include "kernel/plan.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "plugin_sdk/pair_rule.h"

namespace gravitas::kernel {
namespace {

const char* why_none_sleeps(const EnvironmentDescription& d, bool has_contacts) {
  const auto may_sleep = [](const BodyDescription& body) { return (body.flags & kCanSleep) != 0; };
  if (d.sleep.energy == 0.0) return "SleepEnergy is 0";
  if (d.simulator == Simulator::kSmooth) return "the simulator Smooth stops no motion";
  if (!has_contacts && d.constraints.empty()) return "there are neither contacts nor joints that could hold a body";
  return std::ranges::none_of(d.bodies, may_sleep) ? "no body may sleep" : nullptr;
}

}  // namespace

Plan make_plan(EnvironmentDescription* d) {
  Plan plan;
  const auto plan_for = [&](Slot slot, bool is_needed, const char* why_not) {
    std::vector<PluginChoice>& plugins = d->slot(slot).plugins;
    if (!is_needed) {
      plugins.clear();
      return plan.left_out.push_back({slot_name(slot), why_not});
    }
    PlannedSlot& planned = plan.slots.emplace_back();
    planned.slot = slot;
    planned.hosting = d->slot(slot).hosting;
    for (const PluginChoice& plugin : plugins) planned.plugins.push_back(plugin.declaration.name);
  };
  const bool has_forces = std::ranges::any_of(d->bodies, [](const BodyDescription& b) { return !b.forces.empty(); });
  plan_for(Slot::kIntegrator, !d->bodies.empty(), "there are no bodies");
  plan_for(Slot::kForce, has_forces, "no force acts on any body");

  std::vector<TouchRights> rights;
  for (const BodyDescription& body : d->bodies) rights.push_back({body.flags, body.filter_group, body.filter_mask});
  const bool has_contacts = can_any_touch(std::move(rights));
  if (d->simulator == Simulator::kSmooth && has_contacts)
    throw std::invalid_argument(
        "the simulator Smooth moves bodies that cannot touch, and some of these can: leave out their geometry, forbid "
        "the pairs in CollisionFilter, or use Type = \"Basic\", \"Substepping\", \"Continuous\" or \"Bisection\"");
  const bool has_joints = !d->constraints.empty();
  plan_for(Slot::kSpace, has_contacts, "no two bodies can touch");
  plan_for(Slot::kCollision, has_contacts, "no two bodies can touch");
  plan_for(Slot::kConstraint, has_joints, "there are no joints");
  plan_for(Slot::kSolver, has_contacts || has_joints, "there are neither contacts nor joints");
  if (const char* why = why_none_sleeps(*d, has_contacts)) {
    d->sleep.energy = 0.0;
    plan.left_out.push_back({"sleep", why});
  }
  return plan;
}

}  // namespace gravitas::kernel
