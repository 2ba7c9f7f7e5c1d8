// Space `MyName`: a sweep along x finds candidates (my_name.h), the rule that all spaces share decides about them.
//
// Cost: that of sorting, and of all pairs that overlap along x: bodies in a column along another axis are all candidates.
//
// A plugin is a class derived from the base of its slot. It declares itself once, receives a request as columns, and fills
// the columns of the reply. The answer depends on the request and the settings alone: the same request gives the same
// bytes, so keep nothing between calls but caches that can be made again.
#include "plugin_sdk/plugin.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "my_name.h"
#include "plugin_sdk/pair_rule.h"
#include "plugin_sdk/ray_rule.h"
#include "plugin_sdk/space.h"

namespace {

using namespace gravitas;

class MyNamePlugin final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "MyName",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Sorts bodies along x and tests those that overlap there.",
            // promises that rays() is answered
            .capabilities = {"rays"}};
  }

  // Settings, PluginDeclaration::properties, would be read here: plugin_sdk/property.h has their kinds.
  explicit MyNamePlugin(PropertyCursor) {}

  // The question of the slot: all pairs whose bounds overlap and whose filters allow it, ascending and each once
  // (schemas/gravitas/stage/v1/space.proto). PairRule is what all spaces answer by, so that all of them agree; a space is
  // about which pairs it need not ask the rule about.
  void pairs(const stage::SpacePairsRequest& request, const stage::SpacePairsReply& reply, Host& host) override {
    const PairRule is_pair(request);
    intervals_.clear();
    for (std::uint32_t body = 0; body < is_pair.bodies(); ++body) {
      const double lower = request.lower()[3 * body], upper = request.upper()[3 * body];
      // what is no number overlaps with nothing, and could not be sorted
      if (is_pair.has_shape(body) && !std::isnan(lower) && !std::isnan(upper))
        intervals_.push_back({lower, upper, body});
    }
    found_.clear();
    std::size_t met = 0;
    plain::sweep(&intervals_, [&](std::uint32_t a, std::uint32_t b) {
      // prolongs the deadline of the call where there is much to do
      if (met++ % 1024 == 0) host.mark_progress();
      if (is_pair(a, b)) found_.add(a, b);
    });
    host.mark_progress();
    found_.sort(is_pair.bodies());
    found_.write(reply.pair());
  }

  void rays(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host) override {
    test_rays_against_all(request, reply, host);
  }

 private:
  std::vector<plain::Interval> intervals_;  // scratch, so that a step allocates nothing
  PairList found_;                          // scratch
};

}  // namespace

GRAVITAS_PLUGIN(MyNamePlugin)
