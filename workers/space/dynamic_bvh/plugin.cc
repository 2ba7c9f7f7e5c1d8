// Space `DynamicBVH`: a hierarchy of bounding volumes over fat boxes, and the pairs of these kept from call to call
// (pair_finder.h, bounding_tree.h). The fast one, wherever bodies are and however they differ in size.
//
// Cost of a call, n bodies of which m left their fat boxes, p pairs: O(n + p) always (looking at every body, and at
// every candidate), and O(m log n) on the average for those. After a jump of many, O(n log n + p).
#include "plugin_sdk/plugin.h"

#include "workers/space/dynamic_bvh/pair_finder.h"
#include "workers/space/dynamic_bvh/ray_finder.h"

namespace gravitas {
namespace {

class DynamicBvhSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "DynamicBVH",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Hierarchy of bounding boxes, refitted as bodies move: the fast one for any mixture of sizes.",
            .capabilities = {"rays", "debug_geometry"}};
  }
  explicit DynamicBvhSpace(PropertyCursor) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    finder_.find(request, reply, host);
  }

  void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) override {
    ray_finder_.find(request, reply, host);
  }

  void debug_geometry(const stage::SpacePairsRequest& request, const stage::SpaceDebugGeometryReply& reply,
                      Host&) override {
    dynamic_bvh::write_nodes(request, reply);
  }

 private:
  dynamic_bvh::PairFinder finder_;
  dynamic_bvh::RayFinder ray_finder_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::DynamicBvhSpace)
