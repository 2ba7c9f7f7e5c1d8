// An integrator that is right until its third call and then does what its name says. Each bad plugin of this
// kind is one function.
#pragma once

#include "plugin_sdk/integrator.h"

namespace gravitas::faulty {

using Request = stage::IntegratorIntegrateRequest;
using Reply = stage::IntegratorIntegrateReply;

// S* = S_n.
inline void stand_still(const Request& request, const Reply& reply) {
  for_each_body(request, reply, [](std::size_t, const BodyState& state) { return state; });
}

inline PluginDeclaration declaration() {
  return {
      .name = "Faulty", .version = "1.0", .slot = Slot::kIntegrator, .meaning = "Misbehaves on purpose.", .theta = 1.0};
}

// `kMisbehave` is called as misbehave(request, reply, host) from the third call on; if it returns, its answer stands.
template <auto kMisbehave>
class FaultyIntegrator final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() { return faulty::declaration(); }
  explicit FaultyIntegrator(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    if (++calls_ >= 3) {
      kMisbehave(request, reply, host);
    } else {
      stand_still(request, reply);
    }
  }

 private:
  int calls_ = 0;
};

}  // namespace gravitas::faulty
