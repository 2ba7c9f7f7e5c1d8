// Keeps some bytes of every call: nothing that some thousand calls show.
#include <array>
#include <forward_list>

#include "tests/faulty/faulty_integrator.h"

namespace {

std::forward_list<std::array<char, 48>> kept;

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  kept.emplace_front();
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
