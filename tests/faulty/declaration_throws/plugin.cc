// Cannot say what it is: its declaration throws.
#include "plugin_sdk/plugin.h"

#include <stdexcept>

namespace {

class Undeclared final : public gravitas::SpacePlugin {
 public:
  static gravitas::PluginDeclaration declaration() { throw std::runtime_error("its table of types is missing"); }
  explicit Undeclared(gravitas::PropertyCursor) {}
  void pairs(const gravitas::stage::SpacePairsRequest&, const gravitas::stage::SpacePairsReply&,
             gravitas::Host&) override {}
};

}  // namespace

GRAVITAS_PLUGIN(Undeclared)
