// The sandbox of real worker processes, however they were started, and what becomes of their output.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/environment.h"
#include "kernel/fault.h"
#include "plugin_sdk/channel/supervisor.h"
#include "tests/kernel/one_call.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

using harness::faulty_plugin_path;
using harness::Integration;
using harness::WorldBuilder;
using kernel::Carrier;
using kernel::Environment;
using kernel::Hosting;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
using ::testing::UnorderedElementsAre;

using harness::kSanitized;

// A slot with a faulty integrator alone in it.
kernel::SlotDescription slot_with(const std::string& integrator, Hosting hosting) {
  const WorldBuilder builder =
      std::move(WorldBuilder(hosting).plugin(Slot::kIntegrator, faulty_plugin_path(integrator)));
  kernel::SlotDescription slot = builder.description().integrator;
  slot.deadline = 30.0;
  return slot;
}

std::unique_ptr<Carrier> start(const kernel::SlotDescription& slot, std::uint32_t threads = 1) {
  return kernel::start_host(slot, threads, {});
}

// The third call, in which faulty integrators misbehave: what the plugin says, or the fault.
std::string third_call(Carrier* host) {
  Integration call;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(call.make(host).status, GRAVITAS_OK);
  try {
    return call.make(host).text;
  } catch (const kernel::StageFault& fault) {
    return fault.text();
  }
}

bool has(const std::vector<std::string>& list, const std::string& beginning) {
  for (const std::string& one : list)
    if (one.starts_with(beginning)) return true;
  return false;
}

void expect_whole_sandbox(const std::vector<std::string>& said) {
  EXPECT_THAT(said, Contains("no_new_privs"));
  EXPECT_THAT(said, Contains("seccomp"));
  EXPECT_THAT(said, Contains("descriptors 256"));
  EXPECT_TRUE(has(said, "landlock ") || has(said, "no landlock: this system's kernel has none"));
  EXPECT_TRUE(has(said, kSanitized ? "no limit of memory" : "memory 4096 MiB"));
}

class SandboxedWorker : public ::testing::TestWithParam<Hosting> {
 protected:
  void TearDown() override { kernel::set_worker_sandbox(true); }
};

TEST_P(SandboxedWorker, SaysWhatIsEnforced) {
  expect_whole_sandbox(start(slot_with("integrator_nan", GetParam()))->sandbox());
}

TEST_P(SandboxedWorker, APluginIsKeptInFromWhenItIsLoaded) {
  const auto host = start(slot_with("integrator_tries_to_escape", GetParam()));
  const std::string open = has(host->sandbox(), "landlock ") ? "" : "reading, writing";
  const std::string none = "not prevented: " + (open.empty() ? "nothing" : open);
  // a sanitizer's shadow memory leaves no room for a limit of memory; whether ThreadSanitizer's finds room for a
  // terabyte besides is chance
  const std::string all = "not prevented: " + (open.empty() ? "" : open + ", ") + "1 TB";
  if (harness::kThreadSanitized)
    EXPECT_THAT(third_call(host.get()), AnyOf(none, all));
  else
    EXPECT_EQ(third_call(host.get()), kSanitized ? all : none);
}

TEST_P(SandboxedWorker, WithoutASandboxEverythingIsOpen) {
  kernel::set_worker_sandbox(false);
  const auto host = start(slot_with("integrator_tries_to_escape", GetParam()));
  EXPECT_THAT(host->sandbox(), IsEmpty());
  const std::string text = third_call(host.get());
  for (const char* act : {"reading", "writing", "socket", "connect", "fork", "exec", "signal", "ptrace", "peeking"})
    EXPECT_THAT(text, HasSubstr(act));
}

TEST_P(SandboxedWorker, ThereIsRoomForManyThreads) {
  const auto host = start(slot_with("integrator_nan", GetParam()), kSanitized ? 16 : 300);
  if (kSanitized) return;
  EXPECT_THAT(host->sandbox(), Contains("memory 6848 MiB"));
}

TEST_P(SandboxedWorker, ItsLinesAreComplaintsAndItsLastWordsAreInTheFault) {
  const auto host = start(slot_with("integrator_speaks_and_aborts", GetParam()));
  EXPECT_THAT(host->take_complaints(), IsEmpty());
  const std::string text = third_call(host.get());
  EXPECT_THAT(text, HasSubstr("killed by signal 6"));
  EXPECT_THAT(text, EndsWith("; its last words: it cannot go on"));
  EXPECT_THAT(host->take_complaints(),
              UnorderedElementsAre("stdout: three calls are enough", "stderr: it cannot go on"));
}

INSTANTIATE_TEST_SUITE_P(Carriers, SandboxedWorker, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST(WorkerSandbox, LinesOfWorkersAreWarnings) {
  WorldBuilder builder(Hosting::kDirect);
  builder.steps(4, 0.01).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0));
  builder.plugin(Slot::kIntegrator, faulty_plugin_path("integrator_speaks_and_aborts"));
  builder.hosting(Slot::kIntegrator, Hosting::kSharedMemory);
  Environment world(builder.description());
  while (world.step_count() < world.total_steps() && world.step() == kernel::StepOutcome::kCommitted) {
  }
  const std::vector<std::string> warnings = world.warnings();
  EXPECT_THAT(warnings, Contains("worker of slot integrator: stdout: three calls are enough"));
  EXPECT_THAT(warnings, Contains("worker of slot integrator: stderr: it cannot go on"));
}

TEST(WorkerSandbox, AWorkerThatListensIsInOneToo) {
  kernel::SlotDescription slot = slot_with("integrator_tries_to_escape", Hosting::kGrpc);
  const std::string path = ::testing::TempDir() + "/gravitas_listens_" + std::to_string(getpid());
  const std::string address = "unix:" + path;
  const pid_t worker = fork();
  if (worker == 0) {
    execl(kernel::worker_program().c_str(), "gravitas-worker", "--listen", address.c_str(),
          slot.plugins[0].library.c_str(), nullptr);
    _exit(127);
  }
  struct Ended {
    ~Ended() {
      kill(worker, SIGKILL);
      waitpid(worker, nullptr, 0);
      unlink(path.c_str());
    }
    pid_t worker;
    const std::string& path;
  };
  const Ended ended{worker, path};
  slot.plugins[0].address = address;
  while (access(path.c_str(), F_OK) != 0) ASSERT_EQ(waitpid(worker, nullptr, WNOHANG), 0);
  const auto host = start(slot);
  expect_whole_sandbox(host->sandbox());
  const std::string text = third_call(host.get());
  EXPECT_THAT(text, StartsWith("not prevented: "));
  for (const char* act : {"socket", "connect", "fork", "exec", "signal", "ptrace", "peeking"})
    EXPECT_THAT(text, Not(HasSubstr(act)));
}

TEST(WorkerSandbox, AWorkerWhoseKernelIsGoneAlreadyEnds) {
  int ends[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
  close(ends[0]);
  const auto worker = channel::Supervisor::instance().spawn(
      {kernel::worker_program(), "--control-fd", "3", faulty_plugin_path("integrator_nan")}, {ends[1]}, {});
  close(ends[1]);
  EXPECT_TRUE(worker->wait(60'000));
  worker->kill();
}

TEST(WorkerSandbox, ACommandWhoseKernelIsGoneAlreadyIsNotStarted) {
  int ends[2];
  ASSERT_EQ(pipe2(ends, O_CLOEXEC), 0);
  close(ends[0]);
  const pid_t worker = fork();
  if (worker == 0) {
    dup2(ends[1], STDOUT_FILENO);
    execl(kernel::worker_program().c_str(), "gravitas-worker", "--exec", "false", nullptr);
    _exit(127);
  }
  close(ends[1]);
  int status = -1;
  waitpid(worker, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);  // `false` would say 1
}

TEST(WorkerSandbox, ACommandSaysItsOwn) {
  kernel::SlotDescription slot = slot_with("integrator_nan", Hosting::kGrpc);
  kernel::PluginChoice& plugin = slot.plugins[0];
  plugin.command = in_shell(kernel::worker_program()) + " " + in_shell(plugin.library);
  expect_whole_sandbox(start(slot)->sandbox());
  plugin.command = in_shell(kernel::worker_program()) + " --no-sandbox " + in_shell(plugin.library);
  EXPECT_THAT(start(slot)->sandbox(), IsEmpty());
}

TEST(WorkerSandbox, ACommandThatFailsHasItsLastWordsInTheFault) {
  kernel::SlotDescription slot = slot_with("integrator_nan", Hosting::kGrpc);
  slot.plugins[0].command = "echo 'no licence found' >&2; false";
  try {
    start(slot);
    FAIL() << "it started";
  } catch (const kernel::StageFault& fault) {
    EXPECT_THAT(fault.text(), EndsWith("before it listened; its last words: no licence found"));
  }
}

}  // namespace
}  // namespace gravitas
