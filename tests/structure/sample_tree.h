// A small tree on disk for showing that a check finds what it is there to find. Gone with the
// object.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "tests/structure/source_tree.h"

namespace gravitas::structure {

class SampleTree {
 public:
  /// Writes the files (path from the root of the tree → content) into a new folder of its own.
  explicit SampleTree(const std::map<std::string, std::string>& files);
  /// Writes one file.
  SampleTree(const std::string& path, const std::string& content);
  ~SampleTree();
  SampleTree(const SampleTree&) = delete;
  SampleTree& operator=(const SampleTree&) = delete;

  [[nodiscard]] SourceTree tree() const { return tree_of_folder(root_); }

 private:
  std::filesystem::path root_;
};

}  // namespace gravitas::structure
