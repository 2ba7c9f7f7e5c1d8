// The same push everywhere, but that bodies beyond a length that a scene may give are refused.
#include "plugin_sdk/force.h"

namespace gravitas {
namespace {

class Draft final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Draft",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "Pushes bodies that are not too far away.",
        .types = {{"Draft",
                   "Pushes the body.",
                   {Property::vector("Push", "N", "world").required().means("The force."),
                    Property::number("Length", "m").above(1.0).at_most(3.0).means("Beyond it nothing is known.")}}}};
  }
  explicit Draft(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t body) {
      const Vector3 push = properties.vector();
      if (vector_at(request.position(), body).norm() > properties.number()) throw Refusal("the body is beyond Length");
      return ApplicationAnswer{.wrench = {.force = push}, .flags = kConstantWrench};
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Draft)
