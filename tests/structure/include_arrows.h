// Which room may include which: the arrows of the design, read off the #include lines.
//
//   schemas <- plugin_sdk <- workers (each its own folder only; not the worker host)
//   schemas, plugin_sdk (not the worker host) <- kernel <- services
//   tests may include everything; nothing includes tests or deploy
//   services/scaffold/templates/ are files of projects of their own: plugin_sdk (not the worker host), and by their names
//   the headers that stand beside them there
//
// Generated headers are spelt "schemas/stage_frames.h" and "gravitas/<area>/v1/...".
#pragma once

#include <vector>

#include "tests/structure/source_tree.h"

namespace gravitas::structure {

/// Every #include, quoted or in angle brackets, that goes against an arrow, climbs with "../", or
/// is quoted without being spelt from the root of the repository.
std::vector<Finding> find_wrong_includes(const SourceTree& tree);

}  // namespace gravitas::structure
