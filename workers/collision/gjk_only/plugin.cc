// Collision `GjkOnly`: every pair of convex shapes by support points alone, with no knowledge of any shape. Distance by
// Gilbert, Johnson and Keerthi, depth by an expanding polytope (plugin_sdk/geometry/penetration.h), contact points from
// support points in directions round the normal (sampled_map.h).
//
// To exchange for `Standard` and to check it by. Slower, and on round faces and edges that are nearly flush less even: a
// round end touches in at most eight fixed directions. Meshes and compounds are not known here.
#include "plugin_sdk/plugin.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plugin_sdk/collision.h"
#include "plugin_sdk/geometry/contour_contacts.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/shape_cache.h"
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
                               .version = "1.1",
                               .slot = Slot::kCollision,
                               .meaning = "Every convex shape by its support points alone.",
                               .capabilities = {"times_of_impact", "rays", "debug_geometry"},
                               .types = scene_shape_types()};
    std::erase_if(declared.types,
                  [](const TypeDeclaration& type) { return type.name == "TriangleMesh" || type.name == "Compound"; });
    return declared;
  }
  explicit GjkOnly(PropertyCursor) {}

  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host& host) override {
    const Question asked = read(request);
    const std::span<const std::uint32_t> pair = request.pair();
    const std::size_t pairs = pair.size() / 2;
    manifolds_.resize(pairs);
    host.parallel_for(pairs, [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i) {
        const std::uint32_t a = pair[2 * i], b = pair[2 * i + 1];
        collide(asked.shape_of(a), asked.bodies.placed(a), asked.shape_of(b), asked.bodies.placed(b), request.margin(),
                &manifolds_[i]);
      }
    });
    for (std::size_t i = 0; i < pairs; ++i)
      for (int k = 0; k < manifolds_[i].count; ++k)
        collision::write_contact(request, reply, i, manifolds_[i].contacts[static_cast<std::size_t>(k)]);
  }

  void times_of_impact(const stage::CollisionTimesOfImpactRequest& request,
                       const stage::CollisionTimesOfImpactReply& reply, Host& host) override {
    const Question asked = read(request);
    const std::span<const std::uint32_t> pair = request.pair();
    impacts_.assign(pair.size() / 2, std::nullopt);
    const auto moving = [&](std::uint32_t body) {
      return MovingSolid{asked.shape_of(body).exact.get(), asked.bodies.geometry(body), asked.bodies.pose(body),
                         collision::motion_of(request, body)};
    };
    host.parallel_for(impacts_.size(), [&](std::uint64_t begin, std::uint64_t end) {
      for (std::uint64_t i = begin; i < end; ++i)
        impacts_[i] = first_impact(moving(pair[2 * i]), moving(pair[2 * i + 1]), request.target_gap());
    });
    for (std::size_t i = 0; i < impacts_.size(); ++i)
      if (impacts_[i]) collision::write_impact(reply, i, *impacts_[i]);
  }

  void rays(const stage::CollisionRaysRequest& request, const stage::CollisionRaysReply& reply, Host&) override {
    const Question asked = read(request);
    const std::span<const std::uint32_t> candidate = request.candidate();
    for (std::size_t i = 0; i < candidate.size() / 2; ++i) {
      const std::uint32_t body = candidate[2 * i + 1];
      const Pose placed = asked.bodies.placed(body);
      const Ray ray = ray_in(placed, collision::ray_of(request, candidate[2 * i]));
      const ConvexShape& shape = asked.shape_of(body);
      const std::optional<RayHit> hit = shape.exact ? cast_ray(*shape.exact, ray) : cast_ray(*shape.shape, ray);
      if (hit) collision::write_hit(reply, i, hit_from(placed, *hit));
    }
  }

  void debug_geometry(const stage::CollisionDebugGeometryRequest& request,
                      const stage::CollisionDebugGeometryReply& reply, Host&) override {
    collision::check_request(request);
    const collision::ShapeColumns shapes = collision::shapes_of(request);
    for (std::size_t i = 0; i < shapes.shape_type.size(); ++i)
      collision::write_debug_geometry(request, reply, i, *make(shapes.shape_type[i], shapes.parameters(i), i).shape);
  }

 private:
  // The shapes and bodies of a request, checked.
  struct Question {
    std::vector<const ConvexShape*> shapes;
    collision::BodyColumns bodies;
    const ConvexShape& shape_of(std::uint32_t body) const { return *shapes[bodies.body_shape[body]]; }
  };
  template <typename Request>
  Question read(const Request& request) {
    const collision::ShapeColumns columns = collision::shapes_of(request);
    Question question{{}, collision::bodies_of(request)};
    kept_.begin();
    for (std::size_t i = 0; i < columns.shape_type.size(); ++i) {
      const std::span<const double> parameters = columns.parameters(i);
      question.shapes.push_back(&kept_.get(columns.shape_hash[i], columns.shape_type[i], parameters.size(),
                                           [&] { return make(columns.shape_type[i], parameters, i); }));
    }
    kept_.end();
    collision::check_request(request);
    return question;
  }

  static ConvexShape make(std::uint64_t type, std::span<const double> parameters, std::size_t row) {
    std::string why;
    std::optional<SceneShape> shape = read_scene_shape(type, parameters, &why);
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

  ShapeCache<ConvexShape> kept_;
  // scratch, filled anew in every call
  std::vector<Manifold> manifolds_;
  std::vector<std::optional<Impact>> impacts_;
};

}  // namespace
}  // namespace gravitas::gjk_only

GRAVITAS_PLUGIN(gravitas::gjk_only::GjkOnly)
