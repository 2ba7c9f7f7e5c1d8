// Collision `MyName`: balls and half-spaces, one contact a pair, in closed form (my_name.h).
//
// A plugin is a class derived from the base of its slot. It declares itself once, receives a request as columns, and fills
// the columns of the reply. The answer depends on the request and the settings alone: the same request gives the same
// bytes, so keep nothing between calls but caches that can be made again (plugin_sdk/shape_cache.h, for shapes that are
// dear to make).
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "my_name.h"
#include "plugin_sdk/collision.h"
#include "plugin_sdk/geometry/scene_shape.h"

namespace {

using namespace gravitas;
using Kind = SceneShape::Kind;

bool is_known(Kind kind) { return kind == Kind::kSphere || kind == Kind::kHalfspace; }

class MyNamePlugin final : public CollisionPlugin {
 public:
  // Shapes of the scene language are declared as it has them; a scene with others is refused by their names. Times of
  // impact, rays and outlines are capabilities, and methods, of their own: plugin_sdk/plugin.h.
  static PluginDeclaration declaration() {
    PluginDeclaration declared{.name = "MyName",
                               .version = "1.0",
                               .slot = Slot::kCollision,
                               .meaning = "Balls and half-spaces, in closed form."};
    for (const Kind kind : {Kind::kSphere, Kind::kHalfspace})
      declared.types.push_back(scene_shape_types()[static_cast<std::size_t>(kind)]);
    return declared;
  }

  // Settings, PluginDeclaration::properties, would be read here; this one has none.
  explicit MyNamePlugin(PropertyCursor) {}

  // The question of the slot: the contacts of the pairs, in their order, as far as their surfaces are no further apart than
  // the margin (schemas/gravitas/stage/v1/collision.proto). What is impossible is refused with the reason.
  void manifolds(const stage::CollisionManifoldsRequest& request, const stage::CollisionManifoldsReply& reply,
                 Host& host) override {
    const std::vector<SceneShape> shapes = read_shapes(collision::shapes_of(request));
    collision::check_request(request);
    const collision::BodyColumns bodies = collision::bodies_of(request);
    for (std::size_t pair = 0; pair < request.pair().size() / 2; ++pair) {
      // prolongs the deadline of the call where there is much to do
      if (pair % 1024 == 0) host.mark_progress();
      const std::uint32_t a = request.pair()[2 * pair], b = request.pair()[2 * pair + 1];
      const std::optional<collision::ContactPoint> contact =
          touch(shapes[bodies.body_shape[a]], bodies.placed(a), shapes[bodies.body_shape[b]], bodies.placed(b));
      if (contact && contact->depth >= -request.margin()) collision::write_contact(request, reply, pair, *contact);
    }
  }

 private:
  static std::vector<SceneShape> read_shapes(const collision::ShapeColumns& columns) {
    std::vector<SceneShape> shapes;
    for (std::size_t i = 0; i < columns.shape_type.size(); ++i) {
      std::string why;
      std::optional<SceneShape> shape = read_scene_shape(columns.shape_type[i], columns.parameters(i), &why);
      if (shape && !is_known(shape->kind)) why = "is of a type that this plugin does not know";
      if (!why.empty() || !shape) throw Refusal("shape " + std::to_string(i) + ": " + why);
      shapes.push_back(std::move(*shape));
    }
    return shapes;
  }

  // `X`: the frames of the shapes in the world.
  static std::optional<collision::ContactPoint> touch(const SceneShape& a, const Pose& X_WA, const SceneShape& b,
                                                      const Pose& X_WB) {
    if (a.is_unbounded() && b.is_unbounded()) return std::nullopt;
    if (!a.is_unbounded() && !b.is_unbounded())
      return plain::touch_of_balls(X_WA.position, a.size.x(), X_WB.position, b.size.x());
    if (a.is_unbounded())
      return plain::touch_of_halfspace(X_WA.position, X_WA.orientation * Vector3::UnitY(), X_WB.position, b.size.x());
    // the same the other way round: the normal is from a to b
    collision::ContactPoint contact =
        plain::touch_of_halfspace(X_WB.position, X_WB.orientation * Vector3::UnitY(), X_WA.position, a.size.x());
    contact.normal = -contact.normal;
    return contact;
  }
};

}  // namespace

GRAVITAS_PLUGIN(MyNamePlugin)
