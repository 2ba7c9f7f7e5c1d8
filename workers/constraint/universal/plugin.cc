// Constraint `Universal`: Hooke's joint. A cross whose one bar is fixed in body 1 and whose other in body 2.
//
//      Axis1 (body 1)  --+--  Axis2 (body 2)      the points coincide, and the bars keep their angle
//
// Freedoms. The shared point takes the translations. The angle of the bars changes at the rate w.n, n = a1 x a2/|a1 x a2|:
// one turn, about the normal of both bars. Four rows of rank 4 while the bars are not parallel, none redundant; left are the
// turns about either bar.
// Shafts that are across the bars turn by tan(phi2) = tan(phi1)/cos(bend), not evenly; ConstantVelocity does.
#include <string>

#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

class Universal final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Universal",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Hooke's joint.",
            .types = {{"Universal",
                       "Two bodies share a point; an axis of the first and one of the second keep their angle.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point, at the start."),
                        Property::vector("Axis1", "1", "world")
                            .required()
                            .means("Bar of the cross that is fixed in body 1, any length."),
                        Property::vector("Axis2", "1", "world")
                            .required()
                            .means("Bar that is fixed in body 2; not parallel to Axis1, as a rule across it.")}}}};
  }
  explicit Universal(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Universal");
                const Vector3 point = properties.vector();
                const Vector3 axis1 = unit_axis(properties.vector(), "Universal: Axis1");
                const Vector3 axis2 = unit_axis(properties.vector(), "Universal: Axis2");
                if (axis1.cross(axis2).norm() < 1e-6) throw Refusal("Universal: Axis2 is parallel to Axis1");
                write_frame(bodies.pose1, frame_along(point, axis1), &out);
                write_frame(bodies.pose2, frame_along(point, axis2), &out);
                out.number(swing_between(axis1, axis2).angle);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(held_point(one, two.position, {true, true, true}));
      emit(swing_row(one.orientation * Vector3::UnitX(), two.orientation * Vector3::UnitX(), bound.number()));
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Universal)
