#include "kernel/plan.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

namespace gravitas::kernel {
namespace {

constexpr double kMarginShare = 0.01;

// Two bodies can touch if both have a shape, one can be pushed, and their filters let them.
bool can_any_touch(const EnvironmentDescription& d) {
  // bodies that differ in nothing that matters here count once
  struct Kind {
    std::uint32_t flags;
    std::uint64_t group, mask;
    int count;
  };
  std::vector<Kind> kinds;
  for (const BodyDescription& body : d.bodies) {
    if ((body.flags & kHasShape) == 0) continue;
    const auto same = std::ranges::find_if(kinds, [&](const Kind& kind) {
      return kind.flags == body.flags && kind.group == body.filter_group && kind.mask == body.filter_mask;
    });
    if (same != kinds.end()) {
      ++same->count;
    } else {
      kinds.push_back({body.flags, body.filter_group, body.filter_mask, 1});
    }
  }
  for (const Kind& a : kinds) {
    for (const Kind& b : kinds) {
      if (&a == &b && a.count < 2) continue;
      if (((a.flags | b.flags) & kMovable) != 0 && (a.group & b.mask) != 0 && (b.group & a.mask) != 0) return true;
    }
  }
  return false;
}

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

}  // namespace

double contact_margin(const EnvironmentDescription& d) {
  double smallest = std::numeric_limits<double>::max();
  for (const BodyDescription& body : d.bodies) {
    if (body.bound.kind == BoundKind::kSphere) smallest = std::min(smallest, body.bound.half_extents.x());
    if (body.bound.kind == BoundKind::kBox) smallest = std::min(smallest, body.bound.half_extents.minCoeff());
  }
  return smallest == std::numeric_limits<double>::max() ? 0.0 : kMarginShare * smallest;
}

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

  const bool has_contacts = can_any_touch(*d);
  if (d->simulator == Simulator::kSmooth && has_contacts)
    throw std::invalid_argument(
        "the simulator Smooth moves bodies that cannot touch, and some of these can: leave out their geometry, forbid "
        "the pairs in CollisionFilter, or use the simulator Basic");
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
  return plan;
}

}  // namespace gravitas::kernel
