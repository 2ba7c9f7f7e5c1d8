// Takes the masses of two bodies for the whole of their inertia at a contact: off the centre its impulse is too large,
// and the bodies spin away with energy they did not have.
#include "plugin_sdk/plugin.h"

#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/solver.h"
#include "tests/faulty/faulty_solver.h"

namespace {

using namespace gravitas;

class GainsEnergy final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "GainsEnergy",
            .version = "1.0",
            .slot = Slot::kSolver,
            .meaning = "Misbehaves on purpose.",
            .capabilities = {"soft"}};
  }
  explicit GainsEnergy(PropertyCursor) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host&) override {
    refuse_bad_input(request);
    std::vector<Twist> twists;
    for (std::size_t i = 0; i < request.flags().size(); ++i)
      twists.push_back({vector_at(request.trial_linear_velocity(), i), vector_at(request.trial_angular_velocity(), i)});
    for (std::size_t i = 0; i < request.contact_depth().size(); ++i) {
      const Vector3 impulse = push_apart(request, i, &twists);
      push(reply.contact_impulse(), impulse);
      push(reply.contact_direction(), vector_at(request.contact_normal(), i));
      push(reply.contact_turning(), Vector3::Zero());
      reply.contact_correction().push(0.0);
    }
    for (const Twist& twist : twists) {
      if (!twist.linear.allFinite() || !twist.angular.allFinite()) throw Refusal("velocities or masses overflow");
      push(reply.linear_velocity(), twist.linear);
      push(reply.angular_velocity(), twist.angular);
      reply.pose_change().push(0, 0, 0, 0, 0, 0);
    }
    for (std::size_t i = 0; i < request.mode().size(); ++i) {
      push(reply.discrepancy_impulse(), Vector3::Zero());
      push(reply.discrepancy_correction(), Vector3::Zero());
    }
    reply.iterations().set(1);
    reply.residual().set(0.0);
    reply.stop_reason().set(static_cast<std::uint32_t>(StopReason::kConverged));
  }

 private:
  static void push(const stage::ReplyColumn<double>& column, const Vector3& v) { column.push(v.x(), v.y(), v.z()); }

  // The impulse on body 2, which both get.
  static Vector3 push_apart(const stage::SolverSolveRequest& request, std::size_t contact, std::vector<Twist>* twists) {
    const Vector3 normal = vector_at(request.contact_normal(), contact);
    const Vector3 point = vector_at(request.contact_point(), contact);
    const std::uint32_t bodies[2] = {request.contact_body()[2 * contact], request.contact_body()[2 * contact + 1]};
    const double give = request.inverse_mass()[bodies[0]] + request.inverse_mass()[bodies[1]];
    Vector3 relative = Vector3::Zero();
    for (int side = 0; side < 2; ++side) {
      const Twist& twist = (*twists)[bodies[side]];
      const Vector3 arm = point - vector_at(request.trial_position(), bodies[side]);
      relative += (side == 0 ? -1.0 : 1.0) * (twist.linear + twist.angular.cross(arm));
    }
    const double approach = -normal.dot(relative);
    if (!(give > 0.0) || !(approach > 0.0) || request.contact_depth()[contact] < 0.0) return Vector3::Zero();
    const double restitution = request.contact_material()[kMaterialColumns * contact + kRestitution];
    const Vector3 impulse = (1.0 + restitution) * approach / give * normal;
    if (!impulse.allFinite()) throw Refusal("velocities or masses overflow");
    for (int side = 0; side < 2; ++side) {
      const std::uint32_t body = bodies[side];
      if (!(request.inverse_mass()[body] > 0.0)) continue;
      const Vector3 on_body = (side == 0 ? -1.0 : 1.0) * impulse;
      const Vector3 arm = point - vector_at(request.trial_position(), body);
      (*twists)[body] =
          after_impulse((*twists)[body], quaternion_at(request.trial_orientation(), body), request.inverse_mass()[body],
                        vector_at(request.inverse_inertia(), body), on_body, arm.cross(on_body));
    }
    return impulse;
  }
};

}  // namespace

GRAVITAS_PLUGIN(GainsEnergy)
