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
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"
#include "plugin_sdk/math/rotation.h"

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

// From the anchor to the attachment.
struct Span {
  MovingPoint attachment, anchor;
  Vector3 d, rate;
  double length;
  Vector3 direction;  // zero where there is none
};

Span span_of(const Parameters& p, const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  Span span;
  span.attachment = point_of(request, body, p.attachment);
  span.anchor = p.anchor_body == kNone ? MovingPoint{p.anchor, Vector3::Zero(), Vector3::Zero()}
                                       : point_of(request, p.anchor_body, p.anchor);
  span.d = span.attachment.position - span.anchor.position;
  span.rate = span.attachment.velocity - span.anchor.velocity;
  span.length = span.d.stableNorm();
  span.direction = span.length > 0.0 ? Vector3(span.d / span.length) : Vector3::Zero();
  return span;
}

// The force on the attachment, and what acts on either side.
struct Pull {
  Vector3 force;
  Vector3 arm, anchor_arm;
  double potential;
};

Pull pull_of(const Parameters& p, const Span& s) {
  if (p.rest_length == 0.0)
    return {-p.stiffness * s.d - p.damping * s.rate, s.attachment.arm, s.anchor.arm,
            0.5 * p.stiffness * s.d.squaredNorm()};
  const double stretched = s.length - p.rest_length;
  return {-(p.stiffness * stretched + p.damping * s.direction.dot(s.rate)) * s.direction, s.attachment.arm,
          s.anchor.arm, 0.5 * p.stiffness * stretched * stretched};
}

Pull pull_of(const Parameters& p, const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  return pull_of(p, span_of(p, request, body));
}

using ForceBlock = Eigen::Matrix<double, 3, 12>;

// How the position and the velocity of a point change with the state of its body.
struct PointChange {
  ForceBlock position = ForceBlock::Zero(), velocity = ForceBlock::Zero();

  PointChange(const MovingPoint& point, const Vector3& angular_velocity) {
    position.leftCols<3>() = velocity.middleCols<3>(6) = Matrix3::Identity();
    position.middleCols<3>(3) = velocity.rightCols<3>() = -skew(point.arm);
    velocity.middleCols<3>(3) = -skew(angular_velocity) * skew(point.arm);
  }
};

// How the force on the attachment changes with d and its rate.
struct ForceChange {
  Matrix3 by_d, by_rate;

  ForceChange(const Parameters& p, const Span& s) {
    by_d = -p.stiffness * Matrix3::Identity(), by_rate = -p.damping * Matrix3::Identity();
    if (p.rest_length == 0.0) return;
    const Vector3& n = s.direction;
    by_rate = -p.damping * n * n.transpose();
    by_d.setZero();
    if (!(s.length > 0.0)) return;
    const Matrix3 across = (Matrix3::Identity() - n * n.transpose()) / s.length;
    const double pull = p.stiffness * (s.length - p.rest_length) + p.damping * n.dot(s.rate);
    by_d = -n * (p.stiffness * n.transpose() + p.damping * s.rate.transpose() * across) - pull * across;
  }
  ForceBlock by(const PointChange& point) const { return by_d * point.position + by_rate * point.velocity; }
};

// Of a force that acts at an arm; `turns` if the arm is of the body by whose state.
JacobianBlock wrench_block(const ForceBlock& by, const Vector3& arm, const Vector3& force, bool turns) {
  JacobianBlock block;
  block.topRows<3>() = by;
  block.bottomRows<3>() = skew(arm) * by;
  if (turns) block.block<3, 3>(3, 3) += skew(force) * skew(arm);
  return block;
}

class Spring final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Spring",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "Damped spring between two bodies, or a body and the world.",
        .capabilities = {"potential", "jacobians"},
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
    list_applications(request);
    std::size_t row = 0;
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      const Parameters p = read(cursor);
      const std::uint32_t force = request.application()[2 * row++];
      demand_anchor(p, request);
      if (p.anchor_body == body) return reaction(p, request, force);
      const Pull pull = pull_of(p, request, body);
      return ApplicationAnswer{
          .wrench = {pull.force, pull.arm.cross(pull.force)}, .potential = pull.potential, .flags = kHasPotential};
    });
  }

  void jacobians(const stage::ForceWrenchesRequest& request, const stage::ForceJacobiansReply& reply, Host&) override {
    const std::size_t rows = request.application().size() / 2;
    // forces that answer at their anchor, too
    std::vector<std::uint8_t> reacts(request.force_type().size());
    for (std::size_t row = 0; row < rows; ++row) {
      const Application one = application_at(request, row);
      const Parameters p = read(one.properties);
      demand_anchor(p, request);
      if (p.anchor_body == one.body) reacts[one.force] = 1;
    }
    for (std::size_t row = 0; row < rows; ++row) {
      const Application one = application_at(request, row);
      const Parameters p = read(one.properties);
      if (p.anchor_body == one.body) continue;
      const Span span = span_of(p, request, one.body);
      const Pull pull = pull_of(p, span);
      const ForceChange change(p, span);
      const ForceBlock by_own =
          change.by(PointChange(span.attachment, vector_at(request.angular_velocity(), one.body)));
      push_block(reply, one.body, one.body, wrench_block(by_own, pull.arm, pull.force, true));
      if (p.anchor_body == kNone) continue;
      const ForceBlock by_anchor =
          -change.by(PointChange(span.anchor, vector_at(request.angular_velocity(), p.anchor_body)));
      push_block(reply, one.body, p.anchor_body, wrench_block(by_anchor, pull.arm, pull.force, false));
      if (reacts[one.force] == 0) continue;
      push_block(reply, p.anchor_body, one.body, wrench_block(-by_own, pull.anchor_arm, -pull.force, false));
      push_block(reply, p.anchor_body, p.anchor_body, wrench_block(-by_anchor, pull.anchor_arm, -pull.force, true));
    }
  }

 private:
  static void demand_anchor(const Parameters& p, const stage::ForceWrenchesRequest& request) {
    if (p.anchor_body != kNone && p.anchor_body >= request.mass().size())
      throw Refusal("AnchorBody is no row of the bodies");
  }

  // Each force's applications, in their order.
  void list_applications(const stage::ForceWrenchesRequest& request) {
    const std::span<const std::uint32_t> applications = request.application();
    first_of_force_.assign(request.force_type().size(), kNone);
    next_.resize(applications.size() / 2);
    for (std::uint32_t row = static_cast<std::uint32_t>(next_.size()); row-- > 0;) {
      std::uint32_t& first = first_of_force_.at(applications[2 * row]);
      next_[row] = first;
      first = row;
    }
  }

  // What all bodies on the spring do to its anchor. The energy is counted with them.
  ApplicationAnswer reaction(const Parameters& p, const stage::ForceWrenchesRequest& request,
                             std::uint32_t force) const {
    ApplicationAnswer sum;
    for (std::uint32_t row = first_of_force_[force]; row != kNone; row = next_[row]) {
      const std::uint32_t body = request.application()[2 * row + 1];
      if (body == p.anchor_body) continue;
      if (body >= request.mass().size()) throw Refusal("an application names a body that does not exist");
      const Pull pull = pull_of(p, request, body);
      sum.wrench.force -= pull.force;
      sum.wrench.torque -= pull.anchor_arm.cross(pull.force);
    }
    return sum;
  }

  // of a call
  std::vector<std::uint32_t> first_of_force_, next_;
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Spring)
