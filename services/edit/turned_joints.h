// Joints whose angle limits take for another turn once an edit has set them.
//
// An angle is known within a turn. With a single limit it is the turn on its free side, so a joint that stands beyond a
// limit that was just set may count as one that comes from behind, which the limit lets go. Nobody would notice.
#pragma once

#include <string>
#include <vector>

#include "gravitas/edit/v1/edit.pb.h"
#include "kernel/environment.h"

namespace gravitas {

// Before an edit, or after it, when it has the state; `description` has who answers there.
struct EditedSide {
  const kernel::EnvironmentDescription& description;
  const kernel::Environment& environment;
};

// A warning for each. Asks who answers in hosts of their own, where the edit sets limits; who has no answer is passed
// over.
std::vector<std::string> warnings_of_turned_joints(const edit::v1::Edit& edit, const EditedSide& before,
                                                   const EditedSide& after);

}  // namespace gravitas
