// Decisions that were made are put in place where a run goes on: who answers, what follows it, and where.
#include "services/recorder/decision.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "services/edit/edited_scene.h"

namespace gravitas {
namespace {

using kernel::EnvironmentDescription;
using kernel::Hosting;
using kernel::PluginChoice;
using kernel::SlotDescription;

PluginChoice choice_of(const std::string& name, const std::string& command = {}) {
  PluginChoice choice;
  choice.declaration.name = name;
  choice.declaration.slot = Slot::kForce;
  choice.library = command.empty() ? "/plugins/" + name + ".so" : "";
  choice.command = command;
  return choice;
}

// A force A, which B follows where it fails, and C.
struct Scene {
  const PluginChoice a = choice_of("A"), b, c = choice_of("C");
  Catalog catalog;
  EnvironmentDescription description;

  explicit Scene(const std::string& command_of_b = {})
      : b(choice_of("B", command_of_b)),
        catalog({{a.library, a.declaration}, {b.library, b.declaration, b.command}, {c.library, c.declaration}}) {
    SlotDescription& force = description.force;
    force.hosting = Hosting::kSharedMemory;
    force.plugins = {a, c};
    force.plugins[0].fallback = std::make_shared<PluginChoice>(b);
  }
};

recorder::v1::Decision decided(const std::string& why, std::uint32_t step, const PluginChoice& plugin,
                               Hosting hosting = Hosting::kSharedMemory) {
  SlotDescription host;
  host.hosting = hosting;
  return message_of({Slot::kForce, 0, step, why, &host, &plugin});
}

using Decisions = std::vector<recorder::v1::Decision>;

TEST(Decision, AFallbackThatTookOverIsFollowedByNobody) {
  const Scene scene;
  EnvironmentDescription begun = scene.description;
  put_in_place(Decisions{decided("fallback B", 20, scene.b)}, scene.catalog, &begun);
  EXPECT_EQ(begun.force.plugins[0].declaration.name, "B");
  EXPECT_EQ(begun.force.plugins[0].fallback, nullptr);
  // nor after an edit
  EnvironmentDescription edited = scene.description;
  keep_who_answers(scene.description, begun, &edited);
  EXPECT_EQ(edited.force.plugins[0].declaration.name, "B");
  EXPECT_EQ(edited.force.plugins[0].fallback, nullptr);
  // as it is after any other
  begun = scene.description;
  put_in_place(Decisions{decided("settled swap", 20, scene.c)}, scene.catalog, &begun);
  ASSERT_NE(begun.force.plugins[0].fallback, nullptr);
  EXPECT_EQ(begun.force.plugins[0].fallback->declaration.name, "B");
  edited = scene.description;
  keep_who_answers(scene.description, begun, &edited);
  EXPECT_NE(edited.force.plugins[0].fallback, nullptr);
}

// Before a swap to the plugin that is the fallback, too, it was the fallback of who answered.
TEST(Decision, WhatASwapGoesBackToHasItsFallback) {
  const Scene scene;
  Decisions in_force;
  put_in_force(decided("settled swap", 5, scene.c), &in_force);
  put_in_force(decided("swap", 20, scene.b), &in_force);
  EnvironmentDescription begun = scene.description;
  put_in_place(in_force, scene.catalog, &begun);
  take_back_swaps(in_force, scene.catalog, scene.description, &begun);
  EXPECT_EQ(begun.force.plugins[0].declaration.name, "C");
  EXPECT_NE(begun.force.plugins[0].fallback, nullptr);
}

// A swap is told again where its step was broken off behind the cut-over: it went back to itself then.
TEST(Decision, ASwapThatIsToldAgainGoesBackToTheSame) {
  const Scene scene;
  Decisions in_force;
  put_in_force(decided("settled swap", 5, scene.c), &in_force);
  for (int times = 0; times < 2; ++times) put_in_force(decided("swap", 20, scene.b), &in_force);
  ASSERT_EQ(in_force.size(), 1U);
  EXPECT_EQ(in_force[0].plugin(), "B");
  EXPECT_EQ(in_force[0].before().plugin(), "C");
}

TEST(Decision, ACommandTakesNoNeighboursAlong) {
  const Scene scene("a worker of its own");
  const Decisions fallen{decided("fallback B", 20, scene.b, Hosting::kGrpc)};
  EnvironmentDescription begun = scene.description;
  put_in_place(fallen, scene.catalog, &begun);
  EXPECT_EQ(begun.force.plugins[0].command, scene.b.command);
  EXPECT_EQ(begun.force.hosting, Hosting::kSharedMemory);
  // where it has none, the slot is where it is
  begun = scene.description;
  begun.force.plugins.pop_back();
  put_in_place(fallen, scene.catalog, &begun);
  EXPECT_EQ(begun.force.hosting, Hosting::kGrpc);
  // and a library that a swap hosts elsewhere takes them
  begun = scene.description;
  put_in_place(Decisions{decided("settled swap", 20, scene.c, Hosting::kGrpc)}, scene.catalog, &begun);
  EXPECT_EQ(begun.force.hosting, Hosting::kGrpc);
}

}  // namespace
}  // namespace gravitas
