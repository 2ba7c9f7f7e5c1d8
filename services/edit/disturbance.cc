#include "services/edit/disturbance.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

#include "plugin_sdk/local_bound.h"
#include "plugin_sdk/solver/islands.h"

namespace gravitas {
namespace {

using Ids = std::set<std::string>;

// Elements that are in one of the lists alone, or say something else there.
template <typename Elements>
Ids changed(const Elements& before, const Elements& after) {
  std::map<std::string, std::string> texts;
  for (const auto& one : before) texts[one.id()] = one.SerializeAsString();
  Ids ids;
  for (const auto& one : after) {
    const auto found = texts.find(one.id());
    if (found == texts.end() || found->second != one.SerializeAsString()) ids.insert(one.id());
    if (found != texts.end()) texts.erase(found);
  }
  for (const auto& [id, text] : texts) ids.insert(id);
  return ids;
}

// As built: a compound has in it what it names.
Ids changed_shapes(const std::vector<kernel::ShapeDescription>& before,
                   const std::vector<kernel::ShapeDescription>& after) {
  Ids ids;
  for (const kernel::ShapeDescription& one : after) {
    const auto old = std::ranges::find(before, one.id, &kernel::ShapeDescription::id);
    if (old == before.end() || old->type != one.type || old->parameters != one.parameters) ids.insert(one.id);
  }
  return ids;
}

struct ChangedBodies {
  Ids all;
  Ids placed;  // of these who may now meet others: new, moved, of another shape, or in other groups
};

ChangedBodies changed_bodies(const EditedParts& parts) {
  const scene::v1::Environment &before = parts.before.environment(0), &after = parts.after.environment(0);
  ChangedBodies bodies{changed(before.space().bodies().body(), after.space().bodies().body()), parts.log.new_bodies};
  for (const auto& [id, motion] : parts.log.motions) {
    bodies.all.insert(id);
    if (motion.position || motion.orientation) bodies.placed.insert(id);
  }
  const Ids shapes = changed_shapes(parts.described.shapes, parts.next.shapes);
  const Ids surfaces = changed(parts.before.materials().material(), parts.after.materials().material());
  const Ids forces = changed(parts.before.forces().force(), parts.after.forces().force());
  std::map<std::string, const scene::v1::Body*> body_before;
  for (const scene::v1::Body& body : before.space().bodies().body()) body_before[body.id()] = &body;
  for (const scene::v1::Body& body : after.space().bodies().body()) {
    const bool is_pushed = std::ranges::any_of(body.forces(), [&](const auto& id) { return forces.contains(id); });
    if (is_pushed || surfaces.contains(body.material())) bodies.all.insert(body.id());
    const auto old = body_before.find(body.id());
    const bool meets_others = old == body_before.end() || old->second->geometry_id() != body.geometry_id() ||
                              !std::ranges::equal(old->second->collision_groups(), body.collision_groups());
    if (meets_others || shapes.contains(body.geometry_id())) bodies.placed.insert(body.id());
  }
  bodies.all.insert(bodies.placed.begin(), bodies.placed.end());
  // who a force names, too, as a spring its other end
  for (const kernel::EnvironmentDescription* one : {&parts.described, &parts.next})
    for (const kernel::BodyDescription& body : one->bodies)
      if (std::ranges::any_of(body.forces, [&](std::uint32_t row) { return forces.contains(one->forces[row].id); }))
        bodies.all.insert(body.id);

  Ids joints = changed(before.constraints().constraint(), after.constraints().constraint());
  joints.insert(parts.log.new_joints.begin(), parts.log.new_joints.end());
  for (const scene::v1::Environment* one : {&before, &after})
    for (const scene::v1::Constraint& joint : one->constraints().constraint())
      if (joints.contains(joint.id())) bodies.all.insert({joint.body1(), joint.body2()});
  return bodies;
}

// Bodies that may move and whose bounds meet, where the edit leaves them, those of `placed` bodies that may not.
Ids met_in_place(const EditedParts& parts, const Ids& placed) {
  const std::vector<kernel::BodyDescription>& bodies = parts.next.bodies;
  std::vector<LocalBound> all;
  for (const kernel::BodyDescription& body : bodies) all.push_back(body.bound);
  const double margin = contact_margin(all);
  std::vector<Bounds> supports;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if ((bodies[i].flags & kMovable) == 0 && bodies[i].shape != kNone && placed.contains(bodies[i].id))
      supports.push_back(widened(bounds_of(bodies[i].bound, parts.places[i]), margin));
  Ids met;
  for (std::size_t i = 0; i < bodies.size() && !supports.empty(); ++i) {
    if ((bodies[i].flags & kMovable) == 0 || bodies[i].shape == kNone) continue;
    const Bounds own = bounds_of(bodies[i].bound, parts.places[i]);
    const auto meets = [&](const Bounds& other) {
      return (own.lower.array() <= other.upper.array()).all() && (other.lower.array() <= own.upper.array()).all();
    };
    if (std::ranges::any_of(supports, meets)) met.insert(bodies[i].id);
  }
  return met;
}

}  // namespace

std::vector<bool> find_disturbed(const EditedParts& parts, std::span<const std::uint32_t> contact_body,
                                 std::span<const std::uint32_t> intact) {
  const std::vector<kernel::BodyDescription>& bodies = parts.described.bodies;
  const ChangedBodies changes = changed_bodies(parts);
  const auto is_movable = [&](std::uint32_t body) { return (bodies[body].flags & kMovable) != 0; };
  const Ids met = met_in_place(parts, changes.placed);
  std::vector<bool> disturbed(bodies.size());
  for (std::uint32_t i = 0; i < bodies.size(); ++i) disturbed[i] = changes.all.contains(bodies[i].id);
  const std::vector<bool> is_changed = disturbed;
  BodyUnion islands(bodies.size());
  const auto join = [&](std::uint32_t a, std::uint32_t b) {
    if (a == kNone || b == kNone) return;
    if (is_movable(a) && is_movable(b)) {
      islands.join(a, b);
    } else {
      const std::uint32_t moves = is_movable(a) ? a : b;
      disturbed[moves] = disturbed[moves] || is_changed[a] || is_changed[b];
    }
  };
  for (std::uint32_t i = 0; i < bodies.size(); ++i) disturbed[i] = disturbed[i] || met.contains(bodies[i].id);
  for (std::size_t i = 0; i + 1 < contact_body.size(); i += 2) join(contact_body[i], contact_body[i + 1]);
  for (std::size_t j = 0; j < intact.size(); ++j)
    if (intact[j] != 0) join(parts.described.constraints[j].body1, parts.described.constraints[j].body2);
  std::set<std::uint32_t> roots;
  for (std::uint32_t i = 0; i < bodies.size(); ++i)
    if (disturbed[i]) roots.insert(islands.root(i));
  for (std::uint32_t i = 0; i < bodies.size(); ++i) disturbed[i] = roots.contains(islands.root(i));
  return disturbed;
}

}  // namespace gravitas
