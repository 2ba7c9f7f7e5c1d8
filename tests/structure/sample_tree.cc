#include "tests/structure/sample_tree.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <stdexcept>
#include <system_error>

namespace gravitas::structure {

SampleTree::SampleTree(const std::map<std::string, std::string>& files) {
  std::string pattern = testing::TempDir() + "/structure_XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make " + pattern);
  root_ = pattern;
  for (const auto& [path, content] : files) {
    std::filesystem::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << content;
  }
}

SampleTree::SampleTree(const std::string& path, const std::string& content)
    : SampleTree(std::map<std::string, std::string>({{path, content}})) {}

SampleTree::~SampleTree() {
  std::error_code ignored;
  std::filesystem::remove_all(root_, ignored);
}

}  // namespace gravitas::structure
