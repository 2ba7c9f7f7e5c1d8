// A ball joint that refuses, where a scene says when it was made, to be asked with another.
#include <cmath>

#include "plugin_sdk/constraint.h"

namespace {

using namespace gravitas;

class OneAtATime final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "OneAtATime",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Spherical",
                       "A ball joint.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point."),
                        Property::number("Made", "s").at_least(0.0).means("When it was made.")}}}};
  }
  explicit OneAtATime(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Spherical")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector();
                out.vector(inverse_transform_point(bodies.pose1, point));
                out.vector(inverse_transform_point(bodies.pose2, point));
                out.number(std::isnan(properties.number()) ? 0.0 : 1.0);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [&](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      Discrepancy d;
      d.point1 = transform_point(bodies.pose1, bound.vector());
      d.point2 = transform_point(bodies.pose2, bound.vector());
      if (bound.number() > 0.0 && request.constraint_type().size() > 1) throw Refusal("more than one joint");
      emit(d);
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(OneAtATime)
