// Takes bounds for open: bodies that share a face are no pair.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/pair_rule.h"

namespace {

using namespace gravitas;

class OpenBoundsSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "OpenBounds", .version = "1.0", .slot = Slot::kSpace, .meaning = "Misbehaves on purpose."};
  }
  explicit OpenBoundsSpace(PropertyCursor) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host&) override {
    const PairRule is_pair(request);
    const auto bodies = static_cast<std::uint32_t>(request.flags().size());
    for (std::uint32_t a = 0; a < bodies; ++a)
      for (std::uint32_t b = a + 1; b < bodies; ++b)
        if (is_pair(a, b) && !share_a_face(request, a, b)) reply.pair().push(a, b);
  }

 private:
  static bool share_a_face(const stage::SpacePairsRequest& request, std::uint32_t a, std::uint32_t b) {
    for (std::size_t k = 0; k < 3; ++k)
      if (request.upper()[3 * a + k] == request.lower()[3 * b + k] ||
          request.upper()[3 * b + k] == request.lower()[3 * a + k])
        return true;
    return false;
  }
};

}  // namespace

GRAVITAS_PLUGIN(OpenBoundsSpace)
