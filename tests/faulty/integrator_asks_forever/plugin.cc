// Never answers the third call, but asks for derivatives all the time.
#include <vector>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply&, gravitas::Host& host) {
  std::vector<double> room;
  gravitas::Derivatives derivatives(request, host, &room);
  for (;;) derivatives.wrenches_at_start();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
