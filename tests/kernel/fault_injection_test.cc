// Every fault that a worker can be ordered to commit, in one call to each process carrier: what the kernel makes of it.
#include "plugin_sdk/host/fault_injection.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "kernel/fault.h"
#include "plugin_sdk/host/fault_kinds.h"
#include "tests/kernel/one_call.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using harness::Integration;
using harness::OneCall;
using harness::PairSearch;
using harness::start_worker;
using kernel::CallResult;
using kernel::Carrier;
using kernel::FaultKind;
using kernel::Hosting;
using kernel::StageFault;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// Far more than any call here takes, even under a sanitizer on a busy machine; and as long as one that never ends
// is waited for.
constexpr double kLong = 30.0, kShort = 0.2;

std::optional<StageFault> fault_of(OneCall* call, Carrier* carrier, const std::string& order) {
  try {
    call->make(carrier, nullptr, order);
    return std::nullopt;
  } catch (const StageFault& fault) {
    return fault;
  }
}

// Ends each test: all workers are reaped.
void expect_no_process() {
  siginfo_t info{};
  EXPECT_EQ(waitid(P_ALL, 0, &info, WEXITED | WNOHANG | WNOWAIT), -1) << "process " << info.si_pid;
}

class InjectedFaults : public ::testing::TestWithParam<Hosting> {
 protected:
  void TearDown() override { expect_no_process(); }

  std::unique_ptr<Carrier> integrator(double deadline = kLong) const {
    return start_worker(GetParam(), "integrator_euler", deadline);
  }
  std::unique_ptr<Carrier> space(double deadline = kLong) const {
    return start_worker(GetParam(), "space_basic", deadline);
  }

  // A worker of its own commits the fault, and the call ends so.
  void expect_fault(const std::string& order, FaultKind kind, const std::string& text, double deadline = kLong) const {
    SCOPED_TRACE(order);
    Integration call;
    const std::optional<StageFault> fault = fault_of(&call, integrator(deadline).get(), order);
    ASSERT_TRUE(fault.has_value()) << "it was answered";
    EXPECT_EQ(fault->kind, kind) << fault->text();
    EXPECT_THAT(fault->text(), HasSubstr(text));
  }

  // A worker of its own commits it, and answers rightly, now and once more. Returns what it said.
  std::string expect_right(const std::string& order) const {
    SCOPED_TRACE(order);
    Integration call;
    const std::unique_ptr<Carrier> carrier = integrator();
    EXPECT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
    const std::vector<std::vector<std::byte>> right = call.answers();
    const CallResult result = call.make(carrier.get(), nullptr, order);
    EXPECT_EQ(result.status, GRAVITAS_OK) << result.text;
    EXPECT_EQ(call.answers(), right);
    EXPECT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
    EXPECT_EQ(call.answers(), right);
    return result.text;
  }

  // The plugin is said to have failed, and why; the worker lives on.
  void expect_failure(OneCall* call, Carrier* carrier, const std::string& order, const std::string& text) const {
    SCOPED_TRACE(order);
    const CallResult result = call->make(carrier, nullptr, order);
    EXPECT_EQ(result.status, GRAVITAS_FAILED);
    EXPECT_THAT(result.text, HasSubstr(text));
    EXPECT_EQ(call->make(carrier).status, GRAVITAS_OK);
  }

  // The answer is right, and says why it is no other.
  void expect_left_out(OneCall* call, Carrier* carrier, const std::string& order, const std::string& text) const {
    SCOPED_TRACE(order);
    EXPECT_EQ(call->make(carrier).status, GRAVITAS_OK);
    const std::vector<std::vector<std::byte>> right = call->answers();
    const CallResult result = call->make(carrier, nullptr, order);
    EXPECT_EQ(result.status, GRAVITAS_OK);
    EXPECT_THAT(result.text, StartsWith(host::kNotInjected));
    EXPECT_THAT(result.text, HasSubstr(text));
    EXPECT_EQ(call->answers(), right);
  }
};

INSTANTIATE_TEST_SUITE_P(On, InjectedFaults, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

// ---- the process ends --------------------------------------------------------------------------------------------
const std::map<std::string, std::string> kEndings = {{"kill", "killed by signal 9"},   {"segv", "killed by signal 11"},
                                                     {"stack", "killed by signal 11"}, {"abort", "killed by signal 6"},
                                                     {"throw", "killed by signal 6"},  {"fpe", "killed by signal 8"},
                                                     {"exit", "exit code 0"},          {"exit,code=3", "exit code 3"}};

TEST_P(InjectedFaults, ThatEndTheProcess) {
  for (const auto& [order, text] : kEndings) expect_fault(order, FaultKind::kDeath, text);
}

TEST_P(InjectedFaults, ThatEndTheProcessAtAnyMomentBeforeTheReply) {
  for (const char* moment : {"read", "compute", "write"})
    for (const char* kind : {"kill", "segv", "exit"})
      expect_fault(std::string(kind) + ",at=" + moment, FaultKind::kDeath, kEndings.at(kind));
}

// The answer is there, and taken; the next call finds nobody.
TEST_P(InjectedFaults, ThatEndTheProcessAfterTheReply) {
  Integration quiet, call;
  EXPECT_EQ(quiet.make(integrator().get()).status, GRAVITAS_OK);
  const std::unique_ptr<Carrier> carrier = integrator();
  EXPECT_EQ(call.make(carrier.get(), nullptr, "kill,at=reply").status, GRAVITAS_OK);
  EXPECT_EQ(call.answers(), quiet.answers());
  const std::optional<StageFault> next = fault_of(&call, carrier.get(), "");
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->kind, FaultKind::kDeath) << next->text();
}

// Stopped, it is handed a request that another failed at, and dies: the request is not to blame, as it would be for one
// that has read it.
TEST_P(InjectedFaults, ThatEndTheProcessBeforeItHasReadARepeatedRequest) {
  Integration call;
  const std::unique_ptr<Carrier> carrier = integrator();
  ASSERT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
  const int process = carrier->process_id();
  kill(process, SIGSTOP);
  std::thread killer([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    kill(process, SIGKILL);
  });
  std::optional<StageFault> fault;
  try {
    call.make(carrier.get(), nullptr, "", 1);
  } catch (const StageFault& one) {
    fault = one;
  }
  killer.join();
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->kind, FaultKind::kDeath) << fault->text();
  EXPECT_TRUE(fault->is_unread);
}

TEST_P(InjectedFaults, ThatEndTheProcessWithARepeatedRequestRead) {
  for (const char* order : {"kill,at=read", "segv,at=read", "kill", "exit,at=write"}) {
    SCOPED_TRACE(order);
    Integration call;
    const std::unique_ptr<Carrier> carrier = integrator();
    try {
      call.make(carrier.get(), nullptr, order, 1);
      ADD_FAILURE() << "it was answered";
    } catch (const StageFault& fault) {
      EXPECT_EQ(fault.kind, FaultKind::kDeath) << fault.text();
      EXPECT_FALSE(fault.is_unread);
    }
  }
}

TEST_P(InjectedFaults, AreNotNeededToAnswerARepeatedRequest) {
  Integration first, again;
  EXPECT_EQ(first.make(integrator().get()).status, GRAVITAS_OK);
  EXPECT_EQ(again.make(integrator().get(), nullptr, "", 2).status, GRAVITAS_OK);
  EXPECT_EQ(again.answers(), first.answers());
}

// ---- it takes long -----------------------------------------------------------------------------------------------
TEST_P(InjectedFaults, ThatNeverEnd) {
  for (const char* order : {"hang", "deadlock", "stop"})
    expect_fault(order, FaultKind::kDeadline, "within its deadline", kShort);
}

TEST_P(InjectedFaults, ThatTakeTooLong) {
  for (const char* order : {"slow,seconds=1000", "slow,factor=1e6", "delay,seconds=1000"})
    expect_fault(order, FaultKind::kDeadline, "within its deadline", kShort);
}

TEST_P(InjectedFaults, ThatTakeLonger) {
  for (const char* order : {"slow", "slow,seconds=0.01", "jitter,seconds=0.01", "delay,seconds=0.01"})
    expect_right(order);
  // by as much as was ordered
  Integration call;
  EXPECT_GE(call.make(integrator().get(), nullptr, "slow,factor=30").compute_ns, 30'000'000U);
}

// ---- it uses up --------------------------------------------------------------------------------------------------
std::size_t resident_bytes(int process) {
  std::size_t pages = 0;
  std::ifstream("/proc/" + std::to_string(process) + "/statm") >> pages >> pages;
  return 4096 * pages;
}

TEST_P(InjectedFaults, ThatLeak) {
  Integration call;
  const std::unique_ptr<Carrier> carrier = integrator();
  EXPECT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
  const std::size_t before = resident_bytes(carrier->process_id());
  EXPECT_EQ(call.make(carrier.get(), nullptr, "leak,bytes=50e6").status, GRAVITAS_OK);
  EXPECT_GE(resident_bytes(carrier->process_id()), before + 49'000'000);
}

TEST_P(InjectedFaults, ThatUseUpDescriptors) {
  EXPECT_THAT(expect_right("descriptors"),
              ::testing::MatchesRegex("opened [1-9][0-9]+ descriptors: Too many open files"));
}

TEST_P(InjectedFaults, ThatUseUpDescriptorsLeaveOneForTheNextSegments) {
  Integration call;
  const std::unique_ptr<Carrier> carrier = integrator();
  call.make(carrier.get(), nullptr, "descriptors");
  for (std::uint64_t room = 10'000; room <= 1'000'000; room *= 10) {
    call.arena.grow(call.request[0], room);
    call.arena.grow(call.reply[0], room);
    EXPECT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
  }
}

// More than a pipe holds; all of it is read, though not all of it is kept.
TEST_P(InjectedFaults, ThatFloodTheOutput) {
  constexpr std::size_t kBytes = 1'000'000;
  Integration call;
  const std::unique_ptr<Carrier> carrier = integrator();
  EXPECT_EQ(call.make(carrier.get(), nullptr, "flood,bytes=1e6").text, "wrote 1000000 bytes");
  const std::string prefix = "stdout: ";
  std::size_t read = 0;
  for (int i = 0; i < 3000 && read < kBytes; ++i) {
    for (const std::string& line : carrier->take_complaints()) {
      std::size_t dropped = 0;
      const bool is_count = std::sscanf(line.c_str(), "stdout: ... and %zu more bytes dropped", &dropped) == 1;
      read += is_count ? dropped : line.size() - prefix.size() + 1;
    }
    usleep(10'000);
  }
  EXPECT_EQ(read, kBytes);
}

TEST_P(InjectedFaults, ThatFailTheCall) {
  const std::unique_ptr<Carrier> carrier = integrator();
  Integration call;
  expect_failure(&call, carrier.get(), "memory", "std::bad_alloc");
  expect_failure(&call, carrier.get(), "rounding", "changed the floating-point environment");
}

// ---- the reply is damaged ----------------------------------------------------------------------------------------
TEST_P(InjectedFaults, ThatLoseTheReply) {
  for (const char* order : {"drop", "stale", "sequence"})
    expect_fault(order, FaultKind::kDeadline, "within its deadline", kShort);
}

TEST_P(InjectedFaults, ThatSpoilTheReply) {
  for (const char* order : {"truncate", "oversize", "flip", "flip,bit=0", "flip,bit=1000001", "flip,where=header",
                            "scribble", "scribble,seed=2", "scribble,seed=3"})
    expect_fault(order, FaultKind::kBadFrame, "its answer has");
}

// Every call is another question, so that the answer to the one before would be noticed.
TEST_P(InjectedFaults, ThatAnswerTwice) {
  const std::unique_ptr<Carrier> carrier = integrator(), honest = integrator();
  Integration call, quiet;
  for (int i = 0; i < 20; ++i) {
    for (Integration* one : {&call, &quiet}) *one->f64(stage::IntegratorIntegrateRequest::kPosition) = i;
    EXPECT_EQ(call.make(carrier.get(), nullptr, i % 3 == 2 ? "" : "duplicate").status, GRAVITAS_OK);
    EXPECT_EQ(quiet.make(honest.get()).status, GRAVITAS_OK);
    ASSERT_EQ(call.answers(), quiet.answers()) << "call " << i;
  }
}

TEST_P(InjectedFaults, ThatNeedElementsAreLeftOutWhereThereAreNone) {
  const std::unique_ptr<Carrier> carrier = space();
  PairSearch call(64, 1.0);
  for (const char* order : {"truncate", "flip"})
    expect_left_out(&call, carrier.get(), order, "has no elements to damage");
  EXPECT_THAT(call.pairs(), ElementsAre());
}

// ---- the reply is wrong ------------------------------------------------------------------------------------------
struct NumberFault {
  const char* order;
  double (*expected)(double);
};

const NumberFault kNumberFaults[] = {
    {"nan", [](double) { return std::numeric_limits<double>::quiet_NaN(); }},
    {"inf", [](double) { return std::numeric_limits<double>::infinity(); }},
    {"denormal", [](double) { return 0x1p-1032; }},
    {"sign", [](double x) { return -x; }},
    {"scale", [](double x) { return 1000.0 * x; }},
    {"scale,factor=0.5", [](double x) { return 0.5 * x; }},
    {"ulp", [](double x) { return std::nextafter(x, 2.0 * x); }},
    {"zero", [](double) { return 0.0; }},
};

std::vector<std::uint64_t> bits(const std::vector<double>& numbers) {
  std::vector<std::uint64_t> all;
  for (const double number : numbers) all.push_back(std::bit_cast<std::uint64_t>(number));
  return all;
}

// The rows `begin` to `end` of the column come back changed, and nothing else.
void expect_changed(OneCall* call, Carrier* carrier, const NumberFault& fault, const std::string& arguments,
                    std::uint32_t column, std::size_t begin, std::size_t end) {
  SCOPED_TRACE(fault.order + arguments);
  EXPECT_EQ(call->make(carrier).status, GRAVITAS_OK);
  std::vector<double> expected = call->answer<double>(column);
  for (std::size_t i = 3 * begin; i < 3 * end; ++i) expected[i] = fault.expected(expected[i]);
  std::vector<std::vector<std::byte>> same = call->answers();
  const CallResult result = call->make(carrier, nullptr, fault.order + arguments);
  ASSERT_EQ(result.status, GRAVITAS_OK) << result.text;
  EXPECT_EQ(bits(call->answer<double>(column)), bits(expected));
  std::vector<std::vector<std::byte>> others = call->answers();
  others[column] = same[column] = {};
  EXPECT_EQ(others, same);
}

TEST_P(InjectedFaults, ThatChangeNumbers) {
  using Reply = Integration::Reply;
  const std::unique_ptr<Carrier> carrier = integrator();
  Integration call;
  for (const NumberFault& fault : kNumberFaults) {
    expect_changed(&call, carrier.get(), fault, "", Reply::kPosition, 1, 2);
    expect_changed(&call, carrier.get(), fault, ",column=angular_velocity,row=2", Reply::kAngularVelocity, 2, 3);
    expect_changed(&call, carrier.get(), fault, ",column=linear_velocity,all=1", Reply::kLinearVelocity, 0, 3);
  }
}

TEST_P(InjectedFaults, ThatChangeRows) {
  const std::unique_ptr<Carrier> carrier = space();
  PairSearch call;
  const auto pairs_after = [&](const char* order) {
    EXPECT_EQ(call.make(carrier.get(), nullptr, order).status, GRAVITAS_OK) << order;
    return call.pairs();
  };
  EXPECT_THAT(pairs_after(""), ElementsAre(0, 1, 1, 2, 2, 3));
  EXPECT_THAT(pairs_after("permute"), ElementsAre(2, 3, 1, 2, 0, 1));
  EXPECT_THAT(pairs_after("double"), ElementsAre(0, 1, 1, 2, 2, 3, 2, 3));
  EXPECT_THAT(pairs_after("missing"), ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(pairs_after("phantom"), ElementsAre(0, 1, 1, 2, 2, 3, 0, 3));
}

// A row more than there is room for: shared memory asks for room first, as an honest plugin does.
TEST_P(InjectedFaults, ThatAddARowAskForRoom) {
  const std::unique_ptr<Carrier> carrier = space();
  PairSearch call(6);
  CallResult result = call.make(carrier.get(), nullptr, "double");
  if (GetParam() == Hosting::kSharedMemory) {
    ASSERT_EQ(result.status, GRAVITAS_NEEDS_CAPACITY);
    EXPECT_EQ(call.arena.count(call.reply[0]), 8U);
    call.arena.set_count(call.reply[0], 0);
    call.arena.grow(call.reply[0], 8);
    result = call.make(carrier.get(), nullptr, "double");
  }
  EXPECT_EQ(result.status, GRAVITAS_OK) << result.text;
  EXPECT_THAT(call.pairs(), ElementsAre(0, 1, 1, 2, 2, 3, 2, 3));
}

// A request for room is no reply: the worker is still there to be asked again.
TEST_P(InjectedFaults, WaitForTheReplyWhereRoomIsAskedFor) {
  const std::unique_ptr<Carrier> carrier = space();
  PairSearch call(2);
  if (GetParam() == Hosting::kSharedMemory) {
    ASSERT_EQ(call.make(carrier.get(), nullptr, "kill").status, GRAVITAS_NEEDS_CAPACITY);
    call.arena.set_count(call.reply[0], 0);
    call.arena.grow(call.reply[0], 6);
  }
  const std::optional<StageFault> fault = fault_of(&call, carrier.get(), "kill");
  ASSERT_TRUE(fault.has_value());
  EXPECT_EQ(fault->kind, FaultKind::kDeath);
}

// ---- it tries what it should not ---------------------------------------------------------------------------------
TEST_P(InjectedFaults, ThatTryTheForbidden) {
  for (const char* order : {"open", "connect", "fork", "exec", "ptrace", "signal", "map"})
    EXPECT_THAT(expect_right(order), HasSubstr(": ")) << order;
  const std::unique_ptr<Carrier> carrier = integrator();
  if (!std::ranges::count(carrier->sandbox(), "seccomp")) GTEST_SKIP() << "system calls are not restricted here";
  for (const char* order : {"connect", "fork", "exec", "ptrace", "signal"})
    EXPECT_THAT(expect_right(order), EndsWith(": Operation not permitted")) << order;
}

// What a worker could do without the sandbox is really done, and nothing of it stays.
TEST_P(InjectedFaults, ThatTryTheForbiddenWhereItIsAllowed) {
  kernel::set_worker_sandbox(false);
  EXPECT_EQ(expect_right("open"), "open of a new file in /tmp: done");
  EXPECT_THAT(expect_right("connect"), StartsWith("connect to 127.0.0.1:9: "));
  EXPECT_EQ(expect_right("fork"), "fork: done");
  EXPECT_EQ(expect_right("exec"), "exec of a program that does not exist: No such file or directory");
  EXPECT_EQ(expect_right("signal"), "signal to its parent: done");
  // some machines allow this to debuggers only
  EXPECT_THAT(expect_right("ptrace"), StartsWith("ptrace of its parent: "));
  EXPECT_THAT(expect_right("map"), StartsWith("map of 1 TB: "));
  kernel::set_worker_sandbox(true);
}

// ---- orders ------------------------------------------------------------------------------------------------------
TEST_P(InjectedFaults, AnOrderThatDoesNotExistIsAFailureThatNamesWhatIsAllowed) {
  const std::unique_ptr<Carrier> carrier = integrator();
  Integration call;
  expect_failure(&call, carrier.get(), "kil", "there is no fault 'kil': did you mean 'kill'? Allowed: kill, segv, ");
  expect_failure(&call, carrier.get(), "kil", "map, rounding");
  expect_failure(&call, carrier.get(), "slow,faktor=2",
                 "fault 'slow' has no argument 'faktor': did you mean 'factor'? Allowed: factor, seconds");
  expect_failure(&call, carrier.get(), "kill,at=noon", "allowed for at: read, compute, write, reply");
  expect_left_out(&call, carrier.get(), "nan,row=3", "column position has 3 rows, and none with number 3");
  expect_left_out(&call, carrier.get(), "nan,column=wrench", "has no column 'wrench'; it has position, orientation");
}

TEST_P(InjectedFaults, AFaultThatTheReplyHasNothingForIsLeftOut) {
  const std::unique_ptr<Carrier> carrier = space();
  PairSearch call;
  expect_left_out(&call, carrier.get(), "nan", "the reply of Space.Pairs has no column of f64 with elements");
  expect_left_out(&call, carrier.get(), "sign,column=pair", "column pair has whole numbers, not f64");
}

TEST_P(InjectedFaults, AFaultThatAnEmptyReplyHasNoRowsForIsLeftOut) {
  const std::unique_ptr<Carrier> carrier = space();
  PairSearch apart(64, 1.0);
  expect_left_out(&apart, carrier.get(), "missing", "has no column with rows");
  expect_left_out(&apart, carrier.get(), "permute", "has no column of two rows or more");
}

// The tests above know every kind there is.
TEST(InjectedFaultKinds, AreAllTested) {
  std::string source;
  std::getline(std::ifstream(in_source("/tests/kernel/fault_injection_test.cc")), source, '\0');
  for (const host::FaultInfo& kind : host::fault_kinds())
    EXPECT_THAT(source, ::testing::ContainsRegex("\"" + std::string(kind.name) + "[\",]"));
}

}  // namespace
}  // namespace gravitas
