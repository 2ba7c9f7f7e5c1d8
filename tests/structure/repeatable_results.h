// What would make results differ between machines or runs, and must not be called where results are
// made.
//
// glibc chooses sin, exp, atan and the like by processor, and the variants differ in the last bit;
// so kernel/, workers/ and plugin_sdk/ take them from plugin_sdk/math, whose code is fixed. Eigen's
// rotations by angle call glibc's inside. The order in which an unordered container is walked
// depends on addresses and on the library.
#pragma once

#include <vector>

#include "tests/structure/source_tree.h"

namespace gravitas::structure {

/// In kernel/, workers/ and plugin_sdk/: calls of libm's transcendental functions, whether std::,
/// global or built in (plugin_sdk/math/ alone may mention them); Eigen's operations that call them;
/// unordered containers.
std::vector<Finding> find_unrepeatable(const SourceTree& tree);

}  // namespace gravitas::structure
