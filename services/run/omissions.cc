#include "services/run/omissions.h"

#include <algorithm>
#include <span>
#include <vector>

#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/solver.h"

namespace gravitas {
namespace {

using kernel::BodyDescription;
using kernel::EnvironmentDescription;
using kernel::LeftOut;

// Rows of the materials that may meet, each pair once.
std::vector<std::span<const double>> meetings(const EnvironmentDescription& d) {
  const std::size_t count = d.material_count;
  std::vector<bool> movable(count, false), any(count, false);
  for (const BodyDescription& body : d.bodies) {
    if (body.shape == kNone) continue;
    any[body.material] = true;
    if ((body.flags & kMovable) != 0) movable[body.material] = true;
  }
  std::vector<std::span<const double>> rows;
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b)
      if (movable[a] && any[b])
        rows.push_back(std::span(d.material_pairs).subspan((a * count + b) * kMaterialColumns, kMaterialColumns));
  return rows;
}

bool is_round(const EnvironmentDescription& d) {
  return std::ranges::all_of(d.bodies, [&](const BodyDescription& body) {
    return body.shape == kNone || d.shapes[body.shape].type == "Sphere" || d.shapes[body.shape].type == "Halfspace";
  });
}

}  // namespace

std::vector<LeftOut> omissions(const kernel::Environment& environment, const EnvironmentDescription& d) {
  std::vector<LeftOut> all;
  const std::vector<kernel::PlannedSlot> slots = environment.plan().slots;
  const bool has_contacts = std::ranges::find(slots, Slot::kCollision, &kernel::PlannedSlot::slot) != slots.end();
  if (has_contacts) {
    const std::vector<std::span<const double>> rows = meetings(d);
    const auto none_has = [&](std::initializer_list<MaterialColumn> columns) {
      return std::ranges::all_of(rows, [&](std::span<const double> row) {
        return std::ranges::all_of(columns, [&](MaterialColumn column) { return row[column] == 0.0; });
      });
    };
    if (none_has({kStaticFriction, kDynamicFriction}))
      all.push_back({"friction", "no two materials that may meet have friction: contacts are one row each"});
    if (none_has({kRollingFriction, kSpinningFriction}))
      all.push_back({"rolling friction", "no two materials that may meet have rolling or spinning friction"});
    if (none_has({kSurfacePerturbation}))
      all.push_back({"surface perturbation", "no material has any: nothing is drawn"});
    if (is_round(d))
      all.push_back(
          {"manifolds", "all shapes are spheres or half-spaces: one contact a pair, bounds that do not turn"});
    if (d.simulator != kernel::Simulator::kContinuous)
      all.push_back({"times of impact", "the simulator stops at none"});
  }
  if (d.check_physics_every == 0)
    all.push_back({"physics checks", "CheckPhysicsEvery is 0: answers are checked for form and numbers"});
  return all;
}

}  // namespace gravitas
