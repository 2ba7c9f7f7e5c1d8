// Never answers the third call, but marks progress all the time.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host& host) {
  for (;;) host.mark_progress();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
