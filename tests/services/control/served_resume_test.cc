// A served run that goes on from a checkpoint.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::quiet_chain;
using harness::sample;
using harness::Served;
using ::testing::HasSubstr;

// From a checkpoint of step 20 and a journal up to 23 or more, in the middle of a swap's probation, with the edit before it.
TEST(ServedResume, GoesOnFromACheckpoint) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample();
  options.run.checkpoint = folder.path("served.ck");
  options.run.checkpoint_every = 20;
  const auto begin = [](Served* one) {
    one->client.step(10);
    one->edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
    one->client.step(5);
    one->client.swap(harness::parse_swap_request("solver=Newton@step=18"));
    one->client.step(7);
    one->edit({"set Body.Ball01.Position={0,3,0}"});
    one->client.step(5);
  };
  const auto end = [](Served* one) {
    one->client.step(1);
    one->client.swap(harness::parse_swap_request("solver=Direct"));
    one->client.step(40);
    one->edit({"set Body.Ball01.LinearVelocity={1,0,0}"});
    return one->to_the_end().chain_hash();
  };
  Served quiet(sample());
  begin(&quiet);
  const std::string middle = quiet.client.status().chain_hash(), chain = end(&quiet);
  {
    Served served(options);
    begin(&served);
  }
  const std::string kept = harness::read_file(options.run.checkpoint);
  const std::string journal = harness::read_file(options.run.checkpoint + ".journal");
  for (const bool keeps : {false, true})
    for (const char* hosting : {"shm", "direct"}) {
      std::ofstream(options.run.checkpoint) << kept;
      std::ofstream(options.run.checkpoint + ".journal") << journal;
      ServeOptions again = sample(hosting);
      again.run.resume = options.run.checkpoint;
      if (keeps) again.run.checkpoint = options.run.checkpoint;
      {
        Served resumed(again);
        api::Status status = resumed.client.status();
        // edits are in the journal at once, commits before long
        EXPECT_GE(status.step(), 23U) << hosting;
        if (status.step() < 27U) status = resumed.client.step(27U - status.step());
        EXPECT_EQ(status.state(), "paused");
        EXPECT_EQ(status.chain_hash(), middle);
        EXPECT_EQ(end(&resumed), chain) << hosting;
        EXPECT_EQ(resumed.client.status().state(), "finished");
      }
      // what it kept itself goes on to the same end; the one that kept nothing changed nothing
      Served twice(again);
      if (keeps) {
        EXPECT_EQ(twice.client.status().chain_hash(), chain);
      } else {
        if (twice.client.status().step() < 27U) twice.client.step(27U - twice.client.status().step());
        EXPECT_EQ(end(&twice), chain);
      }
      twice.client.reset();
      EXPECT_EQ(twice.client.status().step(), 0U);
      EXPECT_EQ(twice.to_the_end().chain_hash(), quiet_chain());
    }
}

// Whom somebody woke is in no journal: the step that wakes is in the checkpoint.
TEST(ServedResume, GoesOnFromAWake) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample();
  options.run.scenes = {in_source("/tests/scenes/box_on_plane.gravitas")};
  options.run.checkpoint = folder.path("served.ck");
  std::string chain;
  {
    ServeOptions undisturbed = options;
    undisturbed.run.checkpoint.clear();
    Served asleep(undisturbed), served(options);
    served.client.step(100);
    served.client.wake("Box");
    chain = served.client.step(1).chain_hash();
    ASSERT_NE(chain, asleep.client.step(101).chain_hash());
  }
  ServeOptions again = options;
  again.run.resume = options.run.checkpoint;
  Served resumed(again);
  EXPECT_EQ(resumed.client.status().step(), 101U);
  EXPECT_EQ(resumed.client.status().chain_hash(), chain);
}

// Nor is it lost before that step, where the checkpoint is asked for again.
TEST(ServedResume, GoesOnFromAnOrderToWake) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample();
  options.run.scenes = {in_source("/tests/scenes/box_on_plane.gravitas")};
  options.run.checkpoint = folder.path("served.ck");
  Served served(options);
  served.client.step(100);
  served.run.save_checkpoint();
  served.client.wake("Box");
  served.run.save_checkpoint();
  ServeOptions again = options;
  again.run.resume = options.run.checkpoint;
  again.run.checkpoint.clear();
  Served resumed(again);
  EXPECT_EQ(resumed.client.status().step(), 100U);
  EXPECT_EQ(resumed.client.step(1).chain_hash(), served.client.step(1).chain_hash());
}

// Nothing is kept of a last step that is shorter than the others.
TEST(ServedResume, GoesOnBeforeAShortenedLastStep) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.steps.reset();
  options.run.duration = 20.4 / 60.0;
  options.run.checkpoint = folder.path("served.ck");
  std::string before, end;
  {
    Served served(options);
    before = served.client.step(20).chain_hash();
    served.edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
    end = served.client.step(1).chain_hash();
    ASSERT_EQ(served.client.status().state(), "finished");
  }
  ServeOptions again = options;
  again.run.resume = options.run.checkpoint;
  Served resumed(again);
  EXPECT_EQ(resumed.client.status().step(), 20U);
  EXPECT_EQ(resumed.client.status().chain_hash(), before);
  EXPECT_THAT(resumed.client.status().last_warning(), HasSubstr("the last step is shorter"));
  resumed.edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
  EXPECT_EQ(resumed.to_the_end().chain_hash(), end);
}

// Whoever kills the server loses no order of a swap, changed settings among them; what was called off stays so.
TEST(ServedResume, OrdersAgainWhatIsToCome) {
  const gravitas::harness::ScratchFolder folder;
  const auto begin = [](Served* one) {
    one->client.swap(harness::parse_swap_request("integrator=RK4@step=50"));
    const std::uint32_t newton = one->client.swap(harness::parse_swap_request("solver=Newton@step=60")).number();
    one->client.step(10);
    one->run.call_off([&] {
      api::CallOffRequest request;
      request.set_number(newton);
      return request;
    }());
    one->client.set_property(harness::parse_set_request("Solver.Iterations=1"));
  };
  Served quiet(sample("direct"));
  begin(&quiet);
  const std::string chain = quiet.to_the_end().chain_hash();
  EXPECT_NE(chain, quiet_chain());
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  options.run.checkpoint_every = 10;  // else the steps would be those of the journal, which waits before it writes them
  {
    Served served(options);
    begin(&served);
  }
  ServeOptions again = sample("direct");
  again.run.resume = options.run.checkpoint;
  EXPECT_EQ(harness::run_quietly(again.run).report.chain_hash(), chain);
  // twice, and where the second one keeps its own
  for (const char* kept : {"", "served.ck", "other.ck", "third.ck"}) {
    again.run.checkpoint = *kept == '\0' ? "" : folder.path(kept);
    {
      Served resumed(again);
      const api::Status status = resumed.client.status();
      EXPECT_EQ(status.step(), 10U);
      ASSERT_EQ(status.swaps_size(), 2) << kept;
      EXPECT_EQ(status.swaps(0).to(), "RK4");
      EXPECT_EQ(status.swaps(0).step(), 50U);
      EXPECT_EQ(status.swaps(1).to(), "Sequential");
      if (*kept == '\0') EXPECT_EQ(resumed.to_the_end().chain_hash(), chain);
    }
    if (*kept != '\0') again.run.resume = again.run.checkpoint;
  }
  again.run.checkpoint.clear();
  EXPECT_EQ(harness::run_quietly(again.run).report.chain_hash(), chain);
}

TEST(ServedResume, TellsOfAnOrderWhosePluginIsNotToBeHad) {
  const gravitas::harness::ScratchFolder folder;
  const std::string copy = folder.path("copy.so");
  std::filesystem::copy(in_build("/lib/gravitas/solver_newton.so"), copy);
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  {
    Served served(options);
    served.client.swap(harness::parse_swap_request("solver=" + copy + "@step=50"));
  }
  options.run.resume = options.run.checkpoint;
  Served resumed(options);
  EXPECT_EQ(resumed.client.status().swaps_size(), 0);
  EXPECT_THAT(resumed.client.status().last_warning(), HasSubstr("the swap that was ordered for step 50 is not ordered "
                                                                "again: "));
}

// Long after its probation, and within it.
TEST(ServedResume, ListsTheSwapsThatWereMade) {
  for (const std::uint32_t kept : {20U, 40U}) {
    const gravitas::harness::ScratchFolder folder;
    ServeOptions options = sample("direct");
    options.run.checkpoint = folder.path("served.ck");
    {
      Served served(options);
      served.client.step(10);
      served.client.swap(harness::parse_swap_request("solver=Newton@step=18"));
      served.client.step(kept - 10U);
      served.run.save_checkpoint();
    }
    ServeOptions again = sample("direct");
    again.run.resume = options.run.checkpoint;
    Served resumed(again);
    const api::Status status = resumed.client.status();
    EXPECT_EQ(status.step(), kept);
    ASSERT_EQ(status.swaps_size(), 1) << kept;
    EXPECT_EQ(status.swaps(0).slot(), "solver");
    EXPECT_EQ(status.swaps(0).step(), 18U);
    EXPECT_EQ(status.swaps(0).from(), "Sequential");
    EXPECT_EQ(status.swaps(0).to(), "Newton");
    EXPECT_EQ(status.swaps(0).outcome(), kept == 20U ? "probation" : "committed");
    // as a run that goes on tells it
    const RunResult run = harness::run_quietly(again.run);
    ASSERT_EQ(run.report.swaps_size(), 1);
    EXPECT_EQ(run.report.swaps(0).step(), 18U);
    EXPECT_EQ(run.report.swaps(0).outcome(), "committed");
    const api::ServedSwap second = resumed.swap("solver=Direct");
    EXPECT_GT(second.number(), status.swaps(0).number());
    EXPECT_EQ(resumed.client.status().swaps_size(), 2);
    resumed.client.reset();
    EXPECT_EQ(resumed.client.status().swaps_size(), 0);
  }
}

// Two of one slot, the first of them before an edit, and the second called off once: as in a run that never stopped.
TEST(ServedResume, KeepsTheSwapsOfTheReport) {
  const gravitas::harness::ScratchFolder folder;
  const std::string move = "set Body.Ball01.LinearVelocity={0,1,0}";
  RunOptions whole = sample("direct").run;
  whole.swaps = {"solver=Newton@step=18", "solver=Direct@step=40"};
  whole.edits = {move + "@step=20"};
  const report::v1::Report expected = harness::run_quietly(whole).report;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  for (const std::uint32_t more : {2U, 30U}) {
    {
      Served served(options);
      served.client.swap(harness::parse_swap_request("solver=Newton@step=18"));
      api::CallOffRequest off;
      off.set_number(served.client.swap(harness::parse_swap_request("solver=Direct@step=45")).number());
      served.client.swap(harness::parse_swap_request("solver=Direct@step=40"));
      served.client.step(19);
      served.run.call_off(off);
      served.edit({move});
      served.client.step(more);
      served.run.save_checkpoint();
    }
    RunOptions rest = sample("direct").run;
    rest.resume = options.run.checkpoint;
    const report::v1::Report resumed = harness::run_quietly(rest).report;
    EXPECT_EQ(resumed.chain_hash(), expected.chain_hash());
    ASSERT_EQ(resumed.swaps_size(), 2) << more;
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(resumed.swaps(i).step(), expected.swaps(i).step());
      EXPECT_EQ(resumed.swaps(i).from(), expected.swaps(i).from());
      EXPECT_EQ(resumed.swaps(i).outcome(), "committed");
    }
  }
}

TEST(ServedResume, AJournalThatIsReplacedMeanwhileIsTold) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  Served served(options);
  served.client.step(10);
  const std::uint32_t before = served.client.status().warning_count();
  folder.write("other", "of somebody else");
  std::filesystem::rename(folder.path("other"), folder.path("served.ck.journal"));
  served.client.step(1);
  served.run.save_checkpoint();
  const api::Status status = served.client.status();
  EXPECT_EQ(status.warning_count(), before + 1U);
  EXPECT_THAT(status.last_warning(), HasSubstr("served.ck.journal' was removed or replaced"));
}

TEST(ServedResume, DoesNotGoOnFromWhatIsNoCheckpointOfItsScene) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.resume = folder.path("none");
  EXPECT_THROW(ServedRun{options}, BadInput);
  std::ofstream(options.run.resume) << "text";
  EXPECT_THROW(ServedRun{options}, BadInput);
  options.run.checkpoint = folder.path("other.ck");
  options.run.resume.clear();
  options.run.overrides = {"Force.NormalGravity.Acceleration={0,-4,0}"};
  { Served other(options); }
  std::swap(options.run.resume, options.run.checkpoint);
  { Served same(options); }
  options.run.overrides.clear();
  EXPECT_THROW(ServedRun{options}, BadInput);
}

// A library that took over by its path is named in the command that goes on, which may load no other.
TEST(ServedResume, TheCommandThatGoesOnNamesTheLibraryThatTookOver) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  const std::string library = folder.path("mine.so");
  std::filesystem::copy_file(in_build("/lib/gravitas/integrator_verlet.so"), library);
  std::string command, end;
  {
    Served served(options);
    served.client.step(10);
    EXPECT_EQ(served.swap("integrator=" + library).outcome(), "committed");
    command = served.run.save_checkpoint().value().go_on_by;
    end = served.to_the_end().chain_hash();
  }
  EXPECT_THAT(command, HasSubstr(" --swap integrator=" + library + "@step=11 "));
  // as a shell reads it, without words that have blanks
  std::vector<std::string> words;
  std::istringstream rest(command.substr(command.find(' ') + 1));
  for (std::string word; rest >> word;) words.push_back(word);
  words.insert(words.end(), {"--json", "--hosting", "direct"});
  const gravitas::harness::ProgramResult result = gravitas::harness::run_program(words, folder);
  EXPECT_EQ(result.exit_code, 0) << command << result.err;
  EXPECT_EQ(gravitas::harness::read_report(result.out).chain_hash(), end);
}

}  // namespace
}  // namespace gravitas::control
