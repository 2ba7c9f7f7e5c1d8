// Constraint `Bushing`: what gives way between two bodies, in each of the six ways by itself; beside another joint of the same
// bodies, springs and dampers of the freedoms that it leaves.
//
//      force on body 2   -K d - C d'              d: where the point of body 2 is, from that of body 1
//      torque on body 2  -dexp_t^-T (K' t + C' t')   t: the rotation vector by which body 2 has turned against body 1
//
// all in axes that are fixed in body 1, at rest at the start, K, C, K' and C' diagonal. The forces are the gradient of
// (d.K d + t.K' t)/2, and dampers take energy only; t' = dexp_t^-1 w, w the turning of body 2 against body 1 (rotation.h). At
// half a turn t goes on from the other side, with the same energy. With one stiffness about all axes the springs' torque is
// -K' t, and that of dampers -C' w along body 1's axes, of which the above differs by the square of the turn, |t|^2/12.
//
// It takes no freedom: nothing is held, there is no joint error. A row for each way, where body 2 is, so that a way along one
// axis is no lever for another; one discrepancy for the three turns, or where their springs differ one along the gradient of
// each component. The springs are implicit (joint_laws.h): stable for every stiffness, of order one, but for `Smooth`, which has
// the integrator's.
#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

// K and C, or K' and C'.
struct Springs {
  Vector3 stiffness, damping;

  static Springs read(PropertyCursor* numbers) {
    const Vector3 stiffness = numbers->vector();
    return {stiffness, numbers->vector()};
  }
  bool is_even() const { return stiffness.x() == stiffness.y() && stiffness.y() == stiffness.z(); }
  bool is_none() const { return stiffness.isZero(0.0) && damping.isZero(0.0); }
  void write(BoundWriter* out) const { out->vector(stiffness), out->vector(damping); }
  JointSpring on(int axis) const { return {stiffness[axis], damping[axis]}; }
};

class Bushing final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Bushing",
        .version = "1.2",
        .slot = Slot::kConstraint,
        .meaning = "Springs and dampers in six ways.",
        .capabilities = {"coordinates"},
        .types = {
            {"Bushing",
             "The second body is sprung and damped against the first, along and about three axes of it.",
             {Property::vector("BindPoint", "m", "world").required().means("The shared point, at the start."),
              Property::quaternion("Axes", "world")
                  .defaults_to({1.0, 0.0, 0.0, 0.0})
                  .means("Attitude of the axes at the start; they are fixed in body 1."),
              Property::vector("Stiffness", "N/m", "axes").at_least(0.0).required().means("Springs along the axes."),
              along("Damping", "N*s/m", "Dampers along them."),
              along("AngularStiffness", "N*m/rad",
                    "Springs about them: against the components of the rotation vector of the turn."),
              along("AngularDamping", "N*m*s/rad", "Dampers about them: against the rates of these.")},
             {{"displacement_x", "m", "Way of the point of body 2 along the first axis, 0 at the start."},
              {"displacement_y", "m", "Its way along the second."},
              {"displacement_z", "m", "Its way along the third."},
              {"rotation_x", "rad",
               "First component of the rotation vector by which body 2 has turned against body 1."},
              {"rotation_y", "rad", "Its second component."},
              {"rotation_z", "rad", "Its third component."}}}}};
  }
  explicit Bushing(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Bushing");
                const Vector3 point = properties.vector();
                const Pose frame{point, properties.quaternion()};
                const Springs linear = Springs::read(&properties), angular = Springs::read(&properties);
                if (linear.is_none() && angular.is_none())
                  throw Refusal("Bushing: Stiffness, Damping, AngularStiffness and AngularDamping are all zero");
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
                linear.write(&out);
                angular.write(&out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const Springs linear = Springs::read(&bound), angular = Springs::read(&bound);
      for (int axis = 0; axis < 3; ++axis) {
        const JointSpring spring = linear.on(axis);
        if (spring.is_none()) continue;
        Discrepancy way = held_point(one, two.position, {axis == 0, axis == 1, axis == 2});
        spring.yield_on(axis, &way);
        emit(way);
      }
      if (angular.is_even()) {
        Discrepancy turn = turn_between(one.orientation, two.orientation);
        for (int axis = 0; axis < 3; ++axis) angular.on(axis).yield_on(axis, &turn);
        if (!angular.is_none()) emit(turn);
        return;
      }
      for (int axis = 0; axis < 3; ++axis)
        if (const JointSpring spring = angular.on(axis); !spring.is_none())
          emit(sprung_component(one.orientation, two.orientation, axis, spring));
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      for (const std::uint32_t axis : {0U, 1U, 2U})
        emit(axis, way_along(one.orientation * Vector3::Unit(axis), one.position, two.position, bodies));
      const Quaternion to_axes = one.orientation.conjugate();
      const Vector3 turn = log_rotation(to_axes * two.orientation);
      const Vector3 rate = rotation_vector_rate(turn, to_axes * (bodies.spin2 - bodies.spin1));
      for (const std::uint32_t axis : {0U, 1U, 2U}) emit(3 + axis, Coordinate{turn[axis], rate[axis]});
    });
  }

 private:
  static Property along(std::string name, std::string unit, std::string meaning) {
    return Property::vector(std::move(name), std::move(unit), "axes")
        .at_least(0.0)
        .defaults_to({0.0, 0.0, 0.0})
        .means(std::move(meaning));
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Bushing)
