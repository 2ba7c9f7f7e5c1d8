// Answers with the velocities of the request before.
#include <vector>

#include "tests/faulty/faulty_integrator.h"

namespace {

std::vector<double> last;

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  const std::span<double> velocity = reply.linear_velocity().resize(request.linear_velocity().size());
  for (std::size_t i = 0; i < std::min(velocity.size(), last.size()); ++i) velocity[i] = last[i];
  last.assign(request.linear_velocity().begin(), request.linear_velocity().end());
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
