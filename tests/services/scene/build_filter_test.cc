// The collision filter: every kind of rule, with every kind of exception and either default, and what the bits of the
// bodies then allow.
#include "services/scene/build_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using kernel::BodyDescription;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct MemberOfGroups {
  std::string id;
  std::set<std::string> groups;
};

std::string quoted_list(const std::vector<std::string>& names) {
  std::string text = "{";
  for (const std::string& name : names) text += (text.size() > 1 ? ", \"" : "\"") + name + '"';
  return text + "}";
}

std::string scene_text(const std::vector<MemberOfGroups>& bodies, const std::string& filter) {
  std::string text = "Geometries { Geometry { Type = \"Sphere\" Id = \"Unit\" CustomProperties { Radius = 0.5 } } }\n";
  text += "Environment { Space { Type = \"Grid\" Bodies {\n";
  for (const MemberOfGroups& body : bodies) {
    text += "Body { Id = \"" + body.id + "\" GeometryId = \"Unit\" Mass = 1 CollisionGroups = " +
            quoted_list({body.groups.begin(), body.groups.end()}) + " }\n";
  }
  return text + "} }\n" + filter + "}";
}

// What a rule names, decided as the words of the thesis have it.
struct TestRule {
  enum class Kind { kBody, kBodies, kGroup, kGroups } kind;
  std::string one, other;
  bool allow;

  bool names(const MemberOfGroups& a, const MemberOfGroups& b) const {
    switch (kind) {
      case Kind::kBody:
        return a.id == one || b.id == one;
      case Kind::kBodies:
        return (a.id == one && b.id == other) || (a.id == other && b.id == one);
      case Kind::kGroup:
        return a.groups.contains(one) || b.groups.contains(one);
      case Kind::kGroups:
        return (a.groups.contains(one) && b.groups.contains(other)) ||
               (a.groups.contains(other) && b.groups.contains(one));
    }
    return false;
  }
  std::string text() const {
    constexpr const char* kNames[] = {"Body", "Bodies", "Group", "Groups"};
    const bool is_list = kind == Kind::kBodies || kind == Kind::kGroups;
    return std::string("Rule { Allow = ") + (allow ? "true " : "false ") + kNames[static_cast<int>(kind)] + " = " +
           (is_list ? quoted_list({one, other}) : '"' + one + '"') + " }\n";
  }
};

struct TestFilter {
  std::vector<TestRule> rules, exceptions;
  bool default_allow = true;

  bool allows(const MemberOfGroups& a, const MemberOfGroups& b) const {
    for (const TestRule& rule : exceptions)
      if (rule.names(a, b)) return rule.allow;
    for (const TestRule& rule : rules)
      if (rule.names(a, b)) return rule.allow;
    return default_allow;
  }
  std::string text() const {
    std::string text =
        std::string("CollisionFilter { DefaultAllow = ") + (default_allow ? "true" : "false") + "\nRules {\n";
    for (const TestRule& rule : rules) text += rule.text();
    text += "}\nExceptions {\n";
    for (const TestRule& rule : exceptions) text += rule.text();
    return text + "} }\n";
  }
};

// As the pair rule of the spaces has it.
bool bits_allow(const BodyDescription& a, const BodyDescription& b) {
  return (a.filter_group & b.filter_mask) != 0 && (b.filter_group & a.filter_mask) != 0;
}

void expect_filter(const std::vector<MemberOfGroups>& bodies, const TestFilter& filter) {
  const BuiltScene built = build(scene_text(bodies, filter.text()));
  ASSERT_THAT(built.errors(), IsEmpty()) << filter.text();
  const std::vector<BodyDescription>& rows = built.description->bodies;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (std::size_t k = i + 1; k < bodies.size(); ++k) {
      ASSERT_EQ(bits_allow(rows[i], rows[k]), filter.allows(bodies[i], bodies[k]))
          << bodies[i].id << " and " << bodies[k].id << " with\n"
          << filter.text();
    }
  }
}

// "AB" is in two groups; "A2" is as "A" is; "None" is in no group.
std::vector<MemberOfGroups> few_bodies() {
  return {{"A", {"G"}}, {"A2", {"G"}}, {"AB", {"G", "H"}}, {"B", {"H"}}, {"None", {}}, {"None2", {}}};
}

// Each kind with either decision, and none.
std::vector<std::optional<TestRule>> every_rule() {
  using Kind = TestRule::Kind;
  std::vector<std::optional<TestRule>> rules = {std::nullopt};
  for (const bool allow : {false, true}) {
    rules.push_back(TestRule{Kind::kBody, "A", "", allow});
    rules.push_back(TestRule{Kind::kBodies, "A", "B", allow});
    rules.push_back(TestRule{Kind::kGroup, "H", "", allow});
    rules.push_back(TestRule{Kind::kGroups, "G", "H", allow});
    rules.push_back(TestRule{Kind::kGroups, "G", "G", allow});
  }
  return rules;
}

TEST(BuildFilter, HoldsForEveryRuleWithEveryExceptionAndDefault) {
  for (const std::optional<TestRule>& rule : every_rule()) {
    for (const std::optional<TestRule>& exception : every_rule()) {
      for (const bool default_allow : {false, true}) {
        TestFilter filter;
        filter.default_allow = default_allow;
        if (rule) filter.rules = {*rule};
        if (exception) filter.exceptions = {*exception};
        expect_filter(few_bodies(), filter);
        if (HasFatalFailure()) return;
      }
    }
  }
}

// The thesis' own example: rocks meet the cliff and not each other.
TEST(BuildFilter, RocksOfAnAvalancheMeetTheCliffAlone) {
  const std::vector<MemberOfGroups> bodies = {
      {"Cliff", {}}, {"Rock1", {"Rocks"}}, {"Rock2", {"Rocks"}}, {"Rock3", {"Rocks"}}};
  const BuiltScene built =
      build(scene_text(bodies, "CollisionFilter { Rules { Rule { Allow = false Groups = {\"Rocks\", \"Rocks\"} } } }"));
  ASSERT_THAT(built.errors(), IsEmpty());
  const std::vector<BodyDescription>& rows = built.description->bodies;
  for (std::size_t i = 1; i < 4; ++i) {
    EXPECT_TRUE(bits_allow(rows[0], rows[i]));
    for (std::size_t k = i + 1; k < 4; ++k) EXPECT_FALSE(bits_allow(rows[i], rows[k]));
  }
}

TEST(BuildFilter, TheFirstRuleThatNamesAPairDecides) {
  using Kind = TestRule::Kind;
  TestFilter filter;
  filter.rules = {{Kind::kBodies, "A", "B", true}, {Kind::kGroup, "H", "", false}, {Kind::kBody, "AB", "", true}};
  expect_filter(few_bodies(), filter);
  filter.default_allow = false;
  filter.exceptions = {{Kind::kBody, "None", "", true}, {Kind::kBodies, "None", "A", false}};
  expect_filter(few_bodies(), filter);
}

TEST(BuildFilter, HoldsForRandomFilters) {
  using Kind = TestRule::Kind;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    conformance::Draw random(seed);
    std::vector<MemberOfGroups> bodies(2 + random.below(20));
    constexpr std::array kGroups = {"G", "H", "I", "J"};
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].id = "Body" + std::to_string(i);
      for (const char* group : kGroups)
        if (i == 0 || random.below(3) == 0) bodies[i].groups.insert(group);
    }
    const auto draw_rule = [&] {
      const auto kind = static_cast<Kind>(random.below(4));
      const bool is_group = kind == Kind::kGroup || kind == Kind::kGroups;
      const auto count = static_cast<std::uint32_t>(bodies.size());
      const std::uint32_t first = random.below(count), second = (first + 1 + random.below(count - 1)) % count;
      if (is_group) return TestRule{kind, kGroups[random.below(4)], kGroups[random.below(4)], random.below(2) == 0};
      return TestRule{kind, bodies[first].id, bodies[second].id, random.below(2) == 0};
    };
    TestFilter filter;
    filter.default_allow = random.below(2) == 0;
    for (std::uint32_t i = random.below(6); i > 0; --i) filter.rules.push_back(draw_rule());
    for (std::uint32_t i = random.below(4); i > 0; --i) filter.exceptions.push_back(draw_rule());
    ASSERT_NO_FATAL_FAILURE(expect_filter(bodies, filter)) << "seed " << seed;
  }
}

// ---- more kinds than bits

std::vector<MemberOfGroups> numbered_bodies(int count) {
  std::vector<MemberOfGroups> bodies;
  for (int i = 0; i < count; ++i) bodies.push_back({"B" + std::to_string(i), {}});
  return bodies;
}

TEST(BuildFilter, LinksOfAChainIgnoreTheirNeighbours) {
  TestFilter filter;
  for (int i = 0; i + 1 < 150; ++i) {
    filter.rules.push_back({TestRule::Kind::kBodies, "B" + std::to_string(i), "B" + std::to_string(i + 1), false});
  }
  expect_filter(numbered_bodies(150), filter);
}

TEST(BuildFilter, TwoHundredPairsIgnoreEachOther) {
  TestFilter filter;
  for (int i = 0; i < 400; i += 2)
    filter.rules.push_back({TestRule::Kind::kBodies, "B" + std::to_string(i), "B" + std::to_string(i + 1), false});
  expect_filter(numbered_bodies(400), filter);
}

TEST(BuildFilter, AHundredBodiesTouchNothing) {
  TestFilter filter;
  for (int i = 0; i < 100; ++i) filter.rules.push_back({TestRule::Kind::kBody, "B" + std::to_string(i), "", false});
  expect_filter(numbered_bodies(110), filter);
}

// Half of all pairs of 90 bodies, drawn: no 64 rectangles make that.
TEST(BuildFilter, RefusesWhatItsBitsCannotHold) {
  conformance::Draw random(1);
  TestFilter filter;
  for (int i = 0; i < 90; ++i) {
    for (int k = i + 1; k < 90; ++k) {
      if (random.below(2) == 0) continue;
      filter.rules.push_back({TestRule::Kind::kBodies, "B" + std::to_string(i), "B" + std::to_string(k), false});
    }
  }
  EXPECT_THAT(build(scene_text(numbered_bodies(90), filter.text())).errors(),
              ElementsAre(HasSubstr("the CollisionFilter tells 90 kinds of bodies apart, in a way that 64 bits cannot "
                                    "hold; allowed: fewer kinds")));
}

TEST(BuildFilter, SaysThatThereAreTooManyKinds) {
  TestFilter filter;
  for (int i = 0; i < 2100; ++i) filter.rules.push_back({TestRule::Kind::kBody, "B" + std::to_string(i), "", false});
  for (int i = 0; i < 2100; ++i)
    filter.rules.push_back(
        {TestRule::Kind::kBodies, "B" + std::to_string(i), "B" + std::to_string((i + 1) % 2100), true});
  EXPECT_THAT(build(scene_text(numbered_bodies(2101), filter.text())).errors(),
              ElementsAre(HasSubstr("kinds of bodies apart, more than 2048; allowed: fewer kinds")));
}

// ---- mistakes

std::vector<std::string> filter_errors_of(const std::string& rule) {
  return build(scene_text(few_bodies(), "CollisionFilter { Rules {\n" + rule + "\n} }")).errors();
}

TEST(BuildFilter, RefusesRulesThatNameNothing) {
  EXPECT_THAT(
      filter_errors_of("Rule { Allow = false }"),
      ElementsAre("scene:11:1: error: a Rule names its pairs by one of Body, Bodies, Group, Groups; here are 0"));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Body = \"A\" Group = \"G\" }"),
              ElementsAre(HasSubstr("here are 2")));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Bodies = {\"A\"} }"),
              ElementsAre("scene:11:31: error: Bodies is a list of 1; required: 2 names"));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Groups = {\"G\", \"H\", \"G\"} }"),
              ElementsAre("scene:11:31: error: Groups is a list of 3; required: 2 names"));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Bodies = {\"A\", \"A\"} }"),
              ElementsAre("scene:11:31: error: Bodies names \"A\" twice; required: two bodies"));
  EXPECT_THAT(filter_errors_of("Rule { Body = \"A\" }"), ElementsAre(HasSubstr("Rule without Allow")));
}

TEST(BuildFilter, RefusesNamesThatAreNotThere) {
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Body = \"Nine\" }"),
              ElementsAre(HasSubstr("Body names no Body: \"Nine\"; did you mean \"None\"?")));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Bodies = {\"A\", \"X9\"} }"),
              ElementsAre(HasSubstr("Bodies names no Body: \"X9\"")));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Group = \"K\" }"),
              ElementsAre(HasSubstr("Group names no group of any body's CollisionGroups: \"K\"; ")));
  EXPECT_THAT(filter_errors_of("Rule { Allow = false Groups = {\"G\", \"Hh\"} }"),
              ElementsAre(HasSubstr("\"Hh\"; did you mean \"H\"? Allowed: \"G\", \"H\"")));
}

// ---- what stays as it was

TEST(BuildFilter, WithoutOneEverythingIsAllowed) {
  const BuiltScene built = build(scene_text(few_bodies(), ""));
  for (const BodyDescription& body : built.description->bodies) {
    EXPECT_EQ(body.filter_group, 1U);
    EXPECT_EQ(body.filter_mask, ~std::uint64_t{0});
  }
}

TEST(BuildFilter, ADefaultIsOverriddenFromOutside) {
  const std::string text = scene_text(few_bodies(), "CollisionFilter { }");
  const BuiltScene open = build(text), closed = build(text, {"Environment.CollisionFilter.DefaultAllow=false"});
  ASSERT_THAT(closed.errors(), IsEmpty());
  EXPECT_TRUE(bits_allow(open.description->bodies[0], open.description->bodies[1]));
  EXPECT_FALSE(bits_allow(closed.description->bodies[0], closed.description->bodies[1]));
}

}  // namespace
}  // namespace gravitas::scene
