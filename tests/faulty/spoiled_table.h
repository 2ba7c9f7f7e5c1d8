// The table of a plugin that does nothing and would load, for plugins whose table is wrong in one
// entry. Each bad plugin of this kind is one function.
#pragma once

#include "plugin_sdk/plugin.h"

namespace gravitas::faulty {

class Harmless final : public SpacePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Harmless", .version = "1.0", .slot = Slot::kSpace, .meaning = "Is not loaded, on purpose."};
  }
  explicit Harmless(PropertyCursor) {}
  void pairs(const stage::SpacePairsRequest&, const stage::SpacePairsReply&, Host&) override {}
};

template <auto kSpoil>
const gravitas_plugin_table* spoiled_table() {
  static const gravitas_plugin_table table = [] {
    gravitas_plugin_table good = *plugin_table<Harmless>();
    kSpoil(&good);
    return good;
  }();
  return &table;
}

}  // namespace gravitas::faulty

// What such a library exports instead of GRAVITAS_PLUGIN.
#define GRAVITAS_SPOILED_PLUGIN(spoil)                                                               \
  extern "C" __attribute__((visibility("default"))) const gravitas_plugin_table* gravitas_plugin() { \
    return gravitas::faulty::spoiled_table<spoil>();                                                 \
  }
