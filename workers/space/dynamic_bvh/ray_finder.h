// The bodies whose bounds rays meet, by a tree over the bounds themselves: for batches of rays, and for one batch after
// the other while no body moves. Made anew, O(n log n), when bounds or flags differ from the last call's.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/ray_rule.h"
#include "workers/space/dynamic_bvh/bounding_tree.h"

namespace gravitas::dynamic_bvh {

class RayFinder {
 public:
  void find(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host);

 private:
  void build(const stage::SpaceRaysRequest& request);

  // of the last build
  std::vector<double> lower_, upper_;
  std::vector<std::uint32_t> flags_;
  BoundingTree tree_;
  std::vector<std::uint32_t> outsiders_;  // that the tree does not hold
  // scratch
  std::vector<std::uint32_t> found_;
};

// The tree over the bounds of a request, made anew.
void write_nodes(const stage::SpacePairsRequest& request, const stage::SpaceDebugGeometryReply& reply);

}  // namespace gravitas::dynamic_bvh
