// What a summary says of reports made by hand: who failed, in whose words, and what became of it.
#include "services/run/summary.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "gravitas/report/v1/report.pb.h"

namespace gravitas {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

report::v1::FaultRecord* add_fault(std::uint32_t step, report::v1::Report* report) {
  report::v1::FaultRecord* fault = report->add_faults();
  fault->set_step(step);
  fault->set_slot("solver");
  fault->set_plugin("Mine");
  fault->set_kind("deadline");
  fault->set_text("it gave no answer within its deadline of 2000 ms");
  fault->set_recovered_by("standby");
  fault->set_recovery_us(1500.0);
  return fault;
}

TEST(Summary, AFaultInAStepThatWasInterruptedIsNotSurvived) {
  report::v1::Report report;
  report.set_outcome("interrupted");
  report.set_steps(150);
  add_fault(100, &report);
  add_fault(151, &report)->set_recovery_us(0.0);
  const std::string text = summarize(report, {});
  EXPECT_THAT(text,
              HasSubstr("survived: step 100, solver Mine: deadline (it gave no answer within its deadline of 2000 "
                        "ms); standby took over in 1.5 ms\n"));
  EXPECT_THAT(text, HasSubstr("interrupted: step 151, solver Mine: deadline"));
  EXPECT_THAT(text, Not(HasSubstr("survived: step 151")));
  // another had answered, before the run was interrupted
  report.mutable_faults(1)->set_recovery_us(1500.0);
  EXPECT_THAT(summarize(report, {}), HasSubstr("survived: step 151"));
}

TEST(Summary, AnOrderedFaultIsNamedByItsOrder) {
  report::v1::Report report;
  report.set_steps(150);
  add_fault(100, &report)->set_ordered("solver:hang@step=100");
  EXPECT_THAT(summarize(report, {}), HasSubstr("survived: step 100, solver Mine: deadline; standby took over"));
}

// "0 of 0 answers differ" reads like agreement.
TEST(Summary, AComparisonThatNeverWasSaysWhy) {
  report::v1::Report report;
  report::v1::SwapRecord* one = report.add_comparisons();
  one->set_slot("solver");
  one->set_from("Sequential");
  one->set_to("Mine");
  one->set_outcome("refused");
  one->set_reason("it could not be prepared: no such file");
  EXPECT_THAT(summarize(report, {}), HasSubstr("compared: solver Sequential with Mine: no answer was compared; it "
                                               "ended: it could not be prepared: no such file\n"));
}

TEST(Summary, OneIsNotMany) {
  report::v1::Report report;
  report.set_steps(1);
  report.set_bodies(1);
  report.mutable_events()->set_break_(1);
  report.mutable_plan()->add_slots()->set_process(1);
  const std::string text = summarize(report, {});
  EXPECT_THAT(text, HasSubstr("in 1 step, 1 body, "));
  EXPECT_THAT(text, HasSubstr("  1 joint broke\n"));
  EXPECT_THAT(text, HasSubstr("  1 worker process: "));
}

TEST(Summary, TheTimeOfAStepIsAMedian) {
  report::v1::Report report;
  report.mutable_microseconds_per_step()->set_mean(40.0);
  report.mutable_microseconds_per_step()->set_median(12.5);
  EXPECT_THAT(summarize(report, {}), HasSubstr("of wall time (median 12.5 us a step)\n"));
}

}  // namespace
}  // namespace gravitas
