// Never answers the third call, but asks for derivatives all the time.
#include <vector>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply&, gravitas::Host& host) {
  std::vector<double> room;
  gravitas::Derivatives derivatives(request, host, &room);
  for (;;) {
    derivatives.wrenches_at_start();
    // some microseconds of work, so that the time is spent here
    for (volatile int i = 0; i < 10'000; i = i + 1) {
    }
  }
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
