#include "kernel/plan.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "plugin_sdk/pair_rule.h"

namespace gravitas::kernel {
namespace {

void add(Plan* plan, Slot slot, const SlotDescription& description) {
  PlannedSlot& planned = plan->slots.emplace_back();
  planned.slot = slot;
  planned.hosting = description.hosting;
  for (const PluginChoice& plugin : description.plugins) planned.plugins.push_back(plugin.declaration.name);
}

void leave_out(Plan* plan, SlotDescription* slot, const char* name, const char* why) {
  slot->plugins.clear();
  plan->left_out.push_back({name, why});
}

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
  if (d->bodies.empty()) {
    leave_out(&plan, &d->integrator, "integrator", "there are no bodies");
  } else {
    add(&plan, Slot::kIntegrator, d->integrator);
  }

  const bool has_forces = std::ranges::any_of(d->bodies, [](const BodyDescription& b) { return !b.forces.empty(); });
  if (has_forces) {
    add(&plan, Slot::kForce, d->force);
  } else {
    leave_out(&plan, &d->force, "force", "no force acts on any body");
  }

  std::vector<TouchRights> rights;
  for (const BodyDescription& body : d->bodies) rights.push_back({body.flags, body.filter_group, body.filter_mask});
  const bool has_contacts = can_any_touch(std::move(rights));
  if (d->simulator == Simulator::kSmooth && has_contacts)
    throw std::invalid_argument(
        "the simulator Smooth moves bodies that cannot touch, and some of these can: leave out their geometry, forbid "
        "the pairs in CollisionFilter, or use Type = \"Basic\", \"Substepping\", \"Continuous\" or \"Bisection\"");
  if (has_contacts) {
    add(&plan, Slot::kSpace, d->space);
    add(&plan, Slot::kCollision, d->collision);
  } else {
    leave_out(&plan, &d->space, "space", "no two bodies can touch");
    leave_out(&plan, &d->collision, "collision", "no two bodies can touch");
  }

  if (!d->constraints.empty()) {
    add(&plan, Slot::kConstraint, d->constraint);
  } else {
    leave_out(&plan, &d->constraint, "constraint", "there are no joints");
  }

  if (has_contacts || !d->constraints.empty()) {
    add(&plan, Slot::kSolver, d->solver);
  } else {
    leave_out(&plan, &d->solver, "solver", "there are neither contacts nor joints");
  }
  if (const char* why = why_none_sleeps(*d, has_contacts)) {
    d->sleep.energy = 0.0;
    plan.left_out.push_back({"sleep", why});
  }
  return plan;
}

}  // namespace gravitas::kernel
