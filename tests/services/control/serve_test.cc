// The real programs: `gravitas serve` beside `gravitas ctl`.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "gravitas/control_api/v1/control_api.pb.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::read_file;
using harness::ScratchFolder;
using ::testing::HasSubstr;

// A server whose socket is found in a folder of this test's own.
class Served {
 public:
  explicit Served(const std::vector<std::string>& options) {
    std::vector<std::string> words = {"serve", kSample, "--headless"};
    words.insert(words.end(), options.begin(), options.end());
    // where a ctl of another test does not look for servers
    setenv("XDG_RUNTIME_DIR", folder_.path("").c_str(), 1);
    process_ = harness::start_program(words, folder_);
    unsetenv("XDG_RUNTIME_DIR");
    // it says so when it listens
    for (int i = 0; i < 3000 && said().empty() && kill(process_, 0) == 0; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    const std::string mark = " at unix:";
    const std::size_t at = said().find(mark);
    if (at != std::string::npos) socket_ = said().substr(at + mark.size(), said().find('\n') - at - mark.size());
  }
  ~Served() {
    if (process_ > 0) end(SIGTERM);
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

  const std::string& socket() const { return socket_; }
  std::string said() const {
    const std::string text = read_file(folder_.path("stdout"));
    return text.find('\n') == std::string::npos ? "" : text;
  }
  ProgramResult ctl(std::vector<std::string> words) const {
    words.insert(words.begin(), {"ctl", "--socket", socket_});
    const ScratchFolder own;
    return harness::run_program(words, own);
  }
  control_api::v1::Status status() const {
    control_api::v1::Status status;
    const ProgramResult result = ctl({"status", "--json"});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(result.out, &status).ok()) << result.out;
    return status;
  }
  void send(int number) const { kill(process_, number); }
  ProgramResult end(int number) {
    kill(process_, number);
    const ProgramResult result = harness::finish_program(process_, folder_);
    process_ = -1;
    return result;
  }

 private:
  ScratchFolder folder_;
  pid_t process_ = -1;
  std::string socket_;
};

class EndedBy : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Each, EndedBy, ::testing::Values(SIGINT, SIGTERM),
                         [](const auto& which) { return std::string(which.param == SIGINT ? "SIGINT" : "SIGTERM"); });

TEST_P(EndedBy, NothingIsLeft) {
  Served served({"--duration", "3600"});
  ASSERT_FALSE(served.socket().empty());
  const control_api::v1::Status status = served.status();
  EXPECT_EQ(status.scene(), kSample);
  EXPECT_EQ(status.state(), "running");
  ASSERT_GE(status.plan().slots_size(), 5);
  std::vector<int> workers;
  for (const control_api::v1::PlannedSlot& slot : status.plan().slots()) workers.push_back(slot.pid());
  const ProgramResult result = served.end(GetParam());
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_THAT(result.out, HasSubstr("chain hash"));
  EXPECT_FALSE(std::filesystem::exists(served.socket()));
  EXPECT_FALSE(std::filesystem::exists(std::filesystem::path(served.socket()).parent_path()));
  for (const int worker : workers) EXPECT_NE(kill(worker, 0), 0);
}

// Paced by the wall clock, it sleeps between two steps for longer than anybody waits for an end.
TEST(Serve, IsEndedWhileItSleeps) {
  Served served({"--duration", "3600", "--speed", "1e-4"});
  ASSERT_FALSE(served.socket().empty());
  EXPECT_EQ(served.status().state(), "running");
  EXPECT_EQ(served.end(SIGINT).exit_code, 130);
}

TEST(Serve, CtlControlsIt) {
  Served served({"--steps", "200", "--speed", "0", "--paused"});
  ASSERT_FALSE(served.socket().empty());
  const auto said = [&](const std::vector<std::string>& words) {
    const ProgramResult result = served.ctl(words);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.out;
  };
  EXPECT_THAT(said({"status"}), HasSubstr("Sequential"));
  EXPECT_THAT(said({"step", "10"}), HasSubstr("step 10 of 200"));
  EXPECT_THAT(said({"swap", "solver=Sequential,hosting=direct"}), HasSubstr("solver"));
  EXPECT_THAT(said({"step", "20"}), HasSubstr("step 30 of 200"));
  EXPECT_THAT(said({"status"}), HasSubstr("committed: solver Sequential (shm) -> Sequential (direct), before step 11"));
  EXPECT_THAT(said({"set", "Solver.Iterations=50", "--no-wait"}), HasSubstr("ordered: swap 2, before step 31"));
  EXPECT_THAT(said({"inject", "integrator:kill"}), HasSubstr("at step 31"));
  EXPECT_THAT(said({"step", "200"}), HasSubstr("finished"));
  const control_api::v1::Status status = served.status();
  EXPECT_EQ(status.state(), "finished");
  EXPECT_EQ(status.fault_count(), 1U);
  EXPECT_EQ(served.ctl({"step"}).exit_code, 2);
  EXPECT_THAT(said({"reset"}), HasSubstr("step 0 of 200"));
  EXPECT_THAT(said({"resume"}), HasSubstr("of 200"));
  EXPECT_THAT(said({"pause"}), HasSubstr("of 200"));

  ProgramResult refused = served.ctl({"swap", "solver=Sequentail"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("did you mean \"Sequential\"?"));
  EXPECT_EQ(served.end(SIGTERM).exit_code, 130);
  refused = served.ctl({"status"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("start one: gravitas serve SCENE --headless"));
}

// A plugin that answers nonsense is gone again before it has harmed the run; ctl says so with its exit code.
TEST(Serve, ASwapThatIsRolledBackIsExitCode4) {
  Served served({"--duration", "3600"});
  ASSERT_FALSE(served.socket().empty());
  const std::string plugin = in_build("/lib/gravitas-faulty/integrator_nan.so");
  const ProgramResult result = served.ctl({"swap", "integrator=" + plugin});
  EXPECT_EQ(result.exit_code, 4) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("rolled back: integrator Euler -> "));
  EXPECT_EQ(served.status().state(), "running");
}

TEST(Serve, AFaultThatTheRunDidNotSurviveIsExitCode3) {
  Served served({"--duration", "3600"});
  ASSERT_FALSE(served.socket().empty());
  EXPECT_EQ(served.ctl({"inject", "solver:kill,times=9"}).exit_code, 0);
  for (int i = 0; i < 3000 && served.status().state() != "faulted"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const ProgramResult result = served.end(SIGTERM);
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("slot solver"));
  EXPECT_THAT(result.out, HasSubstr("checkpoint"));
}

// Nor is it another one where the checkpoint cannot be written.
TEST(Serve, AFaultIsExitCode3WithoutACheckpointToo) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept");
  Served served({"--duration", "1000", "--checkpoint", kept});
  // where the next one is written before it gets its name
  std::filesystem::create_directory(kept + ".tmp");
  ASSERT_EQ(served.ctl({"inject", "integrator:kill,times=2"}).exit_code, 0);
  for (int i = 0; i < 3000 && served.status().state() != "faulted"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  const ProgramResult result = served.end(SIGTERM);
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the checkpoint is that of step 0: checkpoint '" + kept + "'"));
}

TEST(Serve, CtlEditsTheSceneAndWakesABody) {
  Served served({"--duration", "3600", "--paused"});
  ASSERT_FALSE(served.socket().empty());
  ProgramResult result =
      served.ctl({"edit", "set Body.Ball01.LinearVelocity={0,1,0}", "set Material.Plastic.RestitutionCoefficient=0"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("edited before step 1; the run stood for "));
  result = served.ctl({"edit", "remove Body.Ball1"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("remove Body.Ball1: there is none; did you mean \"Ball01\"?"));
  result = served.ctl({"edit", "jump"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("allowed: add FILE, remove PATH, set PATH=VALUE"));
  EXPECT_EQ(served.ctl({"wake", "Ball01"}).exit_code, 0);
}

TEST(Serve, CtlWritesOverNothingThatTheSceneWasReadFrom) {
  const ScratchFolder folder;
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const std::string mesh = folder.write("x.obj", text);
  const std::string solid = folder.write(
      "solid.gravitas",
      "Geometries { Geometry { Type = \"TriangleMesh\" Id = \"X\" CustomProperties { File = \"x.obj\" } } }");
  Served served({solid, "--duration", "3600"});
  ASSERT_FALSE(served.socket().empty());
  for (const std::string& file : {mesh, solid}) {
    const std::string before = read_file(file);
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"capture", "solver", "--steps", "1"}, {"instrumentation"}}) {
      std::vector<std::string> all = words;
      all.insert(all.end(), {"--out", file});
      const ProgramResult result = served.ctl(all);
      EXPECT_EQ(result.exit_code, 2);
      EXPECT_THAT(result.err, HasSubstr("--out " + file + ": it is the same file as "));
      EXPECT_EQ(read_file(file), before);
    }
  }
}

TEST(Serve, AnInterruptedCaptureIsWhole) {
  Served served({"--duration", "3600", "--speed", "0"});
  ASSERT_FALSE(served.socket().empty());
  const ScratchFolder own;
  const std::string file = own.path("solver.capsule");
  const pid_t capture = harness::start_program(
      {"ctl", "--socket", served.socket(), "capture", "solver", "--out", file, "--steps", "100000"}, own);
  std::error_code none;
  for (int i = 0; i < 3000 && !(std::filesystem::file_size(file, none) > 0 && !none); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  kill(capture, SIGINT);
  const ProgramResult result = harness::finish_program(capture, own);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_THAT(result.out, HasSubstr("calls of slot solver in "));
  const ProgramResult replay = harness::run_program({"replay", file}, own);
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_THAT(replay.out, HasSubstr(" 0 different"));
}

TEST(Serve, WatchShowsLinesAndEndsWithTheServer) {
  Served served({"--duration", "3600"});
  ASSERT_FALSE(served.socket().empty());
  const ScratchFolder own;
  const pid_t watch = harness::start_program({"ctl", "watch", "--socket", served.socket()}, own);
  for (int i = 0; i < 3000 && read_file(own.path("stdout")).empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(served.end(SIGTERM).exit_code, 130);
  const ProgramResult result = harness::finish_program(watch, own);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, ::testing::StartsWith("step "));
  EXPECT_THAT(result.out, HasSubstr("running"));
  EXPECT_THAT(result.err, HasSubstr("the server has ended"));
}

TEST(Serve, UnderNohupItOutlivesItsTerminal) {
  const sighandler_t before = signal(SIGHUP, SIG_IGN);
  Served served({"--duration", "3600", "--paused"});
  signal(SIGHUP, before);
  served.send(SIGHUP);
  EXPECT_EQ(served.ctl({"step", "3"}).exit_code, 0);
  EXPECT_EQ(served.status().step(), 3U);
  EXPECT_EQ(served.end(SIGTERM).exit_code, 130);
}

TEST(Serve, CtlReachesItAtAnAddressAndCapturesCalls) {
  Served served({"--duration", "3600", "--listen", "127.0.0.1:0"});
  const std::string said = served.said(), mark = " and ";
  ASSERT_NE(said.find(mark), std::string::npos) << said;
  const std::string address =
      said.substr(said.find(mark) + mark.size(), said.find('\n') - said.find(mark) - mark.size());
  const ScratchFolder folder;
  const std::string file = folder.path("solver.capsule");
  ProgramResult result =
      harness::run_program({"ctl", "--socket", address, "capture", "solver", "--out", file, "--steps", "15"}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("15 calls of slot solver in 15 steps"));
  result = harness::run_program({"replay", file}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("15 calls: 15 same, 0 different"));
  result = harness::run_program({"serve", kSample, "--headless", "--listen", address}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--listen " + address + ": cannot listen there"));
  EXPECT_THAT(result.err, ::testing::Not(HasSubstr("UNKNOWN"))) << "gRPC's own words";
}

TEST(Serve, WhatCannotBeIsExitCode2) {
  const ScratchFolder folder;
  ProgramResult result = harness::run_program({"serve", kSample}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("the page comes later; allowed: --headless"));
  result = harness::run_program({"serve", kSample, "--headless", "--speed", "-1"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--speed -1"));
  result = harness::run_program({"serve", kSample, "--headless", "--compare", "solver=Newtn"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--compare solver=Newtn: no solver plugin"));
  result = harness::run_program({"serve", kSample, "--headless", "--listen", "0.0.0.0:4711"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("others with --allow-remote"));
  for (const char* address : {"127.0.0.1:99999", "127.0.0.1", "[::1]", "foo"}) {
    result = harness::run_program({"serve", kSample, "--headless", "--listen", address}, folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(std::string(address) + ": allowed: ADDR:PORT, with a port from 0 to 65535"));
  }
  result = harness::run_program({"ctl", "step", "0"}, folder);
  EXPECT_THAT(result.err, HasSubstr("N: \"0\"; allowed: a whole number from 1"));
  result = harness::run_program({"serve", folder.path("none.gravitas"), "--headless"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  result = harness::run_program({"ctl", "--socket", folder.path("none.sock"), "status"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("no server answers"));
  EXPECT_EQ(harness::run_program({"ctl"}, folder).exit_code, 2);
  for (const char* command : {"status", "pause", "resume", "step", "reset", "swap", "set", "inject", "capture", "watch",
                              "events", "edit", "wake"}) {
    result = harness::run_program({"ctl", command, "--help"}, folder);
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(result.out, HasSubstr(std::string("Example: gravitas ctl ") + command));
  }
}

}  // namespace
}  // namespace gravitas
