// What a recorded run is a run of: digests of everything in a scene that determines its trajectory. Ids, hosting,
// threads and how far the run goes are not part of it, so that a run may go on elsewhere and further.
#pragma once

#include <string>

#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "kernel/description.h"
#include "plugin_sdk/trajectory_hash.h"

namespace gravitas {

// Libraries are named, without their digests, which a recorder takes.
recorder::v1::Identity identity_of(const kernel::EnvironmentDescription& description);

// The parts in which a record differs from the scene, with both time steps if these do; empty if it is the same.
std::string find_difference(const recorder::v1::Identity& recorded, const recorder::v1::Identity& scene);

// One number for the identity and this build.
Hash digest_of(const recorder::v1::Identity& identity);

}  // namespace gravitas
