// Answers, from the third call on, with far too many rows in several columns at once, so that room has to be made for
// all of them before the answer can be seen to be wrong.
#include "tests/faulty/faulty_integrator.h"

namespace {

void misbehave(const gravitas::faulty::Request&, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  constexpr std::size_t kRows = 200'000;
  for (double& number : reply.position().resize(3 * kRows)) number = 0.0;
  for (double& number : reply.orientation().resize(4 * kRows)) number = 0.0;
  for (double& number : reply.linear_velocity().resize(3 * kRows)) number = 0.0;
  for (double& number : reply.angular_velocity().resize(3 * kRows)) number = 0.0;
  reply.error_estimate().set(0.0);
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
