#include "services/scene/reference.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/paths.h"

namespace gravitas::scene {
namespace {

TEST(Reference, TheCommittedPageIsThatOfTheGrammarAndThePlugins) {
  const Catalog catalog = Catalog::installed(in_build("/bin/gravitas-worker"), in_build("/lib/gravitas"));
  std::ifstream file(in_source("/services/scene/REFERENCE.md"));
  std::stringstream committed;
  committed << file.rdbuf();
  EXPECT_EQ(committed.str(), reference_page(catalog))
      << "renew it: build/release/bin/gravitas describe --reference > services/scene/REFERENCE.md";
}

}  // namespace
}  // namespace gravitas::scene
