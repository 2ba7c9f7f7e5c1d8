// Fails in the third call with a reason that is no UTF-8: it is written in Latin-1, and too long.
#include <stdexcept>
#include <string>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) {
  throw std::runtime_error("zu k\xfchl: " + std::string(600, '\xe4'));
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
