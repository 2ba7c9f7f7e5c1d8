// The same in a thread of its own, while its third call waits for it.
#include <cstdlib>
#include <thread>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply&, gravitas::Host&) {
  std::thread([] { std::exit(0); }).join();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
