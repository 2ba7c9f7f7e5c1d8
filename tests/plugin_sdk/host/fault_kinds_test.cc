#include "plugin_sdk/host/fault_kinds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>

namespace gravitas::host {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

FaultOrder order_of(const std::string& text) {
  std::string problem;
  std::optional<FaultOrder> order = parse_fault_order(text, &problem);
  EXPECT_TRUE(order.has_value()) << problem;
  return order.value_or(FaultOrder(fault_kinds()[0]));
}

std::string problem_of(const std::string& text) {
  std::string problem;
  EXPECT_FALSE(parse_fault_order(text, &problem).has_value()) << text;
  return problem;
}

TEST(FaultKinds, EachHasANameOfItsOwnAndIsAnOrderWithoutArguments) {
  std::set<std::string_view> names;
  for (const FaultInfo& kind : fault_kinds()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_EQ(order_of(std::string(kind.name)).fault(), kind.fault);
    EXPECT_NE(kind.meaning, "") << kind.name;
  }
  // what scripts rely on
  for (const char* name : {"kill", "segv", "abort", "exit", "hang", "stop", "slow", "nan", "inf", "flip", "truncate",
                           "oversize", "stale", "duplicate", "drop", "leak", "flood"})
    EXPECT_TRUE(names.contains(name)) << name;
}

TEST(FaultKinds, WhatHoldsByDefaultIsAllowed) {
  for (const FaultInfo& kind : fault_kinds()) {
    for (const FaultArgument& argument : kind.arguments) {
      if (argument.standard.empty()) continue;
      const std::string text =
          std::string(kind.name) + "," + std::string(argument.name) + "=" + std::string(argument.standard);
      EXPECT_TRUE(order_of(text).gives(argument.name)) << text;
    }
  }
}

TEST(FaultOrder, HasWhatItGivesAndDefaultsForTheRest) {
  const FaultOrder slow = order_of("slow,factor=2.5");
  EXPECT_EQ(slow.number("factor"), 2.5);
  EXPECT_TRUE(slow.gives("factor"));
  EXPECT_FALSE(slow.gives("seconds"));
  EXPECT_EQ(order_of("slow").number("factor"), 10.0);
  EXPECT_EQ(order_of("flood,bytes=1e9").number("bytes"), 1e9);
  EXPECT_EQ(order_of("leak").number("bytes"), 64.0 * 1024 * 1024);
  EXPECT_EQ(order_of("scale,factor=-3").number("factor"), -3.0);
  const FaultOrder nan = order_of("nan,column=linear_velocity,row=7,all=1");
  EXPECT_EQ(nan.word("column"), "linear_velocity");
  EXPECT_EQ(nan.number("row"), 7.0);
  EXPECT_EQ(nan.word("all"), "1");
  EXPECT_EQ(order_of("nan").word("column"), "");
  EXPECT_EQ(order_of("flip").word("where"), "payload");
}

TEST(FaultOrder, HappensInTheMiddleUnlessItSaysWhen) {
  EXPECT_EQ(order_of("kill").moment(), Moment::kCompute);
  EXPECT_EQ(order_of("kill,at=read").moment(), Moment::kRead);
  EXPECT_EQ(order_of("segv,at=compute").moment(), Moment::kCompute);
  EXPECT_EQ(order_of("exit,at=write,code=4").moment(), Moment::kWrite);
  EXPECT_EQ(order_of("abort,at=reply").moment(), Moment::kReply);
  EXPECT_EQ(order_of("hang").moment(), Moment::kCompute);
}

TEST(FaultOrder, AKindThatDoesNotExistIsNamedWithAllThatDo) {
  const std::string problem = problem_of("kil");
  EXPECT_THAT(problem, StartsWith("there is no fault 'kil': did you mean 'kill'? Allowed: kill, segv, abort, "));
  for (const FaultInfo& kind : fault_kinds()) EXPECT_THAT(problem, HasSubstr(" " + std::string(kind.name)));
  EXPECT_THAT(problem_of(""), StartsWith("there is no fault '': allowed: kill, "));
  EXPECT_THAT(problem_of("KILL"), HasSubstr("did you mean 'kill'?"));
  // it is to be read in full at the other end of a mailbox
  EXPECT_LE(problem.size(), kLongestFaultOrder);
}

TEST(FaultOrder, AnArgumentThatIsWrongIsNamedWithWhatIsAllowed) {
  EXPECT_EQ(problem_of("hang,at=read"), "fault 'hang' has no argument 'at': it takes none");
  EXPECT_EQ(problem_of("slow,faktor=2"),
            "fault 'slow' has no argument 'faktor': did you mean 'factor'? Allowed: factor, seconds");
  EXPECT_EQ(problem_of("kill,"), "fault 'kill' has no argument '': allowed: at");
  EXPECT_EQ(problem_of("kill,at=read,at=read"), "fault 'kill' has the argument 'at' twice");
  EXPECT_EQ(problem_of("kill,at=noon"), "fault 'kill' has 'at=noon': allowed for at: read, compute, write, reply");
  EXPECT_EQ(problem_of("kill,at"), "fault 'kill' has 'at': allowed for at: read, compute, write, reply");
  EXPECT_EQ(problem_of("exit,code=256"), "fault 'exit' has 'code=256': allowed for code: a whole number from 0 to 255");
  EXPECT_EQ(problem_of("exit,code=1.5"), "fault 'exit' has 'code=1.5': allowed for code: a whole number from 0 to 255");
  EXPECT_THAT(problem_of("slow,factor=0.5"), HasSubstr("allowed for factor: a number from 1 to "));
  for (const char* value : {"", "x", "2x", "nan", "inf", " 2"})
    EXPECT_THAT(problem_of("slow,factor=" + std::string(value)), HasSubstr("a number from 1 to ")) << value;
  EXPECT_THAT(problem_of("nan,row=-1"), HasSubstr("a whole number from 0 to "));
  EXPECT_EQ(problem_of("nan,column="), "fault 'nan' has 'column=': allowed for column: the name of a column");
}

TEST(FaultOrder, IsNoLongerThanAMailboxHasRoomFor) {
  const std::string longest = "nan,column=" + std::string(kLongestFaultOrder - 11, 'x');
  EXPECT_EQ(order_of(longest).word("column").size(), kLongestFaultOrder - 11);
  EXPECT_EQ(problem_of(longest + "x"), "the order of a fault is longer than 511 characters");
}

}  // namespace
}  // namespace gravitas::host
