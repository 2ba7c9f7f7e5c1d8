// Answers for more bodies than there is room for, from the third call on, and says that all is well.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  reply.plugin_state().resize(200'000);
}

using Overfull = gravitas::faulty::FaultyIntegrator<misbehave>;

std::int32_t call_and_say_ok(void* instance, std::uint32_t method, const gravitas_column* request,
                             gravitas_reply_column* reply, const gravitas_host* host, gravitas_error* error) {
  const std::int32_t status = gravitas::plugin_table<Overfull>()->call(instance, method, request, reply, host, error);
  return status == GRAVITAS_NEEDS_CAPACITY ? GRAVITAS_OK : status;
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const gravitas_plugin_table* gravitas_plugin() {
  static const gravitas_plugin_table table = [] {
    gravitas_plugin_table changed = *gravitas::plugin_table<Overfull>();
    changed.call = call_and_say_ok;
    return changed;
  }();
  return &table;
}
