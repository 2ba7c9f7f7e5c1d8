// Answers with a position that is not a number in the third call.
#include <limits>

#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  const std::size_t size = request.position().size();
  reply.position().resize(size)[size - 1] = std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
