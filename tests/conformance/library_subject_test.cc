// A library in this process as a subject: what it takes for an answer and what for a fault.
#include "plugin_sdk/conformance/library_subject.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "plugin_sdk/conformance/free_bodies.h"
#include "plugin_sdk/floating_point.h"
#include "tests/paths.h"

namespace gravitas::conformance {
namespace {

using testing::HasSubstr;

std::string shipped(const std::string& name) { return in_build("/lib/gravitas/") + name + ".so"; }
std::string faulty(const std::string& name) { return in_build("/lib/gravitas-faulty/") + name + ".so"; }

// Its third answer: these plugins misbehave from then on.
Answer third_answer(const std::string& library) {
  LibrarySubject subject(faulty(library));
  FreeBodies free;
  free.bodies = {FreeBody{}, FreeBody{}};
  for (int i = 0; i < 2; ++i) {
    const Answer answer = subject.ask(stage::Method::kIntegratorIntegrate, free.request(), free.answers());
    EXPECT_TRUE(answer.ok()) << answer.fault << answer.text;
  }
  return subject.ask(stage::Method::kIntegratorIntegrate, free.request(), free.answers());
}

TEST(LibrarySubject, AnswersWithColumnsOfTheRightSize) {
  LibrarySubject subject(shipped("integrator_euler"));
  EXPECT_EQ(subject.declaration().slot, Slot::kIntegrator);
  FreeBodies free;
  free.bodies = {FreeBody{}, FreeBody{}};
  const Answer answer = subject.ask(stage::Method::kIntegratorIntegrate, free.request(), free.answers());
  ASSERT_TRUE(answer.ok()) << answer.fault << answer.text;
  EXPECT_EQ(answer.columns.f64("orientation").size(), 8U);
}

TEST(LibrarySubject, SaysWhyNothingCanBeHad) {
  EXPECT_THROW(LibrarySubject(shipped("no_such_library")), std::runtime_error);
  EXPECT_THROW(LibrarySubject(faulty("wrong_magic")), std::runtime_error);
  // sweeps from 1 on
  EXPECT_THROW(LibrarySubject(shipped("solver_sequential"), std::vector<double>{0.0, 1.0, 0.0, 1.0, 0.0, 1.0}),
               std::runtime_error);
}

TEST(LibrarySubject, ReportsARefusalWithItsReason) {
  LibrarySubject subject(shipped("integrator_euler"));
  FreeBodies free;
  free.bodies = {FreeBody{}};
  free.time_step = std::numeric_limits<double>::quiet_NaN();
  const Answer answer = subject.ask(stage::Method::kIntegratorIntegrate, free.request(), free.answers());
  EXPECT_EQ(answer.status, GRAVITAS_REFUSED);
  EXPECT_EQ(answer.fault, "");
  EXPECT_THAT(answer.text, HasSubstr("body 0 comes to a state that is not finite"));
  EXPECT_FALSE(answer.ok());
}

TEST(LibrarySubject, AMethodOfAnotherSlotIsUnknown) {
  LibrarySubject subject(shipped("integrator_euler"));
  const Answer answer =
      subject.ask(stage::Method::kSpacePairs, MessageColumns(stage::method_info(stage::Method::kSpacePairs).request));
  EXPECT_EQ(answer.status, GRAVITAS_UNKNOWN_METHOD);
}

TEST(LibrarySubject, AnAnswerOfTheWrongLengthIsAFault) {
  EXPECT_THAT(third_answer("integrator_short").fault, HasSubstr("its answer is wrong: column"));
}

TEST(LibrarySubject, AnAppetiteWithoutEndIsAFault) {
  EXPECT_THAT(third_answer("integrator_wants_room").fault, HasSubstr("room"));
}

TEST(LibrarySubject, WhatChangesTheFloatingPointEnvironmentIsAFault) {
  const std::uint32_t control = floating_point_control();
  EXPECT_EQ(third_answer("integrator_flush_to_zero").fault, "it changed the floating-point environment");
  EXPECT_THROW(LibrarySubject(faulty("flushes_to_zero_when_made")), std::runtime_error);
  EXPECT_EQ(floating_point_control(), control);
}

TEST(LibrarySubject, AFailureIsAStatus) {
  const Answer answer = third_answer("integrator_throws");
  EXPECT_EQ(answer.status, GRAVITAS_FAILED);
  EXPECT_NE(answer.text, "");
}

TEST(Cases, HaveNamesOfTheirOwnUnderTheirSlot) {
  for (const Slot slot :
       {Slot::kSpace, Slot::kCollision, Slot::kConstraint, Slot::kForce, Slot::kSolver, Slot::kIntegrator}) {
    const PluginDeclaration declaration{.name = "X", .version = "1", .slot = slot, .meaning = ""};
    std::set<std::string> names;
    for (const Case& one : number_cases(declaration)) {
      EXPECT_TRUE(one.name.starts_with(std::string(slot_name(slot)) + "/")) << one.name;
      EXPECT_TRUE(names.insert(one.name).second) << one.name;
      EXPECT_TRUE(one.claim.ends_with('.')) << one.claim;
    }
    EXPECT_GE(names.size(), 5U);
  }
}

TEST(Levels, AreNamedFromC0) {
  EXPECT_STREQ(level_name(Level::kHandshake), "C0");
  EXPECT_STREQ(level_name(Level::kNumbers), "C5");
}

}  // namespace
}  // namespace gravitas::conformance
