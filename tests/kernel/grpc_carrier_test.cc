// Workers reached by gRPC that the kernel did not start over inherited sockets: at an address, and by a command.
#include <gmock/gmock.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "gravitas/control/v1/control.grpc.pb.h"
#include "kernel/carrier/carrier.h"
#include "kernel/environment.h"
#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/library.h"
#include "tests/kernel/one_call.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using harness::OneCall;
using harness::plugin_path;
using harness::start_worker;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::FaultKind;
using kernel::Hosting;
using kernel::StageFault;
using kernel::StepOutcome;
using ::testing::HasSubstr;
using ::testing::Not;

WorldBuilder balls(std::uint32_t count) {
  WorldBuilder builder(Hosting::kDirect);
  builder.steps(5, 0.01).ground();
  for (std::uint32_t i = 0; i < count; ++i) builder.sphere(0.5 + 1e-6 * i, 1.0, Vector3(2.0 * i, 0.49, 0));
  builder.gravity(Vector3(0, -10, 0));
  return builder;
}

// The worker's bits, or why there are none.
std::string chain_by_grpc_of(const WorldBuilder& builder) {
  Environment world(builder.description());
  while (world.step_count() < world.total_steps())
    if (world.step() == StepOutcome::kPaused) return world.fault()->fault.text();
  return world.chain_hash().text();
}

StageFault start_fault(const WorldBuilder& builder) {
  try {
    Environment world(builder.description());
  } catch (const StageFault& fault) {
    return fault;
  }
  ADD_FAILURE() << "it started";
  return {FaultKind::kHandshake, "", ""};
}

// A worker that listens, started as a user starts it.
class ListeningWorker {
 public:
  explicit ListeningWorker(const std::string& library) {
    int out[2];
    EXPECT_EQ(pipe(out), 0);
    process_ = fork();
    if (process_ == 0) {
      dup2(out[1], STDOUT_FILENO);
      execl(kernel::worker_program().c_str(), "gravitas-worker", "--listen", "127.0.0.1:0", library.c_str(), nullptr);
      _exit(127);
    }
    close(out[1]);
    std::FILE* said = fdopen(out[0], "r");
    char line[256] = "";
    EXPECT_NE(std::fgets(line, sizeof line, said), nullptr);
    std::fclose(said);
    const std::string text = line;
    EXPECT_THAT(text, HasSubstr("listening at 127.0.0.1:"));
    address_ = text.substr(13, text.size() - 14);
  }
  ~ListeningWorker() { end(); }
  ListeningWorker(const ListeningWorker&) = delete;
  ListeningWorker& operator=(const ListeningWorker&) = delete;

  void end() {
    if (process_ <= 0) return;
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
    process_ = -1;
  }
  const std::string& address() const { return address_; }
  pid_t process() const { return process_; }

 private:
  pid_t process_ = -1;
  std::string address_;
};

TEST(GrpcCarrier, AListeningWorkerServesOneKernelAfterTheOther) {
  const ListeningWorker worker(plugin_path("solver_sequential"));
  WorldBuilder builder = balls(3);
  const std::string direct = chain_by_grpc_of(builder);
  builder.description().solver.plugins[0].address = worker.address();
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
  Environment world(builder.description());
  bool found = false;
  for (const kernel::PlannedSlot& slot : world.plan().slots) {
    if (slot.slot != Slot::kSolver) continue;
    EXPECT_EQ(slot.hosting, Hosting::kGrpc);
    EXPECT_EQ(slot.process_id, worker.process());
    found = true;
  }
  EXPECT_TRUE(found);
}

TEST(GrpcCarrier, AListeningWorkerServesOneKernelAtATime) {
  const ListeningWorker worker(plugin_path("solver_sequential"));
  WorldBuilder builder = balls(3);
  builder.description().solver.plugins[0].address = worker.address();
  Environment first(builder.description());
  const StageFault fault = start_fault(builder);
  EXPECT_EQ(fault.kind, FaultKind::kHandshake);
  EXPECT_EQ(first.step(), StepOutcome::kCommitted);
}

TEST(GrpcCarrier, TheEndOfAListeningWorkerPausesTheEnvironment) {
  ListeningWorker worker(plugin_path("solver_sequential"));
  WorldBuilder builder = balls(3);
  builder.description().solver.plugins[0].address = worker.address();
  Environment world(builder.description());
  ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  worker.end();
  ASSERT_EQ(world.step(), StepOutcome::kPaused);
  // nobody listens there any more
  EXPECT_EQ(world.faults()[0].fault.kind, FaultKind::kDeath);
  EXPECT_THAT(world.faults()[0].fault.text(), HasSubstr(worker.address() + " is gone"));
  EXPECT_EQ(world.fault()->fault.kind, FaultKind::kHandshake);
  EXPECT_EQ(world.step_count(), 1U);
}

TEST(GrpcCarrier, AWorkerOfAnotherPluginRefuses) {
  const ListeningWorker worker(plugin_path("solver_sequential"));
  WorldBuilder builder = balls(3);
  builder.description().integrator.plugins[0].address = worker.address();
  EXPECT_THAT(start_fault(builder).text(),
              HasSubstr("this worker serves plugin 'Sequential', not 'SemiImplicitEuler'"));
}

TEST(GrpcCarrier, AnAddressWithoutWorkerIsAnError) {
  WorldBuilder builder = balls(1);
  builder.description().solver.plugins[0].address = "unix:/nowhere/at/all";
  EXPECT_THAT(start_fault(builder).text(), HasSubstr("no worker answers at unix:/nowhere/at/all: No such file"));
  builder.description().solver.plugins[0].address = "192.0.2.1:7000";
  EXPECT_THAT(start_fault(builder).text(), HasSubstr("no address of this machine"));
}

TEST(GrpcCarrier, ACommandStartsAWorkerBesideTheSlotsLibraries) {
  WorldBuilder builder = balls(3);
  builder.force("Basic", "force_basic", {0, 5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  const std::string direct = chain_by_grpc_of(builder);
  kernel::PluginChoice& gravity = builder.description().force.plugins[0];
  gravity.command = in_shell(kernel::worker_program()) + " " + in_shell(gravity.library);
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
  builder.hosting(Slot::kForce, Hosting::kSharedMemory);
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
}

TEST(GrpcCarrier, ACommandThatIsNoWorkerIsAnError) {
  WorldBuilder builder = balls(1);
  builder.description().solver.plugins[0].command = "true";
  EXPECT_THAT(start_fault(builder).text(), HasSubstr("'true' was ended by itself with exit code 0 before it listened"));
  builder.description().solver.plugins[0].command = "no-such-program";
  EXPECT_THAT(start_fault(builder).text(), HasSubstr("exit code 127"));
}

TEST(GrpcCarrier, ACommandTakesOverFromALibrary) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(5, 0.01).sphere(0.5, 1.0, Vector3::Zero(), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
  const std::string quiet = chain_by_grpc_of(builder);
  kernel::PluginChoice& drag = builder.description().force.plugins[0];
  kernel::PluginChoice command = drag;
  command.command = in_shell(kernel::worker_program()) + " " + in_shell(command.library);
  drag.fallback = std::make_shared<kernel::PluginChoice>(command);
  Environment world(builder.description());
  world.inject({Slot::kForce, "kill", 3, 2});
  while (world.step_count() < world.total_steps()) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  EXPECT_EQ(world.chain_hash().text(), quiet);
  EXPECT_EQ(world.faults().back().recovered_by, "fallback Drag");
}

TEST(GrpcCarrier, ACommandsSocketMayHaveAnyPath) {
  const std::string place = ::testing::TempDir() + "/one's own; \"place\" " + std::to_string(getpid());
  const char* before = getenv("TMPDIR");
  const std::string old = before != nullptr ? before : "";
  ASSERT_EQ(mkdir(place.c_str(), 0700), 0);
  setenv("TMPDIR", place.c_str(), 1);
  WorldBuilder builder = balls(1);
  kernel::PluginChoice& solver = builder.description().solver.plugins[0];
  solver.command = in_shell(kernel::worker_program()) + " " + in_shell(solver.library);
  EXPECT_NO_THROW(Environment world(builder.description()));
  before != nullptr ? setenv("TMPDIR", old.c_str(), 1) : unsetenv("TMPDIR");
  rmdir(place.c_str());
}

// The connection is made, and then nobody says anything.
TEST(GrpcCarrier, AStopEndsTheWaitingForAWorkerAtAnAddress) {
  const std::string path = ::testing::TempDir() + "/gravitas_silent_" + std::to_string(getpid());
  const int listening = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const auto address = channel::unix_address(path);
  ASSERT_TRUE(address);
  unlink(path.c_str());
  ASSERT_EQ(bind(listening, reinterpret_cast<const sockaddr*>(&*address), sizeof *address), 0);
  ASSERT_EQ(listen(listening, 1), 0);
  kernel::SlotDescription slot = balls(1).description().solver;
  slot.plugins[0].address = "unix:" + path;
  std::stop_source source;
  source.request_stop();
  try {
    start_grpc_carrier(slot, 1, source.get_token());
    ADD_FAILURE() << "it started";
  } catch (const StageFault& fault) {
    EXPECT_THAT(fault.text(), Not(HasSubstr("did not answer")));
  }
  close(listening);
  unlink(path.c_str());
}

TEST(GrpcCarrier, WhoSaysNothingKeepsNoKernelFromAListeningWorker) {
  using control::v1::WorkerControl;
  const ListeningWorker worker(plugin_path("solver_sequential"));
  const auto stub = WorkerControl::NewStub(grpc::CreateChannel(worker.address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto silent = stub->Session(&context);
  // it has come: the worker answers what came after it
  grpc::ClientContext probe;
  control::v1::KernelMessage nonsense;
  nonsense.mutable_drain();
  const auto next = stub->Session(&probe);
  next->Write(nonsense);
  next->Finish();
  WorldBuilder builder = balls(3);
  const std::string direct = chain_by_grpc_of(builder);
  builder.description().solver.plugins[0].address = worker.address();
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
  context.TryCancel();
  silent->Finish();
}

// Nine thousand shapes are more than goes inline: they travel as an asset, in the one call that needs it.
TEST(GrpcCarrier, LargeColumnsTravelAsAssets) {
  WorldBuilder builder = balls(9000);
  builder.steps(2, 0.01);
  const std::string direct = chain_by_grpc_of(builder);
  builder.hosting(Slot::kCollision, Hosting::kGrpc);
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
}

// A worker that listens keeps nothing of the kernel before: the same asset is sent, and taken, again.
TEST(GrpcCarrier, AListeningWorkerTakesTheAssetsOfEveryKernel) {
  const ListeningWorker worker(plugin_path("collision_standard"));
  WorldBuilder builder = balls(9000);
  builder.steps(1, 0.01);
  const std::string direct = chain_by_grpc_of(builder);
  builder.description().collision.plugins[0].address = worker.address();
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
  EXPECT_EQ(chain_by_grpc_of(builder), direct);
}

// Of 20, 100 and 3000 bodies: columns of less than 1 KiB, which always go, and of more than 64 KiB. Whatever a stream
// carried before, the answer is that of a worker who is asked for the first time.
TEST(GrpcCarrier, ColumnsThatAreKeptAreThoseOfTheRequestBefore) {
  using Request = stage::IntegratorIntegrateRequest;
  const std::unique_ptr<kernel::Carrier> carrier = start_worker(Hosting::kGrpc, "integrator_euler", 2.0);
  const auto ask_both = [&](harness::Integration* call, const std::string& when) {
    SCOPED_TRACE(when);
    const kernel::CallResult result = call->make(carrier.get());
    const std::vector<std::vector<std::byte>> answers = call->answers();
    const kernel::CallResult first = call->make(start_worker(Hosting::kGrpc, "integrator_euler", 2.0).get());
    EXPECT_EQ(result.status, first.status);
    EXPECT_EQ(result.text, first.text);
    if (first.status == GRAVITAS_OK) {
      EXPECT_EQ(answers, call->answers());
    }
    return result.status;
  };
  for (const std::uint32_t bodies : {20U, 100U, 3000U, 100U, 20U, 3000U}) {
    harness::Integration call(bodies);
    double* velocity = call.f64(Request::kLinearVelocity);
    const std::string count = std::to_string(bodies) + " bodies, ";
    const double was = velocity[30];
    EXPECT_EQ(ask_both(&call, count + "at first"), GRAVITAS_OK);
    EXPECT_EQ(ask_both(&call, count + "the same again"), GRAVITAS_OK);
    velocity[30] = 77.0;
    EXPECT_EQ(ask_both(&call, count + "one column changed"), GRAVITAS_OK);
    velocity[30] = was;
    EXPECT_EQ(ask_both(&call, count + "changed back"), GRAVITAS_OK);
    velocity[30] = std::numeric_limits<double>::infinity();
    EXPECT_NE(ask_both(&call, count + "refused"), GRAVITAS_OK);
    EXPECT_NE(ask_both(&call, count + "refused again"), GRAVITAS_OK);
    velocity[30] = was;
    EXPECT_EQ(ask_both(&call, count + "after the refusal"), GRAVITAS_OK);
  }
}

// Takes three of the asker's deadlines to answer.
class SlowForces final : public kernel::DerivativeSource {
 public:
  SlowForces(const OneCall& call, double deadline) : call_(call), nanoseconds_(static_cast<long>(3e9 * deadline)) {}
  std::span<const kernel::ColumnId> trial_columns() const override { return call_.trial; }
  std::span<const kernel::ColumnId> answer_columns() const override { return call_.derivative; }
  void evaluate() override {
    const timespec pause = {nanoseconds_ / 1'000'000'000, nanoseconds_ % 1'000'000'000};
    nanosleep(&pause, nullptr);
    ++asked;
  }
  int asked = 0;

 private:
  const OneCall& call_;
  long nanoseconds_;
};

class WorkerCarrier : public ::testing::TestWithParam<Hosting> {};
INSTANTIATE_TEST_SUITE_P(Of, WorkerCarrier, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(WorkerCarrier, TheAskersDeadlineStandsStillWhileItsDerivativeIsEvaluated) {
  using Request = stage::IntegratorIntegrateRequest;
  constexpr double kDeadline = 0.3;
  OneCall call(stage::Method::kIntegratorIntegrate);
  *call.f64(Request::kTimeStep) = 0.01;
  *call.u32(Request::kFlags) = kMovable;
  *call.f64(Request::kInverseMass) = 1.0;
  *call.f64(Request::kOrientation) = 1.0;
  const std::unique_ptr<kernel::Carrier> carrier = start_worker(GetParam(), "integrator_euler", kDeadline);
  SlowForces forces(call, kDeadline);
  EXPECT_EQ(call.make(carrier.get(), &forces).status, GRAVITAS_OK);
  EXPECT_EQ(forces.asked, 1);
}

// Answers at once, for sixty deadlines: the asker has ten, without the time that answers take.
class PatientForces final : public kernel::DerivativeSource {
 public:
  PatientForces(const OneCall& call, double deadline)
      : call_(call), until_(channel::now_ns() + static_cast<std::uint64_t>(60e9 * deadline)) {}
  std::span<const kernel::ColumnId> trial_columns() const override { return call_.trial; }
  std::span<const kernel::ColumnId> answer_columns() const override { return call_.derivative; }
  void evaluate() override {
    if (channel::now_ns() > until_) throw StageFault(FaultKind::kFailure, "test", "asked for ever");
  }

 private:
  const OneCall& call_;
  std::uint64_t until_;
};

// Each question starts the deadline anew, up to ten times.
TEST_P(WorkerCarrier, AnIntegratorThatAsksForEverIsEnded) {
  constexpr double kDeadline = 0.25;
  const std::string library = harness::faulty_plugin_path("integrator_asks_forever");
  std::string problem;
  kernel::SlotDescription slot;
  slot.hosting = GetParam();
  slot.deadline = kDeadline;
  slot.plugins = {{load_plugin_library(library, &problem).declaration, library, {}}};
  const std::unique_ptr<kernel::Carrier> carrier = start_host(slot, 1, {});
  harness::Integration call;
  *call.u32(stage::IntegratorIntegrateRequest::kWrenchIsConstant) = 0;
  for (int i = 0; i < 2; ++i) ASSERT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
  PatientForces forces(call, kDeadline);
  try {
    call.make(carrier.get(), &forces);
    FAIL() << "it was answered";
  } catch (const StageFault& fault) {
    EXPECT_EQ(fault.kind, FaultKind::kDeadline) << fault.text();
    EXPECT_THAT(fault.text(), HasSubstr("ten times"));
  }
}

TEST(GrpcCarrier, AMethodThatTheWorkerDoesNotServeIsNamed) {
  OneCall call(stage::Method::kIntegratorDerivative);
  const std::unique_ptr<kernel::Carrier> carrier = start_worker(Hosting::kGrpc, "integrator_euler", 2.0);
  try {
    call.make(carrier.get());
    FAIL() << "it was answered";
  } catch (const StageFault& fault) {
    EXPECT_EQ(fault.kind, FaultKind::kFailure);
    EXPECT_THAT(fault.text(), HasSubstr("no method of a stage: /gravitas.stage.v1.Integrator/Derivative"));
  }
}

}  // namespace
}  // namespace gravitas
