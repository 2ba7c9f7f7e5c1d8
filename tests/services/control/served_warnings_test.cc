// What a served run warns of.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::sample;
using harness::ScratchFolder;
using harness::Served;
using ::testing::HasSubstr;

// An explicit method takes three steps in a time of 1e-7 s, in which the damper wears off.
TEST(ServedWarnings, TellOfAStepThatTakesManyCalls) {
  const ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.steps = 2;
  options.run.scenes = {folder.write("scene", R"(
Forces { Force { Type = "Spring" Id = "Rod" CustomProperties { Stiffness = 1e7 Damping = 1e7 } } }
Simulator { CustomProperties { TimeStep = 0.01 } }
Environment { KineticIntegrator = "DormandPrince54" Space { Bodies {
  Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} LinearVelocity = {-1, 0, 0} } Forces = {"Rod"} } } } })")};
  Served served(options);
  const std::uint32_t before = served.client.status().warning_count();
  const api::Status status = served.client.step(1);
  EXPECT_EQ(status.warning_count(), before + 1U);
  EXPECT_THAT(status.last_warning(), HasSubstr("step 1 took "));
  // it, or the next one: the dearest
  EXPECT_EQ(served.client.step(1).warning_count(), before + 1U);
}

}  // namespace
}  // namespace gravitas::control
