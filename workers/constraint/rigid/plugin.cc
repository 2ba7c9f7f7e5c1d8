// Constraint `Rigid` (§ 2.7.5.4): two bodies as one.
//
//      z  y          of body 2's frame in body 1's: the origin in x, y, z; x across y and z of body 1's,
//      | /           y across its z
//      |/___ x
//
// Freedoms. The origin's three rows take the translations, the angles the turns about z, y and x: six rows of rank 6, none
// redundant. (The seed locks three points fully: nine rows of rank 6, of rank 5 where it puts them on a line.) Turned by
// half a turn about an axis of the frame the rows would hold too; nothing gets there but by a jump.
#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

class Rigid final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Rigid",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Two bodies as one.",
            .types = {{"Rigid",
                       "Two bodies keep their relative pose.",
                       {Property::vector("BindPoint", "m", "world")
                            .means("The point that the joint error is measured at; the centre of mass of body 2, or of "
                                   "body 1 where that is the world, if absent.")}}}};
  }
  explicit Rigid(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Rigid");
                Vector3 point = properties.vector();
                if (point.array().isNaN().all()) point = bodies.centre();
                const Pose frame{point, Quaternion::Identity()};
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(held_point(one, two.position, {true, true, true}));
      hold_orientation(one, two, emit);
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Rigid)
