// Leaves a file open in every call, until there are no descriptors any more.
#include <fcntl.h>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  if (open("/dev/null", O_RDONLY | O_CLOEXEC) < 0) return;
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
