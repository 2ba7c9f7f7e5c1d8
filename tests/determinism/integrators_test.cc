// Every integrator, with derivatives asked through every carrier and with its plugin_state, gives the same bits.
#include <gtest/gtest.h>

#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"

namespace gravitas {
namespace {

using kernel::Hosting;

class EveryIntegrator : public ::testing::TestWithParam<const char*> {};

void expect_same_bits(const std::string& scene, const std::string& integrator, std::uint32_t steps) {
  const auto hash_of = [&](Hosting hosting, std::uint32_t threads) {
    RunOptions options;
    options.scenes = {in_source("/tests/determinism/") + scene};
    options.steps = steps;
    options.hosting = {{std::nullopt, hosting}};
    options.threads = threads;
    options.overrides = {"Integrator=" + integrator};
    const RunResult result = harness::run_quietly(options);
    EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
    EXPECT_EQ(result.report.faults_size(), 0);
    return result.report.chain_hash();
  };
  const std::string reference = hash_of(Hosting::kDirect, 1);
  EXPECT_EQ(hash_of(Hosting::kDirect, 2), reference) << "two threads";
  EXPECT_EQ(hash_of(Hosting::kSharedMemory, 1), reference) << "in workers";
  EXPECT_EQ(hash_of(Hosting::kGrpc, 1), reference) << "by gRPC";
}

TEST_P(EveryIntegrator, GivesTheSameBitsOnEveryHosting) { expect_same_bits("afloat.gravitas", GetParam(), 60); }

// Reactions of joints, and for implicit ones their Jacobian, among the derivatives.
TEST_P(EveryIntegrator, GivesTheSameBitsOnEveryHostingWithJointsInItsDerivatives) {
  expect_same_bits("suspension.gravitas", GetParam(), 12);
}

// Impulses of joints, which that integrator asks for, and steps that joints take part in.
TEST_P(EveryIntegrator, GivesTheSameBitsOnEveryHostingWithLocksInItsDerivatives) {
  expect_same_bits("hinged.gravitas", GetParam(), 12);
}

INSTANTIATE_TEST_SUITE_P(Integrators, EveryIntegrator,
                         ::testing::Values("Euler", "SemiImplicitEuler", "Verlet", "BasicVerlet", "RK4", "RKMK4",
                                           "SymplecticSplitting", "ImplicitMidpoint", "DormandPrince54",
                                           "DormandPrince853", "Rosenbrock", "Radau"),
                         [](const auto& which) { return std::string(which.param); });

}  // namespace
}  // namespace gravitas
