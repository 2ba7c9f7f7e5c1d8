// A run that is interrupted in the middle of a step, wherever in it: the step is given up, and what was committed is that of
// a run that ends there.
#include <gtest/gtest.h>

#include <string>

#include "services/run/session.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using kernel::Hosting;

RunResult run_sample(Hosting hosting, const std::string& integrator, std::uint32_t steps,
                     const std::function<bool()>& interrupted) {
  RunOptions options;
  options.scenes = {kSample};
  options.hosting = {{std::nullopt, hosting}};
  options.overrides = {"Integrator=" + integrator};
  options.steps = steps;
  return run(options, interrupted, [](const Progress&) {});
}

class Interruption : public ::testing::TestWithParam<Hosting> {};
INSTANTIATE_TEST_SUITE_P(Of, Interruption, ::testing::Values(Hosting::kDirect, Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(Interruption, LeavesTheLastCommit) {
  for (const char* integrator : {"RK4", "Radau"}) {
    int in_a_step = 0;
    for (int questions = 100; questions < 124; questions += GetParam() == Hosting::kDirect ? 1 : 6) {
      int asked = 0;
      const RunResult result = run_sample(GetParam(), integrator, 200, [&] { return ++asked > questions; });
      EXPECT_EQ(result.outcome, RunOutcome::kInterrupted);
      // the one that says so, and no other call after it
      EXPECT_EQ(asked, questions + 1);
      const auto steps = static_cast<std::uint32_t>(result.report.steps());
      ASSERT_GT(steps, 0U);
      const RunResult quiet = run_sample(Hosting::kDirect, integrator, steps, [] { return false; });
      EXPECT_EQ(result.report.chain_hash(), quiet.report.chain_hash()) << integrator << ", " << questions;
      EXPECT_EQ(result.report.energy().final(), quiet.report.energy().final());
      int of_whole_steps = 0;
      run_sample(GetParam(), integrator, steps, [&] { return ++of_whole_steps, false; });
      in_a_step += asked > of_whole_steps + 1 ? 1 : 0;
    }
    EXPECT_GT(in_a_step, 0);
  }
}

}  // namespace
}  // namespace gravitas
