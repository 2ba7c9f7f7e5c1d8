// Force `Spring`: from an anchor, a point of the world or of another body, to a point of the body. With d from anchor to
// attachment, n = d/|d| and d' its rate,
//
//   f = -(k (|d| - L_0) + c n.d') n           U = k/2 (|d| - L_0)^2
//   f = -k d - c d'      where L_0 = 0: its smooth form
//
// at the attachment; -f at the anchor of another body, whose answer gathers those of all bodies on this spring. A spring
// of length 0 with L_0 > 0 has no direction and gives no force. The damping of the smooth form is not along d: between
// two bodies it changes their angular momentum. Stiff where k h^2 or c h is large against the masses:
// stability is the integrator's matter.
#include "plugin_sdk/plugin.h"

#include <cmath>

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"

namespace gravitas {
namespace {

struct Parameters {
  double stiffness, damping, rest_length;
  Vector3 attachment;  // geometry frame of the body
  std::uint32_t anchor_body;
  Vector3 anchor;  // world, or geometry frame of the anchor body
};

Parameters read(PropertyCursor cursor) {
  Parameters p;
  p.stiffness = cursor.number(), p.damping = cursor.number(), p.rest_length = cursor.number();
  p.attachment = cursor.vector();
  p.anchor_body = cursor.body();
  p.anchor = cursor.vector();
  return p;
}

// A point fixed in a body.
struct MovingPoint {
  Vector3 position, velocity, arm;  // world; the arm from the centre of mass
};

MovingPoint point_of(const stage::ForceWrenchesRequest& request, std::uint32_t body, const Vector3& local) {
  const Quaternion q = quaternion_at(request.orientation(), body);
  const Vector3 in_body =
      vector_at(request.geometry_position(), body) + quaternion_at(request.geometry_orientation(), body) * local;
  const Vector3 arm = q * in_body;
  return {vector_at(request.position(), body) + arm,
          vector_at(request.linear_velocity(), body) + vector_at(request.angular_velocity(), body).cross(arm), arm};
}

// The force on the attachment, and what acts on either side.
struct Pull {
  Vector3 force;
  Vector3 arm, anchor_arm;
  double potential;
};

Pull pull_of(const Parameters& p, const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  const MovingPoint attachment = point_of(request, body, p.attachment);
  const bool is_world = p.anchor_body == kNone;
  const MovingPoint anchor =
      is_world ? MovingPoint{p.anchor, Vector3::Zero(), Vector3::Zero()} : point_of(request, p.anchor_body, p.anchor);
  const Vector3 d = attachment.position - anchor.position, rate = attachment.velocity - anchor.velocity;
  if (p.rest_length == 0.0)
    return {-p.stiffness * d - p.damping * rate, attachment.arm, anchor.arm, 0.5 * p.stiffness * d.squaredNorm()};
  const double length = d.stableNorm(), stretched = length - p.rest_length;
  const Vector3 n = length > 0.0 ? Vector3(d / length) : Vector3::Zero();
  return {-(p.stiffness * stretched + p.damping * n.dot(rate)) * n, attachment.arm, anchor.arm,
          0.5 * p.stiffness * stretched * stretched};
}

class Spring final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Spring",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "Damped spring between two bodies, or a body and the world.",
        .capabilities = {"potential"},
        .types = {
            {"Spring",
             "Pulls a point of the body towards an anchor, or pushes it off.",
             {Property::number("Stiffness", "N/m").at_least(0.0).required().means("Force per stretch."),
              Property::number("Damping", "N*s/m").at_least(0.0).defaults_to({0}).means("Force per rate of stretch."),
              Property::number("RestLength", "m").at_least(0.0).defaults_to({0}).means("Length without force."),
              Property::vector("AttachmentPoint", "m", "geometry")
                  .defaults_to({0, 0, 0})
                  .means("Where it acts, in the frame of the body's geometry."),
              Property::body("AnchorBody").means("The body at its other end; absent: the world."),
              Property::vector("AnchorPoint", "m", "world")
                  .defaults_to({0, 0, 0})
                  .means("Its other end, in the world, or in the frame of AnchorBody's geometry.")}}}};
  }
  explicit Spring(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    std::size_t row = 0;
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      const Parameters p = read(cursor);
      const std::uint32_t force = request.application()[2 * row++];
      if (p.anchor_body != kNone && p.anchor_body >= request.mass().size())
        throw Refusal("AnchorBody is no row of the bodies");
      if (p.anchor_body == body) return reaction(p, request, force);
      const Pull pull = pull_of(p, request, body);
      return ApplicationAnswer{
          .wrench = {pull.force, pull.arm.cross(pull.force)}, .potential = pull.potential, .flags = kHasPotential};
    });
  }

 private:
  // What all bodies on the spring do to its anchor. The energy is counted with them.
  static ApplicationAnswer reaction(const Parameters& p, const stage::ForceWrenchesRequest& request,
                                    std::uint32_t force) {
    ApplicationAnswer sum;
    const std::span<const std::uint32_t> applications = request.application();
    for (std::size_t i = 0; i + 1 < applications.size(); i += 2) {
      if (applications[i] != force || applications[i + 1] == p.anchor_body) continue;
      if (applications[i + 1] >= request.mass().size())
        throw Refusal("an application names a body that does not exist");
      const Pull pull = pull_of(p, request, applications[i + 1]);
      sum.wrench.force -= pull.force;
      sum.wrench.torque -= pull.anchor_arm.cross(pull.force);
    }
    return sum;
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Spring)
