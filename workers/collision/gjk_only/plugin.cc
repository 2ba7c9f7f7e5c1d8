// Collision `GjkOnly`: every pair of convex shapes by support points alone, with no knowledge of any shape. Distance by
// Gilbert, Johnson and Keerthi, depth by an expanding polytope (plugin_sdk/geometry/penetration.h), contact points from
// support points in directions round the normal (sampled_map.h).
//
// To exchange for `Standard` and to check it by. Slower, and on round faces and edges that are nearly flush less even: a
// round end touches in at most eight fixed directions. Meshes and compounds are not known here.
#include "plugin_sdk/plugin.h"

#include <memory>
#include <string>
#include <vector>

#include "plugin_sdk/collision.h"
#include "plugin_sdk/geometry/contour_contacts.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "workers/collision/gjk_only/sampled_map.h"

namespace gravitas::gjk_only {
namespace {

using Kind = SceneShape::Kind;
using collision::Manifold;

struct ConvexShape {
  std::unique_ptr<SceneShape> shape;
  std::unique_ptr<SupportMap> exact;  // null: a half-space
  std::unique_ptr<SampledMap> sampled;
};

class GjkOnly final : public CollisionPlugin {
 public:
  static PluginDeclaration declaration() {
    PluginDeclaration declared{.name = "GjkOnly",
                               .version = "1.0",
                               .slot = Slot::kCollision,
                               .meaning = "Every convex shape by its support points alone.",
                               .types = scene_shape_types()};
    std::erase_if(declared.types,
                  [](const TypeDeclaration& type) { return type.name == "TriangleMesh" || type.name == "Compound"; });
    return declared;
  }
  explicit GjkOnly(PropertyCursor) {}

  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host& host) override {
    std::vector<ConvexShape> shapes;
    for (std::size_t i = 0; i < request.shape_type().size(); ++i) shapes.push_back(read(request, i));
    collision::check_bodies(request);
    const std::span<const std::uint32_t> pair = request.pair();
    const std::size_t pairs = pair.size() / 2;
    manifolds_.resize(pairs);
    host.parallel_for(pairs, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) {
        const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
        collide(shapes[request.body_shape()[a]], collision::geometry_pose(request, a), shapes[request.body_shape()[b]],
                collision::geometry_pose(request, b), request.margin(), &manifolds_[i]);
      }
    });
    for (std::size_t i = 0; i < pairs; ++i)
      for (int k = 0; k < manifolds_[i].count; ++k)
        collision::write_contact(request, reply, i, manifolds_[i].contacts[static_cast<std::size_t>(k)]);
  }

 private:
  static ConvexShape read(const stage::CollisionManifoldsRequest& request, std::size_t row) {
    std::string why;
    std::optional<SceneShape> shape =
        read_scene_shape(request.shape_type()[row], collision::shape_parameters(request, row), &why);
    const bool is_known = shape && shape->kind != Kind::kTriangleMesh && shape->kind != Kind::kCompound;
    if (shape && !is_known) why = "is of a type that this plugin does not know";
    if (!is_known) throw Refusal("shape " + std::to_string(row) + ": " + why);
    ConvexShape made{std::make_unique<SceneShape>(std::move(*shape)), nullptr, nullptr};
    made.exact = make_support_map(*made.shape);
    if (made.exact) made.sampled = std::make_unique<SampledMap>(*made.exact);
    return made;
  }

  static void collide(const ConvexShape& a, const Pose& X_WA, const ConvexShape& b, const Pose& X_WB, double margin,
                      Manifold* out) {
    out->count = 0;
    const Matrix3 R_WA = X_WA.orientation.toRotationMatrix(), R_WB = X_WB.orientation.toRotationMatrix();
    const Vector3 p_AB_W = X_WB.position - X_WA.position;
    if (!a.exact && !b.exact) return;
    if (!a.exact) {
      collision::collide_halfspace_support_map(R_WA.col(1), *b.sampled, R_WB, p_AB_W, margin, out);
      place(Matrix3::Identity(), X_WA.position, false, out);
    } else if (!b.exact) {
      collision::collide_halfspace_support_map(R_WB.col(1), *a.sampled, R_WA, -p_AB_W, margin, out);
      place(Matrix3::Identity(), X_WB.position, true, out);
    } else {
      const double reach = a.exact->radius() + b.exact->radius() + margin;
      if (!(p_AB_W.squaredNorm() <= reach * reach * (1.0 + 1e-12))) return;
      collision::collide_support_maps({*a.sampled, *b.sampled, R_WA.transpose() * R_WB, R_WA.transpose() * p_AB_W},
                                      margin, out);
      place(R_WA, X_WA.position, false, out);
    }
  }

  static void place(const Matrix3& R, const Vector3& p, bool is_reversed, Manifold* manifold) {
    for (int i = 0; i < manifold->count; ++i) {
      collision::ContactPoint& contact = manifold->contacts[static_cast<std::size_t>(i)];
      contact.point = p + R * contact.point;
      contact.normal = (is_reversed ? -1.0 : 1.0) * (R * contact.normal);
    }
  }

  // scratch, filled anew in every call
  std::vector<Manifold> manifolds_;
};

}  // namespace
}  // namespace gravitas::gjk_only

GRAVITAS_PLUGIN(gravitas::gjk_only::GjkOnly)
