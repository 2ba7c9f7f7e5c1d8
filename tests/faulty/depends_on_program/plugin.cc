// Answers differently in the worker program and in any other, as when it is hosted direct.
#include <unistd.h>

#include <array>
#include <string_view>

#include "tests/faulty/faulty_integrator.h"

namespace {

bool is_in_worker() {
  std::array<char, 4096> path;
  const ssize_t size = readlink("/proc/self/exe", path.data(), path.size());
  return size > 0 && std::string_view(path.data(), static_cast<std::size_t>(size)).ends_with("/gravitas-worker");
}

class ProgramReader final : public gravitas::IntegratorPlugin {
 public:
  static gravitas::PluginDeclaration declaration() {
    return {.name = "ProgramReader",
            .version = "1.0",
            .slot = gravitas::Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit ProgramReader(gravitas::PropertyCursor) {}

  void integrate(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply,
                 gravitas::Host&) override {
    gravitas::faulty::stand_still(request, reply);
    reply.error_estimate().set(is_in_worker() ? 1.0 : 0.0);
  }
};

}  // namespace

GRAVITAS_PLUGIN(ProgramReader)
