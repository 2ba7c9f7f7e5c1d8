// Values lie flattened by the declaration of the plugin of before: who takes its place must read them the same.
#include "plugin_sdk/stand_in.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace gravitas {
namespace {

PluginDeclaration force_with(std::vector<Property> properties) {
  return {
      .name = "F", .version = "1", .slot = Slot::kForce, .meaning = "", .types = {{"Pull", "", std::move(properties)}}};
}

std::string why(const PluginDeclaration& now, const PluginDeclaration& next) {
  return why_no_stand_in(now, next, std::vector<std::string>{"Pull"});
}

TEST(StandIn, HasTheSlotAndTheTypesInUse) {
  const PluginDeclaration now = force_with({});
  EXPECT_EQ(why(now, now), "");
  PluginDeclaration other = now;
  other.types[0].name = "Push";
  EXPECT_EQ(why(now, other), "it does not serve the type 'Pull'");
  EXPECT_EQ(why_no_stand_in(now, other, {}), "");
  other.slot = Slot::kSolver;
  EXPECT_EQ(why(now, other), "it is a plugin of slot solver");
}

TEST(StandIn, HasTheSamePropertiesInTheSameOrder) {
  const Property a = Property::number("A", "N"), b = Property::number("B", "N"), flag = Property::flag("A");
  const std::string reason = "its type 'Pull' has other properties than that of F";
  EXPECT_EQ(why(force_with({a, b}), force_with({b, a})), reason);
  EXPECT_EQ(why(force_with({a, b}), force_with({a})), reason);
  EXPECT_EQ(why(force_with({a}), force_with({flag})), reason);
  EXPECT_EQ(why(force_with({Property::table("T", 2, "m", "")}), force_with({Property::table("T", 3, "m", "")})),
            reason);
}

TEST(StandIn, HasTheSameChoicesInTheSamePlaces) {
  const auto frame = [](std::vector<std::string> choices) {
    return force_with({Property::choice("Frame", std::move(choices))});
  };
  const std::string reason = "its type 'Pull' has other properties than that of F";
  EXPECT_EQ(why(frame({"World", "Body"}), frame({"World", "Body"})), "");
  EXPECT_EQ(why(frame({"World", "Body"}), frame({"Body", "World"})), reason);
  EXPECT_EQ(why(frame({"World", "Body"}), frame({"World"})), reason);
  // one that no scene has chosen so far
  EXPECT_EQ(why(frame({"World", "Body"}), frame({"World", "Body", "Path"})), "");
}

}  // namespace
}  // namespace gravitas
