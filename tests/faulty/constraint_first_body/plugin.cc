// A ball joint that takes the pose of the first body for that of the world.
#include "plugin_sdk/constraint.h"

namespace {

using namespace gravitas;

template <typename Request>
Pose pose_of(const Request& request, std::size_t joint, std::size_t end) {
  const std::uint32_t named = request.constraint_body()[2 * joint + end];
  const std::uint32_t body = named == kNone ? 0 : named;
  return {vector_at(request.position(), body), quaternion_at(request.orientation(), body)};
}

class FirstBodyIsWorld final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "FirstBodyIsWorld",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Spherical",
                       "A ball joint.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point.")}}}};
  }
  explicit FirstBodyIsWorld(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    std::size_t joint = 0;
    bind_each(request, reply, [&](std::uint64_t type, PropertyCursor properties, const JointBodies&, BoundWriter& out) {
      if (type != type_id("Spherical")) throw Refusal("a joint of another type");
      const Vector3 point = properties.vector();
      for (const std::size_t end : {0U, 1U}) out.vector(inverse_transform_point(pose_of(request, joint, end), point));
      ++joint;
    });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    std::size_t joint = 0;
    describe_each(request, reply, [&](std::uint64_t, PropertyCursor bound, const JointBodies&, auto&& emit) {
      while (request.intact()[joint] == 0) ++joint;
      Discrepancy d;
      d.point1 = transform_point(pose_of(request, joint, 0), bound.vector());
      d.point2 = transform_point(pose_of(request, joint, 1), bound.vector());
      emit(d);
      ++joint;
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(FirstBodyIsWorld)
