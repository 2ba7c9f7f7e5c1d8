// Answers differently in each process: a number comes from where an object lies in memory.
#include <cstdint>

#include "tests/faulty/faulty_integrator.h"

namespace {

class Addressed final : public gravitas::IntegratorPlugin {
 public:
  static gravitas::PluginDeclaration declaration() {
    return {.name = "Addressed",
            .version = "1.0",
            .slot = gravitas::Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit Addressed(gravitas::PropertyCursor) {}

  void integrate(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply,
                 gravitas::Host&) override {
    gravitas::faulty::stand_still(request, reply);
    reply.error_estimate().set(static_cast<double>(reinterpret_cast<std::uintptr_t>(&declaration)));
  }
};

}  // namespace

GRAVITAS_PLUGIN(Addressed)
