// Collision `Standard` (§ 4.3): every shape of the scene language; see narrow_phase.h for the methods.
//
// Pairs are independent of each other, so they are computed on the host's threads, each into its
// own place, and written in order.
#include "plugin_sdk/plugin.h"

#include <vector>

#include "plugin_sdk/collision.h"
#include "workers/collision/standard/narrow_phase.h"
#include "workers/collision/standard/shape_store.h"

namespace gravitas::collision {
namespace {

class Standard final : public CollisionPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Standard",
            .version = "2.0",
            .slot = Slot::kCollision,
            .meaning =
                "Closed forms where there are any, separating axes and clipping, distance and expanding polytopes "
                "elsewhere.",
            .types = declared_shapes()};
  }
  explicit Standard(PropertyCursor) {}

  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host& host) override {
    const std::vector<Shape>& shapes = store_.read(request);
    check_bodies(request);
    const std::span<const std::uint32_t> pair = request.pair();
    const std::size_t pairs = pair.size() / 2;
    if (contacts_.size() < pairs) contacts_.resize(pairs);
    host.parallel_for(pairs, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) {
        const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
        collide(shapes[request.body_shape()[a]], geometry_pose(request, a), shapes[request.body_shape()[b]],
                geometry_pose(request, b), request.margin(), &contacts_[i]);
      }
    });
    for (std::size_t i = 0; i < pairs; ++i)
      for (std::size_t k = 0; k < contacts_[i].size(); ++k) write_contact(request, reply, i, contacts_[i][k]);
  }

 private:
  ShapeStore store_;
  // scratch, filled anew in every call
  std::vector<ContactList> contacts_;
};

}  // namespace
}  // namespace gravitas::collision

GRAVITAS_PLUGIN(gravitas::collision::Standard)
