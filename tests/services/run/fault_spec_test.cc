#include "services/run/fault_spec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "plugin_sdk/host/fault_kinds.h"
#include "services/run/session.h"

namespace gravitas {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string problem_of(const std::string& specification) {
  try {
    parse_fault(specification);
  } catch (const BadInput& problem) {
    return problem.what();
  }
  ADD_FAILURE() << specification << " was taken";
  return "";
}

void expect(const kernel::FaultInjection& fault, Slot slot, const std::string& order, std::uint32_t step,
            std::uint32_t times) {
  EXPECT_EQ(fault.slot, slot);
  EXPECT_EQ(fault.order, order);
  EXPECT_EQ(fault.step, step);
  EXPECT_EQ(fault.times, times);
}

TEST(FaultSpec, HasSlotKindAndStep) {
  expect(parse_fault("solver:kill@step=100"), Slot::kSolver, "kill", 100, 1);
  expect(parse_fault("collision:hang@step=5"), Slot::kCollision, "hang", 5, 1);
  expect(parse_fault("integrator:nan@step=7"), Slot::kIntegrator, "nan", 7, 1);
  expect(parse_fault("space:drop@step=1"), Slot::kSpace, "drop", 1, 1);
  expect(parse_fault("force:exit@step=4294967295"), Slot::kForce, "exit", 4294967295U, 1);
  expect(parse_fault("constraint:segv@step=2"), Slot::kConstraint, "segv", 2, 1);
}

TEST(FaultSpec, ArgumentsGoToTheWorkerButForStepAndTimes) {
  expect(parse_fault("solver:slow@step=5,factor=10"), Slot::kSolver, "slow,factor=10", 5, 1);
  expect(parse_fault("solver:nan@step=5,column=pose_change,times=3,row=0"), Slot::kSolver,
         "nan,column=pose_change,row=0", 5, 3);
  expect(parse_fault("solver:slow@factor=10,step=5"), Slot::kSolver, "slow,factor=10", 5, 1);
  // beside the kind
  expect(parse_fault("solver:slow,factor=10@step=5,times=2"), Slot::kSolver, "slow,factor=10", 5, 2);
}

TEST(FaultSpec, EveryKindIsTaken) {
  for (const host::FaultInfo& kind : host::fault_kinds())
    EXPECT_EQ(parse_fault("solver:" + std::string(kind.name) + "@step=1").order, kind.name);
}

TEST(FaultSpec, AMistakeIsNamedWithWhatIsAllowed) {
  EXPECT_EQ(problem_of("sovler:kill@step=1"),
            "--fault sovler:kill@step=1: there is no slot 'sovler': did you mean \"solver\"? Allowed: \"space\", "
            "\"collision\", \"constraint\", \"force\", \"solver\", \"integrator\"");
  EXPECT_THAT(problem_of("solver:kil@step=1"),
              StartsWith("--fault solver:kil@step=1: there is no fault 'kil': did you mean 'kill'? Allowed: kill, "));
  EXPECT_THAT(problem_of("solver:slow@step=1,faktor=2"),
              HasSubstr("fault 'slow' has no argument 'faktor': did you mean 'factor'? Allowed: factor, seconds"));
  EXPECT_THAT(
      problem_of("solver:nan@step=1,column=pose_chnge"),
      HasSubstr("replies of slot solver have no column 'pose_chnge' of numbers: did you mean \"pose_change\"?"));
  EXPECT_THAT(problem_of("solver:nan@step=1,column=iterations"), HasSubstr("no column 'iterations' of numbers"));
  EXPECT_THAT(problem_of("space:permute@step=1,column=foo"),
              HasSubstr("slot space have no column 'foo': allowed: \"pair\""));
  EXPECT_THAT(problem_of("solver:kill@step=1,at=noon"), HasSubstr("allowed for at: read, compute, write, reply"));
}

TEST(FaultSpec, TheFormIsSaidWhereItIsMissed) {
  const std::string form = "; the form is SLOT:KIND@step=N[,ARGUMENT=VALUE]...";
  EXPECT_EQ(problem_of("kill@step=1"), "--fault kill@step=1: no ':' behind the slot" + form);
  EXPECT_EQ(problem_of("solver:kill"), "--fault solver:kill: no '@step=N' behind the kind" + form);
  EXPECT_EQ(problem_of("solver:kill@"), "--fault solver:kill@: no step=N behind '@'" + form);
  EXPECT_EQ(problem_of("solver:kill@at=read"), "--fault solver:kill@at=read: no step=N behind '@'" + form);
  EXPECT_THAT(problem_of(""), StartsWith("--fault : no ':'"));
}

TEST(FaultSpec, StepAndTimesAreWholeNumbersFromOne) {
  for (const char* value : {"0", "-1", "1.5", "x", "", "4294967296", "5x", " 5"}) {
    for (const char* name : {"step", "times"}) {
      const std::string part = std::string(name) + "=" + value;
      const std::string other = name == std::string("step") ? "" : "step=1,";
      EXPECT_THAT(problem_of("solver:kill@" + other + part),
                  HasSubstr("'" + part + "': allowed for " + name + ": a whole number from 1 to 4294967295"));
    }
  }
  EXPECT_THAT(problem_of("solver:kill@step"), HasSubstr("'step': allowed for step: a whole number from 1"));
  EXPECT_THAT(problem_of("solver:kill@step=1,step=2"), HasSubstr("'step' is given twice"));
}

TEST(FaultSpec, HelpNamesEveryKindAndArgument) {
  const std::string help = fault_help();
  for (const host::FaultInfo& kind : host::fault_kinds()) {
    EXPECT_THAT(help, HasSubstr("  " + std::string(kind.name) + " "));
    EXPECT_THAT(help, HasSubstr(std::string(kind.group) + "\n"));
  }
  EXPECT_THAT(help, HasSubstr("    at: when in the call, read|compute|write|reply [compute]\n"));
}

}  // namespace
}  // namespace gravitas
