// Every path that the documents name exists, so that a reader who follows them never ends in
// nothing.
#pragma once

#include <filesystem>
#include <vector>

#include "tests/structure/source_tree.h"

namespace gravitas::structure {

/// Paths in Markdown files that lead nowhere.
///
/// Looked at are the words inside `backticks` that begin with a room ("kernel/step.cc",
/// "./deploy/run"), and the targets of [links](that) which are no web address, taken from the
/// document's folder. Left out are fenced blocks, what is in build/, and patterns (with one of * <
/// > { } $ … or ...). A line number at the end (":12") is cut off. A path counts as existing when
/// it names a file or folder of the tree, or one below `generated`, where the build puts the
/// headers it makes.
std::vector<Finding> find_dead_paths(const SourceTree& tree, const std::filesystem::path& generated);

}  // namespace gravitas::structure
