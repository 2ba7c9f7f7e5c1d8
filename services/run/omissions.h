// What plugins need not do for a scene, found in its description: work that is left out row by row inside of a slot, as
// the kernel's plan (kernel/plan.h) leaves out whole slots. Exact: what is left out would change no bit.
#pragma once

#include <vector>

#include "kernel/environment.h"

namespace gravitas {

// Nothing about slots that the plan leaves out altogether.
//   "friction"              contacts are one row instead of three: no two bodies that may touch have friction between them
//   "rolling friction"      and no rows of turning
//   "surface perturbation"  no random numbers are drawn
//   "manifolds"             one contact a pair, nothing to reduce, bounds that do not turn: spheres and half-spaces alone
//   "times of impact"       collision is not asked for them: the simulator stops at none
//   "physics checks"        answers are checked for form and numbers alone: CheckPhysicsEvery is 0
std::vector<kernel::LeftOut> omissions(const kernel::Environment& environment,
                                       const kernel::EnvironmentDescription& description);

}  // namespace gravitas
