// Names and the slips that people make in them.
#include "plugin_sdk/near_miss.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace gravitas {
namespace {

const std::vector<std::string> kShapes = {"Sphere", "Box", "Cylinder", "Halfspace"};

TEST(NearMiss, FindsOneSlipOfEachKind) {
  EXPECT_EQ(nearest_name("Sphre", kShapes), "Sphere");         // a letter left out
  EXPECT_EQ(nearest_name("Spheere", kShapes), "Sphere");       // one too many
  EXPECT_EQ(nearest_name("Sphare", kShapes), "Sphere");        // another one
  EXPECT_EQ(nearest_name("Shpere", kShapes), "Sphere");        // two exchanged
  EXPECT_EQ(nearest_name("halfSpace", kShapes), "Halfspace");  // case
}

TEST(NearMiss, SuggestsNothingFarAway) {
  EXPECT_EQ(nearest_name("Torus", kShapes), "");
  EXPECT_EQ(nearest_name("", kShapes), "");
  EXPECT_EQ(nearest_name("x", std::vector<std::string>{"y"}), "");
  EXPECT_EQ(nearest_name(std::string(200, 'a'), std::vector<std::string>{std::string(200, 'a')}), "");
}

TEST(NearMiss, TakesTheFirstOfEquals) {
  EXPECT_EQ(nearest_name("Ball3", std::vector<std::string>{"Ball1", "Ball2"}), "Ball1");
  EXPECT_EQ(nearest_name("Ball2", std::vector<std::string>{"Ball1", "Ball2"}), "Ball2");
}

TEST(NearMiss, SaysWhatIsAllowed) {
  EXPECT_EQ(allowed_names("Bxo", kShapes), R"(did you mean "Box"? Allowed: "Sphere", "Box", "Cylinder", "Halfspace")");
  EXPECT_EQ(allowed_names("Torus", kShapes), R"(allowed: "Sphere", "Box", "Cylinder", "Halfspace")");
  EXPECT_EQ(allowed_names("Torus", {}), "none is allowed here");
}

TEST(NearMiss, CutsLongLists) {
  std::vector<std::string> names;
  for (int i = 0; i < 37; ++i) names.push_back("N" + std::to_string(i));
  EXPECT_TRUE(quoted_names(names).ends_with(R"("N11", … (37 in all))"));
}

}  // namespace
}  // namespace gravitas
