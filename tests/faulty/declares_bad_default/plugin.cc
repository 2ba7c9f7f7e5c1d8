// Declares a default that its own bounds forbid.
#include "plugin_sdk/plugin.h"

namespace {

using namespace gravitas;

class BadDefault final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "BadDefault",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Misbehaves on purpose.",
            .properties = {Property::number("Margin", "m")
                               .at_least(0.0)
                               .at_most(1.0)
                               .defaults_to({2.0})
                               .means("Cannot be what it is.")}};
  }
  explicit BadDefault(PropertyCursor) {}
  void pairs(const stage::SpacePairsRequest&, const stage::SpacePairsReply&, Host&) override {}
};

}  // namespace

GRAVITAS_PLUGIN(BadDefault)
