// Asks for room for 2^40 numbers in the third call.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  reply.plugin_state().resize(std::uint64_t{1} << 40);
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
