// Answers all pairs in descending order.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/pair_rule.h"

namespace {

using namespace gravitas;

class UnsortedSpace final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Unsorted", .version = "1.0", .slot = Slot::kSpace, .meaning = "Misbehaves on purpose."};
  }
  explicit UnsortedSpace(PropertyCursor) {}

  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host&) override {
    const PairRule is_pair(request);
    for (auto a = static_cast<std::uint32_t>(request.flags().size()); a-- > 0;)
      for (auto b = static_cast<std::uint32_t>(request.flags().size()); b-- > a + 1;)
        if (is_pair(a, b)) reply.pair().push(a, b);
  }
};

}  // namespace

GRAVITAS_PLUGIN(UnsortedSpace)
