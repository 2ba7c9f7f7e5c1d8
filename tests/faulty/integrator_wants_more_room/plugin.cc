// Asks for more room from the third call on, whatever it has, and does not say how much.
#include <utility>

#include "tests/faulty/faulty_integrator.h"

namespace {

using namespace gravitas;

bool is_hungry = false;

void misbehave(const faulty::Request& request, const faulty::Reply& reply, Host&) {
  faulty::stand_still(request, reply);
  is_hungry = true;
}

using Hungry = faulty::FaultyIntegrator<misbehave>;

std::int32_t call(void* instance, std::uint32_t method, const gravitas_column* request, gravitas_reply_column* reply,
                  const gravitas_host* host, gravitas_error* error) {
  const std::int32_t status = plugin_table<Hungry>()->call(instance, method, request, reply, host, error);
  return std::exchange(is_hungry, false) ? GRAVITAS_NEEDS_CAPACITY : status;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const gravitas_plugin_table* gravitas_plugin() {
  static const gravitas_plugin_table table = [] {
    gravitas_plugin_table one = *plugin_table<Hungry>();
    one.call = call;
    return one;
  }();
  return &table;
}
