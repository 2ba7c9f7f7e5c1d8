// Ends its process in the third call as a program ends whose work is done: handlers run, the exit code is 0.
#include <cstdlib>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) { std::exit(0); }

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
