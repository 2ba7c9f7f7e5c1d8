// Never answers the third call.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) {
  for (volatile bool forever = true; forever;) {
  }
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
