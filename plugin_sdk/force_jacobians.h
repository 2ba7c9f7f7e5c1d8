// For authors of forces: the answers of Force.Jacobians.
#pragma once

#include <cstdint>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas {

// Adds a block: how the wrench on `body` changes with the state of `by`. Throws Refusal where it is not finite.
void push_block(const stage::ForceJacobiansReply& reply, std::uint32_t body, std::uint32_t by,
                const JacobianBlock& block);

// Answers for forces whose wrench on a body depends on that body's state alone: a block for each application whose wrench is
// not constant, by central differences of wrenches(), all bodies at once (24 calls, whatever their number). Steps are 1e-6
// m and rad, and of velocities 1e-6 of them, at least of 1 m/s and 1 rad/s; positions far from the origin take longer ones.
// Error: 1e-10 of a wrench that changes over lengths of 1 m.
void difference_own_states(ForcePlugin& force, const stage::ForceWrenchesRequest& request,
                           const stage::ForceJacobiansReply& reply, Host& host);

// The base of such forces, which declare the capability `jacobians`.
class OwnStateForce : public ForcePlugin {
 public:
  void jacobians(const stage::ForceWrenchesRequest& request, const stage::ForceJacobiansReply& reply,
                 Host& host) override {
    difference_own_states(*this, request, reply, host);
  }
};

}  // namespace gravitas
