// What the tree looks like from outside: what stands at the top, how long files and rooms are, what
// files are called.
#pragma once

#include <vector>

#include "tests/structure/source_tree.h"

namespace gravitas::structure {

/// Longest C++, proto, Python or TypeScript file, in lines: beyond it a file is more than one idea.
inline constexpr int kLongestFile = 600;
/// All C++ of kernel/ together, in lines, but for the simulators: what can be read in an afternoon.
inline constexpr int kLongestKernel = 6000;
/// A simulator, in lines: each is an order of stages of its own, in one file, and may come and go.
inline constexpr int kLongestSimulator = 150;
/// Longest README of a room, in lines: a page.
inline constexpr int kLongestReadme = 60;

/// Entries of the top level that are neither a room, nor one of the known files, nor hidden.
std::vector<Finding> find_strays_at_the_top(const SourceTree& tree);

/// Rooms without a README.md, and rooms' READMEs longer than a page.
std::vector<Finding> find_rooms_without_guide(const SourceTree& tree);

/// Source files that are too long, and the kernel when it is.
std::vector<Finding> find_overlong_sources(const SourceTree& tree);

/// Files and folders with a word in their name that says nothing: util, helper, common, misc,
/// manager.
std::vector<Finding> find_vague_names(const SourceTree& tree);

}  // namespace gravitas::structure
