// Constraint `MyName`: a point of body 2 stays in a plane of body 1 (the rows and their freedoms: my_name.h).
//
// A plugin is a class derived from the base of its slot. It declares itself once (name, types, properties), receives a
// request as columns, and fills the columns of the reply. The answer depends on the request and the settings alone: the
// same request gives the same bytes, so keep nothing between calls but caches that can be made again.
#include <cstdint>

#include "my_name.h"
#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"

namespace {

using namespace gravitas;

class MyNamePlugin final : public ConstraintPlugin {
 public:
  // What a scene may write in the CustomProperties of such a joint; Body1 and Body2 stand beside them. Parsing, checking,
  // `gravitas describe` and the documentation come from here. More kinds of properties: plugin_sdk/property.h.
  static PluginDeclaration declaration() {
    return {.name = "MyName",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "A point that stays in a plane.",
            .types = {{"MyName",
                       "A point of body 2 stays in a plane that body 1 carries.",
                       {Property::vector("BindPoint", "m", "world").required().means("The point, at the start."),
                        Property::vector("Normal", "1", "world")
                            .required()
                            .means("Normal of the plane at the start, of any length.")}}}};
  }

  explicit MyNamePlugin(PropertyCursor) {}

  // First question, when the scene starts: what it says in world coordinates becomes numbers that are fixed in the bodies.
  // These come back with every second question; nothing else is remembered. What cannot be is refused, by its name.
  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& bound) {
                demand_type(type, "MyName");
                // values come in the order of declaration
                const Vector3 point = properties.vector();
                const Vector3 normal = unit_axis(properties.vector(), "MyName: Normal");
                write_frame(bodies.pose1, frame_along(point, normal), &bound);
                bound.vector(inverse_transform_point(bodies.pose2, point));
              });
  }

  // Second question, in every step: the discrepancies of each joint that holds, in a state of the bodies
  // (schemas/gravitas/stage/v1/constraint.proto). Solvers derive the rows from them.
  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose plane = read_frame(&bound, bodies.pose1);
      const Vector3 point = transform_point(bodies.pose2, bound.vector());
      emit(plain::point_in_plane(plane, point));
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(MyNamePlugin)
