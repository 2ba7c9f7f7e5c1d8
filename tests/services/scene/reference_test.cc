#include "services/scene/reference.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace gravitas::scene {
namespace {

TEST(Reference, TheCommittedPageIsThatOfTheGrammarAndThePlugins) {
  const Catalog catalog =
      Catalog::installed(GRAVITAS_BINARY_DIR "/bin/gravitas-worker", GRAVITAS_BINARY_DIR "/lib/gravitas");
  std::ifstream file(GRAVITAS_SOURCE_DIR "/services/scene/REFERENCE.md");
  std::stringstream committed;
  committed << file.rdbuf();
  EXPECT_EQ(committed.str(), reference_page(catalog))
      << "renew it: build/release/bin/gravitas describe --reference > services/scene/REFERENCE.md";
}

}  // namespace
}  // namespace gravitas::scene
