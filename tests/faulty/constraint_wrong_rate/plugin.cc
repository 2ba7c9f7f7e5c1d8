// A ball joint that tells how high body 2 is above body 1, at a rate that forgets that body 1 turns.
#include "plugin_sdk/joint_coordinates.h"

namespace {

using namespace gravitas;

class WrongRate final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "WrongRate",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .capabilities = {"coordinates"},
            .types = {{"Mast",
                       "A shared point.",
                       {Property::vector("Point", "m", "world").required().means("The point.")},
                       {{"height", "m", "How far body 2 is along the first axis of body 1."}}}}};
  }
  explicit WrongRate(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Mast")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector();
                out.vector(inverse_transform_point(bodies.pose1, point));
                out.vector(inverse_transform_point(bodies.pose2, point));
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Vector3 anchor1 = bound.vector();
      emit(point_discrepancy(anchor1, bound.vector(), bodies));
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor, const JointBodies& bodies, auto&& emit) {
      const Vector3 axis = bodies.pose1.orientation * Vector3::UnitX();
      emit(0, Coordinate{axis.dot(bodies.pose2.position - bodies.pose1.position),
                         axis.dot(bodies.velocity2 - bodies.velocity1)});
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(WrongRate)
