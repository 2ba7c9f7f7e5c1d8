// Constraint `Distance`: two points, one of either body, within a range of distances.
//
//      x1 o-----------o x2      rod: neither bound given, or both equal;  rope: a largest distance alone;
//           |x2 - x1|           strut: a smallest alone;  both: a rope with a stop
//
// Freedoms. One row along u = (x2 - x1)/|x2 - x1|: J v = u.(v2 + w2 x r2 - v1 - w1 x r1) is the rate of the distance, and
// not zero for any body that can be moved, so a rod takes one freedom of twelve (rank 1), a rope none while it is slack.
// With a stiffness what is beyond the range is a stretch that a spring and a damper hold, force -k stretch - c |x2 - x1|' along
// u, and never across the range: an elastic rope, a spring, a strut. It takes no freedom, and may start beyond the range.
// What an edit leaves beyond the range is an error of the joint as any other: the pose change of the next step takes it out (with
// Sequential its CorrectionFactor of it), gives nothing a velocity, and does the work that the way asks for. So a rope hoists as fast
// as edits shorten it.
// u turns with the points (the discrepancy is radial). Where the points meet u is undefined: a rope, which has no lower limit then,
// is slack there, a rod of length 0 is refused.
#include <algorithm>
#include <cmath>
#include <string>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

// A distance that a scene gives with few digits is put right in the first step.
constexpr double kGivenDigits = 1e-3;

class Distance final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Distance",
        .version = "1.4",
        .slot = Slot::kConstraint,
        .meaning = "Rod, rope or cable.",
        .capabilities = {"coordinates"},
        .types = {
            {"Distance",
             "A point of either body, kept at a distance: a rod, a rope, or both bounds of a range.",
             {Property::vector("BindPoint1", "m", "world").required().means("Point of body 1, at the start."),
              Property::vector("BindPoint2", "m", "world").required().means("Point of body 2, at the start."),
              Property::number("MinimumDistance", "m")
                  .at_least(0.0)
                  .means("Smallest distance; absent: 0, or that of the start if MaximumDistance is absent too."),
              Property::number("MaximumDistance", "m")
                  .at_least(0.0)
                  .means("Largest distance, above 0; absent: none, or that of the start if MinimumDistance is absent "
                         "too. Set while it runs, what is then too long is pulled in by the next step."),
              Property::number("Stiffness", "N/m")
                  .above(0.0)
                  .means("Spring that holds what is beyond the range; rigid if absent."),
              Property::number("Damping", "N*s/m").at_least(0.0).means("Its damping; none if absent."),
              restitution_property()},
             {{"length", "m", "Distance between the points."}}}}};
  }
  explicit Distance(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Distance");
                const Vector3 point1 = properties.vector(), point2 = properties.vector();
                double least = properties.number(), most = properties.number();
                const double start = (point2 - point1).norm();
                const bool is_rod = std::isnan(least) && std::isnan(most);
                if (is_rod) least = most = start;
                // no distance is below 0: as a limit it would hold points that meet, along whatever direction
                if (!(least > 0.0)) least = -kUnlimited;
                if (std::isnan(most)) most = kUnlimited;
                const JointSpring spring = JointSpring::of(&properties);
                const bool is_rigid = spring.stiffness == 0.0;
                if (is_rigid && spring.damping > 0.0) throw Refusal("Distance: Damping is given without Stiffness");
                const double restitution = read_restitution(&properties, "Distance", !is_rod && is_rigid,
                                                            "MinimumDistance or MaximumDistance, or with Stiffness");
                // with a spring it may start beyond them, and after an edit it need not be where it started
                const bool is_judged = is_rigid && !bodies.is_kept;
                demand_range(least, most, is_judged ? start : std::max(least, std::min(start, most)));
                out.vector(inverse_transform_point(bodies.pose1, point1));
                out.vector(inverse_transform_point(bodies.pose2, point2));
                out.number(least);
                out.number(most);
                write_spring(spring, &out);
                out.number(restitution);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Vector3 point1 = transform_point(bodies.pose1, bound.vector());
      const Vector3 point2 = transform_point(bodies.pose2, bound.vector());
      const Vector3 between = point2 - point1;
      const double length = between.norm();
      const Vector3 along = length > 0.0 ? Vector3(between / length) : Vector3::UnitX();
      Discrepancy d = row_along(along, point1, point2, AxisMode::kLimited);
      d.modes |= kRadialDiscrepancy;
      d.lower.x() = bound.number();
      d.upper.x() = bound.number();
      const JointSpring spring = read_spring(&bound);
      if (spring.stiffness > 0.0) d.compliance.x() = 1.0 / spring.stiffness;
      d.damping.x() = spring.damping;
      d.restitution = bound.number();
      emit(d);
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Vector3 point1 = transform_point(bodies.pose1, bound.vector());
      const Vector3 point2 = transform_point(bodies.pose2, bound.vector());
      emit(0, distance_between(point1, point2, bodies));
    });
  }

 private:
  static void demand_range(double least, double most, double start) {
    if (least > most)
      throw Refusal("Distance: MinimumDistance " + std::to_string(least) + " lies above MaximumDistance " +
                    std::to_string(most));
    if (!(most > 0.0)) throw Refusal("Distance: MaximumDistance is 0; a shared point is a Spherical joint");
    const std::string now = ", but BindPoint1 and BindPoint2 are " + std::to_string(start) + " m apart";
    if (start < (1.0 - kGivenDigits) * least)
      throw Refusal("Distance: MinimumDistance is " + std::to_string(least) + now);
    if (start > (1.0 + kGivenDigits) * most)
      throw Refusal("Distance: MaximumDistance is " + std::to_string(most) + now);
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Distance)
