// The pairs of bodies from call to call.
//
//   bounds that left their fat box  -->  boxes of the tree  -->  candidates  -->  the rule  -->  answer
//     (of most bodies: none)             (refitted)             (pairs whose       (asked again where
//                                                               fat boxes overlap)  bounds changed)
//
// A body's fat box is its bounds, wider by a share of their extent all around and by some calls' motion ahead. While
// bounds stay in it, nothing is done for the body but to look. As bounds lie in fat boxes, every pair of the answer is a
// candidate, and the answer is what the rule leaves of these: it does not depend on when a fat box was made.
//
// Bodies with new fat boxes are fresh: the candidates of a few are kept apart from those of all others, so that these
// need not be touched; those of many are merged into them.
//
// Everything is built anew when the bodies' number, flags or filters differ from the last call's, when many left their
// fat boxes at once, or when the tree's boxes have together grown to twice what they were when it was built.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/space.h"
#include "workers/space/dynamic_bvh/bounding_tree.h"

namespace gravitas::dynamic_bvh {

class PairFinder {
 public:
  void find(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host);

 private:
  // Bounds are not those of the last call; candidates stand in fresh_.
  static constexpr std::uint8_t kChanged = 1, kFresh = 2;

  // Where a fat box was made.
  struct Birth {
    Box bounds;
    std::uint64_t call = 0;
  };

  bool is_other_scene(const stage::SpacePairsRequest& request) const;
  // Marks the bodies whose bounds are not bit for bit those of the last call; false if there are none.
  bool take_bounds(const stage::SpacePairsRequest& request);
  // True if everything must be built anew, for a body left its fat box that has no place in the tree, or many did.
  bool look_for_moved(const stage::SpacePairsRequest& request, const PairRule& rule);
  void build(const stage::SpacePairsRequest& request, const PairRule& rule);
  void update(const stage::SpacePairsRequest& request, const PairRule& rule);
  void note_change(std::uint32_t body);
  void find_fresh(const PairRule& rule);
  Box fat_box(std::uint32_t body, const Box& bounds);
  void find_candidates(const PairRule& rule);
  // Candidates of two bodies that did not move, and those found.
  void merge_found();
  // The rule over all candidates, and over outsiders with all.
  void find_pairs(const stage::SpacePairsRequest& request, const PairRule& rule, Host& host);
  void make_room(std::size_t pairs);
  // Appends those of candidates [i, end) that are pairs.
  void add_pairs(const stage::SpacePairsRequest& request, std::uint64_t i, std::uint64_t end);

  std::uint64_t call_ = 0;
  // the scene of the last build
  std::vector<std::uint32_t> flags_;
  std::vector<std::uint64_t> group_, mask_;
  // of the last call: while no bounds change, its answer is the next one's
  std::vector<double> lower_, upper_;
  std::vector<std::uint32_t> changed_bodies_, fresh_bodies_;
  std::vector<std::uint8_t> state_;  // by body: kChanged, kFresh
  std::vector<std::uint32_t> pairs_;
  std::size_t pair_end_ = 0;  // in pairs_, which never shrinks
  double edges_at_build_ = 0.0;
  double mean_extent_ = 0.0;  // m
  // by body
  std::vector<Box> fat_;
  std::vector<Birth> birth_;
  std::vector<std::uint8_t> has_moved_;
  // bodies that the tree does not hold: tested against all
  std::vector<std::uint32_t> outsiders_;
  BoundingTree tree_;
  // candidates of body a stand at begin_[a] … begin_[a + 1]: a | b << 32, ascending in b > a; those with fresh bodies do not
  // count
  std::vector<std::uint64_t> begin_;
  std::vector<std::uint64_t> candidate_;
  std::vector<std::uint8_t> overlaps_;  // whether the candidate's bounds overlap
  std::vector<std::uint64_t> fresh_;    // candidates with fresh bodies, a << 32 | b, ascending
  // scratch
  std::vector<std::uint32_t> moved_, members_;
  PairList found_;
  std::vector<std::uint64_t> next_begin_;
  std::vector<std::uint64_t> next_candidate_;
  std::vector<std::uint8_t> next_overlaps_;
};

}  // namespace gravitas::dynamic_bvh
