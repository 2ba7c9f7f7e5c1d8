// Answers with a quaternion of length 1.1 in the third call.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  const std::size_t size = request.orientation().size();
  for (double& number : reply.orientation().resize(size)) number *= 1.1;
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
