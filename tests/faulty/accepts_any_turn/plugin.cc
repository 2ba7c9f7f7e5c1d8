// Takes any four finite numbers for the quaternion that it declares.
#include "plugin_sdk/plugin.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace {

using namespace gravitas;

class Turned final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Turned",
            .version = "1.0",
            .slot = Slot::kSpace,
            .meaning = "Is turned, on purpose.",
            .properties = {Property::quaternion("Turn", "world").defaults_to({1, 0, 0, 0}).means("How it is turned.")}};
  }
  explicit Turned(PropertyCursor) {}
  void pairs(const stage::SpacePairsRequest&, const stage::SpacePairsReply&, Host&) override {}
};

std::int32_t create(const double* settings, std::uint64_t count, void** instance, gravitas_error* error) {
  if (count != 4 || !std::ranges::all_of(std::span(settings, count), [](double x) { return std::isfinite(x); })) {
    detail::set_error(error, "four finite numbers are needed");
    return GRAVITAS_REFUSED;
  }
  *instance = new Turned(PropertyCursor({settings, count}));
  return GRAVITAS_OK;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const gravitas_plugin_table* gravitas_plugin() {
  static const gravitas_plugin_table table = [] {
    gravitas_plugin_table one = *plugin_table<Turned>();
    one.create = create;
    return one;
  }();
  return &table;
}
