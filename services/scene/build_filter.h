// The collision filter (§ 3.4.3, § 3.4.4): rules about bodies and groups, compiled to two words of bits a body.
#pragma once

#include "services/scene/build_context.h"

namespace gravitas::scene {

// Fills filter_group and filter_mask of description.bodies, whose rows are complete, so that a pair (a, b) is allowed if
// and only if group(a) & mask(b) and group(b) & mask(a) are both non-zero: the rule that every space asks.
//
// Of a pair decides the first exception that names it, else the first rule that does, else DefaultAllow. A filter that
// needs more than the 64 bits is refused (filter_bits.h says which do).
void build_filter(const IdIndex& bodies, BuildContext* context);

}  // namespace gravitas::scene
