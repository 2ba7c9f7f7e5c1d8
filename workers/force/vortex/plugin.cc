// Force `Vortex` (§ 4.2): a columnar field around an axis, at the centre of mass. With a the unit axis through c,
// r = (x - c) - ((x - c).a) a the way from it, and rho = |r| / R,
//
//   f = 2/(1 + rho^2) (S a x r - I r) / R + L/(1 + rho^2) a
//
// so that the swirl (Strength S) and the pull towards the axis (Inflow I) vanish on the axis, are largest, S and I, at
// the radius R and fall off as 1/rho, and the lift along the axis (Lift L) is largest on it: the profile of Kaufmann and
// Scully, smooth everywhere. The seed gives no formula. No potential: the swirl does work on a round trip.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"

namespace gravitas {
namespace {

class Vortex final : public OwnStateForce {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Vortex",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "Columnar vortex around an axis.",
        .capabilities = {"jacobians"},
        .types = {{"Vortex",
                   "Drives bodies around an axis, towards it and along it: at rho Radius from the axis with 2 rho/(1 + "
                   "rho^2) of Strength "
                   "and Inflow, and 1/(1 + rho^2) of Lift.",
                   {Property::vector("Centre", "m", "world").required().means("A point of the axis."),
                    Property::vector("Axis", "1", "world").required().means("Direction of the axis, of any length."),
                    Property::number("Strength", "N")
                        .required()
                        .means("Force around the axis, right-handed, at the Radius, where it is largest."),
                    Property::number("Lift", "N").defaults_to({0}).means("Force along the axis, on the axis."),
                    Property::number("Inflow", "N").defaults_to({0}).means("Force towards the axis at the Radius."),
                    Property::number("Radius", "m")
                        .above(0.0)
                        .defaults_to({1})
                        .means("Distance from the axis where the swirl is strongest.")}}}};
  }
  explicit Vortex(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      const Vector3 centre = cursor.vector(), axis = cursor.vector();
      const double strength = cursor.number(), lift = cursor.number(), inflow = cursor.number();
      const double radius = cursor.number();
      const double length = axis.stableNorm();
      if (!(length > 0.0)) throw Refusal("Axis: a direction has a length above 0");
      const Vector3 along = axis / length;
      const Vector3 way = vector_at(request.position(), body) - centre;
      const Vector3 out = (way - way.dot(along) * along) / radius;
      const double profile = 1.0 / (1.0 + out.squaredNorm());
      const Vector3 force = 2.0 * profile * (strength * along.cross(out) - inflow * out) + profile * lift * along;
      return ApplicationAnswer{.wrench = {.force = force}};
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Vortex)
