// Free bodies for questions to an integrator: written body by body, stepped with what it answers.
#pragma once

#include <vector>

#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/integrator.h"

namespace gravitas::conformance {

struct FreeBody {
  double mass = 2.0;
  Vector3 moments = Vector3(1, 2, 4);  // principal, kg m^2
  double damping = 0.0;                // 1/s
  BodyState state = {};
  Wrench wrench = {};  // constant
  std::uint32_t flags = kMovable;
};

class FreeBodies {
 public:
  double time = 0.0;
  double time_step = 0.01;
  std::vector<FreeBody> bodies;
  std::vector<double> plugin_state;
  std::vector<std::uint32_t> changed;  // empty: nothing was
  // Answers the derivative; without it the bodies' own wrenches, said to be constant.
  DerivativeFunction derivative;
  std::uint32_t jacobian_blocks = 0;  // that it answers, at most

  MessageColumns request() const;
  // What answers the derivatives of request().
  DerivativeFunction answers() const;
  // One call; its answer is checked for unit attitudes.
  MessageColumns ask(Inquiry* inquiry) const;
  // S* becomes the state.
  void step(Inquiry* inquiry);
  void steps(Inquiry* inquiry, int count);

  static BodyState state_in(const MessageColumns& reply, std::size_t body);
};

}  // namespace gravitas::conformance
