// Constraint `Spherical` (§ 2.7.5.2, 2.83): a ball-and-socket joint. One point, fixed in both bodies, stays one
// point: p2 - p1 = 0. One discrepancy with three locked axes; takes three of the twelve freedoms, rank 3.
// (The seed's glossary calls it a minimum distance; the points coincide.)
#include "plugin_sdk/constraint.h"

namespace gravitas {
namespace {

class Spherical final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Spherical",
        .version = "1.0",
        .slot = Slot::kConstraint,
        .meaning = "Ball-and-socket joint.",
        .types = {{"Spherical",
                   "Two bodies share a point about which they turn freely.",
                   {Property::vector("BindPoint", "m", "world").required().means("The shared point, at the start.")}}}};
  }
  explicit Spherical(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Spherical")) throw Refusal("a joint is of a type that this plugin does not know");
                const Vector3 point = properties.vector();
                out.vector(inverse_transform_point(bodies.pose1, point));
                out.vector(inverse_transform_point(bodies.pose2, point));
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Vector3 anchor1 = bound.vector();
      const Vector3 anchor2 = bound.vector();
      emit(point_discrepancy(anchor1, anchor2, bodies));
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Spherical)
