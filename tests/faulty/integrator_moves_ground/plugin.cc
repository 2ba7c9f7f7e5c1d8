// Moves a body that cannot move in the third call.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  reply.position().resize(request.position().size())[0] += 1.0;
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
