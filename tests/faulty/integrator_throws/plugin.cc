// Throws in the third call.
#include <stdexcept>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) {
  throw std::runtime_error("out of ideas");
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
