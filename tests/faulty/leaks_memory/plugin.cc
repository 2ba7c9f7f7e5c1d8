// Keeps a page of memory of every call.
#include <memory>
#include <vector>

#include "tests/faulty/faulty_integrator.h"

namespace {

constexpr std::size_t kPage = 4096;

std::vector<std::unique_ptr<char[]>> kept;

void misbehave(const gravitas::faulty::Request& request, const gravitas::faulty::Reply& reply, gravitas::Host&) {
  gravitas::faulty::stand_still(request, reply);
  kept.push_back(std::make_unique<char[]>(kPage));
}

}  // namespace

GRAVITAS_PLUGIN(gravitas::faulty::FaultyIntegrator<misbehave>)
