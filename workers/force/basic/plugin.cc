// Force `Basic` (§ 4.2): a force at a point, constant or by a table over time, in world or body axes; or, where it
// is instantaneous, an impulse in N s applied once at the start, whatever the time step (the seed let its effect
// go with dt).
//
// With p the point of application (world) and x the centre of mass: torque = (p - x) x f + Torque.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <span>

#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"

namespace gravitas {
namespace {

enum Frame : std::uint32_t { kWorldFrame = 0, kBodyFrame = 1 };

struct Parameters {
  Vector3 force;
  Vector3 point;  // geometry frame
  Vector3 torque;
  std::uint32_t frame;
  std::span<const double> table;  // rows t, fx, fy, fz
  bool instantaneous;
};

Parameters read(PropertyCursor cursor) {
  Parameters p;
  p.force = cursor.vector();
  p.point = cursor.vector();
  p.torque = cursor.vector();
  p.frame = cursor.choice();
  p.table = cursor.table(4);
  p.instantaneous = cursor.flag();
  return p;
}

// Linear between the rows of the table, constant outside it; at a jump what comes after.
Vector3 force_at(const Parameters& p, double time) {
  const std::size_t rows = p.table.size() / 4;
  if (rows == 0) return p.force;
  const auto row_force = [&](std::size_t row) {
    return Vector3(p.table[4 * row + 1], p.table[4 * row + 2], p.table[4 * row + 3]);
  };
  std::size_t next = 0;
  while (next < rows && p.table[4 * next] <= time) ++next;
  if (next == 0) return row_force(0);
  if (next == rows) return row_force(rows - 1);
  const double before = p.table[4 * (next - 1)], after = p.table[4 * next];
  const double share = (time - before) / (after - before);
  return (1.0 - share) * row_force(next - 1) + share * row_force(next);
}

class BasicForce final : public OwnStateForce {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "BasicForce",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "A given force at a point of the body, constant, over time, or as an impulse.",
        .capabilities = {"jacobians"},
        .types = {
            {"Basic",
             "A given force at a point of the body.",
             {Property::vector("Force", "N", "world")
                  .defaults_to({0, 0, 0})
                  .means("The force, in N; in N s where Instantaneous is true."),
              Property::vector("ApplicationPoint", "m", "geometry")
                  .defaults_to({0, 0, 0})
                  .means("Where it acts, in the frame of the body's geometry."),
              Property::vector("Torque", "N*m", "world")
                  .defaults_to({0, 0, 0})
                  .means("An additional torque (N m s where Instantaneous)."),
              Property::choice("Frame", {"World", "Body"})
                  .defaults_to({0})
                  .means("Axes in which Force, Torque and Table are given: the world's or the geometry's."),
              Property::table("Table", 4, "s,N", "world")
                  .means("Rows {t, fx, fy, fz}: the force over time, linear between rows and constant before and after "
                         "them; two rows of one time are a jump. Steps end where it jumps or bends. Replaces Force."),
              Property::flag("Instantaneous")
                  .defaults_to({0})
                  .means("The value is an impulse, applied once at the start (of a Table, its value at time 0).")}}}};
  }
  explicit BasicForce(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      return answer(read(cursor), request, body);
    });
  }

 private:
  static ApplicationAnswer answer(const Parameters& p, const stage::ForceWrenchesRequest& request, std::uint32_t body) {
    for (std::size_t row = 1; row < p.table.size() / 4; ++row) {
      const double time = p.table[4 * row];
      if (time < p.table[4 * row - 4]) throw Refusal("Table: times must ascend");
      if (row > 1 && time == p.table[4 * row - 8]) throw Refusal("Table: more than two rows of one time");
    }

    // where the geometry's frame lies in the world
    const Quaternion q_WB = quaternion_at(request.orientation(), body);
    const Quaternion q_WG = q_WB * quaternion_at(request.geometry_orientation(), body);
    const Vector3 arm = q_WB * vector_at(request.geometry_position(), body) + q_WG * p.point;
    const Vector3 given = force_at(p, request.time());
    const Vector3 force = p.frame == kBodyFrame ? Vector3(q_WG * given) : given;
    const Vector3 torque = p.frame == kBodyFrame ? Vector3(q_WG * p.torque) : p.torque;
    const Wrench wrench{force, arm.cross(force) + torque};
    if (p.instantaneous) return {.impulse = wrench, .flags = kConstantWrench};

    // the same for ever only if neither time nor the attitude matters
    const bool at_centre = p.point.isZero(0.0) && vector_at(request.geometry_position(), body).isZero(0.0);
    const bool constant = p.table.empty() && p.frame == kWorldFrame && at_centre;
    return {.wrench = wrench, .flags = constant ? kConstantWrench : 0U};
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::BasicForce)
