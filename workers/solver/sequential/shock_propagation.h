// A start for the relaxation of contacts, layer by layer: shock propagation, with the momentum kept.
//
//   up      layer 1 stands on what nothing pushes, layer k on layer k - 1. Each layer is relaxed against the one
//           below as if that were immovable with the velocity it has just been given: w, what the bodies end up with.
//   down    from the highest layer on, each is relaxed against the one below moving with its w, and hands the
//           reaction on: so every layer is relaxed under all that rests on it.
//
// Known from the literature is the upward pass alone, done last: bodies below are frozen and get no reaction, so that
// a stack stands, but no impulse knows of more than one layer's weight, and momentum is made from nothing. Here
// v_{n+1} = v* + M^-1 J^T lambda holds as always, and the sweeps that follow look at all bodies as they are: what
// layers get wrong (bodies that push sideways, joints, impacts that run back) they put right. A stack of boxes is exact
// at once, at any ratio of mass. Layers are those of the contact graph, not of gravity's direction; what hangs in the
// air is in none.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

// Layer of each body from the blocks of `contacts`: 0 for what nothing pushes, kNone where no way leads there.
template <typename Contacts>
std::vector<std::uint32_t> layers_of(const SolverBodies& bodies, const Contacts& contacts) {
  std::vector<std::uint32_t> layer(bodies.count() + 1, kNone);
  for (std::uint32_t i = 0; i < layer.size(); ++i)
    if (!bodies[i].is_pushed()) layer[i] = 0;
  std::vector<std::uint32_t> found = {0};
  for (std::uint32_t next = 1; !found.empty(); ++next) {
    found.clear();
    for (std::size_t block = 0; block < contacts.block_count(); ++block) {
      if (!contacts.holds(block)) continue;
      const auto [body1, body2] = contacts.bodies_of(block);
      if (layer[body1] == next - 1 && layer[body2] == kNone) found.push_back(body2);
      if (layer[body2] == next - 1 && layer[body1] == kNone) found.push_back(body1);
    }
    for (const std::uint32_t body : found) layer[body] = next;
  }
  return layer;
}

// True of contacts by which each body that rests does so on one other, and not all on the ground: of stacks, where layers
// are the solution and no start only.
template <typename Contacts>
bool is_stack(const SolverBodies& bodies, const Contacts& contacts) {
  if (contacts.block_count() > bodies.count()) return false;
  const std::vector<std::uint32_t> layer = layers_of(bodies, contacts);
  std::uint32_t highest = 0;
  std::size_t resting = 0, borne = 0;
  for (const std::uint32_t k : layer) {
    if (k == 0 || k == kNone) continue;
    highest = std::max(highest, k);
    ++resting;
  }
  for (std::size_t block = 0; block < contacts.block_count(); ++block) {
    const auto [body1, body2] = contacts.bodies_of(block);
    borne += layer[body1] != kNone && layer[body2] != kNone ? 1 : 0;
  }
  return highest > 1 && borne == resting;
}

// Sets the multipliers of `contacts` (ContactGaps or ContactImpulses) and adds what they do to x, in which no contact has
// been pushed yet. A layer is relaxed until it changes by no more than `tolerance`, or kMostVisits times.
template <typename Contacts>
void start_by_layers(const SolverBodies& bodies, double tolerance, Contacts* contacts, BodyMotion* x) {
  constexpr int kMostVisits = 50;
  const auto count = static_cast<std::uint32_t>(bodies.count() + 1);
  const std::vector<std::uint32_t> layer = layers_of(bodies, *contacts);

  // a twin of each body that nothing pushes, `count` rows further on, is what those above see of it
  const SolverBodies doubled = bodies.with_immovable_twins();
  contacts->clear_multipliers();
  Contacts from_above = *contacts;
  std::vector<std::vector<std::uint32_t>> blocks;
  for (std::size_t block = 0; block < contacts->block_count(); ++block) {
    const auto [body1, body2] = contacts->bodies_of(block);
    if (layer[body1] == kNone || layer[body2] == kNone) continue;
    const std::uint32_t upper = std::max(layer[body1], layer[body2]);
    if (blocks.size() <= upper) blocks.resize(upper + 1);
    blocks[upper].push_back(static_cast<std::uint32_t>(block));
    if (layer[body1] != layer[body2]) from_above.replace_body(block, layer[body1] < layer[body2] ? 0 : 1, count);
  }
  from_above.set_responses(doubled);

  BodyMotion seen = *x;
  seen.insert(seen.end(), x->begin(), x->end());
  const auto relax = [&](const std::vector<std::uint32_t>& layer_blocks) {
    for (int visit = 0; visit < kMostVisits; ++visit) {
      double change = 0.0;
      for (const std::uint32_t block : layer_blocks)
        change = std::max(change, from_above.relax(block, 1.0, doubled, seen));
      if (change <= tolerance) return;
    }
  };
  for (std::uint32_t k = 1; k < blocks.size(); ++k) {
    relax(blocks[k]);
    for (std::uint32_t i = 0; i < count; ++i)
      if (layer[i] == k) seen[count + i] = seen[i];
  }

  std::copy(x->begin(), x->end(), seen.begin());
  from_above.clear_multipliers();
  for (std::size_t k = blocks.size(); k-- > 1;) {
    relax(blocks[k]);
    for (const std::uint32_t block : blocks[k]) {
      contacts->take_block(block, from_above);
      const auto [body1, body2] = contacts->bodies_of(block);
      if (layer[body1] == layer[body2]) continue;
      // on the lower body alone: the upper one has had it
      const std::uint32_t upper = layer[body1] < layer[body2] ? body2 : body1;
      const Twist had = seen[upper];
      contacts->push_block(block, bodies, seen);
      seen[upper] = had;
    }
  }
  contacts->push_all(bodies, *x);
}

}  // namespace gravitas
