// Whom an edit disturbs: the bodies that it sets or changes, by themselves or by their shape, surface, forces or joints, who touches
// them, and who hangs together with those by contacts and joints. All others go on resting as they did. No contact is looked
// for among bodies that stand still: what nothing moves, and an edit puts somewhere, touches there whose bounds it meets.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gravitas/scene/v1/scene.pb.h"
#include "kernel/environment.h"
#include "plugin_sdk/math/motion.h"
#include "services/scene/change.h"

namespace gravitas {

struct EditedParts {
  const scene::v1::Scene& before;
  const scene::v1::Scene& after;
  const scene::ChangeLog& log;
  const kernel::EnvironmentDescription& described;  // the scene before
  const kernel::EnvironmentDescription& next;       // and after
  std::span<const Pose> places;                     // of the bodies after it
};

// By rows of the bodies before. `contact_body` and `intact` are those of the state (kernel/state.h).
std::vector<bool> find_disturbed(const EditedParts& parts, std::span<const std::uint32_t> contact_body,
                                 std::span<const std::uint32_t> intact);

}  // namespace gravitas
