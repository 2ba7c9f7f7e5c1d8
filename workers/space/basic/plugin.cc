// Space `Basic` (§ 4.6): every pair is tested. O(n^2) and nothing to go wrong: the reference for all others.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/ray_rule.h"

namespace gravitas {
namespace {

class BasicSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Basic",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Tests every pair of bodies: O(n^2), the reference for all other spaces.",
            .capabilities = {"rays"}};
  }
  explicit BasicSpace(PropertyCursor) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    const PairRule is_pair(request);
    const auto bodies = static_cast<std::uint32_t>(request.flags().size());
    const stage::ReplyColumn<std::uint32_t> pair = reply.pair();
    for (std::uint32_t a = 0; a < bodies; ++a) {
      host.mark_progress();
      for (std::uint32_t b = a + 1; b < bodies; ++b)
        if (is_pair(a, b)) pair.push(a, b);
    }
  }

  void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) override {
    test_rays_against_all(request, reply, host);
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::BasicSpace)
