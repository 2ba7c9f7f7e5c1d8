// A ball joint that refuses, where a scene says how far its first body may go, all that is further from where that was bound:
// it knows the frame of the world.
#include <cmath>

#include "plugin_sdk/constraint.h"

namespace {

using namespace gravitas;

class StaysNear final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "StaysNear",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Spherical",
                       "A ball joint.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point."),
                        Property::number("Way", "m").above(0.0).at_most(0.5).means("How far body 1 may go.")}}}};
  }
  explicit StaysNear(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Spherical")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector();
                out.vector(inverse_transform_point(bodies.pose1, point));
                out.vector(inverse_transform_point(bodies.pose2, point));
                out.vector(bodies.pose1.position);
                const double way = properties.number();
                out.number(std::isnan(way) ? 1e9 : way);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      Discrepancy d;
      d.point1 = transform_point(bodies.pose1, bound.vector());
      d.point2 = transform_point(bodies.pose2, bound.vector());
      const Vector3 start = bound.vector();
      if ((bodies.pose1.position - start).norm() > bound.number()) throw Refusal("body 1 has gone further than Way");
      emit(d);
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(StaysNear)
