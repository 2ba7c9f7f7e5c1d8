#include "services/edit/disturbance.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>

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

struct ChangedBodies {
  Ids all;
  Ids placed;  // of these who may now be where nothing was: new, moved, or of another shape
};

ChangedBodies changed_bodies(const EditedParts& parts) {
  const scene::v1::Environment &before = parts.before.environment(0), &after = parts.after.environment(0);
  ChangedBodies bodies{changed(before.space().bodies().body(), after.space().bodies().body()), parts.log.new_bodies};
  for (const auto& [id, motion] : parts.log.motions) {
    bodies.all.insert(id);
    if (motion.position || motion.orientation) bodies.placed.insert(id);
  }
  const Ids shapes = changed(parts.before.geometries().geometry(), parts.after.geometries().geometry());
  const Ids surfaces = changed(parts.before.materials().material(), parts.after.materials().material());
  const Ids forces = changed(parts.before.forces().force(), parts.after.forces().force());
  std::map<std::string, std::string> shape_before;
  for (const scene::v1::Body& body : before.space().bodies().body()) shape_before[body.id()] = body.geometry_id();
  for (const scene::v1::Body& body : after.space().bodies().body()) {
    const bool is_pushed = std::ranges::any_of(body.forces(), [&](const auto& id) { return forces.contains(id); });
    if (is_pushed || surfaces.contains(body.material())) bodies.all.insert(body.id());
    if (shapes.contains(body.geometry_id()) || shape_before[body.id()] != body.geometry_id())
      bodies.placed.insert(body.id());
  }
  bodies.all.insert(bodies.placed.begin(), bodies.placed.end());

  Ids joints = changed(before.constraints().constraint(), after.constraints().constraint());
  joints.insert(parts.log.new_joints.begin(), parts.log.new_joints.end());
  for (const scene::v1::Environment* one : {&before, &after})
    for (const scene::v1::Constraint& joint : one->constraints().constraint())
      if (joints.contains(joint.id())) bodies.all.insert({joint.body1(), joint.body2()});
  return bodies;
}

}  // namespace

std::vector<bool> find_disturbed(const EditedParts& parts, std::span<const std::uint32_t> contact_body,
                                 std::span<const std::uint32_t> intact) {
  const std::vector<kernel::BodyDescription>& bodies = parts.described.bodies;
  const ChangedBodies changes = changed_bodies(parts);
  const auto is_movable = [&](std::uint32_t body) { return (bodies[body].flags & kMovable) != 0; };
  // what moves is found by what it meets
  for (const kernel::BodyDescription& body : parts.next.bodies)
    if (changes.placed.contains(body.id) && (body.flags & kMovable) == 0) return std::vector<bool>(bodies.size(), true);
  std::vector<bool> disturbed(bodies.size());
  for (std::uint32_t i = 0; i < bodies.size(); ++i) disturbed[i] = changes.all.contains(bodies[i].id);
  const std::vector<bool> is_changed = disturbed;
  BodyUnion islands(bodies.size());
  for (std::size_t i = 0; i + 1 < contact_body.size(); i += 2) {
    const std::uint32_t a = contact_body[i], b = contact_body[i + 1];
    if (is_movable(a) && is_movable(b)) {
      islands.join(a, b);
    } else {
      const std::uint32_t moves = is_movable(a) ? a : b;
      disturbed[moves] = disturbed[moves] || is_changed[a] || is_changed[b];
    }
  }
  for (std::size_t j = 0; j < intact.size(); ++j) {
    const std::uint32_t a = parts.described.constraints[j].body1, b = parts.described.constraints[j].body2;
    if (intact[j] != 0 && a != kNone && b != kNone && is_movable(a) && is_movable(b)) islands.join(a, b);
  }
  std::set<std::uint32_t> roots;
  for (std::uint32_t i = 0; i < bodies.size(); ++i)
    if (disturbed[i]) roots.insert(islands.root(i));
  for (std::uint32_t i = 0; i < bodies.size(); ++i) disturbed[i] = roots.contains(islands.root(i));
  return disturbed;
}

}  // namespace gravitas
