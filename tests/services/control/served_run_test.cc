// A served run through its API: server and client in this process, workers in theirs.
#include "services/control/served_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "services/capsule/replay.h"
#include "services/control/status_text.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::CurrentFolder;
using harness::kSteps;
using harness::quiet_chain;
using harness::refusal;
using harness::run_quietly;
using harness::sample;
using harness::Served;
using ::testing::HasSubstr;
using ::testing::StartsWith;

api::PlannedSlot planned(const api::Status& status, const std::string& name) {
  for (const api::PlannedSlot& slot : status.plan().slots())
    if (slot.slot() == name) return slot;
  return {};
}

TEST(ServedRun, StepsAreCountedAndTheEndIsAState) {
  Served served;
  EXPECT_EQ(served.client.status().state(), "paused");
  EXPECT_EQ(served.client.status().step(), 0U);
  EXPECT_EQ(served.client.step(1).step(), 1U);
  api::Status status = served.client.step(9);
  EXPECT_EQ(status.step(), 10U);
  EXPECT_EQ(status.state(), "paused");
  EXPECT_DOUBLE_EQ(status.time(), 10 * status.time_step());
  EXPECT_EQ(status.total_steps(), kSteps);
  EXPECT_EQ(status.steps_per_second(), 0.0);

  status = served.client.step(1000);
  EXPECT_EQ(status.step(), kSteps);
  EXPECT_EQ(status.state(), "finished");
  EXPECT_EQ(status.chain_hash(), quiet_chain());
  EXPECT_THAT(refusal([&] { served.client.resume(); }), HasSubstr("reset begins it again"));
  EXPECT_EQ(served.client.pause().state(), "finished");

  status = served.client.reset();
  EXPECT_EQ(status.step(), 0U);
  EXPECT_EQ(status.state(), "paused");
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

// What hangs is what one asks for then: the status came with the end of the step.
TEST(ServedRun, TellsItsStatusWhileAStepWaitsForAWorkerThatHangs) {
  Served served;
  served.client.step(10);
  served.client.inject("solver:hang@step=11");
  std::future<api::Status> step = std::async(std::launch::async, [&] { return served.client.step(1); });
  api::Status status;
  while (status.waited() == 0.0 && step.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    status = served.client.status();
  EXPECT_GT(status.waited(), 0.0);
  EXPECT_EQ(status.step(), 10U);
  EXPECT_EQ(planned(status, "solver").plugin(), "Sequential");
  EXPECT_EQ(step.get().step(), 11U);
  EXPECT_EQ(served.client.status().waited(), 0.0);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

TEST(ServedRun, WhoWaitsForAStepThatHangsIsToldSo) {
  ServeOptions options = sample();
  options.run.overrides = {"Plugin.solver.Deadline=5"};
  Served served(options);
  served.client.step(10);
  std::vector<api::Status> told;
  ControlClient waiting(served.socket.path());
  waiting.on_wait([&](const api::Status& status) { told.push_back(status); });
  waiting.pause();
  waiting.reactions();
  EXPECT_TRUE(told.empty());
  served.client.inject("solver:hang@step=11");
  std::future<api::Status> step = std::async(std::launch::async, [&] { return served.client.step(1); });
  while (served.client.status().waited() == 0.0 && step.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
    continue;
  EXPECT_EQ(waiting.pause().step(), 11U);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_GE(told[0].waited(), 0.5);
  EXPECT_THAT(waiting_line(told[0]), StartsWith("step 11 has taken "));
  step.get();
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

TEST(ServedRun, ResumedItGoesOnAndPausedItStands) {
  ServeOptions options = sample();
  options.run.steps = 100'000'000;
  Served served(options);
  EXPECT_EQ(served.client.resume().state(), "running");
  std::uint32_t seen = 0;
  served.client.watch(10, [&](const api::Status& status) {
    EXPECT_EQ(status.state(), "running");
    EXPECT_GE(status.step(), seen);
    seen = status.step();
    return seen < 100;
  });
  EXPECT_THAT(refusal([&] { served.client.step(1); }), HasSubstr("pause it first"));
  const api::Status paused = served.client.pause();
  EXPECT_EQ(paused.state(), "paused");
  EXPECT_EQ(served.client.status().step(), paused.step());
  EXPECT_EQ(served.client.resume().state(), "running");
  EXPECT_EQ(served.client.reset().state(), "running");
  EXPECT_EQ(served.client.pause().state(), "paused");
}

// At the pace of the wall clock a run of 0.1 s takes so long; how much longer is for the machine to say.
TEST(ServedRun, ItIsPacedByTheWallClock) {
  ServeOptions options = sample("direct");
  options.speed = 1.0;
  options.run.steps = 10;
  options.run.time_step = 0.01;
  Served served(options);
  const auto begin = std::chrono::steady_clock::now();
  served.client.resume();
  served.client.watch(10, [](const api::Status& status) { return status.state() == "running"; });
  EXPECT_EQ(served.client.status().state(), "finished");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100));
}

TEST(ServedRun, ASwapChangesNoBit) {
  Served served;
  served.client.step(10);
  const api::ServedSwap swap = served.swap("solver=Sequential");
  EXPECT_EQ(swap.outcome(), "committed") << swap.reason();
  EXPECT_EQ(swap.step(), 11U);
  EXPECT_GT(swap.pause_us(), 0.0);
  const int before = planned(served.client.status(), "integrator").pid();
  EXPECT_THAT(served.swap("integrator=Euler@step=100").outcome(), ::testing::AnyOf("preparing", "shadow"));
  served.client.step(60);
  EXPECT_EQ(served.client.status().swaps(1).outcome(), "committed");
  EXPECT_EQ(served.client.status().swaps(1).step(), 100U);
  EXPECT_NE(planned(served.client.status(), "integrator").pid(), before);
  const api::Status end = served.to_the_end();
  EXPECT_EQ(end.step(), kSteps);
  EXPECT_EQ(end.chain_hash(), quiet_chain());
}

TEST(ServedRun, HostingIsExchangedThereAndBack) {
  Served served;
  served.client.step(5);
  for (const char* hosting : {"grpc", "direct", "grpc", "shm"}) {
    const api::ServedSwap swap = served.swap(std::string("solver=Sequential,hosting=") + hosting);
    EXPECT_EQ(swap.outcome(), "committed") << swap.reason();
    EXPECT_EQ(planned(served.client.status(), "solver").hosting(), hosting);
    const int pid = planned(served.client.status(), "solver").pid();
    EXPECT_EQ(pid == getpid(), std::string(hosting) == "direct");
  }
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

TEST(ServedRun, ASwapIsFollowedWhileTheRunGoesOn) {
  ServeOptions options = sample();
  options.run.steps = 100'000'000;
  Served served(options);
  served.client.resume();
  api::Status status;
  const auto ordered = served.client.swap(parse_swap_request("collision=Standard,hosting=direct"));
  const std::optional<api::ServedSwap> swap = wait_for_swap(&served.client, ordered.number(), &status);
  ASSERT_TRUE(swap);
  EXPECT_EQ(swap->outcome(), "committed") << swap->reason();
  EXPECT_EQ(swap->step(), ordered.step());
  EXPECT_GE(status.step(), swap->step());
  // numbers go on after a reset, where nothing is known of the swap any more
  served.client.pause();
  served.client.reset();
  EXPECT_EQ(planned(served.client.status(), "collision").hosting(), "shm");
  EXPECT_FALSE(wait_for_swap(&served.client, ordered.number(), &status));
  EXPECT_EQ(served.client.swap(parse_swap_request("collision=Standard")).number(), ordered.number() + 1);
}

TEST(ServedRun, APropertyIsChangedAndKeptBySwapsToTheSamePlugin) {
  Served served;
  const auto setting = [&](int row) { return planned(served.client.status(), "solver").settings(row).value(); };
  const std::string correction = setting(1);
  EXPECT_EQ(planned(served.client.status(), "solver").settings(0).name(), "Iterations");
  EXPECT_EQ(served.set("Solver.Iterations=3").outcome(), "committed");
  EXPECT_EQ(setting(0), "3");
  EXPECT_EQ(setting(1), correction);
  // two at one step: the second builds on the first
  served.client.set_property(parse_set_request("solver.Iterations=4"));
  served.set("solver.CorrectionFactor=0.25");
  EXPECT_EQ(setting(0), "4");
  EXPECT_EQ(setting(1), "0.25");
  EXPECT_EQ(served.swap("solver=Sequential,hosting=direct").outcome(), "committed");
  EXPECT_EQ(setting(0), "4");
  EXPECT_EQ(setting(1), "0.25");
  EXPECT_NE(served.to_the_end().chain_hash(), quiet_chain());

  served.client.reset();
  EXPECT_EQ(setting(1), correction);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

TEST(ServedRun, AnInjectedFaultIsSurvived) {
  Served served;
  served.client.step(10);
  EXPECT_EQ(served.client.inject("solver:kill").step(), 11U);
  EXPECT_EQ(served.client.inject("integrator:nan@step=30").step(), 30U);
  const api::Status end = served.to_the_end();
  EXPECT_EQ(end.chain_hash(), quiet_chain());
  ASSERT_EQ(end.faults_size(), 2);
  EXPECT_EQ(end.fault_count(), 2U);
  EXPECT_EQ(end.faults(0).step(), 11U);
  EXPECT_EQ(end.faults(0).kind(), "kill");
  EXPECT_GT(end.faults(0).recovery_us(), 0.0);
  EXPECT_EQ(end.faults(1).slot(), "integrator");
}

TEST(ServedRun, AFaultThatNobodySurvivesIsAState) {
  const CurrentFolder here;
  Served served;
  served.client.inject("solver:kill@step=5,times=100");
  const api::Status status = served.to_the_end();
  EXPECT_EQ(status.state(), "faulted");
  EXPECT_EQ(status.step(), 4U);
  EXPECT_THAT(status.fault(), HasSubstr("step 5: slot solver, plugin Sequential"));
  EXPECT_THAT(refusal([&] { served.client.step(1); }), HasSubstr("reset begins it again"));
  // what it left goes on to where nobody disturbed it
  RunOptions resumed = sample("direct").run;
  resumed.resume = status.checkpoint();
  const RunResult whole = run_quietly(resumed);
  EXPECT_EQ(whole.report.chain_hash(), quiet_chain());
  EXPECT_EQ(whole.report.steps(), kSteps);
  EXPECT_GT(whole.report.events().collision_start(), 0U);
  EXPECT_EQ(served.client.reset().state(), "paused");
  EXPECT_EQ(served.client.status().checkpoint(), "");
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

// The command goes on with what was changed live: the chain is that of a served run that nobody disturbed.
TEST(ServedRun, AFaultedOneNamesTheCommandThatGoesOn) {
  const CurrentFolder here;
  const auto change = [](Served* served) {
    served->client.step(10);
    served->edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
    served->client.step(10);
    served->swap("solver=Newton");
    served->set("Solver.Iterations=77");
    return served->client.status().step();
  };
  ServeOptions options = sample();
  options.hosting_words = {"--hosting", "shm"};
  options.run.overrides = {"Solver.Iterations=60"};
  Served quiet(options), faulted(options);
  change(&quiet);
  const std::uint32_t step = change(&faulted) + 1;
  faulted.client.inject("integrator:kill,times=2");
  faulted.client.swap(harness::parse_swap_request("space=Grid@step=110"));
  quiet.client.swap(harness::parse_swap_request("space=Grid@step=110"));
  const api::Status status = faulted.to_the_end();
  ASSERT_EQ(status.state(), "faulted");
  EXPECT_EQ(status.step(), step - 1);
  ASSERT_EQ(status.edits_size(), 1);
  ASSERT_EQ(status.edits(0).texts_size(), 1);
  EXPECT_EQ(status.edits(0).texts(0), "set Body.Ball01.LinearVelocity={0,1,0}");
  ASSERT_THAT(status.resume_command(), StartsWith("gravitas run " + in_shell(kSample)));
  EXPECT_THAT(status.resume_command(),
              HasSubstr(" --set Solver.Iterations=60 --hosting shm --swap space=Grid@step=110 "));
  EXPECT_THAT(status_page(status), HasSubstr("to go on: " + status.resume_command()));
  const gravitas::harness::ScratchFolder folder;
  const std::string command = in_shell(in_build("/bin/")) + status.resume_command() + " --json > " + folder.path("out");
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  EXPECT_EQ(harness::read_report(harness::read_file(folder.path("out"))).chain_hash(), quiet.to_the_end().chain_hash());
}

TEST(ServedRun, ASwapThatIsCalledOffNeverComes) {
  Served quiet, served;
  const std::uint32_t late = served.client.swap(parse_swap_request("solver=Newton@step=50")).number();
  served.client.step(10);
  served.edit({"set Body.Ball01.Id=Ball01"});  // it goes along
  quiet.client.step(10);
  quiet.edit({"set Body.Ball01.Id=Ball01"});
  const api::ServedSwap off = served.client.call_off(late);
  EXPECT_EQ(off.outcome(), "refused");
  EXPECT_EQ(off.reason(), "called off");
  EXPECT_THAT(refusal([&] { served.client.call_off(late); }), HasSubstr("refused already; none is on its way"));
  EXPECT_THAT(refusal([&] { served.client.call_off(7); }), HasSubstr("no swap or comparison has that number"));
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet.to_the_end().chain_hash());
}

TEST(ServedRun, ASwapOnItsWayNamesWhomItReplaces) {
  Served served;
  served.client.step(3);
  served.client.swap(harness::parse_swap_request("solver=Newton@step=50"));
  ASSERT_EQ(served.client.status().swaps_size(), 1);
  EXPECT_EQ(served.client.status().swaps(0).from(), "Sequential");
}

TEST(ServedRun, KeepsACheckpointThatGoesOn) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample();
  options.run.checkpoint = folder.path("served.ck");
  options.run.checkpoint_every = 20;
  const auto go_on = [&] {
    RunOptions resumed = sample("direct").run;
    resumed.resume = options.run.checkpoint;
    return run_quietly(resumed);
  };
  Served quiet(sample()), served(options);
  for (Served* one : {&quiet, &served}) {
    one->client.step(10);
    one->edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
    one->client.step(15);
  }
  // of step 20, and with the journal up to 25
  const std::string chain = quiet.to_the_end().chain_hash();
  EXPECT_EQ(go_on().report.chain_hash(), chain);
  EXPECT_THAT(served.run.save_checkpoint().value().go_on_by, HasSubstr(" --resume " + options.run.checkpoint));
  EXPECT_EQ(go_on().report.chain_hash(), chain);
  served.client.reset();
  EXPECT_EQ(go_on().report.chain_hash(), quiet_chain());
}

TEST(ServedRun, TheCallsOfItsNextStepsAreCaptured) {
  const gravitas::harness::ScratchFolder folder;
  for (const char* hosting : {"shm", "direct"}) {
    Served served(sample(hosting));
    served.client.step(5);
    api::CaptureRequest request;
    request.set_slot("solver");
    request.set_path(folder.path("solver.capsule"));
    request.set_steps(20);
    std::future<api::Captured> captured = served.run.capture(request);
    EXPECT_THROW(served.run.capture(request), NotNow);
    EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
    const api::Captured result = captured.get();
    EXPECT_EQ(result.first_step(), 6U);
    EXPECT_EQ(result.steps(), 20U);
    EXPECT_EQ(result.calls(), 20U);
    capsule::ReplayOptions replay;
    replay.file = request.path();
    const report::v1::ReplayReport report = capsule::replay(replay, [](std::uint32_t) { return true; });
    EXPECT_EQ(report.calls(), 20U);
    EXPECT_EQ(report.same(), 20U);
    EXPECT_THAT(refusal([&] { served.client.capture(request); }), HasSubstr("reset begins it again"));
  }
}

TEST(ServedRun, ACaptureThatTheRunOutlivesIsKeptAsFarAsItCame) {
  const gravitas::harness::ScratchFolder folder;
  Served served(sample("direct"));
  api::CaptureRequest request;
  request.set_slot("integrator");
  request.set_path(folder.path("integrator.capsule"));
  request.set_steps(1000);
  std::future<api::Captured> captured = served.run.capture(request);
  served.client.step(3);
  served.run.end_capture();
  EXPECT_EQ(captured.get().steps(), 3U);
  captured = served.run.capture(request);
  served.client.reset();
  EXPECT_EQ(captured.get().calls(), 0U);
  request.set_path("/nowhere/at/all");
  EXPECT_THAT(refusal([&] { served.client.capture(request); }), HasSubstr("/nowhere/at/all"));
  request.set_path("relative");
  EXPECT_THAT(refusal([&] { served.client.capture(request); }), HasSubstr("an absolute path"));
  // the server would wait for who reads it
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string& path : {pipe, std::string("/dev/null")}) {
    request.set_path(path);
    EXPECT_THAT(refusal([&] { served.client.capture(request); }),
                HasSubstr("capsule '" + path + "': it is not an ordinary file"));
  }
  EXPECT_EQ(served.client.step(3).step(), 3U);
}

TEST(ServedRun, ItListensAtAnAddress) {
  const gravitas::harness::ScratchFolder folder;
  ServedRun run(sample("direct"));
  const ControlServer server(&run, folder.path("one"), "127.0.0.1:0");
  EXPECT_THAT(server.address(), ::testing::MatchesRegex("127.0.0.1:[1-9][0-9]*"));
  EXPECT_EQ(ControlClient(server.address()).step(3).step(), 3U);
  EXPECT_EQ(ControlClient(folder.path("one")).status().step(), 3U);
  EXPECT_THROW(ControlServer(&run, folder.path("two"), server.address()), BadInput);
}

TEST(ServedRun, WhatCannotBeIsRefusedWithTheReason) {
  Served served;
  const auto swap = [&](const std::string& text) {
    return refusal([&] { served.client.swap(parse_swap_request(text)); });
  };
  const auto set = [&](const std::string& text) {
    return refusal([&] { served.client.set_property(parse_set_request(text)); });
  };
  // other clients may say anything
  api::SwapRequest strange = parse_swap_request("solver=Sequential");
  strange.set_slot("sovler");
  EXPECT_THAT(refusal([&] { served.client.swap(strange); }), HasSubstr("unknown slot 'sovler'; allowed: space"));
  strange.set_slot("solver");
  strange.set_hosting("shn");
  EXPECT_THAT(refusal([&] { served.client.swap(strange); }), HasSubstr("allowed: direct, shm, grpc"));
  EXPECT_THAT(swap("solver=Sequentail"), HasSubstr("did you mean \"Sequential\"?"));
  EXPECT_THAT(swap("solver=/nowhere/plugin.so"), HasSubstr("cannot be used"));
  EXPECT_THAT(swap("force=Gravity"), HasSubstr("the plan leaves the slot out"));
  EXPECT_THAT(swap("solver=Sequential@step=121"), HasSubstr("allowed: 1 (the next) to 120"));
  EXPECT_THAT(set("Solver.Iteration=5"), HasSubstr("did you mean \"Iterations\"?"));
  EXPECT_THAT(set("Solver.Iterations=0"), HasSubstr("a whole number in [1,"));
  EXPECT_THAT(set("Solver.Iterations=many"), HasSubstr("many"));
  EXPECT_THAT(set("Solver.Iterations=5 6"), HasSubstr("one value"));
  EXPECT_THAT(set("Solvr.Iterations=5"), HasSubstr("unknown slot"));
  EXPECT_THAT(set("Force.Down.Acceleration={0,0,0}"), HasSubstr("gravitas ctl edit 'set PATH=VALUE'"));
  const auto inject = [&](const std::string& text) { return refusal([&] { served.client.inject(text); }); };
  EXPECT_THAT(inject("solver:kil"), HasSubstr("kill"));
  EXPECT_THAT(inject("solver:foo"), HasSubstr("inject solver:foo: there is no fault 'foo'"));
  EXPECT_THAT(inject("solver"), HasSubstr("SLOT:KIND[@step=N]"));
  EXPECT_THAT(inject("force:kill"), HasSubstr("the plan leaves the slot out"));
  EXPECT_THAT(inject("solver:kill@step=121"), HasSubstr("1 (the next) to 120"));
  EXPECT_THAT(refusal([&] { served.client.step(0); }), HasSubstr("from 1"));
  EXPECT_THAT(refusal([&] { served.client.watch(1, [](const api::Status&) { return true; }); }), HasSubstr("10 to"));
  // none of it has touched the run
  EXPECT_EQ(served.client.status().swap_count(), 0U);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
  EXPECT_EQ(served.client.status().fault_count(), 0U);
}

TEST(ServedRun, WhatIsNoSpecificationIsRefusedAtHome) {
  for (const char* text :
       {"", "solver", "=Sequential", "solver=", "solver=Sequential@5", "solver=S@step=x", "solver=S@step=5,more",
        "solver=S,hosting=shm,hosting=shm", "solver=S,", "sovler=S", "solver=S,hosting=shn"})
    EXPECT_THROW(parse_swap_request(text), BadInput) << text;
  for (const char* text : {"", "Solver", "Solver=5", "Solver.Iterations", "Solver.=5", ".Iterations=5", "Solver.I="})
    EXPECT_THROW(parse_set_request(text), BadInput) << text;
  const api::SwapRequest whole = parse_swap_request("solver=Sequential@step=7,hosting=grpc");
  EXPECT_EQ(whole.slot(), "solver");
  EXPECT_EQ(whole.plugin(), "Sequential");
  EXPECT_EQ(whole.step(), 7U);
  EXPECT_EQ(whole.hosting(), "grpc");
  EXPECT_EQ(parse_swap_request("solver=some/p.so").plugin().front(), '/');
}

// Watching and a long step order must not hold up the end.
TEST(ServedRun, TheServerEndsCallsThatWait) {
  ServeOptions options = sample("direct");
  options.run.steps = 100'000'000;
  const gravitas::harness::ScratchFolder folder;
  ServedRun run(options);
  const ServerSocket socket(folder.path("control.sock"));
  auto server = std::make_optional<ControlServer>(&run, socket.path());
  ControlClient stepping(socket.path()), watching(socket.path());
  std::thread steps([&] { EXPECT_THROW(stepping.step(100'000'000), ControlError); });
  std::promise<void> both;
  std::thread watch([&] {
    bool told = false;
    watching.watch(10, [&](const api::Status& status) {
      if (status.step() > 0 && !told) both.set_value();
      told |= status.step() > 0;
      return true;
    });
  });
  both.get_future().wait();
  server.reset();
  steps.join();
  watch.join();
  EXPECT_EQ(run.status().state(), "paused");
}

TEST(ServerSocket, IsPrivateAndRemovesWhatItMade) {
  std::string path;
  {
    const ServerSocket socket("");
    path = socket.path();
    struct stat about {};
    ASSERT_EQ(stat(path.substr(0, path.rfind('/')).c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0777, 0700U);
    // nobody listens yet
    EXPECT_THAT(find_servers(), ::testing::Not(::testing::Contains(path)));
    ServedRun run(sample("direct"));
    const ControlServer server(&run, path);
    ASSERT_EQ(stat(path.c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 0077, 0U);
    EXPECT_THAT(find_servers(), ::testing::Contains(path));
    EXPECT_THROW(ServerSocket second(path), BadInput);
  }
  EXPECT_NE(access(path.substr(0, path.rfind('/')).c_str(), F_OK), 0);
  // one that was killed leaves its socket, where nobody answers
  const gravitas::harness::ScratchFolder left;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::snprintf(address.sun_path, sizeof address.sun_path, "%s", left.path("control.sock").c_str());
  const int dead = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  close(dead);
  EXPECT_EQ(access(address.sun_path, F_OK), 0);
  EXPECT_NO_THROW(ServerSocket(left.path("control.sock")));
  const gravitas::harness::ScratchFolder folder;
  EXPECT_THROW(ServerSocket(folder.write("file", "kept")), BadInput);
  EXPECT_EQ(gravitas::harness::read_file(folder.path("file")), "kept");
  EXPECT_THROW(ServerSocket(folder.path(std::string(120, 'x'))), BadInput);
  EXPECT_THROW(ServerSocket(folder.path("none/control.sock")), BadInput);
}

// Whatever is asked between two steps, the run ends where nobody asked it.
TEST(ServedRun, AnswersQuestionsAboutItsState) {
  Served served;
  served.client.step(10);
  query::v1::Batch batch;
  query::v1::Ray* ray = batch.add_rays();
  for (const double number : {0.0, 100.0, 0.0}) ray->add_origin(number);
  for (const double number : {0.0, -1.0, 0.0}) ray->add_direction(number);
  ray->set_hits(query::v1::HITS_ALL);
  const query::v1::Answers answers = served.client.query(batch);
  EXPECT_EQ(answers.step(), 10U);
  ASSERT_EQ(answers.rays_size(), 1);
  ASSERT_GT(answers.rays(0).hits_size(), 0);

  // from the body that was met it is as far back
  const query::v1::RayHit& hit = answers.rays(0).hits(0);
  EXPECT_NEAR(hit.point(1), 100.0 - hit.distance(), 1e-9);

  api::InstrumentationRequest kinds;
  kinds.add_kinds("bounds");
  const instrumentation::v1::Frame frame = served.client.instrumentation(kinds);
  EXPECT_EQ(frame.step(), 10U);
  EXPECT_GT(frame.boxes_size(), 0);
  EXPECT_EQ(frame.lines_size(), 0);

  batch.mutable_rays(0)->mutable_filter()->add_only("Nobody");
  try {
    served.client.query(batch);
    FAIL();
  } catch (const ControlError& error) {
    EXPECT_EQ(error.kind, ControlError::Kind::kRefused);
    EXPECT_THAT(error.what(), HasSubstr("rays[0].filter.only: there is no body 'Nobody'"));
  }
  kinds.add_kinds("bound");
  EXPECT_THROW(served.client.instrumentation(kinds), ControlError);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

TEST(ServedRun, TellsTheReactionsOfTheLastStep) {
  Served served;
  EXPECT_EQ(served.client.reactions().reactions_size(), 0) << "no step has been made";
  served.client.step(10);
  const api::Reactions reactions = served.client.reactions();
  ASSERT_GE(reactions.reactions_size(), 1);
  for (const report::v1::Reaction& one : reactions.reactions()) {
    EXPECT_EQ(one.step(), 10U);
    EXPECT_EQ(one.force_size(), 3);
    EXPECT_EQ(one.torque_size(), 3);
  }
  served.client.reset();
  EXPECT_EQ(served.client.reactions().reactions_size(), 0);
}

TEST(ServedRun, TellsTheCoordinatesOfJoints) {
  Served served;
  const api::Joints start = served.client.joints();
  EXPECT_EQ(start.missing_size(), 0);
  ASSERT_EQ(start.coordinates_size(), 1);
  EXPECT_EQ(start.coordinates(0).joint(), "MyAngularMotor");
  EXPECT_EQ(start.coordinates(0).name(), "angle");
  EXPECT_NEAR(start.coordinates(0).value(), 0.0, 1e-15);
  served.client.step(10);
  const api::Joints now = served.client.joints();
  EXPECT_GT(now.time(), 0.0);
  ASSERT_EQ(now.coordinates_size(), 1);
  EXPECT_NE(now.coordinates(0).value(), 0.0);
  EXPECT_NE(now.coordinates(0).rate(), 0.0);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

}  // namespace
}  // namespace gravitas::control
