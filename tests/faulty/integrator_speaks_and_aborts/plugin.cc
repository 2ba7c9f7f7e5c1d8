// Writes a line on standard output, one on standard error and gives up, in the third call.
#include <cstdio>
#include <cstdlib>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) {
  std::printf("three calls are enough\n");
  std::fprintf(stderr, "it cannot go on");  // a line that is only begun
  std::abort();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
