// Hands out plugin_state that is only a name for what it keeps in its process: in another process the name means
// nothing.
#include <map>

#include "tests/faulty/faulty_integrator.h"

namespace {

class Forgetful final : public gravitas::IntegratorPlugin {
 public:
  static gravitas::PluginDeclaration declaration() {
    return {.name = "Forgetful",
            .version = "1.0",
            .slot = gravitas::Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .capabilities = {"plugin_state"},
            .theta = 1.0};
  }
  explicit Forgetful(gravitas::PropertyCursor) {}

  void integrate(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply,
                 gravitas::Host&) override {
    gravitas::faulty::stand_still(request, reply);
    // the same name for the same request, so that asking twice shows nothing
    const double name = request.time() + 1.0;
    const auto known = request.plugin_state().empty() ? history_.end() : history_.find(request.plugin_state()[0]);
    reply.error_estimate().set(known == history_.end() ? 0.0 : known->second);
    history_[name] = 0.5;
    reply.plugin_state().push(name);
  }

 private:
  std::map<double, double> history_;
};

}  // namespace

GRAVITAS_PLUGIN(Forgetful)
