// Collision `Standard` (§ 4.3): every shape of the scene language; see narrow_phase.h for the methods.
//
// Pairs are computed on the host's threads, each into its own place, and written in order; in between contacts over seams
// are mended (seams.h), which is all that a pair knows of others.
#include "plugin_sdk/plugin.h"

#include <optional>
#include <vector>

#include "plugin_sdk/collision.h"
#include "workers/collision/standard/moving_pairs.h"
#include "workers/collision/standard/narrow_phase.h"
#include "workers/collision/standard/seams.h"
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
            .capabilities = {"times_of_impact", "rays", "debug_geometry"},
            .types = declared_shapes()};
  }
  explicit Standard(PropertyCursor) {}

  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host& host) override {
    const std::vector<Shape>& shapes = store_.read(shapes_of(request));
    check_request(request);
    const BodyColumns bodies = bodies_of(request);
    const std::span<const std::uint32_t> pair = request.pair();
    const std::size_t pairs = pair.size() / 2;
    if (contacts_.size() < pairs) contacts_.resize(pairs);
    host.parallel_for(pairs, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) {
        const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
        collide(shapes[bodies.body_shape[a]], bodies.placed(a), shapes[bodies.body_shape[b]], bodies.placed(b),
                request.margin(), &contacts_[i]);
      }
    });
    seams_.mend(shapes, bodies, pair, request.margin(), {contacts_.data(), pairs});
    for (std::size_t i = 0; i < pairs; ++i)
      for (std::size_t k = 0; k < contacts_[i].size(); ++k) write_contact(request, reply, i, contacts_[i][k]);
  }

  void times_of_impact(const stage::CollisionTimesOfImpactRequest& request,
                       const stage::CollisionTimesOfImpactReply& reply, Host& host) override {
    const std::vector<Shape>& shapes = store_.read(shapes_of(request));
    check_request(request);
    const BodyColumns bodies = bodies_of(request);
    const std::span<const std::uint32_t> pair = request.pair();
    impacts_.assign(pair.size() / 2, std::nullopt);
    const auto moving = [&](std::uint32_t body) {
      return MovingBody{bodies.geometry(body), bodies.pose(body), motion_of(request, body)};
    };
    host.parallel_for(impacts_.size(), [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) {
        const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
        impacts_[i] = first_impact(shapes[bodies.body_shape[a]], moving(a), shapes[bodies.body_shape[b]], moving(b),
                                   request.target_gap());
      }
    });
    for (std::size_t i = 0; i < impacts_.size(); ++i)
      if (impacts_[i]) write_impact(reply, i, *impacts_[i]);
  }

  void rays(const stage::CollisionRaysRequest& request, const stage::CollisionRaysReply& reply, Host& host) override {
    const std::vector<Shape>& shapes = store_.read(shapes_of(request));
    check_request(request);
    const BodyColumns bodies = bodies_of(request);
    const std::span<const std::uint32_t> candidate = request.candidate();
    hits_.assign(candidate.size() / 2, std::nullopt);
    host.parallel_for(hits_.size(), [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i)
        hits_[i] = cast_ray(shapes[bodies.body_shape[candidate[2 * i + 1]]], bodies.placed(candidate[2 * i + 1]),
                            ray_of(request, candidate[2 * i]));
    });
    for (std::size_t i = 0; i < hits_.size(); ++i)
      if (hits_[i]) write_hit(reply, i, *hits_[i]);
  }

  // Asked seldom, and once of each shape: nothing is kept.
  void debug_geometry(const stage::CollisionDebugGeometryRequest& request,
                      const stage::CollisionDebugGeometryReply& reply, Host& host) override {
    check_request(request);
    const ShapeColumns shapes = shapes_of(request);
    for (std::size_t i = 0; i < shapes.shape_type.size(); ++i) {
      host.mark_progress();
      const StoredShape stored = read_shape(shapes.shape_type[i], shapes.parameters(i), i);
      if (stored.scene_shape) {
        write_debug_geometry(request, reply, i, *stored.scene_shape);
      } else if ((request.kinds() & kOutlines) != 0) {
        std::vector<LineSegment> lines;
        append_outline(*stored.map, {}, &lines);
        write_outline(reply, i, lines);
      }
    }
  }

 private:
  ShapeStore store_;
  // scratch, filled anew in every call
  std::vector<ContactList> contacts_;
  Seams seams_;
  std::vector<std::optional<Impact>> impacts_;
  std::vector<std::optional<RayHit>> hits_;
};

}  // namespace
}  // namespace gravitas::collision

GRAVITAS_PLUGIN(gravitas::collision::Standard)
