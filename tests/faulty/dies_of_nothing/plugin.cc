// Starts with the first body, without asking whether there is one.
#include "plugin_sdk/plugin.h"

#include <csignal>

#include "plugin_sdk/pair_rule.h"

namespace {

using namespace gravitas;

class NeedsABody final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "NeedsABody", .version = "1.0", .slot = Slot::kSpace, .meaning = "Misbehaves on purpose."};
  }
  explicit NeedsABody(PropertyCursor) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host&) override {
    const PairRule is_pair(request);
    const auto count = static_cast<std::uint32_t>(request.flags().size());
    // what a read through a null pointer comes to
    if (count == 0) raise(SIGSEGV);
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = a + 1; b < count; ++b)
        if (is_pair(a, b)) reply.pair().push(a, b);
  }
};

}  // namespace

GRAVITAS_PLUGIN(NeedsABody)
