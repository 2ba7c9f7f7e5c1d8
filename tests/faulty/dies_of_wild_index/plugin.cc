// A force that looks up its bodies without asking whether they are there.
#include "plugin_sdk/plugin.h"

namespace {

using namespace gravitas;

class Trusting final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Trusting",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{.name = "Weight", .meaning = "Mass downwards.", .properties = {}}}};
  }
  explicit Trusting(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    const double* mass = request.mass().data();
    for (std::size_t i = 0; i < request.application().size() / 2; ++i) {
      reply.wrench().push(0.0, -mass[request.application()[2 * i + 1]], 0.0, 0.0, 0.0, 0.0);
      reply.impulse().push(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
      reply.potential().push(0.0);
      reply.flags().push(0U);
    }
  }
};

}  // namespace

GRAVITAS_PLUGIN(Trusting)
